//! GYRE text models.

use super::*;

fn small(version: &str, columns: usize) -> String {
    let mut text = format!("3 2.0E+33 7.0E+10 4.0E+33 {version}\n");
    for (k, (r, m, rho)) in [(0.0, 0.0, 9.0), (1e10, 1e33, 3.0), (7e10, 2e33, 0.5)].into_iter().enumerate() {
        text.push_str(&format!("{} {r:e} {m:e} 1.0E+33 1.0D+17 1.0E+7 {rho:e}", k + 1));
        (7..columns).for_each(|i| text.push_str(&format!(" {i}.5")));
        text.push('\n');
    }
    text
}

#[test]
fn real_red_giant_has_its_stated_mass_and_one_jump() {
    let Some(path) = shared("gyre/rgb.mesa") else { return };
    let field = read(&path);
    assert_eq!(field.format, "gyre");
    assert_eq!(field.density.as_deref(), Some("density"));
    let r = radii(&field);
    assert_eq!(r.len(), 2719);
    assert_eq!(r.windows(2).filter(|w| w[0] == w[1]).count(), 1);
    assert_eq!(values(&field, "density")[0], 69_023.988_127_597_45);
    // The trapezoid rule over shells is second order in the model's own spacing.
    close(mass(&field, "density"), 3.960_560_412_281_664_4e33, 1e-4);
    close(*values(&field, "enclosed_mass").last().unwrap(), 3.960_560_412_281_664_4e33, 1e-6);
}

#[test]
fn every_version_is_read_with_its_own_columns() {
    for (version, columns) in [("", 19), ("19", 19), ("100", 19), ("101", 19), ("120", 20)] {
        let field = read_text("gyre", small(version, columns).as_bytes(), &FieldRequest::default()).unwrap();
        assert_eq!(radii(&field), [0.0, 1e10, 7e10]);
        assert_eq!(values(&field, "density"), [9.0, 3.0, 0.5]);
        assert_eq!(values(&field, "pressure"), [1e17; 3]);
        let rotation = (!version.is_empty()).then_some(columns as f64 - 0.5);
        assert_eq!(field.variable("angular_velocity").map(|v| v.values.get(0)), rotation, "version {version}");
        let inner = values(&field, "enclosed_mass")[1];
        // Early versions store w = m / (M - m): w = 1e33 means all of M.
        assert_eq!(inner, if columns == 19 && ["", "19"].contains(&version) { 2e33 } else { 1e33 });
        let unit = field.variable("density").and_then(|v| v.unit.clone()).unwrap();
        assert_eq!(unit.to_cgs, 1.0);
    }
}

#[test]
fn faults_are_named_with_their_line() {
    let good = small("100", 19);
    for (from, to, expected) in [
        ("3 2.0E+33", "4 2.0E+33", "has 3 rows, the header states 4; the file is truncated"),
        ("3 2.0E+33", "2 2.0E+33", "line 4: there are more rows than the 2"),
        ("3 2.0E+33", "18446744073709551615 2.0E+33", "has 3 rows, the header states 18446744073709551615"),
        ("3 2.0E+33", "1 2.0E+33", "states 1 points, expected at least 2"),
        (" 100\n", " 130\n", "version 130; known are"),
        ("1e10", "-1e10", "line 3: the radius is -1e10 after 0e0"),
        ("3e0", "3e0x", "line 3, column '7': found '3e0x', expected a number"),
        ("2 1e10", "5 1e10", "line 3: has index 5, expected 2"),
        (" 18.5\n2", "\n2", "line 2: has 18 columns, expected 19"),
        ("3 2.0E+33", "star 2.0E+33", "expected the header 'N M R L version'"),
    ] {
        assert!(good.contains(from), "{from}");
        let error = error_of("gyre", &good.replacen(from, to, 1));
        assert!(error.contains(expected), "{error}\n{expected}");
        assert!(error.contains("input.txt"), "{error}");
    }
}

#[test]
fn damage_never_panics() {
    survives_damage("gyre", small("100", 19).as_bytes(), 1, true);
    let Some(path) = shared("gyre/rgb.mesa") else { return };
    let content = std::fs::read(path).unwrap();
    let end = content.iter().enumerate().filter(|(_, b)| **b == b'\n').nth(40).unwrap().0;
    survives_damage("gyre", &content[..end], 100, false);
}

#[test]
fn requested_columns_are_the_only_ones() {
    let text = small("100", 19);
    let request = FieldRequest { carry: Some(vec!["temperature".into()]), ..FieldRequest::default() };
    let field = read_text("gyre", text.as_bytes(), &request).unwrap();
    let names: Vec<_> = field.variables.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names, ["temperature", "density"]);
    let request = FieldRequest { density: Some("rho".into()), ..FieldRequest::default() };
    let error = read_text("gyre", text.as_bytes(), &request).unwrap_err().to_string();
    assert!(error.contains("variable 'rho'") && error.contains("enclosed_mass, luminosity, pressure"), "{error}");
}
