//! One set of particles through every format: each column comes back to the precision in which the format stores it, and
//! a format holds what its kind can hold.

use sph_formats::common::particle_names as names;
use sph_formats::{
    Column, FORMATS, FieldRequest, FileContent, ParticleFile, ParticleTable, RunHeader, Species, UnitDimension,
    UnitSystem, Values, WriteOptions,
};
use std::path::Path;

const COUNT: usize = 1000;

/// Gas of one mass in solar units, which are Phantom's too, on a winding curve in a periodic box.
fn particles() -> ParticleFile {
    let t = |i: usize| (i as f64 + 0.5) / COUNT as f64;
    let column = |name: &str, components: usize, f: &dyn Fn(usize, usize) -> f64, dimension| Column {
        name: name.into(),
        components,
        values: Values::F64((0..COUNT * components).map(|n| f(n / components, n % components)).collect()),
        dimension,
    };
    let ids = Values::I64((0..COUNT as i64).map(|i| 3 * i + 11).collect());
    let materials = Values::I64((0..COUNT as i64).map(|i| 400 + i % 3).collect());
    let columns = vec![
        column(names::COORDINATES, 3, &|i, k| 1.0 + (7.0 * t(i) * (k + 1) as f64).sin() / 1.5, UnitDimension::LENGTH),
        column(names::VELOCITIES, 3, &|i, k| (9.0 * t(i) + k as f64).cos(), UnitDimension::VELOCITY),
        column(names::MASSES, 1, &|_, _| 0.001, UnitDimension::MASS),
        column(names::DENSITY, 1, &|i, _| 0.1 + t(i), UnitDimension::mass_density(3)),
        column(names::SUPPORT_RADIUS, 1, &|i, _| 0.2 + t(i) / 3.0, UnitDimension::LENGTH),
        column(names::INTERNAL_ENERGY, 1, &|i, _| 1e-3 + t(i) / 7.0, UnitDimension::SPECIFIC_ENERGY),
        Column { name: names::PARTICLE_IDS.into(), components: 1, values: ids, dimension: UnitDimension::NONE },
        Column { name: names::MATERIAL_IDS.into(), components: 1, values: materials, dimension: UnitDimension::NONE },
        column("HydrogenFraction", 1, &|i, _| 0.7 * t(i), UnitDimension::NONE),
    ];
    ParticleFile {
        header: RunHeader {
            dimension: 3,
            box_size: [2.0; 3],
            box_corner: None,
            periodic: [true; 3],
            units: UnitSystem::solar(),
            time: 0.75,
            kernel: "Wendland C6".into(),
            kernel_neighbors: 200.0,
            provenance: vec![("Seed".into(), "9".into())],
            layouts: Vec::new(),
        },
        species: vec![Species { part_type: 0, table: ParticleTable { count: COUNT, columns } }],
    }
}

fn read(path: &Path, format: Option<&str>) -> ParticleFile {
    match sph_formats::read(FORMATS, path, format, &FieldRequest::default()).unwrap() {
        FileContent::Particles(p) => p,
        FileContent::Field(_) => panic!("{}: read as a field", path.display()),
    }
}

/// What a format has no place for, or holds in a form of its own.
fn not_held(format: &str) -> &'static [&'static str] {
    match format {
        // One list of blocks; no units, dimension or periodic axes either.
        "gadget-binary" | "gadget-binary-1" => &[names::MATERIAL_IDS, "HydrogenFraction"],
        "arepo" => &[names::SUPPORT_RADIUS],
        // Smoothing lengths of their own convention; a dump's density is made of them.
        "swift" => &[names::SUPPORT_RADIUS],
        "phantom" => &[names::SUPPORT_RADIUS, names::DENSITY],
        _ => &[],
    }
}

#[test]
fn every_format_gives_back_every_column_to_its_precision() {
    let folder = tempfile::tempdir().unwrap();
    let original = particles();
    for spec in FORMATS.iter().filter(|f| f.write.is_some()) {
        for double in [false, true] {
            let path = folder.path().join(format!("a.{}", spec.extensions[0]));
            let options = WriteOptions { compression: 1, double_precision: double };
            sph_formats::write(FORMATS, &path, Some(spec.name), &original, options).unwrap();
            let own = spec.read.is_some().then_some(spec.name);
            let back = read(&path, own);
            for old in &original.species[0].table.columns {
                if not_held(spec.name).contains(&old.name.as_str()) {
                    continue;
                }
                let new = back.species[0].table.column(&old.name);
                let new = new.unwrap_or_else(|| panic!("{}: no {}", spec.name, old.name));
                assert_eq!((new.components, new.values.len()), (old.components, old.values.len()), "{}", spec.name);
                // Positions and integers keep every digit; other numbers those of f32, unless f64 is asked for.
                let binary = spec.name.starts_with("gadget-binary");
                let exact =
                    double || matches!(old.values, Values::I64(_)) || (old.name == names::COORDINATES && !binary);
                for i in 0..old.values.len() {
                    // Phantom's unit of time is its own.
                    let unit = match spec.name {
                        "phantom" => {
                            back.header.units.to_cgs(old.dimension) / original.header.units.to_cgs(old.dimension)
                        }
                        _ => 1.0,
                    };
                    let (a, b) = (old.values.get(i), unit * new.values.get(i));
                    let near = unit != 1.0 && (a - b).abs() <= if exact { 1e-14 } else { 1.2e-7 } * a.abs();
                    let same = near || if exact { a == b } else { a == b || a as f32 == b as f32 };
                    assert!(same, "{} ({double}): {} {i} is {b:e} of {a:e}", spec.name, old.name);
                }
            }
            if !spec.name.starts_with("gadget-binary") {
                let (a, b) = (&original.header, &back.header);
                assert_eq!(
                    (a.dimension, a.box_size, a.periodic),
                    (b.dimension, b.box_size, b.periodic),
                    "{}",
                    spec.name
                );
                if spec.name == "phantom" {
                    assert_eq!((a.units.length, a.units.mass), (b.units.length, b.units.mass));
                    assert!((a.time * a.units.time / (b.time * b.units.time) - 1.0).abs() < 1e-14);
                    continue;
                }
                assert_eq!((a.units, a.time), (b.units, b.time), "{}", spec.name);
            }
        }
    }
}
