//! KEPLER's models.

use super::*;

const CELLS: usize = 200;

/// Names of a progenitor's columns, and of their values for a cell between two fractions of the radius.
fn cell(inner: f64, outer: f64) -> Vec<(&'static str, String)> {
    let volume = 4.0 / 3.0 * std::f64::consts::PI * STAR_RADIUS.powi(3) * (outer.powi(3) - inner.powi(3));
    let number = |v: f64| format!("{v:.16E}");
    vec![
        ("cell outer total mass", number(enclosed(outer))),
        ("cell outer radius", number(outer * STAR_RADIUS)),
        ("cell outer velocity", number(-1e5 * outer)),
        ("cell density", number((enclosed(outer) - enclosed(inner)) / volume)),
        ("cell temperature", number(1e9)),
        ("cell pressure", number(1e20)),
        ("cell specific energy", number(1e17)),
        ("cell specific entropy", number(1.0)),
        ("cell angular velocity", "---".into()),
        ("cell A_bar", number(4.0)),
        ("cell Y_e", number(0.5)),
        ("stability", "radiative".into()),
        ("NETWORK", if outer < 0.5 { "QSE".into() } else { "APPROX".into() }),
        ("h1", if outer < 0.5 { "---".into() } else { number(0.7) }),
        ("he4", number(0.25)),
    ]
}

/// A polytrope of index 1 whose cells have its mean densities, as a progenitor is handed on; from a radius on.
fn progenitor(from: f64) -> String {
    let mut text = "VERSION 10104 -- made by hand\n  grid   ".to_owned();
    cell(0.0, 1.0).iter().for_each(|(name, _)| text += &format!("{name:<25}"));
    text += "\n";
    let face = |i: usize| from + (1.0 - from) * i as f64 / CELLS as f64;
    for i in 0..CELLS {
        text += &format!("{:5}:", i + 1);
        cell(face(i), face(i + 1)).iter().for_each(|(_, value)| text += &format!("  {value}"));
        text += "\n";
    }
    text + " wind:  1.0E+33 ---\n"
}

fn check(field: &RawField) {
    let r = radii(field);
    assert_eq!((field.format, r.len(), r[0]), ("kepler", CELLS + 1, 0.0));
    // Seventeen digits; densities are differences of masses, which cancel to (1/200)^3 in the center.
    close(mass(field, "density"), star_mass(), 1e-9);
    let m = values(field, "enclosed_mass");
    assert_eq!(m[0], 0.0);
    close(m[CELLS], star_mass(), 1e-15);
    let location = |name: &str| field.variable(name).map(|v| v.location);
    for name in ["density", "temperature", "pressure", "internal_energy", "specific_entropy", "he4"] {
        assert_eq!(location(name), Some(Location::Cell), "{name}");
    }
    for name in ["enclosed_mass", "velocity"] {
        assert_eq!(location(name), Some(Location::Node), "{name}");
    }
    assert_eq!((values(field, "velocity")[0], values(field, "velocity")[CELLS]), (0.0, -1e5));
}

#[test]
fn progenitors_have_the_mass_of_their_cells() {
    let field = read_text("kepler", progenitor(0.0).as_bytes(), &FieldRequest::default()).unwrap();
    check(&field);
    let h1 = values(&field, "h1");
    assert_eq!((h1[0], h1[CELLS - 1]), (0.0, 0.7));
    for (name, unit) in [("density", 1.0), ("velocity", 1.0), ("h1", 1.0)] {
        assert_eq!(field.variable(name).and_then(|v| v.unit.as_ref()).map(|u| u.to_cgs), Some(unit), "{name}");
    }
    for part in ["stability, NETWORK", "cell angular velocity", "'wind:'", "does not have the isotope: h1"] {
        assert!(field.notes.iter().any(|n| n.contains(part)), "{part}: {:?}", field.notes);
    }
    assert_eq!(field.metadata[0].1, "VERSION 10104 -- made by hand");
}

#[test]
fn other_ways_of_writing_give_the_same() {
    // The header does not name the cells' numbers; commented facts, names and units; brackets with numbers.
    let plain = progenitor(0.0);
    let commented = plain
        .replace("VERSION", "# VERSION")
        .replace("  grid  ", "# grid  ")
        .replacen("    1:", "# unit    g    cm    cm/sec    g/cm**3\n    1", 1)
        .replace(" wind:  1.0E+33 ---\n", "");
    let mut names = plain.lines().nth(1).unwrap().to_owned();
    for (i, (name, _)) in cell(0.0, 1.0).iter().enumerate() {
        names = names.replacen(&format!("{name:<25}"), &format!("[{:02} {name:>28}]  ", i + 2), 1);
    }
    let bracketed = plain.replacen(plain.lines().nth(1).unwrap(), &names.replace("grid", "# [01 grid]"), 1);
    for text in [plain.replacen("  grid ", "       ", 1), commented, bracketed] {
        check(&read_text("kepler", text.as_bytes(), &FieldRequest::default()).unwrap());
    }
}

#[test]
fn a_model_above_a_core_begins_where_its_mass_says() {
    // With the cells' own masses, which a hollow model needs.
    let from = 0.3;
    let plain = progenitor(from);
    let mut text = String::new();
    for (n, line) in plain.lines().enumerate() {
        let face = |i: usize| from + (1.0 - from) * i as f64 / CELLS as f64;
        let own = |i: usize| enclosed(face(i + 1)) - enclosed(face(i));
        let more = match n {
            0 => String::new(),
            1 => "cell mass".into(),
            n if n < CELLS + 2 => format!(" {:.16E}", own(n - 2)),
            _ => String::new(),
        };
        text += &format!("{line}{more}\n");
    }
    let field = read_text("kepler", text.as_bytes(), &FieldRequest::default()).unwrap();
    // The cell's volume is a few percent of the ball's within it, which is what rounding grows by.
    close(radii(&field)[0], from * STAR_RADIUS, 1e-12);
    close(values(&field, "enclosed_mass")[0], enclosed(from), 1e-12);
    close(mass(&field, "density"), star_mass() - enclosed(from), 1e-10);
    assert!(field.notes.iter().any(|n| n.contains("the model begins at")), "{:?}", field.notes);
    // Without them the innermost cell seems to reach to the center.
    let field = read_text("kepler", plain.as_bytes(), &FieldRequest::default()).unwrap();
    assert_eq!(radii(&field)[0], 0.0);
}

#[test]
fn a_real_star_has_its_stated_mass() {
    let Some(path) = shared("phantom/kepler_MS.data") else { return };
    let field = read(&path);
    assert_eq!((field.format, field.density.as_deref()), ("kepler", Some("density")));
    let density = field.variable("density").unwrap();
    assert_eq!((density.location, density.values.len()), (Location::Cell, 1065));
    assert_eq!((radii(&field).len(), radii(&field)[0]), (1066, 0.0));
    close(*radii(&field).last().unwrap(), 5.888_201_189_711_471_6e10, 1e-15);
    // Total mass of the last row.
    close(mass(&field, "density"), 1.990_527_639_487_848_6e33, 1e-6);
    let enclosed = field.variable("enclosed_mass").unwrap();
    assert_eq!((enclosed.location, enclosed.values.get(0)), (Location::Node, 0.0));
    for name in ["density", "temperature", "pressure", "internal_energy", "velocity", "enclosed_mass"] {
        let unit = field.variable(name).and_then(|v| v.unit.as_ref()).map(|u| u.to_cgs);
        assert_eq!(unit, Some(1.0), "{name}");
    }
    assert_eq!(values(&field, "temperature")[0], 1.356_843_249_099_494_7e7);
    assert_eq!(values(&field, "h1")[0], 0.700_873_167_255_713_2);
    assert!(field.variable("cell Y_e").is_some_and(|v| v.unit.is_none()));
    assert!(field.metadata.iter().any(|(_, text)| text.starts_with("VERSION  10202")));
    assert!(field.notes.iter().any(|n| n.contains("left out: fe56, 'fe'")), "{:?}", field.notes);
}

#[test]
fn faults_are_named_with_line_and_column() {
    let good = progenitor(0.0);
    let lines: Vec<&str> = good.lines().collect();
    let with = |line: usize, column: usize, field: &str| {
        let mut own: Vec<String> = lines.iter().map(|l| (*l).to_owned()).collect();
        let mut fields: Vec<&str> = own[line - 1].split_whitespace().collect();
        fields[column] = field;
        own[line - 1] = fields.join("  ");
        own.join("\n") + "\n"
    };
    for (text, expected) in [
        (with(12, 4, "NaN"), "line 12, column 'cell density': the density is NaN"),
        (with(12, 4, "-2.0"), "line 12, column 'cell density': the density is -2e0"),
        (with(12, 4, "---"), "line 12, column 'cell density': found a dash"),
        (with(12, 4, "dense"), "line 12, column 'cell density': found 'dense', expected a number"),
        (with(12, 14, "much"), "line 12, column 'h1': found 'much', expected a number"),
        (with(12, 2, "1.0"), "line 12, column 'cell outer radius': the outer radius is 1e0 cm"),
        (with(12, 2, "inf"), "line 12, column 'cell outer radius': the outer radius is inf cm"),
        (with(12, 1, "1.0"), "line 12, column 'cell outer total mass': the enclosed mass shrinks"),
        (good.replacen("he4 ", "h1  ", 1), "column 'h1': names two columns"),
        (good.replacen("    7:", " wind:", 1), "is a cell behind the line 'wind: ...'"),
        (good.replacen(" APPROX ", " ", 1), "columns, the header names 16"),
        (good.replacen("    1:", "# unit  Msun  Rsun\n    1:", 1), "line 3: states units other than cm and g/cm**3"),
        (lines[..2].join("\n"), "has no cells below"),
        (lines[2..].join("\n"), "line 1: expected a line above that names the columns"),
    ] {
        let error = error_of("kepler", &text);
        assert!(error.contains(expected), "{error}\nlacks {expected}");
    }
}

#[test]
fn damage_never_panics() {
    let text: String = progenitor(0.0).lines().take(6).map(|l| format!("{l}\n")).collect();
    survives_damage("kepler", text.as_bytes(), 5, false);
}
