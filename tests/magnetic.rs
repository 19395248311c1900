//! Units of magnetic fields: from files and scenes to the numbers that each code takes, against closed forms.

use rust_hdf5::H5File;
use sph_formats::common::netcdf_classic::{ClassicFile, Data};
use sph_formats::{FileContent, ParticleFile, UnitDimension};
use sph_prep::relaxation::Control;
use sph_prep::{FORMATS, Report, Scene};
use std::f64::consts::PI;
use std::path::Path;

const QUICK: &str = "polish: none\nwvt: {iterations: 0}\nthermal: {internal_energy: 1}\n";
const BOX: &str = "input: {expression: '1'}\nunits: galactic\nparticles: 64\ndomain: {box: [[0, 0, 0], [1, 1, 1]], boundary: periodic}\n";

fn run(scene: &str, out: &Path) -> Report {
    let mut scene = Scene::parse(&format!("{scene}\n{QUICK}")).unwrap();
    scene.output.file = Some(out.into());
    sph_prep::run(&scene, FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn refusal(scene: &str) -> String {
    let scene = Scene::parse(&format!("{scene}\n{QUICK}")).unwrap();
    sph_prep::place(&scene, FORMATS, &Control::default()).unwrap_err().to_string()
}

fn read(path: &Path) -> ParticleFile {
    match sph_formats::read(FORMATS, path, None, &Default::default()).unwrap() {
        FileContent::Particles(file) => *Box::new(file),
        FileContent::Field(_) => panic!("no particles"),
    }
}

/// The first particle's field in gauss.
fn gauss(file: &ParticleFile) -> Vec<f64> {
    let column = file.species[0].table.column("MagneticField").unwrap();
    let unit = file.header.units.to_cgs(UnitDimension::MAGNETIC_FIELD);
    (0..column.components).map(|k| column.values.get(k) * unit).collect()
}

fn close(found: f64, expected: f64, label: &str) {
    // Files hold single precision.
    assert!((found - expected).abs() <= 1e-6 * expected.abs().max(1e-30), "{label}: {found:e}, expected {expected:e}");
}

/// A field with sources, or one that does not go on across periodic faces, is no magnetic field.
#[test]
fn sources_of_a_stated_field_are_told() {
    let told = |field: &str| -> Vec<String> {
        let scene = Scene::parse(&format!("{BOX}fields: {{{field}}}\n{QUICK}")).unwrap();
        let (_, report) =
            sph_prep::place(&scene, FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{field}: {e}"));
        report
            .warnings
            .into_iter()
            .filter(|warning| warning.contains("the magnetic field") && warning.contains("divergence"))
            .collect()
    };
    for (field, expected) in [
        ("magnetic_field: ['x*uG/kpc', 'y*uG/kpc', 0]", "the largest field over the width"),
        ("magnetic_field: ['uG*x/kpc', '-uG*y/kpc', 0]", "faces of the periodic box"),
        ("vector_potential: [0, 0, 'x*y*uG/kpc']", "faces of the periodic box"),
    ] {
        let all = told(field);
        assert!(all.iter().any(|w| w.contains(expected)), "{field}: {all:?}");
    }
    for field in [
        "magnetic_field: ['uG*sin(2*pi*y/kpc)', 0, 1 uG]",
        "magnetic_field: ['if(y < 0.5*kpc, uG, -uG)', 0, 0]",
        "vector_potential: [0, 0, 'uG*kpc*cos(2*pi*x/kpc)']",
        "magnetic_field: ['uG*sin(120*pi*(x - y)/kpc)', 'uG*sin(120*pi*(x - y)/kpc)', 0]",
    ] {
        assert!(told(field).is_empty(), "{field}: {:?}", told(field));
    }
}

/// In the code's own numbers the pressure is B^2/(8 pi) of the field in gauss.
#[test]
fn each_code_gets_the_field_in_its_own_units() {
    let folder = tempfile::tempdir().unwrap();
    for field in ["[3e-6 G, 0, -0.4 nT]", "[3 uG, 0, '-4*1e-6*gauss']", "['3e-10*T', 0, '-0.4*nT']"] {
        for (name, dataset) in [
            ("ic.gizmo", "MagneticField"),
            ("ic.arepo", "MagneticField"),
            ("ic.hdf5", "MagneticFluxDensities"),
            ("ic.phantom", ""),
            ("ic.vtu", ""),
        ] {
            let path = folder.path().join(name);
            let format = if name == "ic.hdf5" { "output: {format: swift}\n" } else { "" };
            let report = run(&format!("{BOX}fields: {{magnetic_field: {field}}}\n{format}"), &path);
            assert!(report.notes.iter().any(|n| n.contains("the magnetic field is in")), "{name}: {:?}", report.notes);
            let back = read(&path);
            for (k, expected) in [3e-6, 0.0, -4e-6].into_iter().enumerate() {
                close(gauss(&back)[k], expected, &format!("{name}, {field}"));
            }
            if dataset.is_empty() {
                continue;
            }
            let file = H5File::open(&path).unwrap();
            let numbers: Vec<f32> = file.dataset(&format!("PartType0/{dataset}")).unwrap().read_raw().unwrap();
            let number = f64::from(numbers[0]);
            let units = back.header.units;
            let pressure = units.to_cgs(UnitDimension::PRESSURE);
            let found = match name {
                "ic.gizmo" => number * number / (8.0 * PI),
                "ic.arepo" => number * number / (8.0 * PI) * pressure,
                // mu_0 = 4 pi/100 g cm s^-2 A^-2.
                _ => (number * units.mass / units.time.powi(2)).powi(2) / (2.0 * 4.0 * PI / 100.0),
            };
            assert!((found / (9e-12 / (8.0 * PI)) - 1.0).abs() < 1e-6, "{name}: {found:e}");
        }
    }
}

/// Numbers without a unit are those of codes' tests: the magnetic pressure is B^2/2 in them.
#[test]
fn plain_numbers_have_the_pressure_of_half_their_square() {
    let folder = tempfile::tempdir().unwrap();
    let scene = BOX.replace("units: galactic\n", "");
    for (name, factor) in [("ic.gizmo", (4.0 * PI).sqrt()), ("ic.arepo", (4.0 * PI).sqrt()), ("ic.phantom", 1.0)] {
        let path = folder.path().join(name);
        run(&format!("{scene}fields: {{magnetic_field: [2, 0, 0]}}"), &path);
        close(read(&path).species[0].table.column("MagneticField").unwrap().values.get(0), 2.0, name);
        if factor > 1.0 {
            let file = H5File::open(&path).unwrap();
            let numbers: Vec<f32> = file.dataset("PartType0/MagneticField").unwrap().read_raw().unwrap();
            close(f64::from(numbers[0]), 2.0 * factor, name);
        }
    }
}

fn grid(path: &Path, unit: Option<&str>) {
    let line = [0.0, 1.0, 2.0];
    let mut file = ClassicFile::new();
    let ids = ["x", "y"].map(|name| {
        let id = file.dimension(name, 3);
        let axis = name.to_uppercase();
        file.variable(name, &[id], Data::F64(&line), &[("axis", axis.as_str().into()), ("units", "pc".into())]);
        id
    });
    file.variable("rho", &[ids[1], ids[0]], Data::F64(&[1e-20; 9]), &[("units", "g/cm^3".into())]);
    for (name, value) in [("Bx", &[50.0; 9]), ("By", &[-20.0; 9])] {
        let attributes: Vec<_> = unit.map(|u| ("units", u.into())).into_iter().collect();
        file.variable(name, &[ids[1], ids[0]], Data::F64(value), &attributes);
    }
    file.write(path).unwrap();
}

#[test]
fn a_files_unit_is_kept_and_a_missing_one_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let (input, out) = (folder.path().join("grid.nc"), folder.path().join("ic.gizmo"));
    let scene = |more: &str| format!("input: {{file: '{}'{more}}}\nparticles: 49", input.display());
    for (unit, more, factor) in [
        (Some("nT"), "", 1e-5),
        (Some("uG"), "", 1e-6),
        (None, ", magnetic_field_unit: 1e-6 G", 1e-6),
        // The file knows better.
        (Some("nT"), ", magnetic_field_unit: G", 1e-5),
    ] {
        grid(&input, unit);
        let report = run(&scene(more), &out);
        assert!(!report.warnings.iter().any(|w| w.contains("'Bx'")), "{unit:?}{more}: {:?}", report.warnings);
        let numbers: Vec<f32> =
            H5File::open(&out).unwrap().dataset("PartType0/MagneticField").unwrap().read_raw().unwrap();
        close(f64::from(numbers[0]), 50.0 * factor, "x");
        close(f64::from(numbers[1]), -20.0 * factor, "y");
        // Placed anew, the field is the same in another code's numbers.
        let next = folder.path().join("next.phantom.vtu");
        run(&format!("input: {{file: '{}'}}\nparticles: 30", out.display()), &next);
        close(gauss(&read(&next))[0], 50.0 * factor, "placed anew");
    }
    grid(&input, None);
    let report = run(&scene(""), &out);
    let warned = report.warnings.iter().any(|w| w.contains("'Bx' states no unit") && w.contains("magnetic_field_unit"));
    assert!(warned, "{:?}", report.warnings);
    for (more, part) in [
        (", magnetic_field_unit: km", "'km' is a unit of another quantity"),
        (", magnetic_field_unit: oersted", "is not a known unit; write for example G, T"),
    ] {
        let text = refusal(&scene(more));
        assert!(text.contains("input.magnetic_field_unit") && text.contains(part), "{text}");
    }
}

#[test]
fn a_unit_that_is_no_magnetic_field_or_cannot_be_converted_is_refused() {
    for (field, scene, parts) in [
        (
            "[3 km, 0, 0]",
            BOX.to_owned(),
            &["fields.magnetic_field", "which is a length", "expected a magnetic field"][..],
        ),
        ("[3 uG, 0, 0]", BOX.replace("units: galactic\n", ""), &["fields.magnetic_field", "states no units"]),
    ] {
        let text = refusal(&format!("{scene}fields: {{magnetic_field: {field}}}"));
        assert!(parts.iter().all(|part| text.contains(part)), "{field}: {text}");
    }
}

/// GADGET's files have no word for it, and codes with such files differ by more than a factor of 3.5.
#[test]
fn a_field_of_an_hdf5_file_that_says_nothing_of_its_unit_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("gas.hdf5");
    let scene = format!("{BOX}fields: {{magnetic_field: ['1*uG', 0, 0]}}\noutput: {{format: gadget}}");
    run(&scene, &path);
    let told = || {
        let facts = read(&path).header.provenance;
        facts.iter().any(|(_, text)| text.contains("nothing says what its magnetic field is in"))
    };
    assert!(!told());
    let file = H5File::open_rw(&path).unwrap();
    file.delete_group("SphPrep").unwrap();
    file.close().unwrap();
    assert!(told());
}
