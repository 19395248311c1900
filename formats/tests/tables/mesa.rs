//! MESA profiles.

use super::*;

const SUN: (f64, f64) = (1.327_124_4e26 / 6.674_3e-8, 6.957e10);

/// A profile of three zones of density 1, 2 and 4 between 0, 1, 2 and 3 solar radii, in nominal units.
fn small() -> String {
    let volume = |inner: f64, outer: f64| 4.0 / 3.0 * std::f64::consts::PI * (outer.powi(3) - inner.powi(3));
    let unit = SUN.1.powi(3) / SUN.0;
    let inner = 4.0 * volume(0.0, 1.0) * unit;
    let middle = inner + 2.0 * volume(1.0, 2.0) * unit;
    let outer = middle + volume(2.0, 3.0) * unit;
    format!(
        " 1 2 3 4\n model_number num_zones star_age compiler\n 7 3 1.0E+9 \"gfortran 12\"\n\n\
         1 2 3 4 5 6 7 8\n zone mass logR logRho logT h1 velocity odd\n\
         1 {outer:.16E} {:.16E} 0.0 3.0 0.7 3.0 1\n\
         2 {middle:.16E} {:.16E} {:.16E} 4.0 0.6 2.0 2\n\
         3 {inner:.16E} 0.0 {:.16E} 5.0 0.5 1.0 3\n",
        3_f64.log10(),
        2_f64.log10(),
        2_f64.log10(),
        4_f64.log10()
    )
}

fn read_small(text: &str) -> Result<RawField> {
    read_text("mesa", text.as_bytes(), &FieldRequest::default())
}

#[test]
fn real_profiles_have_their_stated_mass_to_rounding() {
    // Masses (Msun) and radii (Rsun) are those of the first zone's line in each file.
    for (name, zones, star_mass, log_radius) in [
        ("mainsequence_logE", 785, 1.0, None),
        ("redgiant_logE", 1224, 1.0, None),
        ("wd1_0.6Msolar", 1199, 0.607_990_318_454_245_9, None),
        ("mesa_16M_profile_tams.data", 1999, 16.0, Some(1.003_334_787_586_178_9)),
    ] {
        let file = if log_radius.is_some() { name.to_owned() } else { format!("mesa2hydro_profile_{name}.data") };
        let Some(path) = shared(&format!("mesa/{file}")) else { continue };
        let field = read(&path);
        assert_eq!((field.format, field.density.as_deref()), ("mesa", Some("density")));
        let density = field.variable("density").unwrap();
        assert_eq!((density.location, density.values.len()), (Location::Cell, zones));
        assert_eq!((radii(&field).len(), radii(&field)[0]), (zones + 1, 0.0));
        // These files are of a MESA whose Sun had 1.9892e33 g and 6.9598e10 cm.
        let stated = star_mass * 1.9892e33;
        close(mass(&field, "density"), stated, 1e-12);
        let enclosed = values(&field, "enclosed_mass");
        assert_eq!(enclosed[0], 0.0);
        close(*enclosed.last().unwrap(), stated, 1e-12);
        if let Some(log_radius) = log_radius {
            close(*radii(&field).last().unwrap(), 10_f64.powf(log_radius) * 6.9598e10, 1e-12);
        }
        for (name, cgs) in [("temperature", 1.0), ("pressure", 1.0), ("x_mass_fraction_H", 1.0)] {
            let variable = field.variable(name).unwrap();
            assert_eq!(variable.unit.as_ref().map(|u| u.to_cgs), Some(cgs), "{name}");
        }
        assert!(field.notes.iter().any(|n| n.contains("older MESA")), "{:?}", field.notes);
    }
}

#[test]
fn a_profile_without_radius_is_rebuilt_from_mass_and_density() {
    let Some(path) = shared("mesa/py_mesa_reader_profile1.data") else { return };
    let field = read(&path);
    // 0.1 Msun at 1, 0.4 at 10, 0.5 at 100 g/cm^3.
    let shell = |m: f64, rho: f64| 3.0 * m * SUN.0 / (4.0 * std::f64::consts::PI * rho);
    let cubes = [shell(0.1, 1.0), shell(0.4, 10.0), shell(0.5, 100.0)];
    let r = radii(&field);
    close(r[1], cubes[0].cbrt(), 1e-14);
    close(r[3], cubes.iter().sum::<f64>().cbrt(), 1e-14);
    close(mass(&field, "density"), SUN.0, 1e-13);
    assert!(field.notes.iter().any(|n| n.contains("rebuilt from mass and density")), "{:?}", field.notes);
}

#[test]
fn columns_land_where_they_belong() {
    let field = read_small(&small()).unwrap();
    for (found, wanted) in radii(&field).iter().zip([0.0, 1.0, 2.0, 3.0]) {
        assert!((found - wanted * SUN.1).abs() < 1e-14 * SUN.1);
    }
    close(mass(&field, "density"), *values(&field, "enclosed_mass").last().unwrap(), 1e-13);
    for (found, wanted) in values(&field, "density").into_iter().zip([4.0, 2.0, 1.0]) {
        close(found, wanted, 1e-14);
    }
    assert_eq!(values(&field, "temperature"), [1e5, 1e4, 1e3]);
    assert_eq!(values(&field, "h1"), [0.5, 0.6, 0.7]);
    assert_eq!(values(&field, "velocity"), [0.0, 1.0, 2.0, 3.0]);
    assert_eq!(values(&field, "odd"), [3.0, 2.0, 1.0]);
    assert_eq!(field.variable("odd").unwrap().unit, None);
    assert!(field.variable("zone").is_none() && field.variable("logR").is_none());
    assert!(field.metadata.contains(&("compiler".into(), "gfortran 12".into())));
    assert!(field.notes.iter().any(|n| n.contains("nominal ones of the IAU")), "{:?}", field.notes);
}

#[test]
fn solar_units_of_the_header_win() {
    let text = small()
        .replace("1 2 3 4\n model", "1 2 3 4 5 6\n msun rsun model")
        .replace(" 7 3 1.0", " 1.99D33 6.96+10 7 3 1.0");
    let field = read_small(&text).unwrap();
    close(radii(&field)[1], 6.96e10, 1e-15);
    assert!(field.notes.iter().any(|n| n.contains("from the header")), "{:?}", field.notes);
}

#[test]
fn an_inner_boundary_of_the_header_is_taken() {
    let with = |radius: &str| {
        let text = small().replace("star_age", "R_center").replace("1.0E+9", radius);
        radii(&read_small(&text).unwrap())[0]
    };
    close(with("0.5"), 0.5 * SUN.1, 1e-15);
    close(with("1.0E+10"), 1e10, 1e-15);
    assert_eq!(with("0"), 0.0);
}

#[test]
fn the_density_may_be_named_by_its_column() {
    for name in ["density", "logRho"] {
        let request = FieldRequest {
            density: Some(name.into()),
            carry: Some(vec!["temperature".into()]),
            ..FieldRequest::default()
        };
        let field = read_text("mesa", small().as_bytes(), &request).unwrap();
        assert_eq!(field.density.as_deref(), Some(name));
        assert_eq!(field.variables.len(), 2);
        close(values(&field, name)[0], 4.0, 1e-14);
    }
    let request = FieldRequest { carry: Some(vec!["logT".into()]), ..FieldRequest::default() };
    let error = read_text("mesa", small().as_bytes(), &request).unwrap_err().to_string();
    assert!(error.contains("the column of this name is read as 'temperature'"), "{error}");
    let request = FieldRequest { carry: Some(vec!["fe56".into()]), ..FieldRequest::default() };
    let error = read_text("mesa", small().as_bytes(), &request).unwrap_err().to_string();
    assert!(error.contains("variable 'fe56'") && error.contains("enclosed_mass, density, temperature, h1"), "{error}");
}

#[test]
fn faults_are_named_with_their_line() {
    let good = small();
    for (from, to, expected) in [
        (" 7 3 1.0E+9", " 7 4 1.0E+9", "has 3 zones, num_zones states 4; the file is truncated"),
        ("\"gfortran 12\"", "", "line 3: has 3 values for 4 entries"),
        ("zone mass", "model_number mass", "this is a MESA history, expected a profile"),
        (" 5.0 0.5 ", " 5.0 ", "line 9: has 7 columns, expected 8"),
        (" 5.0 0.5 ", " 5.0 abc ", "line 9, column 'h1': found 'abc', expected a number"),
        (" 5.0 0.5 ", " **** 0.5 ", "too wide for its Fortran format"),
        ("1 2 3 4 5 6 7 8", "1 2 3 4 5 6 7 9", "expected the numbers of the columns"),
        (" odd\n", "\n", "line 6: has 7 names for 8 columns"),
    ] {
        assert!(good.contains(from), "{from}");
        let error = error_of("mesa", &good.replacen(from, to, 1));
        assert!(error.contains(expected), "{error}\n{expected}");
    }
    let rebuilt = read_small(&good.replacen(" logR ", " lnR ", 1)).unwrap();
    close(radii(&rebuilt)[3], 3.0 * SUN.1, 1e-13);
    let no_mass = good.replacen(" logR ", " lnR ", 1).replacen(" mass ", " m ", 1);
    assert!(error_of("mesa", &no_mass).contains("the columns are zone, m, lnR, logRho, logT"));
}

#[test]
fn faces_must_descend() {
    let outer = format!("{:.16E}", 3_f64.log10());
    let middle = format!("{:.16E}", 2_f64.log10());
    for (radius, problem) in [
        (outer.as_str(), "is that of the zone before"),
        ("1.0", "expected zones from the surface to the center"),
        ("NaN", "the outer radius is NaN cm, expected a finite one above 0"),
        ("-1000", "the outer radius is 0e0 cm"),
    ] {
        let error = error_of("mesa", &small().replacen(&middle, radius, 1));
        assert!(error.contains("line 8: the ") && error.contains(problem), "{error}\n{problem}");
    }
}

#[test]
fn a_profile_without_density_says_so_by_leaving_it_open() {
    let field = read_small(&small().replace("logRho", "logXYZ")).unwrap();
    assert_eq!(field.density, None);
    assert!(field.variable("logXYZ").is_some());
}

#[test]
fn damage_never_panics() {
    survives_damage("mesa", small().as_bytes(), 1, true);
    let Some(path) = shared("mesa/mesa2hydro_profile_mainsequence_logE.data") else { return };
    let content = std::fs::read(path).unwrap();
    let end = content.iter().enumerate().filter(|(_, b)| **b == b'\n').nth(60).unwrap().0;
    survives_damage("mesa", &content[..end], 100, false);
    let whole = String::from_utf8(content).unwrap();
    for cut in [whole.len() / 2, whole.len() - 1000, whole.len() - 10] {
        let result = read_small(&whole[..cut]);
        assert!(result.is_err(), "cut at {cut} of {}", whole.len());
    }
}
