//! `sph-prep convert`: a chain through every kind of container keeps what can be kept and says what cannot.

#![cfg(all(feature = "swift", feature = "gadget", feature = "gadget-binary", feature = "vtk", feature = "table"))]

use assert_cmd::Command;
use sph_formats::common::particle_names as names;
use sph_formats::{
    Column, FORMATS, FieldRequest, FileContent, ParticleFile, ParticleTable, RunHeader, Species, UnitDimension,
    UnitSystem, Values, WriteOptions,
};
use std::path::Path;

/// 500 particles along a curve, no two numbers alike.
fn particles() -> ParticleFile {
    let n = 500;
    let x = |i: usize| (i as f64 + 0.5) / n as f64;
    let column = |name: &str, components: usize, f: &dyn Fn(usize) -> f64, dimension: UnitDimension| Column {
        name: name.into(),
        components,
        values: Values::F64((0..n * components).map(f).collect()),
        dimension,
    };
    let columns = vec![
        column(names::COORDINATES, 3, &|i| 2.0 * x(i / 3).powi(1 + (i % 3) as i32), UnitDimension::LENGTH),
        column(names::VELOCITIES, 3, &|i| x(i / 3) - (i % 3) as f64, UnitDimension::VELOCITY),
        column(names::MASSES, 1, &|i| 1e-3 * (1.0 + x(i)), UnitDimension::MASS),
        column(names::DENSITY, 1, &|i| 3.0 + x(i), UnitDimension::mass_density(3)),
        column(names::SUPPORT_RADIUS, 1, &|i| 0.1 + x(i), UnitDimension::LENGTH),
        column(names::INTERNAL_ENERGY, 1, &|i| 7.0 + x(i), UnitDimension::SPECIFIC_ENERGY),
        column("IronFraction", 1, &x, UnitDimension::NONE),
    ];
    ParticleFile {
        header: RunHeader {
            dimension: 3,
            box_size: [2.0; 3],
            periodic: [true; 3],
            units: UnitSystem::solar(),
            time: 0.25,
            kernel: "Wendland C4".into(),
            kernel_neighbors: 120.0,
            provenance: vec![("Scene".into(), "a: 1 -- b\n".into())],
        },
        species: vec![Species { part_type: 0, table: ParticleTable { count: n, columns } }],
    }
}

fn read(path: &Path) -> ParticleFile {
    match sph_formats::read(FORMATS, path, None, &FieldRequest::default()).unwrap() {
        FileContent::Particles(p) => p,
        FileContent::Field(_) => panic!("a field"),
    }
}

fn convert(from: &Path, to: &Path, more: &[&str]) -> (bool, String) {
    let output = Command::cargo_bin("sph-prep").unwrap().arg("convert").arg(from).arg(to).args(more).output().unwrap();
    (output.status.success(), String::from_utf8(output.stderr).unwrap())
}

fn same(a: &ParticleFile, b: &ParticleFile, name: &str, tolerance: f64) {
    let get = |p: &ParticleFile| p.species[0].table.column(name).unwrap_or_else(|| panic!("no {name}")).values.to_f64();
    for (x, y) in get(a).iter().zip(get(b)) {
        assert!((x - y).abs() <= tolerance * x.abs(), "{name}: {y} of {x}");
    }
}

#[test]
fn a_chain_of_formats_keeps_columns_header_and_units() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let original = particles();
    let options = WriteOptions { compression: 4, double_precision: false };
    sph_formats::write(FORMATS, &file("a.hdf5"), None, &original, options).unwrap();
    for pair in ["a.hdf5", "b.h5", "c.vtu", "d.csv", "e.npz", "f.vtp", "g.hdf5"].windows(2) {
        let (good, text) = convert(&file(pair[0]), &file(pair[1]), &[]);
        assert!(good && !text.contains("does not hold"), "{pair:?}: {text}");
    }
    let (first, last) = (read(&file("a.hdf5")), read(&file("g.hdf5")));
    for name in [
        names::COORDINATES,
        names::VELOCITIES,
        names::MASSES,
        names::DENSITY,
        names::INTERNAL_ENERGY,
        names::PARTICLE_IDS,
    ] {
        same(&first, &last, name, 0.0);
        if name != names::PARTICLE_IDS {
            same(&original, &last, name, 6e-8);
        }
    }
    same(&first, &last, "IronFraction", 0.0);
    // Computed anew from masses and densities in f32.
    same(&first, &last, names::SUPPORT_RADIUS, 1.2e-7);
    assert_eq!((last.header.units, last.header.box_size), (original.header.units, original.header.box_size));
    assert_eq!((last.header.kernel.as_str(), last.header.periodic), ("Wendland C4", [true; 3]));
    assert!(last.header.provenance.contains(&("Scene".into(), "a: 1 -- b\n".into())));
}

#[test]
fn losses_are_listed_and_units_converted() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let original = particles();
    sph_formats::write(FORMATS, &file("a.h5"), None, &original, WriteOptions::default()).unwrap();
    let (good, text) = convert(&file("a.h5"), &file("b.gadget"), &["--units", "cgs"]);
    assert!(good, "{text}");
    for lost in ["'IronFraction'", "the kernel", "the provenance"] {
        assert!(text.contains(&format!("does not hold {lost}")) || text.contains(&format!("column {lost}")), "{text}");
    }
    assert!(!text.contains("unit system"), "{text}");
    let back = read(&file("b.gadget"));
    let factor = 6.957e10;
    for (x, y) in original.species[0].table.columns[0]
        .values
        .to_f64()
        .iter()
        .zip(back.species[0].table.columns[0].values.to_f64())
    {
        assert!((x * factor / y - 1.0).abs() < 1e-6);
    }
    let (good, text) = convert(&file("a.h5"), &file("c.hdf5"), &["--units", "furlongs"]);
    assert!(!good && text.contains("furlongs") && !file("c.hdf5").exists(), "{text}");
    std::fs::write(file("grid.csv"), "x,y,rho\n0,0,1\n1,0,2\n0,1,3\n1,1,4\n").unwrap();
    let (good, text) = convert(&file("grid.csv"), &file("c.hdf5"), &[]);
    assert!(!good && text.contains("holds a grid"), "{text}");
}
