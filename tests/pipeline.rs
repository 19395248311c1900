//! Whole runs through a host's own list of formats: a reader that yields fields made here, a writer that keeps
//! what it is given.

use sph_formats::common::particle_names as names;
use sph_formats::{
    Capabilities, FieldRequest, FileContent, FormatError, FormatSpec, Geometry, Location, Match, ParticleFile,
    RawField, Unit, Values, Variable, WriteOptions,
};
use sph_prep::relaxation::Control;
use sph_prep::run::pipeline;
use sph_prep::run::report::Report;
use sph_prep::scene::Scene;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

static KEPT: Mutex<Option<HashMap<PathBuf, ParticleFile>>> = Mutex::new(None);

fn no_sniff(_: &[u8]) -> Match {
    Match::No
}

fn sniff_profile(head: &[u8]) -> Match {
    if head.starts_with(b"profile") { Match::Certain } else { Match::No }
}

/// The path handed to a writer is a temporary; its extension is that of the output and tells the tests apart.
fn keep(path: &Path, file: &ParticleFile, _: WriteOptions) -> Result<(), FormatError> {
    let key = PathBuf::from(path.extension().unwrap());
    KEPT.lock().unwrap().get_or_insert_default().insert(key, file.clone());
    std::fs::write(path, "kept").map_err(|e| FormatError::io(path, "write", e))
}

/// Density of the n = 1 polytrope, sin(pi r)/(pi r), on 400 nodes, with a pressure and a composition.
fn read_profile(path: &Path, _: &FieldRequest) -> Result<FileContent, FormatError> {
    let nodes: Vec<f64> = (0..400).map(|i| i as f64 / 399.0).collect();
    let rho: Vec<f64> = nodes.iter().map(|&r| polytrope(r)).collect();
    let variable = |name: &str, unit: &str, values: Vec<f64>| Variable {
        name: name.into(),
        description: None,
        unit: Unit::parse(unit),
        location: Location::Node,
        components: 1,
        values: Values::F64(values),
    };
    Ok(FileContent::Field(RawField {
        path: path.into(),
        format: "profile",
        geometry: Geometry::Radial { nodes: nodes.clone(), unit: Unit::parse("Rsun") },
        variables: vec![
            variable("rho", "g/cm^3", rho.clone()),
            variable("pressure", "dyn/cm2", rho.iter().map(|r| r * r).collect()),
            variable("x_h", "1", nodes.iter().map(|r| 0.7 * r).collect()),
            variable("material", "1", nodes.iter().map(|r| if *r < 0.5 { 402.0 } else { 400.0 }).collect()),
        ],
        density: Some("rho".into()),
        metadata: Vec::new(),
        notes: Vec::new(),
    }))
}

fn polytrope(r: f64) -> f64 {
    let x = std::f64::consts::PI * r;
    if x > 0.0 { (x.sin() / x).max(0.0) } else { 1.0 }
}

const FORMATS: &[FormatSpec] = &[
    FormatSpec {
        name: "memory",
        summary: "kept in memory",
        extensions: &["t1", "t2", "t3", "t4", "t5", "t6", "t7", "t8", "t9", "t10", "t11"],
        feature: "none",
        reference: "none",
        capabilities: Capabilities { write_particles: true, dimensions: &[1, 2, 3], ..Capabilities::NONE },
        sniff: no_sniff,
        read: None,
        write: Some(keep),
        stream: None,
    },
    FormatSpec {
        name: "profile",
        summary: "a polytrope",
        extensions: &["profile"],
        feature: "none",
        reference: "none",
        capabilities: Capabilities {
            read_field: true,
            geometries: &["radial"],
            dimensions: &[3],
            ..Capabilities::NONE
        },
        sniff: sniff_profile,
        read: Some(read_profile),
        write: None,
        stream: None,
    },
];

/// Runs a scene whose output ends in `tag`, and returns what the writer got.
fn run(scene: &str, tag: &str) -> (Report, ParticleFile) {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("star.profile");
    std::fs::write(&input, "profile").unwrap();
    let mut scene = Scene::parse(scene).unwrap();
    if scene.input.expression.is_none() {
        scene.input.file = Some(input);
    }
    scene.output.file = Some(folder.path().join(format!("out.{tag}")));
    let stop = AtomicBool::new(false);
    let control = Control { deadline: None, interrupted: &stop, observer: &|_| {} };
    let report = pipeline::run(&scene, FORMATS, &control).unwrap_or_else(|e| panic!("{e}"));
    let file = KEPT.lock().unwrap().get_or_insert_default().remove(&PathBuf::from(tag)).unwrap();
    (report, file)
}

fn numbers(file: &ParticleFile, name: &str) -> Vec<f64> {
    file.species[0].table.column(name).unwrap_or_else(|| panic!("no column {name}")).values.to_f64()
}

#[test]
fn a_star_becomes_particles_with_its_mass_pressure_and_composition() {
    let (report, file) = run("particles: 4000", "t1");
    let (x, m, rho) =
        (numbers(&file, names::COORDINATES), numbers(&file, names::MASSES), numbers(&file, names::DENSITY));
    assert_eq!(m.len(), 4000);
    let total: f64 = m.iter().sum();
    assert!((total / report.mass.total - 1.0).abs() < 1e-12, "{total} against {}", report.mass.total);
    // 4/pi in units of (solar radius)^3 g/cm^3, less the atmosphere.
    let whole = 4.0 / std::f64::consts::PI * 6.957e10_f64.powi(3);
    let grams = report.mass.total_cgs.unwrap();
    assert!(grams < whole * 1.0001 && grams > 0.995 * whole, "{grams} of {whole}");
    assert!(report.notes.iter().any(|n| n.contains("atmosphere is cut")), "{:?}", report.notes);
    let edge = file.header.box_size[0];
    let u = numbers(&file, names::INTERNAL_ENERGY);
    let xh = numbers(&file, "x_h");
    let unit_radius = 6.957e10 / file.header.units.length;
    for i in 0..m.len() {
        let r = (0..3).map(|k| (x[3 * i + k] - 0.5 * edge).powi(2)).sum::<f64>().sqrt() / unit_radius;
        assert!(r < 1.0 && (0..3).all(|k| x[3 * i + k] >= 0.0 && x[3 * i + k] < edge));
        assert!((xh[i] - 0.7 * r).abs() < 1e-6, "{} at {r}", xh[i]);
        // u = P / ((gamma - 1) rho) = 1.5 rho in cgs.
        let wanted = 1.5 * polytrope(r) / (file.header.units.length / file.header.units.time).powi(2);
        assert!((u[i] / wanted - 1.0).abs() < 1e-3, "{} against {wanted} at {r}", u[i]);
    }
    assert!(report.density_error.interior_refitted.unwrap().mean < 0.02, "{:?}", report.density_error);
    assert!(rho.iter().all(|r| *r > 0.0));
}

#[test]
fn results_do_not_depend_on_the_scale_of_lengths_and_masses() {
    let scene = |size: f64, density: f64| {
        format!(
            "input: {{expression: '{density:e} * (2 + sin(2*pi*x/{size:e}))'}}\n\
             domain: {{box: [[0,0,0],[{size:e},{size:e},{size:e}]], boundary: [periodic]}}\n\
             particles: 1000\nwvt: {{iterations: 5}}\nsolver: {{evaluations: 30}}"
        )
    };
    let (_, one) = run(&scene(1.0, 1.0), "t2");
    for (tag, size, density) in [("t3", 1e11, 1e-7), ("t4", 1e-30, 1e200)] {
        let (_, other) = run(&scene(size, density), tag);
        let (a, b) = (numbers(&one, names::COORDINATES), numbers(&other, names::COORDINATES));
        // Particles come in the order of a tree, which rounding may change: each is sought among all.
        let periodic = |d: f64| (d - d.round()).abs();
        let gap = |a: &[f64], b: &[f64]| (0..3).map(|k| periodic(a[k] - b[k] / size)).fold(0.0, f64::max);
        let nearest = |a: &[f64]| b.chunks(3).map(|b| gap(a, b)).fold(f64::INFINITY, f64::min);
        let worst = a.chunks(3).map(nearest).fold(0.0, f64::max);
        // Rounding of the expression grows over some thirty iterations, to far less than the spacing of 0.1.
        assert!(worst < 1e-3, "{worst} at size {size:e}");
    }
}

#[test]
fn every_dimension_and_boundary_gives_exactly_n_in_the_box() {
    for (d, tag) in [(1, "t5"), (2, "t6"), (3, "t7")] {
        for boundary in ["periodic", "reflecting", "open"] {
            let zeros = vec!["0"; d].join(",");
            let ones = vec!["1"; d].join(",");
            let scene = format!(
                "input: {{expression: '1 + x'}}\ndomain: {{box: [[{zeros}],[{ones}]], boundary: [{boundary}]}}\n\
                 particles: 777\nwvt: {{iterations: 8}}"
            );
            let (report, file) = run(&scene, tag);
            let x = numbers(&file, names::COORDINATES);
            assert_eq!(x.len(), 777 * d, "{d}-D {boundary}");
            assert!(x.iter().all(|&v| v >= 0.0 && v < file.header.box_size[0]), "{d}-D {boundary}");
            assert!((report.mass.total - 1.5).abs() < 1e-9, "{d}-D {boundary}: {}", report.mass.total);
            assert!(report.mass.defect.abs() < 1e-12);
        }
    }
}

#[test]
fn few_particles_work_too() {
    for n in [1, 2, 7] {
        let (report, file) = run(&format!("particles: {n}"), "t8");
        assert_eq!(numbers(&file, names::MASSES).len(), n);
        assert!(report.mass.defect.abs() < 1e-12);
    }
}

#[test]
fn a_resolution_field_gives_varying_masses_that_add_up() {
    let (report, file) = run(
        "input: {expression: '1'}\nresolution: {number_density: '1 + 9*x'}\n\
         domain: {box: [[0,0,0],[1,1,1]], boundary: [reflecting]}\nparticles: 5000\nwvt: {iterations: 20}",
        "t9",
    );
    let m = numbers(&file, names::MASSES);
    assert!((m.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    assert!(report.mass.largest / report.mass.smallest > 5.0);
    assert!(report.density_error.all_refitted.mean < 0.03, "{:?}", report.density_error);
}

#[test]
fn materials_are_carried_without_mixing_or_given_by_layers() {
    let (_, file) = run("particles: 500\nwvt: {iterations: 5}\npolish: none", "t10");
    let middle = file.header.box_size[0] / 2.0;
    let radii = |file: &ParticleFile| -> Vec<f64> {
        let x = numbers(file, names::COORDINATES);
        x.chunks(3).map(|p| p.iter().map(|c| (c - middle).powi(2)).sum::<f64>().sqrt()).collect()
    };
    let check = |file: &ParticleFile, expected: &dyn Fn(f64) -> f64| {
        let ids = file.species[0].table.column(names::MATERIAL_IDS).unwrap();
        for (i, r) in radii(file).into_iter().enumerate() {
            assert_eq!(ids.values.get(i), expected(r), "at radius {r}");
        }
    };
    // The nodes on both sides of the jump are 199/399 and 200/399; half-way between them one material weighs more.
    check(&file, &|r| if r < 199.5 / 399.0 { 402.0 } else { 400.0 });
    let layers = "material: [{id: 7, radius: 0.3}, {id: -2, radius: 0.6}, {id: 5}]";
    let (_, file) = run(&format!("particles: 500\nwvt: {{iterations: 5}}\npolish: none\n{layers}"), "t11");
    check(&file, &|r| {
        if r < 0.3 {
            7.0
        } else if r < 0.6 {
            -2.0
        } else {
            5.0
        }
    });
}

/// What is written beside the density tells how it was summed, and what it should be.
#[test]
fn the_file_says_what_its_density_is_and_on_demand_what_it_should_be() {
    let yaml = "input: {expression: '3 + sin(2*pi*x)'}
domain: {box: [[0, 0], [1, 1]], boundary: [periodic]}
particles: 300
output: {units: code, target_density: true}";
    let place =
        |yaml: &str| sph_prep::place(&Scene::parse(yaml).unwrap(), sph_prep::FORMATS, &Control::default()).unwrap().0;
    let file = place(yaml);
    let table = &file.species[0].table;
    let (x, target) = (table.column(names::COORDINATES).unwrap(), table.column("TargetDensity").unwrap());
    for i in 0..300 {
        let expected = 3.0 + (std::f64::consts::TAU * x.values.get(2 * i)).sin();
        assert!((target.values.get(i) / expected - 1.0).abs() < 1e-12, "{i}");
    }
    let said = file.header.provenance.iter().find(|(key, _)| key == "DensityDefinition").unwrap();
    assert!(said.1.contains("Wendland C4") && said.1.contains("itself included"), "{}", said.1);
    let without = place(&yaml.replace(", target_density: true", ""));
    assert!(without.species[0].table.column("TargetDensity").is_none());
}
