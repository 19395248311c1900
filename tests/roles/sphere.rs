//! Components along longitude, latitude and radius, and variables whose units are not stated.

use sph_formats::common::netcdf_classic::{Attribute, ClassicFile, Data};
use sph_formats::common::particle_names as columns;
use sph_formats::{ParticleFile, UnitDimension};
use sph_prep::relaxation::Control;
use sph_prep::{FORMATS, Report, Scene, place};
use std::path::Path;

/// Expansion v = H x and rotation about the z axis.
const EXPANSION: f64 = 0.5;
const ROTATION: f64 = 2.0;

/// A shell from r = 1 to 2, every 5 degrees; values by radius, colatitude in radians.
fn shell(path: &Path, variables: &[(&str, &dyn Fn(f64, f64) -> f64)]) {
    let lon: Vec<f64> = (0..72).map(|i| 5.0 * f64::from(i)).collect();
    let lat: Vec<f64> = (0..37).map(|i| -90.0 + 5.0 * f64::from(i)).collect();
    let r: Vec<f64> = (0..9).map(|i| 1.0 + f64::from(i) / 8.0).collect();
    let mut file = ClassicFile::new();
    let text = |unit: &str| Attribute::from(unit);
    let ids = [("lon", &lon, "degrees_east"), ("lat", &lat, "degrees_north"), ("radius", &r, "m")].map(
        |(name, nodes, unit)| {
            let id = file.dimension(name, nodes.len());
            file.variable(name, &[id], Data::F64(nodes), &[("units", text(unit))]);
            id
        },
    );
    let values: Vec<(&str, Vec<f64>)> = variables
        .iter()
        .map(|(name, f)| {
            let all = r.iter().flat_map(|&r| {
                let lon = &lon;
                lat.iter().flat_map(move |&lat| lon.iter().map(move |_| f(r, (90.0 - lat).to_radians())))
            });
            (*name, all.collect())
        })
        .collect();
    for (name, values) in &values {
        file.variable(name, &[ids[2], ids[1], ids[0]], Data::F64(values), &[]);
    }
    file.write(path).unwrap();
}

fn run(path: &Path, more: &str) -> (ParticleFile, Report) {
    run_in(path, more, "")
}

/// With lines of the scene beside its input.
fn run_in(path: &Path, more: &str, beside: &str) -> (ParticleFile, Report) {
    let text = format!(
        "input: {{file: '{}', density: density{more}}}\nparticles: 300\npolish: none\nwvt: {{iterations: 0}}\n{beside}",
        path.display()
    );
    place(&Scene::parse(&text).unwrap(), FORMATS, &Control::default()).unwrap()
}

#[test]
fn components_on_the_sphere_become_cartesian() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shell.nc");
    let up = |r: f64, _: f64| EXPANSION * r;
    let east = |r: f64, theta: f64| ROTATION * r * theta.sin();
    let none = |_: f64, _: f64| 0.0;
    let density = |_: f64, _: f64| 1.0;
    let sets: [&[(&str, &dyn Fn(f64, f64) -> f64)]; 3] = [
        &[("density", &density), ("vr", &up), ("vtheta", &none), ("vphi", &east)],
        // CF: eastward, northward, upward.
        &[("density", &density), ("u", &east), ("v", &none), ("w", &up)],
        &[("density", &density), ("eastward_wind", &east), ("northward_wind", &none), ("upward_air_velocity", &up)],
    ];
    for set in sets {
        shell(&path, set);
        let (file, report) = run(&path, "");
        let table = &file.species[0].table;
        let (x, v) = (table.column(columns::COORDINATES).unwrap(), table.column(columns::VELOCITIES).unwrap());
        let middle = 0.5 * file.header.box_size[0];
        for i in 0..table.count {
            let x: [f64; 3] = std::array::from_fn(|k| x.values.get(3 * i + k) - middle);
            let v: [f64; 3] = std::array::from_fn(|k| v.values.get(3 * i + k));
            let expected = [EXPANSION * x[0] - ROTATION * x[1], EXPANSION * x[1] + ROTATION * x[0], EXPANSION * x[2]];
            // Chords of 5 degrees lie (2.5 degrees)^2 / 2 = 1e-3 within the circle, along both angles.
            for k in 0..3 {
                assert!(
                    (v[k] - expected[k]).abs() < 3e-3 * ROTATION * 2.0,
                    "{}: {v:?}, expected {expected:?}",
                    set[1].0
                );
            }
        }
        // The radius has a unit, and the density none.
        assert!(report.warnings.iter().all(|w| w.contains("no unit is used")), "{:?}", report.warnings);
    }
}

#[test]
fn a_velocity_without_a_unit_is_in_the_coherent_units_of_the_input_or_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grid.nc");
    let line = [0.0, 1.0, 2.0, 3.0];
    let write = |length: &str, density: &str| {
        let mut file = ClassicFile::new();
        let id = file.dimension("x", 4);
        file.variable("x", &[id], Data::F64(&line), &[("units", length.into()), ("axis", "X".into())]);
        file.variable("density", &[id], Data::F64(&[1.0; 4]), &[("units", density.into())]);
        file.variable("vx", &[id], Data::F64(&[7.0; 4]), &[]);
        file.write(&path).unwrap();
    };
    let velocity = |file: &ParticleFile| {
        let v = file.species[0].table.column(columns::VELOCITIES).unwrap().values.get(0);
        v * file.header.units.to_cgs(UnitDimension::VELOCITY)
    };
    write("m", "kg/m^3");
    let (file, report) = run(&path, "");
    assert!((velocity(&file) / 700.0 - 1.0).abs() < 1e-12, "{}", velocity(&file));
    assert!(
        report.warnings.iter().any(|w| w.contains("'vx' states no known unit") && w.contains("SI")),
        "{:?}",
        report.warnings
    );
    write("cm", "g/cm^3");
    let (file, _) = run(&path, "");
    assert!((velocity(&file) / 7.0 - 1.0).abs() < 1e-12, "{}", velocity(&file));
    // What nobody states the units of is in the scene's, whatever these are.
    write("", "");
    let solar = sph_formats::UnitSystem::solar().to_cgs(UnitDimension::VELOCITY);
    for (units, expected) in [("si", 700.0), ("solar", 7.0 * solar)] {
        let (file, report) = run_in(&path, "", &format!("units: {units}"));
        assert!((velocity(&file) / expected - 1.0).abs() < 1e-12, "{units}: {}", velocity(&file));
        assert!(report.warnings.iter().any(|w| w.contains("'vx'") && w.contains("the scene's units")), "{report:?}");
    }
    // Lengths in one system and densities in another say nothing of velocities.
    write("km", "g/cm^3");
    let (_, report) = run(&path, "");
    assert!(
        report.warnings.iter().any(|w| w.contains("'vx' states no unit that is known") && w.contains("as they stand")),
        "{:?}",
        report.warnings
    );
    // One of the two alone is of no use, which is hardly meant.
    for (length, density, key) in [("km", "", "input.density_unit"), ("", "kg/m^3", "input.length_unit")] {
        write(length, density);
        let (_, report) = run(&path, "");
        assert!(report.warnings.iter().any(|w| w.contains("no unit is used") && w.contains(key)), "{report:?}");
    }
}

/// What has a meaning is missed where it is left out.
#[test]
fn a_variable_that_lacks_a_value_is_left_out_with_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grid.nc");
    let mut file = ClassicFile::new();
    let id = file.dimension("x", 4);
    file.variable("x", &[id], Data::F64(&[0.0, 1.0, 2.0, 3.0]), &[("axis", "X".into())]);
    file.variable("density", &[id], Data::F64(&[1.0; 4]), &[]);
    file.variable("pressure", &[id], Data::F64(&[1.0, f64::NAN, 1.0, 1.0]), &[]);
    file.write(&path).unwrap();
    let (particles, report) = run(&path, "");
    assert!(particles.species[0].table.column(columns::PRESSURE).is_none());
    let warned = |w: &String| w.contains("'pressure' is left out: 1 of its 4 values") && w.contains("missing: zero");
    assert!(report.warnings.iter().any(warned), "{:?}", report.warnings);
    assert!(report.variables.iter().any(|v| v.name == "pressure" && v.written_as.is_none()), "{:?}", report.variables);
}

#[test]
fn components_out_of_the_plane_are_warned_of_unless_they_are_zero() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plane.nc");
    let line = [0.0, 1.0, 2.0];
    for (out_of_plane, is_warned) in [(0.0, false), (3.0, true)] {
        let mut file = ClassicFile::new();
        let ids = ["x", "y"].map(|name| {
            let id = file.dimension(name, 3);
            file.variable(name, &[id], Data::F64(&line), &[("axis", name.to_uppercase().as_str().into())]);
            id
        });
        let along = [out_of_plane; 9];
        for (name, values) in [("density", &[1.0; 9]), ("vel1", &[5.0; 9]), ("vel2", &[7.0; 9]), ("vel3", &along)] {
            file.variable(name, &[ids[1], ids[0]], Data::F64(values), &[]);
        }
        file.write(&path).unwrap();
        let (file, report) = run(&path, "");
        let v = file.species[0].table.column(columns::VELOCITIES).unwrap();
        assert_eq!((v.components, v.values.get(0), v.values.get(1)), (2, 5.0, 7.0));
        let warned = report.warnings.iter().any(|w| w.contains("'vel3'") && w.contains("out of the 2-D space"));
        assert_eq!(warned, is_warned, "{:?}", report.warnings);
    }
}
