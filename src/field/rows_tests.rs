//! A polytrope of index 1 as rows of every kind: its density and masses are known in closed form.

use super::*;
use crate::field::{FieldOptions, Source, from_raw};
use sph_formats::{Geometry, RawField, Unit};
use std::f64::consts::PI;

/// The mass of all within a radius, of 4/pi in all; the density at the center is 1.
fn enclosed(x: f64) -> f64 {
    4.0 / PI * ((PI * x).sin() / PI - x * (PI * x).cos())
}

fn density(x: f64) -> f64 {
    if x > 0.0 { (PI * x).sin() / (PI * x) } else { 1.0 }
}

/// Radius, density, enclosed mass and the zone's own mass of each row.
fn table(staggering: Staggering, zones: usize) -> Vec<[f64; 4]> {
    let face = |i: usize| (i as f64 / zones as f64).powf(1.3);
    (0..zones)
        .map(|i| {
            let (a, b) = (face(i), face(i + 1));
            let mass = enclosed(b) - enclosed(a);
            let mean = mass / (4.0 / 3.0 * PI * (b.powi(3) - a.powi(3)));
            match staggering {
                Staggering::Nodes => {
                    [a, density(a), enclosed(a), if i > 0 { enclosed(a) - enclosed(face(i - 1)) } else { 0.0 }]
                }
                Staggering::OuterFaces => [b, mean, enclosed(b), mass],
                Staggering::InnerFaces => [a, mean, enclosed(a), mass],
                Staggering::Centers => [0.5 * (a + b), mean, enclosed(b), mass],
            }
        })
        .collect()
}

fn variable(name: &str, unit: Option<&str>, values: Vec<f64>) -> Variable {
    Variable {
        name: name.into(),
        description: None,
        unit: unit.and_then(Unit::parse),
        location: Location::Node,
        components: 1,
        values: Values::F64(values),
    }
}

/// A file with columns r, rho and the mass `name`, which is column `mass` of the rows, in the given units.
fn file(rows: &[[f64; 4]], (name, mass): (&str, usize), units: Option<[&str; 3]>) -> RawField {
    let [length, rho, of_mass] = units.map_or([None; 3], |u| u.map(Some));
    let column = |k: usize| rows.iter().map(|r| r[k]).collect::<Vec<f64>>();
    RawField {
        path: "star.tab".into(),
        format: "table",
        geometry: Geometry::Radial { nodes: column(0), unit: length.and_then(Unit::parse) },
        variables: vec![
            variable("rho", rho, column(1)),
            variable(name, of_mass, column(mass)),
            variable("temperature", None, column(1)),
            variable("v_r", None, column(0)),
        ],
        density: Some("rho".into()),
        metadata: vec![],
        notes: vec![],
    }
}

fn read(raw: RawField, staggering: Option<Staggering>) -> Result<Source<3>> {
    from_raw::<3>(raw, &FieldOptions { staggering, ..FieldOptions::default() })
}

fn mass(source: &Source<3>) -> f64 {
    source.mass.unwrap().value
}

#[test]
fn rows_of_every_kind_are_told_by_their_mass() {
    for staggering in Staggering::ALL {
        for zones in [40, 300] {
            for column in [("m", 2), ("dm", 3)] {
                let source = read(file(&table(staggering, zones), column, None), None).unwrap();
                // Tables at points and at inner faces end before the last zone.
                let last = ((zones - 1) as f64 / zones as f64).powf(1.3);
                let (expected, within) = match staggering {
                    // The curve through points misses the mass to second order in their distance.
                    Staggering::Nodes => (enclosed(last), 0.3 / (zones * zones) as f64),
                    Staggering::InnerFaces => (enclosed(last), 1e-12),
                    Staggering::OuterFaces | Staggering::Centers => (4.0 / PI, 1e-12),
                };
                let found = mass(&source);
                assert!(
                    (found / expected - 1.0).abs() < within,
                    "{staggering:?} {zones} {column:?}: {found} {expected}"
                );
                let says = if staggering == Staggering::Nodes { "points" } else { "zones" };
                assert!(
                    source.notes.iter().any(|n| n.starts_with("rows are") && n.contains(says)),
                    "{:?}",
                    source.notes
                );
            }
        }
    }
}

#[test]
fn zones_lose_the_percents_that_points_would_add() {
    let rows = table(Staggering::OuterFaces, 100);
    let as_points = mass(&read(file(&rows, ("m", 2), None), Some(Staggering::Nodes)).unwrap());
    assert!(as_points / (4.0 / PI) > 1.01, "{as_points}");
    let inferred = mass(&read(file(&rows, ("m", 2), None), None).unwrap());
    assert!((inferred * PI / 4.0 - 1.0).abs() < 1e-12, "{inferred}");
}

#[test]
fn a_fraction_of_the_mass_tells_the_shape() {
    let mut rows = table(Staggering::OuterFaces, 100);
    rows.iter_mut().for_each(|r| r[2] *= 0.25 * PI);
    let source = read(file(&rows, ("q", 2), Some(["cm", "g/cm^3", ""])), None).unwrap();
    assert!((mass(&source) * PI / 4.0 - 1.0).abs() < 1e-12);
}

#[test]
fn few_digits_of_the_mass_do() {
    let mut rows = table(Staggering::OuterFaces, 400);
    rows.iter_mut().for_each(|r| r[2] = (r[2] * 1e5).round() / 1e5);
    let source = read(file(&rows, ("m", 2), None), None).unwrap();
    assert!((mass(&source) * PI / 4.0 - 1.0).abs() < 1e-12, "{:?}", source.notes);
}

#[test]
fn variables_go_where_their_rows_do() {
    let rows = table(Staggering::OuterFaces, 100);
    let source = read(file(&rows, ("m", 2), None), None).unwrap();
    let at = |name: &str, x: f64| {
        let field = source.carried.iter().find(|c| c.info().name == name).unwrap();
        let mut out = vec![0.0; field.info().components];
        field.evaluate(&[x, 0.0, 0.0], &mut out);
        out[0]
    };
    // The velocity of a face is its radius; at the center there is none.
    assert!((at("v_r", 0.5) - 0.5).abs() < 1e-4 && at("v_r", 1e-9) < 1e-8);
    // Temperatures are those of the zones' insides, here the density: 1 - (pi x)^2/6 + ...
    assert!((at("temperature", 0.5) / density(0.5) - 1.0).abs() < 1e-3, "{}", at("temperature", 0.5));
    assert!((at("m", 0.5) / enclosed(0.5) - 1.0).abs() < 1e-3);
}

#[test]
fn wrong_units_are_not_taken_for_other_rows() {
    const CGS: [&str; 3] = ["cm", "g/cm^3", "g"];
    for staggering in [Staggering::Nodes, Staggering::OuterFaces] {
        for factor in [0.985, 1.03, 1e3, 1.989e33] {
            let mut rows = table(staggering, 200);
            rows.iter_mut().for_each(|r| r[2] *= factor);
            let text = match read(file(&rows, ("m", 2), Some(CGS)), None) {
                Ok(_) => "accepted".into(),
                Err(e) => e.to_string(),
            };
            for part in ["field 'm'", "in the units that the file states", "input.density_unit", staggering.name()] {
                assert!(text.contains(part), "{staggering:?} {factor}: {text}");
            }
            let overruled = read(file(&rows, ("m", 2), Some(CGS)), Some(staggering)).unwrap();
            assert!((mass(&overruled) * PI / 4.0 - 1.0).abs() < 1e-3);
            // Without units there is nothing to contradict: the rows are found, and the factor is told.
            let open = read(file(&rows, ("m", 2), None), None).unwrap();
            assert!(open.notes.iter().any(|n| n.contains("but for a factor")), "{:?}", open.notes);
            assert!((mass(&open) - mass(&overruled)).abs() < 1e-12);
        }
    }
}

#[test]
fn masses_that_fit_nothing_are_refused_unless_the_rows_are_stated() {
    let mut rows = table(Staggering::Nodes, 100);
    rows.iter_mut().enumerate().for_each(|(i, r)| r[2] = i as f64);
    let text = match read(file(&rows, ("m", 2), None), None) {
        Ok(_) => "accepted".into(),
        Err(e) => e.to_string(),
    };
    for part in ["field 'm'", "does not fit radius and density", "expected at most 0.02", "--staggering", "star.tab"] {
        assert!(text.contains(part), "{text}");
    }
    assert!(read(file(&rows, ("m", 2), None), Some(Staggering::Nodes)).is_ok());
    // A disc's mass is none of the star's that the rows would make.
    assert!(from_raw::<2>(file(&rows, ("m", 2), None), &FieldOptions::default()).is_ok());
    // What does not grow is no enclosed mass, whatever its name.
    rows.iter_mut().for_each(|r| r[2] = 1.0 - r[0]);
    let source = read(file(&rows, ("m", 2), None), None).unwrap();
    assert!(source.notes.iter().any(|n| n.contains("no mass that grows outwards")), "{:?}", source.notes);
}
