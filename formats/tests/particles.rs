//! Every particle writer of the registry: what it writes is read back, and no damage to its files ends in a panic.

use crate::support::{
    can_read, equalize, particles, particles_of, read_back, replace, same_columns, table, write, writers,
};
use sph_formats::common::particle_names as names;
use sph_formats::registry::read;
use sph_formats::{FORMATS, FieldRequest, FormatError, ParticleFile, Species, Values};

#[test]
fn every_format_keeps_particles_in_every_dimension() {
    let folder = tempfile::tempdir().unwrap();
    for spec in writers().filter(|s| can_read(s)) {
        for extension in spec.extensions.iter().take(if spec.name == "vtk" { 3 } else { 1 }) {
            // Files of several blocks in one dimension alone: blocks are cut by particles.
            let widest = spec.capabilities.dimensions.iter().copied().max().unwrap_or(3);
            for d in 1..=3 {
                for n in [1, 2, 7].into_iter().chain((d == widest).then_some(20_000)) {
                    let context = format!("{}-{d}-{n}", spec.name);
                    let p = particles_of(spec, n, d);
                    let path = folder.path().join(format!("{context}.{extension}"));
                    if !spec.capabilities.dimensions.contains(&d) {
                        let refused = write(spec, &path, &p, false).unwrap_err();
                        assert!(matches!(refused, FormatError::Output { .. }), "{context}: {refused}");
                        continue;
                    }
                    // Half a unit in the last place of f32, and as much again where its shortest digits are written.
                    for (double, tolerance) in [(true, 0.0), (false, 1.2e-7)] {
                        write(spec, &path, &p, double).unwrap();
                        let back = read_back(&path).unwrap_or_else(|e| panic!("{context}: {e}"));
                        assert_eq!(back.header.dimension, d, "{context}");
                        assert_eq!(back.species.len(), 1, "{context}");
                        same_columns(&context, &p.species[0].table, &back.species[0].table, tolerance);
                    }
                }
            }
        }
    }
}

/// In single precision: masses that have lost digits, and columns of which nothing is left. What is next to nothing beside the rest may become 0.
#[test]
fn numbers_that_single_precision_loses_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for spec in writers().filter(|s| can_read(s) && ["swift", "gadget", "gizmo", "gadget-binary"].contains(&s.name)) {
        let path = folder.path().join(format!("{}.{}", spec.name, spec.extensions[0]));
        let with = |name: &str, scale: f64, first: f64| {
            let mut p = particles_of(spec, 20, 3);
            let column = p.species[0].table.columns.iter_mut().find(|c| c.name == name).unwrap();
            let mut values: Vec<f64> = column.values.to_f64().iter().map(|v| v * scale).collect();
            values[0] *= first;
            column.values = Values::F64(values);
            p
        };
        let tried = |p: &ParticleFile, double: bool| write(spec, &path, p, double).map_err(|e| e.to_string());
        for (name, scale, first, problem) in [
            (names::MASSES, 1e-44, 1.0, "too little for f32"),
            (names::MASSES, 1.0, 1e-40, "f32's range"),
            (names::DENSITY, 1e-50, 1.0, "too little for f32"),
            (names::INTERNAL_ENERGY, 1e-70, 1.0, "too little for f32"),
        ] {
            let error = tried(&with(name, scale, first), false).unwrap_err();
            assert!(error.contains(problem) && error.contains("double precision"), "{}, {name}: {error}", spec.name);
            tried(&with(name, scale, first), true).unwrap_or_else(|e| panic!("{}, {name}: {e}", spec.name));
        }
        tried(&with(names::DENSITY, 1.0, 1e-50), false).unwrap_or_else(|e| panic!("{}: {e}", spec.name));
    }
}

#[test]
fn no_particles_are_written_and_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    for spec in writers().filter(|s| can_read(s)) {
        let path = folder.path().join(format!("{}.{}", spec.name, spec.extensions[0]));
        match write(spec, &path, &particles_of(spec, 0, 3), false) {
            Ok(()) => match read_back(&path) {
                Ok(back) => assert!(back.species.iter().all(|s| s.table.count == 0), "{}", spec.name),
                Err(e) => assert!(matches!(e, FormatError::Input { .. }), "{}: {e}", spec.name),
            },
            Err(e) => assert!(matches!(e, FormatError::Output { .. }), "{}: {e}", spec.name),
        }
    }
}

#[test]
fn writers_require_the_columns_that_they_say_and_no_others() {
    let folder = tempfile::tempdir().unwrap();
    for spec in writers() {
        for name in [names::INTERNAL_ENERGY, names::VELOCITIES, names::PARTICLE_IDS, "IronFraction"] {
            let mut p = particles_of(spec, 3, 3);
            p.species[0].table.columns.retain(|c| c.name != name);
            let path = folder.path().join(format!("{}.{}", spec.name, spec.extensions[0]));
            let required = spec.capabilities.requires.contains(&name);
            assert_eq!(write(spec, &path, &p, false).is_err(), required, "{} without {name}", spec.name);
        }
    }
}

#[test]
fn several_types_come_back_as_such_or_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut p = particles(5, 3);
    p.species.push(Species { part_type: 4, table: table(3, 3, 1000) });
    p.species.push(Species { part_type: 1, table: table(9, 3, 2000) });
    for spec in writers().filter(|s| can_read(s)) {
        let path = folder.path().join(format!("{}.{}", spec.name, spec.extensions[0]));
        let mut p = p.clone();
        if spec.capabilities.equal_masses {
            let refused = write(spec, &path, &p, true).unwrap_err().to_string();
            assert!(refused.contains("masses"), "{}: {refused}", spec.name);
            equalize(&mut p);
        }
        if let Err(e) = write(spec, &path, &p, true) {
            assert!(matches!(e, FormatError::Output { .. }), "{}: {e}", spec.name);
            continue;
        }
        let mut back = read_back(&path).unwrap();
        assert_eq!(back.species.len(), 3, "{}", spec.name);
        for old in &mut p.species {
            let new = back.species.iter_mut().find(|s| s.part_type == old.part_type).unwrap();
            for name in [names::COORDINATES, names::MASSES, names::PARTICLE_IDS] {
                assert_eq!(
                    old.table.column(name).unwrap().values,
                    new.table.column(name).unwrap().values,
                    "{}",
                    spec.name
                );
            }
        }
    }
}

#[test]
fn damaged_files_are_refused_or_read_without_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    for spec in writers().filter(|s| can_read(s)) {
        for extension in spec.extensions.iter().take(if spec.name == "vtk" { 3 } else { 1 }) {
            let path = folder.path().join(format!("a.{extension}"));
            write(spec, &path, &particles_of(spec, 150, 3), false).unwrap();
            let whole = std::fs::read(&path).unwrap();
            let attempt = |bytes: &[u8]| {
                replace(&path, bytes);
                read(FORMATS, &path, None, &FieldRequest::default()).is_ok()
            };
            let complete = read_back(&path).unwrap();
            for length in (0..whole.len()).step_by(1024) {
                if attempt(&whole[..length]) {
                    // Nothing but the vertex cells and closing tags may be missing.
                    let context = format!("{extension}: the first {length} bytes of {}", whole.len());
                    let back = read_back(&path).unwrap();
                    same_columns(&context, &complete.species[0].table, &back.species[0].table, 0.0);
                }
            }
            let step = (whole.len() / 150).max(1);
            for i in (0..whole.len()).step_by(step) {
                for mask in [0xff, 0x10, 0x01] {
                    let mut bytes = whole.clone();
                    bytes[i] ^= mask;
                    attempt(&bytes);
                }
            }
        }
    }
}
