//! Phantom dumps: units, types and masses of the code's own, byte order, small dumps, several MPI blocks.

use sph_formats::common::particle_names as names;
use sph_formats::units::GRAVITATIONAL_CONSTANT_CGS;
use sph_formats::{
    Column, FORMATS, FieldRequest, FileContent, FormatError, ParticleFile, ParticleTable, RunHeader, Species,
    UnitDimension, UnitSystem, Values, WriteOptions,
};
use std::path::Path;

fn species(part_type: u8, mass: f64) -> Species {
    let column = |name: &str, components, values: &[f64], dimension| Column {
        name: name.into(),
        components,
        values: Values::F64(values.to_vec()),
        dimension,
    };
    let columns = vec![
        column(names::COORDINATES, 3, &[0.5, -1.0, 1.5, 0.25, 0.75, 2.5], UnitDimension::LENGTH),
        column(names::VELOCITIES, 3, &[1.0, 0.0, 0.0, 0.0, -2.0, 0.0], UnitDimension::VELOCITY),
        column(names::MASSES, 1, &[mass, mass], UnitDimension::MASS),
        column(names::DENSITY, 1, &[mass, 8.0 * mass], UnitDimension::mass_density(3)),
        column(names::INTERNAL_ENERGY, 1, &[1.5, 6.0], UnitDimension::SPECIFIC_ENERGY),
        column("alpha", 1, &[0.5, 1.0], UnitDimension::NONE),
    ];
    Species { part_type, table: ParticleTable { count: 2, columns } }
}

fn particles(units: UnitSystem, species: Vec<Species>) -> ParticleFile {
    ParticleFile {
        header: RunHeader {
            dimension: 3,
            box_size: [4.0; 3],
            box_corner: None,
            periodic: [false; 3],
            units,
            time: 0.25,
            kernel: "M4".into(),
            kernel_neighbors: 57.9,
            provenance: vec![],
            layouts: Vec::new(),
        },
        species,
    }
}

fn write(path: &Path, p: &ParticleFile) -> Result<(), FormatError> {
    sph_formats::write(FORMATS, path, Some("phantom"), p, WriteOptions::default())
}

fn read(path: &Path) -> Result<ParticleFile, FormatError> {
    match sph_formats::read(FORMATS, path, None, &FieldRequest::default())? {
        FileContent::Particles(p) => Ok(p),
        FileContent::Field(_) => panic!("read as a field"),
    }
}

fn values(p: &ParticleFile, species: usize, name: &str) -> Vec<f64> {
    p.species[species].table.column(name).unwrap_or_else(|| panic!("no {name}")).values.to_f64()
}

#[test]
fn lengths_are_phantoms_and_the_time_unit_makes_gravity_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("star_00000.tmp");
    // A unit of time ten times the free one.
    let mut units = UnitSystem::solar();
    units.time *= 10.0;
    write(&path, &particles(units, vec![species(0, 0.5)])).unwrap();
    let p = read(&path).unwrap();
    let u = p.header.units;
    let g = 6.672041e-8 * u.mass * u.time.powi(2) / u.length.powi(3);
    assert!((g - 1.0).abs() < 1e-12, "{g}");
    let close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-12 * b.abs());
    // Phantom's G is smaller than that of the units, and its unit of time longer.
    let longer = (GRAVITATIONAL_CONSTANT_CGS / 6.672041e-8_f64).sqrt();
    assert!(close(&values(&p, 0, names::VELOCITIES), &[0.1, 0.0, 0.0, 0.0, -0.2, 0.0].map(|v| v * longer)));
    assert!(close(&values(&p, 0, names::INTERNAL_ENERGY), &[0.015, 0.06].map(|u| u * longer * longer)));
    assert!((p.header.time * longer - 2.5).abs() < 1e-12);
    // In the file the middle of the box is the origin.
    let bytes = std::fs::read(&path).unwrap();
    let record = [-1.5, -1.75].map(f64::to_le_bytes).concat();
    assert!(bytes.windows(16).any(|w| w == record));
    assert_eq!(values(&p, 0, names::COORDINATES), [0.5, -1.0, 1.5, 0.25, 0.75, 2.5]);
    assert_eq!((p.header.box_size, p.header.periodic), ([4.0; 3], [false; 3]));
    // h = 1.2 (m/rho)^(1/3) in f4; the kernel's support is 2 h.
    let support: Vec<f64> = [1.2f32, 0.6].iter().map(|h| 2.0 * f64::from(*h)).collect();
    assert_eq!(values(&p, 0, names::SUPPORT_RADIUS), support);
    assert_eq!(values(&p, 0, "alpha"), [0.5, 1.0]);
    assert_eq!(values(&p, 0, names::PARTICLE_IDS), [1.0, 2.0]);
}

#[test]
fn types_have_their_own_masses() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.phantom");
    let mut p = particles(UnitSystem::CODE, vec![species(0, 0.5), species(1, 2.0), species(4, 0.25)]);
    p.species[1].table.columns.retain(|c| c.name != names::INTERNAL_ENERGY);
    write(&path, &p).unwrap();
    let back = read(&path).unwrap();
    assert_eq!(back.species.iter().map(|s| s.part_type).collect::<Vec<_>>(), [0, 1, 4]);
    for (i, mass) in [0.5, 2.0, 0.25].into_iter().enumerate() {
        assert_eq!(values(&back, i, names::MASSES), [mass; 2]);
    }
    assert!(back.species[1].table.column(names::INTERNAL_ENERGY).is_none());
    assert_eq!(values(&back, 2, names::INTERNAL_ENERGY), [1.5, 6.0]);
}

#[test]
fn only_vectors_that_the_dump_has_are_not_lost() {
    let columns = FORMATS.iter().find(|spec| spec.name == "phantom").unwrap().capabilities.columns;
    for name in [names::VELOCITIES, names::MAGNETIC_FIELD] {
        assert_eq!(columns.loses(name, 3), None);
    }
    let text = columns.loses("VectorPotential", 3).unwrap();
    assert!(text.contains("no vectors but Velocities and MagneticField"), "{text}");
    assert_eq!(columns.loses("metallicity", 1), None);
}

#[test]
fn what_phantom_cannot_hold_is_refused_with_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let refusal = |change: &dyn Fn(&mut ParticleFile)| {
        let mut p = particles(UnitSystem::solar(), vec![species(0, 0.5)]);
        change(&mut p);
        write(&folder.path().join("a.phantom"), &p).unwrap_err().to_string()
    };
    let text = refusal(&|p| p.species[0].table.columns[2].values = Values::F64(vec![0.5, 0.51]));
    assert!(text.contains("5e-1 to 5.1e-1") && text.contains("equal mass"), "{text}");
    let text = refusal(&|p| p.species[0].part_type = 2);
    assert!(text.contains("type 2"), "{text}");
    let text = refusal(&|p| p.header.periodic = [true, false, true]);
    assert!(text.contains("all axes or none"), "{text}");
    let text = refusal(&|p| p.species[0].table.columns[3].values = Values::F64(vec![0.5, 0.0]));
    assert!(text.contains("'h' of particle 1"), "{text}");
}

/// A dump as a small-endian, big-endian, full or small one, in one or more MPI blocks.
struct Maker {
    bytes: Vec<u8>,
    big: bool,
    small: bool,
}

impl Maker {
    fn record(&mut self, words: &[Vec<u8>]) {
        let body: Vec<u8> = words
            .iter()
            .flat_map(|w| {
                let mut w = w.clone();
                if self.big {
                    w.reverse();
                }
                w
            })
            .collect();
        let length = body.len() as i32;
        let mark = if self.big { length.to_be_bytes() } else { length.to_le_bytes() };
        self.bytes.extend(mark);
        self.bytes.extend(body);
        self.bytes.extend(mark);
    }

    fn text(&mut self, text: &str, width: usize) {
        let padded = format!("{text:width$}");
        self.record(&padded.bytes().map(|b| vec![b]).collect::<Vec<_>>());
    }

    fn ints(&mut self, ints: &[i32]) {
        self.record(&ints.iter().map(|n| n.to_le_bytes().to_vec()).collect::<Vec<_>>());
    }

    fn real(&self, x: f64) -> Vec<u8> {
        if self.small { (x as f32).to_le_bytes().to_vec() } else { x.to_le_bytes().to_vec() }
    }

    fn reals(&mut self, reals: &[f64]) {
        let words: Vec<_> = reals.iter().map(|x| self.real(*x)).collect();
        self.record(&words);
    }

    /// A dump of two MPI blocks with one and two particles, the last of which was accreted, and a sink.
    fn dump(big: bool, small: bool) -> Vec<u8> {
        let mut m = Self { bytes: Vec::new(), big, small };
        let int = |n: i32| n.to_le_bytes().to_vec();
        let pattern = [int(60769), m.real(60878.0), int(60878), int(1), int(690_706)];
        m.record(&pattern);
        m.text("?T:Phantom:2025.0", 100);
        m.ints(&[1]);
        m.text("nblocks", 16);
        m.ints(&[2]);
        for _ in 0..4 {
            m.ints(&[0]);
        }
        m.ints(&[3]);
        m.text(&["hfact", "massoftype", "time"].map(|t| format!("{t:16}")).concat(), 48);
        m.reals(&[1.0, 0.25, 7.0]);
        m.ints(&[0]);
        m.ints(&[0]);
        m.ints(&[4]);
        for (n, x, h) in [(1i64, vec![1.0], vec![0.5]), (2, vec![2.0, 3.0], vec![0.25, -1.0])] {
            for (n, counts) in [(n, [0, 0, 0, 0, 0, 4, 0, 0]), (1, [0, 0, 0, 0, 0, 1, 0, 0])] {
                let mut words = vec![n.to_le_bytes().to_vec()];
                words.extend(counts.map(int));
                m.record(&words);
            }
            for (tag, values) in [("x", &x), ("y", &x), ("z", &x), ("h", &h)] {
                m.text(tag, 16);
                m.reals(values);
            }
            m.text("x", 16);
            m.reals(&[9.0]);
        }
        m.bytes
    }
}

#[test]
fn both_byte_orders_small_dumps_and_mpi_blocks_are_read() {
    let folder = tempfile::tempdir().unwrap();
    for (big, small) in [(false, false), (true, false), (false, true), (true, true)] {
        let path = folder.path().join("dump_00001");
        std::fs::write(&path, Maker::dump(big, small)).unwrap();
        let p = read(&path).unwrap_or_else(|e| panic!("{big} {small}: {e}"));
        assert_eq!(values(&p, 0, names::COORDINATES), [1.0, 1.0, 1.0, 2.0, 2.0, 2.0], "{big} {small}");
        // m (hfact / h)^3.
        assert_eq!(values(&p, 0, names::DENSITY), [2.0, 16.0]);
        assert_eq!(values(&p, 0, names::MASSES), [0.25; 2]);
        assert_eq!(p.header.time, 7.0);
        let notes = format!("{:?}", p.header.provenance);
        assert!(notes.contains("1 sink") && notes.contains("1 particles with h <= 0"), "{notes}");
    }
}

fn sinks(part_type: u8, radii: &[(&str, [f64; 2])]) -> Species {
    let mut points = species(part_type, 3.0);
    points.table.columns.retain(|c| [names::COORDINATES, names::VELOCITIES, names::MASSES].contains(&c.name.as_str()));
    for (name, values) in radii {
        points.table.columns.push(Column {
            name: (*name).into(),
            components: 1,
            values: Values::F64(values.to_vec()),
            dimension: UnitDimension::LENGTH,
        });
    }
    points
}

#[test]
fn point_masses_are_sinks_in_arrays_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.phantom");
    let radii = [(names::SOFTENING_RADIUS, [0.5, 0.0]), (names::ACCRETION_RADIUS, [0.0, 0.25])];
    let p = particles(UnitSystem::CODE, vec![species(0, 0.5), sinks(1, &radii)]);
    write(&path, &p).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let has = |values: [f64; 2]| bytes.windows(16).any(|w| w == values.map(f64::to_le_bytes).concat());
    // About the middle of the box; hsoft is half of the softening radius.
    assert!(has([-1.5, -1.75]) && has([0.25, 0.0]) && has([3.0, 3.0]));
    let back = read(&path).unwrap();
    assert_eq!(back.species.iter().map(|s| (s.part_type, s.table.count)).collect::<Vec<_>>(), [(0, 2), (1, 2)]);
    for name in [names::COORDINATES, names::VELOCITIES, names::MASSES, names::SOFTENING_RADIUS, names::ACCRETION_RADIUS]
    {
        assert_eq!(values(&back, 1, name), p.species[1].table.column(name).unwrap().values.to_f64(), "{name}");
    }
    assert_eq!(values(&back, 0, names::MASSES), [0.5; 2]);
    // Beside dark matter they get a type of their own.
    let mut dark = species(1, 2.0);
    dark.table.columns.retain(|c| c.name != names::INTERNAL_ENERGY);
    write(&path, &particles(UnitSystem::solar(), vec![species(0, 0.5), dark, sinks(5, &radii)])).unwrap();
    let back = read(&path).unwrap();
    assert_eq!(back.species.iter().map(|s| s.part_type).collect::<Vec<_>>(), [0, 1, 5]);
    let longer = (GRAVITATIONAL_CONSTANT_CGS / 6.672041e-8_f64).sqrt();
    assert!((values(&back, 2, names::VELOCITIES)[0] / longer - 1.0).abs() < 1e-12);
    for cut in (0..bytes.len()).step_by(7) {
        std::fs::write(&path, &bytes[..cut]).unwrap();
        assert!(read(&path).is_err(), "cut at {cut} of {}", bytes.len());
    }
}

#[test]
fn sinks_that_cannot_be_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refusal = |species: Species| {
        let p = particles(UnitSystem::CODE, vec![self::species(0, 0.5), species]);
        write(&folder.path().join("a.phantom"), &p).unwrap_err().to_string()
    };
    let text = refusal(sinks(1, &[(names::ACCRETION_RADIUS, [0.0, 0.5])]));
    assert!(text.contains("point mass 1") && text.contains("softening_radius"), "{text}");
    let text = refusal(sinks(1, &[(names::SOFTENING_RADIUS, [0.5, f64::NAN])]));
    assert!(text.contains("hsoft") && text.contains("NaN"), "{text}");
    let text = refusal(sinks(1, &[(names::SOFTENING_RADIUS, [0.5, -0.5])]));
    assert!(text.contains("point mass 2") && text.contains("-0.5"), "{text}");
    let mut light = sinks(1, &[(names::SOFTENING_RADIUS, [0.5, 0.5])]);
    light.table.columns[2].values = Values::F64(vec![1.0, 0.0]);
    assert!(refusal(light).contains("weighs 0"));
}

/// The records of a dump.
fn records(path: &Path) -> Vec<Vec<u8>> {
    let bytes = std::fs::read(path).unwrap();
    let (mut records, mut rest) = (Vec::new(), bytes.as_slice());
    while let Some((length, more)) = rest.split_first_chunk::<4>() {
        let length = u32::from_le_bytes(*length) as usize;
        records.push(more[..length].to_vec());
        rest = &more[length + 4..];
    }
    records
}

fn with_column(mut species: Species, name: &str, components: usize, values: &[f64]) -> Species {
    let values = Values::F64(values.to_vec());
    species.table.columns.push(Column { name: name.into(), components, values, dimension: UnitDimension::NONE });
    species
}

/// Phantom takes dust as a fraction of the gas only where the identity says so, and reads a magnetic field from a block of its own.
#[test]
fn the_identity_says_what_is_in_a_dump_and_a_field_has_its_own_block() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ic_00000.tmp");
    let field = [0.5, -1.0, 2.0, 0.25, 4.0, -8.0];
    let dusty = with_column(species(0, 0.5), names::DUST_FRACTION, 1, &[0.01, 0.02]);
    let magnetic = with_column(species(0, 0.5), names::MAGNETIC_FIELD, 3, &field);
    let grains = with_column(species(2, 0.25), names::DUST_TO_GAS_RATIO, 1, &[0.1, 0.1]);
    for (all, what, lengths) in [
        (vec![species(0, 0.5)], "(hydro)", 2_i32),
        (vec![dusty], "(hydro+1dust)", 2),
        (vec![species(0, 0.5), grains], "(hydro+dust)", 2),
        (vec![magnetic], "(mhd+clean)", 4),
    ] {
        write(&path, &particles(UnitSystem::CODE, all)).unwrap();
        let records = records(&path);
        let identity = String::from_utf8(records[1].clone()).unwrap();
        assert!(identity.trim_end().ends_with(what), "{identity}");
        let tags: Vec<String> = records.iter().map(|r| String::from_utf8_lossy(r).trim_end().to_owned()).collect();
        // Heads of arrays have 40 bytes, and their number stands before them.
        let first = records.iter().position(|r| r.len() == 40).unwrap();
        assert_eq!(records[first - 1], lengths.to_le_bytes(), "{what}");
        assert_eq!(records[first..].iter().take_while(|r| r.len() == 40).count(), lengths as usize, "{what}");
        let length = |head: usize| i64::from_le_bytes(records[first + head][..8].try_into().unwrap());
        if lengths == 4 {
            assert_eq!([0, 1, 2, 3].map(length), [2, 0, 0, 2]);
            let back = read(&path).unwrap();
            assert_eq!(values(&back, 0, names::MAGNETIC_FIELD), field);
            // Behind all others.
            assert_eq!(tags[tags.len() - 6], "Bx");
        }
    }
}

/// Phantom leaves units of 1 for its own where matter attracts itself, after it has read the parameter file.
#[test]
fn pure_numbers_have_the_units_that_phantom_would_take() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ic_00000.tmp");
    let mut p = particles(UnitSystem::CODE, vec![species(0, 0.5)]);
    for (periodic, units) in [(false, [1.496e13, 1.9891e33]), (true, [1.0, 1.0])] {
        p.header.periodic = [periodic; 3];
        write(&path, &p).unwrap();
        let records = records(&path);
        let at = records.iter().position(|r| r.starts_with(b"udist           ")).unwrap();
        let number = |i: usize| f64::from_le_bytes(records[at + 1][8 * i..8 * i + 8].try_into().unwrap());
        assert_eq!([number(0), number(1)], units);
        let gravity = 6.672041e-8 * number(1) * number(2).powi(2) / number(0).powi(3);
        assert!(periodic || (gravity - 1.0).abs() < 1e-9, "{gravity}");
        let back = read(&path).unwrap();
        assert_eq!(back.header.units, UnitSystem::CODE);
        assert_eq!(values(&back, 0, names::VELOCITIES), values(&p, 0, names::VELOCITIES));
    }
}
