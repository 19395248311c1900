//! Every particle writer of the registry: what it writes is read back, and no damage to its files ends in a panic.

use sph_formats::common::particle_names as names;
use sph_formats::registry::read;
use sph_formats::{
    Column, FORMATS, FieldRequest, FileContent, FormatError, FormatSpec, ParticleFile, ParticleTable, RunHeader,
    Species, UnitDimension, UnitSystem, Values, WriteOptions,
};
use std::path::Path;

fn column(name: &str, components: usize, values: Values, dimension: UnitDimension) -> Column {
    Column { name: name.into(), components, values, dimension }
}

/// Gas in a box of edge 2 with a number for everything; no two columns or axes are alike.
fn table(n: usize, d: usize, first_id: i64) -> ParticleTable {
    let x = |i: usize| 2.0 * (i as f64 + 0.3) / n as f64;
    let line = |f: &dyn Fn(usize) -> f64| Values::F64((0..n).map(f).collect());
    let vector = |f: &dyn Fn(usize, usize) -> f64| {
        Values::F64((0..n).flat_map(|i| (0..d).map(move |c| (i, c))).map(|(i, c)| f(i, c)).collect())
    };
    let columns = vec![
        column(names::COORDINATES, d, vector(&|i, c| x(i) / (c + 1) as f64), UnitDimension::LENGTH),
        column(names::VELOCITIES, d, vector(&|i, c| x(i) - (c + 1) as f64), UnitDimension::VELOCITY),
        column(names::MASSES, 1, line(&|i| 0.125 + x(i) / 64.0), UnitDimension::MASS),
        column(names::DENSITY, 1, line(&|i| 1.0 + x(i)), UnitDimension::mass_density(d)),
        column(names::SUPPORT_RADIUS, 1, line(&|i| 0.25 + x(i) / 8.0), UnitDimension::LENGTH),
        column(names::INTERNAL_ENERGY, 1, line(&|i| 10.0 + x(i)), UnitDimension::SPECIFIC_ENERGY),
        column(
            names::PARTICLE_IDS,
            1,
            Values::I64((0..n as i64).map(|i| first_id + 3 * i).collect()),
            UnitDimension::NONE,
        ),
        column("IronFraction", 1, line(&|i| x(i) / 4.0), UnitDimension::NONE),
    ];
    ParticleTable { count: n, columns }
}

fn particles(n: usize, d: usize) -> ParticleFile {
    let mut box_size = [0.0; 3];
    box_size[..d].fill(2.0);
    ParticleFile {
        header: RunHeader {
            dimension: d,
            box_size,
            periodic: std::array::from_fn(|k| k < d),
            units: UnitSystem::solar(),
            time: 0.5,
            kernel: "Wendland C4".into(),
            kernel_neighbors: 120.0,
            provenance: vec![("Seed".into(), "42".into())],
        },
        species: vec![Species { part_type: 0, table: table(n, d, 7) }],
    }
}

/// The same for a format: with one mass where it has but one.
fn particles_of(spec: &FormatSpec, n: usize, d: usize) -> ParticleFile {
    let mut p = particles(n, d);
    if spec.capabilities.equal_masses {
        equalize(&mut p);
    }
    p
}

fn equalize(p: &mut ParticleFile) {
    for (t, species) in p.species.iter_mut().enumerate() {
        let masses = species.table.columns.iter_mut().find(|c| c.name == names::MASSES).unwrap();
        masses.values = Values::F64(vec![0.375 + t as f64; species.table.count]);
    }
}

fn writers() -> impl Iterator<Item = &'static FormatSpec> {
    FORMATS.iter().filter(|f| f.write.is_some())
}

fn write(spec: &FormatSpec, path: &Path, p: &ParticleFile, double: bool) -> Result<(), FormatError> {
    let options = WriteOptions { compression: 4, double_precision: double };
    sph_formats::write(FORMATS, path, Some(spec.name), p, options)
}

fn read_back(path: &Path) -> Result<ParticleFile, FormatError> {
    match read(FORMATS, path, None, &FieldRequest::default())? {
        FileContent::Particles(p) => Ok(p),
        FileContent::Field(f) => panic!("{}: read as a {} by '{}'", path.display(), f.geometry.kind(), f.format),
    }
}

/// The particle reader that takes a format's files must be in the build.
fn can_read(spec: &FormatSpec) -> bool {
    let reader = match spec.name {
        "gadget-binary-1" => "gadget-binary",
        "arepo" | "gizmo" | "swift" => "gadget",
        name => name,
    };
    FORMATS.iter().any(|f| f.name == reader && f.read.is_some() && f.capabilities.read_particles)
}

/// The columns of `old` are in `new`, to `tolerance` (relative).
fn same_columns(context: &str, old: &ParticleTable, new: &ParticleTable, tolerance: f64) {
    assert_eq!(old.count, new.count, "{context}");
    for c in &old.columns {
        let Some(stored) = new.column(&c.name) else {
            let may_miss = ["IronFraction", names::SUPPORT_RADIUS].contains(&c.name.as_str());
            assert!(may_miss, "{context}: {} is lost", c.name);
            continue;
        };
        // These store a smoothing length of their own, from masses and densities.
        let own_length = context.contains("swift") || context.contains("phantom");
        if c.name == names::SUPPORT_RADIUS && own_length {
            continue;
        }
        // Phantom's density is the cube of its smoothing length.
        let cubed = c.name == names::DENSITY && context.contains("phantom");
        let tolerance = if cubed { (3.0 * tolerance).max(1e-15) } else { tolerance };
        assert_eq!(stored.components, c.components, "{context}: {}", c.name);
        for i in 0..c.values.len() {
            let (a, b) = (c.values.get(i), stored.values.get(i));
            assert!((a - b).abs() <= a.abs() * tolerance, "{context}: {} is {b} of {a}", c.name);
        }
    }
}

#[test]
fn every_format_keeps_particles_in_every_dimension() {
    let folder = tempfile::tempdir().unwrap();
    for spec in writers().filter(|s| can_read(s)) {
        for extension in spec.extensions.iter().take(if spec.name == "vtk" { 3 } else { 1 }) {
            for d in 1..=3 {
                for n in [1, 2, 7, 20_000] {
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
                std::fs::write(&path, bytes).unwrap();
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
