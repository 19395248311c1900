//! FGONG models.

use super::*;

/// Points of a small model, center and surface among them.
const POINTS: usize = 401;
const VARIABLES: usize = 40;

/// How the numbers of a version are written.
fn number(version: u32, value: f64) -> String {
    match version {
        1000.. => format!(" {}", fortran(value, 26, 18, 3)),
        _ => fortran(value, 16, 9, 2),
    }
}

fn block(version: u32, values: &[f64]) -> String {
    let line = |five: &[f64]| five.iter().map(|v| number(version, *v)).collect::<String>() + "\n";
    values.chunks(5).map(line).collect()
}

/// The variables of a point.
fn point(x: f64) -> Vec<f64> {
    let mut all: Vec<f64> = (1..=VARIABLES).map(|i| -(i as f64)).collect();
    all[0] = x * STAR_RADIUS;
    // The center's is that of Model S.
    all[1] = if x > 0.0 { (enclosed(x) / star_mass()).ln() } else { -1.381_551_056e2 };
    all[3] = 1e17 * sinc(x).powi(2);
    all[4] = sinc(x);
    all[5] = 0.7;
    all[2] = 0.0;
    all
}

/// A polytrope of index 1 from the surface inwards.
fn model(version: u32) -> String {
    let mut globals = [0.0; 15];
    globals[..5].copy_from_slice(&[star_mass(), STAR_RADIUS, 3.8e33, -0.02, -0.7]);
    globals[12] = 4.6e9;
    let mut text = format!("polytrope\nmade by hand\n\n\n{POINTS:>10}{:>10}{VARIABLES:>10}{version:>10}\n", 15);
    text += &block(version, &globals);
    (0..POINTS).rev().for_each(|i| text += &block(version, &point(i as f64 / (POINTS - 1) as f64)));
    text
}

#[test]
fn polytropes_come_back_in_both_ways_of_writing() {
    for version in [300, 1300] {
        let text = model(version);
        assert!(text.contains("E+10-") || version == 1300, "numbers touch");
        let field = read_text("fgong", text.as_bytes(), &FieldRequest::default()).unwrap();
        assert_eq!((field.density.as_deref(), radii(&field).len()), (Some("density"), POINTS));
        // Ten digits, or all of them; ln(m / M) is 18 at most beyond the center, so that as many units of its last digit
        // are missed by the mass.
        let digits = if version == 300 { 5e-10 } else { 4e-16 };
        let (rho, m) = (values(&field, "density"), values(&field, "enclosed_mass"));
        for i in 1..POINTS - 1 {
            let x = i as f64 / (POINTS - 1) as f64;
            close(radii(&field)[i], x * STAR_RADIUS, digits);
            close(rho[i], sinc(x), digits);
            close(m[i], enclosed(x), 20.0 * digits);
        }
        // Straight lines over r^3 miss a part of (1/400)^2 of the order of 1.
        close(mass(&field, "density"), star_mass(), 3e-5);
        for (name, unit) in [("density", 1.0), ("pressure", 1.0), ("enclosed_mass", 1.0), ("luminosity", 1.0)] {
            assert_eq!(field.variable(name).and_then(|v| v.unit.as_ref()).map(|u| u.to_cgs), Some(unit), "{name}");
        }
        assert!(field.variables.iter().all(|v| v.location == Location::Node));
        assert!(field.variable("temperature").is_none() && field.notes.iter().any(|n| n.contains("temperature")));
        assert_eq!(values(&field, "x_mass_fraction_H")[7], 0.7);
        assert_eq!(values(&field, "z_mass_fraction_metals")[7], -17.0);
        assert_eq!((values(&field, "he3")[3], values(&field, "ne20")[3]), (-21.0, -36.0));
        assert!(field.metadata.contains(&("title".into(), "polytrope".into())));
        assert!(field.metadata.contains(&("age (yr)".into(), "4.6e9".into())));
    }
}

#[test]
fn versions_have_their_own_variables() {
    let with = |version: u32| {
        let text = model(300).replace("        40       300\n", &format!("        40{version:>10}\n"));
        read_text("fgong", text.as_bytes(), &FieldRequest::default()).unwrap()
    };
    for (version, metals, helium, neon) in
        [(100, false, false, false), (200, false, true, false), (210, true, true, false), (300, true, true, true)]
    {
        let field = with(version);
        let has = |name: &str| field.variable(name).is_some();
        assert_eq!(
            (has("z_mass_fraction_metals"), has("he3"), has("ne20")),
            (metals, helium, neon),
            "version {version}"
        );
    }
    let field = with(700);
    assert!(field.variable("he3").is_none() && field.notes.iter().any(|n| n.contains("700 is not known")));
}

#[test]
fn either_order_is_read() {
    let inward = model(1300);
    let lines: Vec<&str> = inward.lines().collect();
    let (head, points) = lines.split_at(8);
    let mut outward = head.join("\n") + "\n";
    points.chunks(VARIABLES / 5).rev().flatten().for_each(|line| outward += &format!("{line}\n"));
    let [a, b] = [inward, outward].map(|t| read_text("fgong", t.as_bytes(), &FieldRequest::default()).unwrap());
    assert_eq!(radii(&a), radii(&b));
    assert_eq!(values(&a, "density"), values(&b, "density"));
}

#[test]
fn faults_are_named_with_line_and_column() {
    let good = model(300);
    let lines: Vec<&str> = good.lines().collect();
    // The second point from the surface: line 17 has r, ln q, T, P, rho.
    let with = |line: usize, column: usize, field: &str| {
        let mut own: Vec<String> = lines.iter().map(|l| (*l).to_owned()).collect();
        own[line - 1].replace_range(16 * (column - 1)..16 * column, &format!("{field:>16}"));
        own.join("\n") + "\n"
    };
    for (text, expected) in [
        (with(17, 5, "NaN"), "line 17, column '5': the density is NaN"),
        (with(17, 5, "-1.000000000E+00"), "line 17, column '5': the density is -1e0"),
        (with(17, 1, "NaN"), "line 17, column '1': the radius is NaN"),
        (with(17, 1, "1.000000000E+00"), "column '1': the radius is"),
        (with(17, 2, "NaN"), "line 17, column '2': the enclosed mass is NaN"),
        (with(17, 2, " 9.000000000E+02"), "line 17, column '2': the enclosed mass is inf"),
        (with(17, 2, "-1.000000000E+02"), "the enclosed mass shrinks outwards"),
        (with(18, 3, "****************"), "line 18, column '3': found '****************', a number too wide"),
        (with(18, 3, "density"), "line 18, column '3': found 'density', expected a number"),
        (with(6, 1, "-1.000000000E+00"), "line 6, column '1': the star's mass is -1e0 g"),
        (good.replace("       401  ", "       402  "), "the file is truncated"),
        (good.replace("       401  ", "       400  "), "follows the last point"),
        (good.replace("       401  ", "         1  "), "line 5: states 1 points"),
        (good.replace("       401  ", "9999999999  "), "line 5: states 9999999999 points of 40 variables"),
        (good.replace("       401  ", "      -401  "), "line 5: found '-401"),
        (good.replace("        40       300", "         4       300"), "line 5: found"),
        (good.replacen("made by hand\n", "", 1), "line 5: found"),
        (good[..good.len() - 3].to_owned(), "the last line has 78 characters and no line end"),
        ("a\nb\n".to_owned(), "ends before the four lines of text"),
        (String::new(), "is empty"),
    ] {
        let error = error_of("fgong", &text);
        assert!(error.contains(expected), "{error}\nlacks {expected}");
    }
}

#[test]
fn damage_never_panics() {
    let text = model(300);
    let cut: String = text.lines().take(40).map(|l| format!("{l}\n")).collect::<String>().replace("  401  ", "    4  ");
    survives_damage("fgong", cut.as_bytes(), 7, true);
}
