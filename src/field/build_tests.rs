//! Whole sources from hand-made raw fields.

use super::*;
use crate::field::{Centering, Period, ScalarField, total_mass};
use sph_formats::{GridAxis, Unit, UnitDimension, Values};
use std::f64::consts::PI;

fn variable(name: &str, location: Location, components: usize, values: Vec<f64>) -> Variable {
    Variable { name: name.into(), description: None, unit: None, location, components, values: Values::F64(values) }
}

fn raw(geometry: Geometry, variables: Vec<Variable>) -> RawField {
    RawField {
        path: "test.dat".into(),
        format: "test",
        geometry,
        density: variables.first().map(|v| v.name.clone()),
        variables,
        metadata: vec![],
        notes: vec![],
    }
}

fn radial_raw(nodes: Vec<f64>, variables: Vec<Variable>) -> RawField {
    raw(Geometry::Radial { nodes, unit: None }, variables)
}

fn axis(name: &str, nodes: Vec<f64>) -> GridAxis {
    GridAxis { name: name.into(), nodes, unit: None, bounds: None }
}

fn grid_raw(axes: Vec<GridAxis>, variables: Vec<Variable>) -> RawField {
    raw(Geometry::Grid { coordinates: Coordinates::Cartesian, axes }, variables)
}

fn message<const D: usize>(raw: RawField) -> String {
    match from_raw::<D>(raw, &FieldOptions::default()) {
        Ok(_) => "accepted".into(),
        Err(e) => e.to_string(),
    }
}

#[test]
fn a_profile_is_a_star_a_disc_and_a_sheet() {
    let make = || {
        radial_raw(
            vec![0.0, 0.5, 1.0],
            vec![
                variable("rho", Location::Cell, 1, vec![2.0, 2.0]),
                variable("temperature", Location::Cell, 1, vec![10.0, 5.0]),
                variable("v_r", Location::Node, 1, vec![0.0, 1.0, 2.0]),
                variable("mass", Location::Node, 1, vec![0.0, 1.0, 8.0 * PI / 3.0]),
            ],
        )
    };
    assert_eq!(natural_dimension(&make()), 3);
    let star = from_raw::<3>(make(), &FieldOptions { center: [1.0; 3], ..FieldOptions::default() }).unwrap();
    assert!((star.mass.unwrap().value / (8.0 / 3.0 * PI) - 1.0).abs() < 1e-14);
    assert_eq!(star.density.value(&[1.0, 1.0, 1.9]), 2.0);
    assert_eq!(star.density.value(&[0.0, 0.0, 0.0]), 0.0);
    assert!(star.notes.iter().any(|n| n.contains("'mass'")), "{:?}", star.notes);
    let mut out = [0.0; 3];
    let velocity = star.carried.iter().find(|c| c.info().name == "v_r").unwrap();
    assert_eq!(velocity.info().components, 3);
    velocity.evaluate(&[1.0, 1.5, 1.0], &mut out);
    assert!((out[1] - 1.0).abs() < 1e-14 && out[0] == 0.0);
    star.carried[0].evaluate(&[1.0; 3], &mut out[..1]);
    assert_eq!(out[0], 10.0);
    let disc = from_raw::<2>(make(), &FieldOptions::default()).unwrap();
    assert!((disc.mass.unwrap().value / (2.0 * PI) - 1.0).abs() < 1e-14);
    let sheet = from_raw::<1>(make(), &FieldOptions::default()).unwrap();
    assert!((sheet.mass.unwrap().value - 4.0).abs() < 1e-14);
    assert_eq!((sheet.domain.lo, sheet.domain.hi), ([-1.0], [1.0]));
    // Cubature over the same domain knows nothing of the shortcut.
    struct Plain(Source<2>);
    impl ScalarField<2> for Plain {
        fn value(&self, x: &[f64; 2]) -> f64 {
            self.0.density.value(x)
        }
    }
    let domain = disc.domain.clone();
    let mass = total_mass(&Plain(disc), &domain, 1e-8).unwrap();
    assert!((mass.value - 2.0 * PI).abs() <= mass.error);
}

#[test]
fn the_logarithm_of_a_density_is_none() {
    let make = |name: &str, is_named: bool| {
        let mut raw = radial_raw(vec![0.0, 1.0], vec![variable(name, Location::Node, 1, vec![1.0, 0.5])]);
        raw.density = raw.density.filter(|_| is_named);
        message::<3>(raw)
    };
    for name in ["log_rho", "logRho", "lnd", "log10(rho)", "ln_density"] {
        for is_named in [true, false] {
            let text = make(name, is_named);
            assert!(text.contains(name) && text.contains("antilogarithm"), "{name}: {text}");
        }
    }
    assert_eq!(make("logistic", true), "accepted");
}

#[test]
fn scaling_changes_units_and_nothing_else() {
    let make = || radial_raw(vec![0.0, 0.5, 1.0], vec![variable("rho", Location::Node, 1, vec![3.0, 2.0, 0.5])]);
    let plain = from_raw::<3>(make(), &FieldOptions::default()).unwrap();
    let scaled = from_raw::<3>(make(), &FieldOptions::default()).unwrap().scaled(7e10, 0.25);
    let x = [0.1, 0.2, 0.3];
    let there = scaled.density.value(&x.map(|v| v * 7e10));
    assert!((there / (0.25 * plain.density.value(&x)) - 1.0).abs() < 1e-14);
    let expected = plain.mass.unwrap().value * 0.25 * 7e10_f64.powi(3);
    assert!((scaled.mass.unwrap().value / expected - 1.0).abs() < 1e-14);
    let again = total_mass(scaled.density.as_ref(), &scaled.domain, 1e-6).unwrap();
    assert!((again.value / expected - 1.0).abs() < 1e-13);
    let profile = &scaled.radial.unwrap().profile;
    assert!((profile.total_mass().value / expected - 1.0).abs() < 1e-14);
    assert!((profile.outer_radius() / 7e10 - 1.0).abs() < 1e-15);
    // The surface itself belongs to the star in any unit.
    for r in [7e10 / 3.0, 7e10] {
        assert!(scaled.density.value(&[r, 0.0, 0.0]) > 0.0);
    }
}

#[test]
fn units_are_used_for_the_comparison_of_masses_only() {
    let unit = |to_cgs: f64, dimension| Some(Unit { symbol: "u".into(), to_cgs, dimension });
    let mut rho = variable("rho", Location::Cell, 1, vec![1.0]);
    rho.unit = unit(1.0, UnitDimension::mass_density(3));
    let mut mass = variable("m", Location::Node, 1, vec![0.0, 4.0 * PI / 3.0]);
    mass.unit = unit(1e30, UnitDimension::MASS);
    let mut raw = radial_raw(vec![0.0, 1.0], vec![rho, mass]);
    if let Geometry::Radial { unit: length, .. } = &mut raw.geometry {
        *length = unit(1e10, UnitDimension::LENGTH);
    }
    let source = from_raw::<3>(raw, &FieldOptions::default()).unwrap();
    let note = source.notes.iter().find(|n| n.contains("'m'")).unwrap();
    assert!(note.contains("4.188790e0, the file's 'm' ends at 4.188790e0"), "{note}");
}

#[test]
fn grids_take_nodes_cells_and_vectors() {
    let axes = || vec![axis("x", vec![0.0, 1.0, 2.0]), axis("y", vec![0.0, 2.0])];
    let velocity: Vec<f64> = (0..6).flat_map(|i| [f64::from(i % 3), 1.0, 9.0]).collect();
    let raw = grid_raw(
        axes(),
        vec![
            variable("rho", Location::Node, 1, vec![1.0, 2.0, 3.0, 1.0, 2.0, 3.0]),
            variable("u", Location::Cell, 1, vec![5.0, 6.0]),
            variable("v", Location::Node, 3, velocity),
        ],
    );
    let source = from_raw::<2>(raw, &FieldOptions::default()).unwrap();
    assert_eq!(source.mass.unwrap().value, 8.0);
    assert_eq!(source.density.value(&[0.5, 1.7]), 1.5);
    let mut out = [0.0; 2];
    source.carried[0].evaluate(&[1.5, 0.3], &mut out[..1]);
    assert_eq!(out[0], 6.0);
    source.carried[1].evaluate(&[9.0, 0.3], &mut out);
    assert_eq!(out, [2.0, 1.0]);
    assert_eq!(source.domain.hi, [2.0, 2.0]);

    let cells = grid_raw(axes(), vec![variable("rho", Location::Cell, 1, vec![1.0, 3.0])]);
    let options = FieldOptions { periodic: [Some(Period::Auto); 2], ..FieldOptions::default() };
    let source = from_raw::<2>(cells, &options).unwrap();
    assert_eq!(source.domain.axes, [Axis::Periodic; 2]);
    assert_eq!(source.mass.unwrap().value, 8.0);
    assert_eq!(source.density.value(&[2.5, -1.0]), 1.0);

    let mut bounded = axes();
    bounded[0].bounds = Some(vec![-0.5, 0.5, 1.5, 2.5]);
    bounded[1].bounds = Some(vec![-1.0, 1.0, 3.0]);
    let raw = grid_raw(bounded, vec![variable("rho", Location::Node, 1, vec![1.0; 6])]);
    let source = from_raw::<2>(raw, &FieldOptions::default()).unwrap();
    assert_eq!((source.domain.lo, source.domain.hi), ([-0.5, -1.0], [2.5, 3.0]));
    assert_eq!(source.mass.unwrap().value, 12.0);
}

/// Means of cells whose widths grow: straight lines between their middles have another mass, and say by how much.
#[test]
fn interpolation_that_changes_the_mass_of_cells_says_so() {
    let faces: Vec<f64> = (0..9).map(|i| 1.5_f64.powi(i)).collect();
    let middles = faces.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
    let values: Vec<f64> = faces.windows(2).map(|w| (0.5 * (w[0] + w[1])).powf(-1.5)).collect();
    let cells: f64 = values.iter().zip(faces.windows(2)).map(|(v, w)| v * (w[1] - w[0])).sum();
    let grid = GridAxis { bounds: Some(faces), ..axis("x", middles) };
    let raw = grid_raw(vec![grid], vec![variable("density", Location::Node, 1, values)]);
    for interpolation in [None, Some(Interpolation::Constant), Some(Interpolation::Linear), Some(Interpolation::Cubic)]
    {
        let source = from_raw::<1>(raw.clone(), &FieldOptions { interpolation, ..FieldOptions::default() }).unwrap();
        let off = source.mass.unwrap().value / cells - 1.0;
        let said = source.notes.iter().find(|n| n.contains("off that of the cells"));
        let is_off = off.abs() > 1e-6;
        assert_eq!(is_off, matches!(interpolation, Some(Interpolation::Linear | Interpolation::Cubic)), "{off}");
        assert_eq!(said.is_some(), is_off, "{interpolation:?}: {:?}", source.notes);
        assert!(said.is_none_or(|n| n.contains(&format!("{:+.3} %", 100.0 * off))), "{said:?}");
    }
}

#[test]
fn periodic_nodes_lie_in_cells_or_end_where_they_begin() {
    let options = FieldOptions { periodic: [Some(Period::Auto)], ..FieldOptions::default() };
    let build = |x: Vec<f64>, rho: Vec<f64>, options: &FieldOptions<1>| {
        let raw = grid_raw(vec![axis("x", x)], vec![variable("rho", Location::Node, 1, rho)]);
        from_raw::<1>(raw, options).map(|s| (s.domain.lo[0], s.domain.hi[0], s.mass.unwrap().value))
    };
    assert_eq!(build(vec![0.5, 1.5, 2.5], vec![1.0, 2.0, 3.0], &options).unwrap(), (0.0, 3.0, 6.0));
    assert_eq!(build(vec![0.5, 1.5, 2.5], vec![1.0, 2.0, 1.0], &options).unwrap(), (0.0, 3.0, 4.0));
    assert_eq!(build(vec![0.0, 1.0, 2.0], vec![1.0, 2.0, 1.0], &options).unwrap(), (0.0, 2.0, 3.0));
    let error = build(vec![0.0, 1.0, 2.0], vec![1.0, 2.0, 3.0], &options).unwrap_err().to_string();
    assert!(error.contains("input.centering") && error.contains("neither"), "{error}");
    let cells = FieldOptions { centering: Centering::Cells, ..options };
    assert_eq!(build(vec![0.0, 1.0, 2.0], vec![1.0, 2.0, 3.0], &cells).unwrap(), (-0.5, 2.5, 6.0));
}

#[test]
fn open_axes_that_end_at_nodes_are_told_where_nobody_says_so() {
    let told = |nodes: &[f64], centering: Centering| {
        let rho = variable("rho", Location::Node, 1, vec![1.0; nodes.len()]);
        let options = FieldOptions { centering, ..FieldOptions::default() };
        let source = from_raw::<1>(grid_raw(vec![axis("x", nodes.to_vec())], vec![rho]), &options).unwrap();
        source.notes.into_iter().find(|note| note.contains("input.centering"))
    };
    let even = told(&[0.5, 1.5, 2.5], Centering::Unknown).unwrap();
    assert!(even.contains("along x") && even.contains("`centering: cells`"), "{even}");
    let uneven = told(&[0.5, 1.5, 4.5], Centering::Unknown).unwrap();
    assert!(uneven.contains("bounds of its cells"), "{uneven}");
    for stated in [Centering::Nodes, Centering::Cells, Centering::Points] {
        assert_eq!(told(&[0.5, 1.5, 2.5], stated), None);
    }
}

#[test]
fn meshes_and_clouds_become_sources() {
    let points = vec![[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [1.0, 1.0, 5.0], [0.0, 1.0, 5.0]];
    let cells = Cells { types: vec![5, 5], offsets: vec![0, 3, 6], connectivity: vec![0, 1, 2, 0, 2, 3] };
    let mesh = raw(
        Geometry::Mesh { dimension: 2, points: points.clone(), unit: None, cells },
        vec![
            variable("rho", Location::Node, 1, vec![1.0, 2.0, 4.0, 3.0]),
            variable("region", Location::Cell, 1, vec![7.0, 8.0]),
        ],
    );
    let source = from_raw::<2>(mesh, &FieldOptions::default()).unwrap();
    // rho = 1 + x + 2 y.
    assert!((source.mass.unwrap().value - 2.5).abs() < 1e-14);
    assert!((source.density.value(&[0.3, 0.4]) - 2.1).abs() < 1e-12);
    assert_eq!(source.density.value(&[1.1, 0.4]), 0.0);
    let mut out = [0.0];
    source.carried[0].evaluate(&[0.5, 7.0], &mut out);
    assert_eq!(out[0], 8.0);
    let scaled = source.scaled(3.0, 2.0);
    assert!((scaled.domain.volume() - 9.0).abs() < 1e-13);
    let mass = total_mass(scaled.density.as_ref(), &scaled.domain, 1e-6).unwrap();
    assert!((mass.value - 45.0).abs() < 1e-12, "{mass:?}");
    assert!(scaled.domain.contains(&[2.9, 2.9]) && !scaled.domain.contains(&[3.1, 0.1]));

    let mut cloud_points = points;
    cloud_points.push([0.5, 0.5, 5.0]);
    let cloud = raw(
        Geometry::Cloud { dimension: 2, points: cloud_points, unit: None },
        vec![variable("rho", Location::Node, 1, vec![1.0; 5])],
    );
    let source = from_raw::<2>(cloud, &FieldOptions::default()).unwrap();
    assert!(source.mass.is_none());
    let mass = total_mass(source.density.as_ref(), &source.domain, 1e-6).unwrap();
    assert!((mass.value - 1.0).abs() <= mass.error.max(1e-12), "{mass:?}");
}

#[test]
fn refusals_name_variable_place_and_file() {
    let nan = grid_raw(
        vec![axis("x", vec![0.0, 1.0, 2.0]), axis("y", vec![0.0, 2.0])],
        vec![variable("rho", Location::Node, 1, vec![1.0, 1.0, 1.0, 1.0, f64::NAN, 1.0])],
    );
    let text = message::<2>(nan.clone());
    for part in ["'rho'", "1 of 6", "index (1, 1)", "(1, 2)", "missing: zero", "test.dat"] {
        assert!(text.contains(part), "{text}");
    }
    let options = FieldOptions { missing: Missing::Zero, ..FieldOptions::default() };
    let source = from_raw::<2>(nan.clone(), &options).unwrap();
    assert!(source.notes[0].contains("1 missing values"), "{:?}", source.notes);
    assert!(message::<3>(nan).contains("2 dimension(s), the scene asks for 3"));

    let rho = || variable("rho", Location::Node, 1, vec![1.0; 3]);
    assert!(message::<3>(radial_raw(vec![0.0, 2.0, 1.0], vec![rho()])).contains("must ascend"));
    assert!(message::<3>(radial_raw(vec![-1.0, 2.0, 3.0], vec![rho()])).contains("must not be negative"));
    assert!(message::<3>(radial_raw(vec![1.0, 1.0, 1.0], vec![rho()])).contains("no extent"));
    assert!(message::<3>(radial_raw(vec![0.0, f64::NAN, 1.0], vec![rho()])).contains("finite"));
    assert!(message::<3>(radial_raw(vec![0.0, 1.0], vec![rho()])).contains("3 values where"));
    assert!(message::<1>(grid_raw(vec![axis("x", vec![0.0, 1.0, 0.5])], vec![rho()])).contains("axis 'x' goes from 1"));
    assert!(
        message::<1>(grid_raw(vec![axis("x", vec![0.0])], vec![variable("rho", Location::Node, 1, vec![1.0])]))
            .contains("two or more")
    );
    let mut undecided = radial_raw(vec![0.0, 1.0, 2.0], vec![rho()]);
    undecided.density = None;
    assert!(message::<3>(undecided).contains("--density: the file has 'rho'"));
    let mut absent = radial_raw(vec![0.0, 1.0, 2.0], vec![rho()]);
    absent.density = Some("dens".into());
    assert!(message::<3>(absent).contains("'dens': is not in the file"));
    let vector = radial_raw(vec![0.0, 1.0], vec![variable("v", Location::Node, 3, vec![1.0; 6])]);
    assert!(message::<3>(vector).contains("3 components"));
    let lone = radial_raw(vec![0.0, 0.0, 1.0], vec![variable("rho", Location::Node, 1, vec![5.0, 0.0, 0.0])]);
    assert!(message::<3>(lone).contains("nothing to place"));
}

#[test]
fn variables_that_cannot_be_carried_are_named() {
    let make = || {
        radial_raw(
            vec![0.0, 1.0],
            vec![
                variable("rho", Location::Node, 1, vec![1.0; 2]),
                variable("t", Location::Node, 1, vec![1.0, f64::NAN]),
                variable("tensor", Location::Node, 6, vec![1.0; 12]),
            ],
        )
    };
    let source = from_raw::<3>(make(), &FieldOptions::default()).unwrap();
    assert!(source.carried.is_empty());
    assert_eq!(source.notes.len(), 2, "{:?}", source.notes);
    let asked = |names: &[&str]| FieldOptions {
        carried: Some(names.iter().map(|n| (*n).to_owned()).collect()),
        missing: Missing::Zero,
        ..FieldOptions::default()
    };
    assert_eq!(from_raw::<3>(make(), &asked(&["t"])).unwrap().carried.len(), 1);
    let error = from_raw::<3>(make(), &asked(&["xyz"])).err().unwrap().to_string();
    assert!(error.contains("'xyz'") && error.contains("'tensor'"), "{error}");
}

#[test]
fn layered_shells_on_the_sphere_have_their_mass() {
    let lon: Vec<f64> = (0..8).map(|i| 45.0 * f64::from(i)).collect();
    let lat = vec![-90.0, -45.0, 0.0, 45.0, 90.0];
    let r = vec![3.0, 5.0, 5.0, 6.0];
    let values = [2.0, 2.0, 1.0, 1.0].iter().flat_map(|&v| vec![v; 40]).collect();
    let axes = vec![axis("lon", lon), axis("lat", lat), axis("r", r)];
    let mut shell = grid_raw(axes, vec![variable("rho", Location::Node, 1, values)]);
    if let Geometry::Grid { coordinates, .. } = &mut shell.geometry {
        *coordinates = Coordinates::Geographic;
    }
    let source = from_raw::<3>(shell, &FieldOptions::default()).unwrap();
    let expected = 4.0 / 3.0 * PI * (2.0 * (125.0 - 27.0) + (216.0 - 125.0));
    assert!((source.mass.unwrap().value / expected - 1.0).abs() < 1e-12);
    assert!((source.domain.volume() / (4.0 / 3.0 * PI * (216.0 - 27.0)) - 1.0).abs() < 1e-14);
    assert_eq!(source.density.value(&[0.0, 4.0, 0.0]), 2.0);
    assert_eq!(source.density.value(&[0.0, -4.0, 4.0]), 1.0);
}

#[test]
fn an_interpolation_that_is_not_for_the_input_is_told() {
    let notes = |interpolation: Option<Interpolation>| {
        let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let cells = Cells { types: vec![5, 5], offsets: vec![0, 3, 6], connectivity: vec![0, 1, 2, 0, 2, 3] };
        let mesh = Geometry::Mesh { dimension: 2, points, unit: None, cells };
        let raw = raw(mesh, vec![variable("rho", Location::Cell, 1, vec![1.0, 2.0])]);
        let options = FieldOptions { interpolation, ..FieldOptions::default() };
        from_raw::<2>(raw, &options).unwrap().notes.into_iter().filter(|n| n.contains("input.interpolation")).count()
    };
    assert_eq!([None, Some(Interpolation::Linear), Some(Interpolation::Cubic)].map(notes), [0, 1, 1]);
}

/// The density of cells has slopes; what is carried beside it is that of the cell, whether it is at the cells of the density or at others.
#[test]
fn what_cells_carry_is_that_of_the_cell() {
    let grid = GridAxis { bounds: Some((0..6).map(f64::from).collect()), ..axis("x", vec![0.5, 1.5, 2.5, 3.5, 4.5]) };
    let share = vec![0.0, 0.2, 0.7, 0.9, 1.0];
    let variables = vec![
        variable("density", Location::Node, 1, vec![1.0, 2.0, 3.0, 4.0, 5.0]),
        variable("share", Location::Node, 1, share.clone()),
        variable("number", Location::Node, 1, vec![3.0, 4.0, 6.0, 9.0, 13.0]),
    ];
    let source = from_raw::<1>(grid_raw(vec![grid], variables), &FieldOptions::default()).unwrap();
    assert!((source.density.value(&[2.9]) - 3.4).abs() < 1e-12);
    for i in 0..50 {
        let x = [0.1 * (f64::from(i) + 0.5)];
        let mut out = [0.0];
        source.carried[0].evaluate(&x, &mut out);
        assert_eq!(out[0], share[x[0] as usize], "{x:?}");
        source.carried[1].evaluate(&x, &mut out);
        assert_eq!(out[0].fract(), 0.0, "{x:?}");
    }
}
