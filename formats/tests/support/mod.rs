//! Particles and helpers of the tests that go through every format of the registry.

// Each test uses a part of them.
#![allow(dead_code)]

mod files;
pub mod plotfile;
pub mod ramses;
#[cfg(feature = "hdf5-layer")]
pub mod trees;

pub use files::replace;

use sph_formats::common::particle_names as names;
use sph_formats::registry::read;
use sph_formats::{
    Column, FORMATS, FieldRequest, FileContent, FormatError, FormatSpec, ParticleFile, ParticleTable, RawField,
    RunHeader, Species, UnitDimension, UnitSystem, Values, WriteOptions,
};
use std::path::Path;

/// The field of a file.
pub fn attempt(path: &Path) -> Result<RawField, FormatError> {
    match read(FORMATS, path, None, &FieldRequest::default())? {
        FileContent::Field(field) => Ok(field),
        FileContent::Particles(_) => panic!("a grid holds no particles"),
    }
}

/// Flips a bit behind the signature of an HDF5 file, 400 times in other places; most are in values, but not all may be read.
pub fn refuses_flipped_bits(path: &Path, format: &str, request: &FieldRequest) {
    let whole = std::fs::read(path).unwrap();
    let mut refused = 0;
    for n in 0..400 {
        let at = 64 + n * 7919 % (whole.len() - 64);
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (n % 8);
        replace(path, &bytes);
        refused += usize::from(read(FORMATS, path, Some(format), request).is_err());
    }
    assert!(refused > 20, "{refused} of 400 damaged files refused");
    replace(path, &whole);
}

/// What is said of a file that is no field.
pub fn refusal(path: &Path) -> String {
    attempt(path).map(|f| f.geometry.kind()).unwrap_err().to_string()
}

pub fn column(name: &str, components: usize, values: Values, dimension: UnitDimension) -> Column {
    Column { name: name.into(), components, values, dimension }
}

/// Gas in a box of edge 2 with a number for everything; no two columns or axes are alike.
pub fn table(n: usize, d: usize, first_id: i64) -> ParticleTable {
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

pub fn particles(n: usize, d: usize) -> ParticleFile {
    let mut box_size = [0.0; 3];
    box_size[..d].fill(2.0);
    ParticleFile {
        header: RunHeader {
            dimension: d,
            box_size,
            box_corner: None,
            periodic: std::array::from_fn(|k| k < d),
            units: UnitSystem::solar(),
            time: 0.5,
            kernel: "Wendland C4".into(),
            kernel_neighbors: 120.0,
            provenance: vec![("Seed".into(), "42".into())],
            layouts: Vec::new(),
        },
        species: vec![Species { part_type: 0, table: table(n, d, 7) }],
    }
}

/// The same for a format: with one mass where it has but one.
pub fn particles_of(spec: &FormatSpec, n: usize, d: usize) -> ParticleFile {
    let mut p = particles(n, d);
    if spec.capabilities.equal_masses {
        equalize(&mut p);
    }
    p
}

pub fn equalize(p: &mut ParticleFile) {
    for (t, species) in p.species.iter_mut().enumerate() {
        let masses = species.table.columns.iter_mut().find(|c| c.name == names::MASSES).unwrap();
        masses.values = Values::F64(vec![0.375 + t as f64; species.table.count]);
    }
}

pub fn writers() -> impl Iterator<Item = &'static FormatSpec> {
    FORMATS.iter().filter(|f| f.write.is_some())
}

pub fn write(spec: &FormatSpec, path: &Path, p: &ParticleFile, double: bool) -> Result<(), FormatError> {
    let options = WriteOptions { compression: 4, double_precision: double };
    sph_formats::write(FORMATS, path, Some(spec.name), p, options)
}

pub fn read_back(path: &Path) -> Result<ParticleFile, FormatError> {
    match read(FORMATS, path, None, &FieldRequest::default())? {
        FileContent::Particles(p) => Ok(p),
        FileContent::Field(f) => panic!("{}: read as a {} by '{}'", path.display(), f.geometry.kind(), f.format),
    }
}

/// The particle reader that takes a format's files must be in the build.
pub fn can_read(spec: &FormatSpec) -> bool {
    let reader = match spec.name {
        "gadget-binary-1" => "gadget-binary",
        "arepo" | "gizmo" | "swift" => "gadget",
        name => name,
    };
    FORMATS.iter().any(|f| f.name == reader && f.read.is_some() && f.capabilities.read_particles)
}

/// The columns of `old` are in `new`, to `tolerance` (relative).
pub fn same_columns(context: &str, old: &ParticleTable, new: &ParticleTable, tolerance: f64) {
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
            let same =
                |a: f64| (a - b).abs() <= a.abs() * tolerance.max(if a == c.values.get(i) { 0.0 } else { 1e-15 });
            // Phantom's unit of time follows from its own constant of gravity.
            let longer = (6.674_30_f64 / 6.672_041).sqrt().powi(-i32::from(c.dimension.time));
            let is_same = same(a) || context.contains("phantom") && same(a * longer);
            assert!(is_same, "{context}: {} is {b} of {a}", c.name);
        }
    }
}
