//! SWIFT and GADGET files: what is written, read back, refused, and survived.

use crate::support::replace;
use sph_formats::common::hdf5_read::Reader;
use sph_formats::common::particle_names as names;
use sph_formats::model::{DOUBT_KEY, LACKS_KEY};
use sph_formats::registry::{detect, detect_output};
use sph_formats::{
    Column, FORMATS, FieldRequest, FileContent, FormatError, ParticleFile, ParticleTable, RunHeader, Species,
    UnitDimension, UnitSystem, Values, WriteOptions,
};
use std::path::Path;

fn column(name: &str, components: usize, values: Values, dimension: UnitDimension) -> Column {
    Column { name: name.into(), components, values, dimension }
}

/// `n` particles on a line through a box of edge 2, each number known in closed form.
fn particles(n: usize, d: usize) -> ParticleFile {
    let x = |i: usize| 2.0 * (i as f64 + 0.5) / n as f64;
    let line = |f: &dyn Fn(usize) -> f64| Values::F64((0..n).map(f).collect());
    let positions = (0..n).flat_map(|i| (0..d).map(move |c| x(i) / (c + 1) as f64));
    let columns = vec![
        column(names::COORDINATES, d, Values::F64(positions.collect()), UnitDimension::LENGTH),
        column(names::MASSES, 1, line(&|_| 0.125), UnitDimension::MASS),
        column(names::DENSITY, 1, line(&|i| 1.0 + x(i)), UnitDimension::mass_density(d)),
        column(names::SUPPORT_RADIUS, 1, line(&|_| 0.25), UnitDimension::LENGTH),
        column(names::INTERNAL_ENERGY, 1, line(&|i| 10.0 + x(i)), UnitDimension::SPECIFIC_ENERGY),
        column("iron/fraction", 1, line(&|i| x(i) / 4.0), UnitDimension::NONE),
        column(names::MATERIAL_IDS, 1, Values::I64(vec![101; n]), UnitDimension::NONE),
    ];
    let mut box_size = [0.0; 3];
    box_size[..d].fill(2.0);
    ParticleFile {
        header: RunHeader {
            dimension: d,
            box_size,
            box_corner: None,
            periodic: [true, d > 1, false],
            units: UnitSystem { length: 6.957e10, mass: 1.988e33, time: 1.6e3, temperature: 1.0 },
            time: 0.5,
            kernel: "Wendland C4".into(),
            kernel_neighbors: 120.0,
            provenance: vec![("Seed".into(), "42".into()), ("Scene".into(), "é: 1\n".into())],
            layouts: Vec::new(),
        },
        species: vec![Species { part_type: 0, table: ParticleTable { count: n, columns } }],
    }
}

fn write(format: &str, path: &Path, p: &ParticleFile, compression: u8) -> Result<(), FormatError> {
    let spec = FORMATS.iter().find(|f| f.name == format).unwrap();
    let options = WriteOptions { compression, double_precision: false };
    (spec.write.unwrap())(path, p, options)
}

fn read(path: &Path) -> Result<ParticleFile, FormatError> {
    let spec = detect(FORMATS, path, None)?;
    match (spec.read.unwrap())(path, &FieldRequest::default())? {
        FileContent::Particles(p) => Ok(p),
        FileContent::Field(_) => panic!("a field"),
    }
}

fn refusal(format: &str, p: &ParticleFile) -> String {
    let folder = tempfile::tempdir().unwrap();
    let error = write(format, &folder.path().join("a.hdf5"), p, 0).unwrap_err();
    assert!(matches!(error, FormatError::Output { .. }), "{error}");
    error.to_string()
}

#[test]
fn written_particles_are_read_back_in_every_dimension_and_flavor() {
    let folder = tempfile::tempdir().unwrap();
    for (format, level) in [("swift", 0), ("swift", 4), ("gadget", 0), ("gadget", 4)] {
        for d in 1..=3 {
            for n in [1, 2, 7, 300] {
                let p = particles(n, d);
                let path = folder.path().join(format!("{format}{level}{d}{n}.hdf5"));
                write(format, &path, &p, level).unwrap();
                let back = read(&path).unwrap();
                assert_eq!(back.header.dimension, d);
                assert_eq!(back.header.box_size, p.header.box_size);
                assert_eq!(back.header.periodic, p.header.periodic);
                assert_eq!(back.header.units, p.header.units);
                assert_eq!(back.header.kernel, "Wendland C4");
                for fact in &p.header.provenance {
                    assert!(back.header.provenance.contains(fact), "{:?}", back.header.provenance);
                }
                same_columns(format, &p, &back);
            }
        }
    }
}

fn same_columns(format: &str, p: &ParticleFile, back: &ParticleFile) {
    let (old, new) = (&p.species[0].table, &back.species[0].table);
    assert_eq!(old.count, new.count);
    for c in &old.columns {
        if format == "swift" && c.name == names::SUPPORT_RADIUS {
            continue;
        }
        let stored = new.column(&c.name.replace('/', "_")).unwrap();
        assert_eq!(stored.components, c.components, "{}", c.name);
        assert_eq!(stored.dimension, c.dimension, "{}", c.name);
        for i in 0..c.values.len() {
            // Half a unit in the last place of f32.
            let tolerance = c.values.get(i).abs() * 6e-8;
            assert!((stored.values.get(i) - c.values.get(i)).abs() <= tolerance);
        }
    }
    let velocities = new.column(names::VELOCITIES).unwrap();
    assert_eq!(velocities.components, p.header.dimension);
    assert!(velocities.values.to_f64().iter().all(|&v| v == 0.0));
    let ids = new.column(names::PARTICLE_IDS).unwrap();
    assert_eq!(ids.values, Values::I64((1..=old.count as i64).collect()));
    if format == "swift" {
        let h = new.column(names::SUPPORT_RADIUS).unwrap();
        // The file says how many particles are within the support.
        let ball = [2.0, std::f64::consts::PI, 4.18879020478639][p.header.dimension - 1];
        for i in 0..old.count {
            let volume = 0.125 / (1.0 + 2.0 * (i as f64 + 0.5) / old.count as f64);
            let expected = (120.0 / ball * volume).powf(1.0 / p.header.dimension as f64);
            assert!((h.values.get(i) / expected - 1.0).abs() < 6e-8);
        }
    }
}

#[test]
fn several_blocks_of_chunks_keep_their_order() {
    // Chunks have 65536 rows; the last one is not full.
    let n = (1 << 18) + 70_001;
    let p = particles(n, 3);
    let folder = tempfile::tempdir().unwrap();
    for level in [0, 1] {
        let path = folder.path().join(format!("{level}.hdf5"));
        write("swift", &path, &p, level).unwrap();
        let back = read(&path).unwrap();
        let (old, new) = (&p.species[0].table, &back.species[0].table);
        let positions = |t: &ParticleTable| t.column(names::COORDINATES).unwrap().values.clone();
        assert_eq!(positions(old), positions(new));
        let ids = new.column(names::PARTICLE_IDS).unwrap();
        assert_eq!(ids.values, Values::I64((1..=n as i64).collect()));
    }
}

#[test]
fn equal_particles_give_equal_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let p = particles(70_000, 3);
    for (format, level) in [("swift", 4), ("gadget", 0)] {
        let bytes = |name: &str| {
            let path = folder.path().join(name);
            write(format, &path, &p, level).unwrap();
            std::fs::read(path).unwrap()
        };
        let first = bytes("a.hdf5");
        std::thread::sleep(std::time::Duration::from_millis(1100));
        assert!(first == bytes("b.hdf5"), "{format}: bytes differ");
    }
}

#[test]
fn header_has_the_shapes_that_codes_demand() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.hdf5");
    let mut p = particles(5, 3);
    p.header.box_size = [2.0, 4.0, 2.0];
    write("swift", &path, &p, 4).unwrap();
    let file = Reader::open(&path, "gadget").unwrap();
    let header = file.group_attributes("Header").unwrap();
    assert_eq!(header.numbers("BoxSize").unwrap(), [2.0, 4.0, 2.0]);
    for name in ["NumPart_ThisFile", "NumPart_Total"] {
        assert_eq!(header.numbers(name).unwrap(), [5.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }
    assert_eq!(header.numbers("MassTable").unwrap(), [0.0; 6]);
    assert_eq!(header.numbers("Flag_DoublePrecision").unwrap(), [0.0]);
    let units = file.group_attributes("Units").unwrap();
    assert_eq!(units.names().count(), 5);
    assert_eq!(units.numbers("Unit current in cgs (U_I)").unwrap(), [1.0]);
    let u = file.dataset_attributes("PartType0/InternalEnergy").unwrap();
    assert_eq!(u.numbers("U_L exponent").unwrap(), [2.0]);
    assert_eq!(u.numbers("U_t exponent").unwrap(), [-2.0]);
    assert_eq!(u.numbers("a-scale exponent").unwrap(), [0.0]);
    for (name, factor) in
        [("InternalEnergy", (6.957e10 / 1.6e3_f64).powi(2)), ("ParticleIDs", 1.0), ("Masses", 1.988e33)]
    {
        let own = file.dataset_attributes(&format!("PartType0/{name}")).unwrap();
        let found = own.number("Conversion factor to CGS (not including cosmological corrections)").unwrap();
        assert!((found / factor - 1.0).abs() < 1e-12, "{name}: {found}");
    }
    assert_eq!(header.numbers("Flag_Entropy_ICs").unwrap(), [0.0]);
}

#[test]
fn datasets_have_the_unit_of_the_rule_where_a_column_states_none() {
    let folder = tempfile::tempdir().unwrap();
    for d in 1..=3 {
        let mut p = particles(5, d);
        p.species[0].table.columns.iter_mut().for_each(|c| c.dimension = UnitDimension::NONE);
        for format in ["swift", "gadget", "gizmo", "arepo"] {
            let path = folder.path().join(format!("{format}{d}.hdf5"));
            write(format, &path, &p, 0).unwrap();
            let back = read(&path).unwrap();
            for (name, dimension) in [
                (names::COORDINATES, UnitDimension::LENGTH),
                (names::VELOCITIES, UnitDimension::VELOCITY),
                (names::MASSES, UnitDimension::MASS),
                (names::DENSITY, UnitDimension::mass_density(d)),
                (names::INTERNAL_ENERGY, UnitDimension::SPECIFIC_ENERGY),
                (names::PARTICLE_IDS, UnitDimension::NONE),
            ] {
                assert_eq!(back.species[0].table.column(name).unwrap().dimension, dimension, "{format} {d}: {name}");
            }
        }
    }
}

fn without(p: &ParticleFile, missing: &[&str]) -> ParticleFile {
    let mut p = p.clone();
    p.species[0].table.columns.retain(|c| !missing.contains(&c.name.as_str()));
    p
}

#[test]
fn swift_gets_its_lengths_from_support_radii_where_there_is_no_density() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.hdf5");
    for d in 1..=3 {
        let mut p = without(&particles(9, d), &[names::DENSITY]);
        for (neighbors, expected) in [
            // As many neighbors as SWIFT's own: its smoothing length is the support radius over kernel_gamma.
            (0.0, 0.25 / [1.732051, 1.778002, 1.825742][d - 1]),
            // The spacing at which so many particles lie within the support.
            (
                120.0,
                1.2348 * 0.25 * ([2.0, std::f64::consts::PI, 4.18879020478639][d - 1] / 120.0).powf(1.0 / d as f64),
            ),
        ] {
            p.header.kernel_neighbors = neighbors;
            write("swift", &path, &p, 0).unwrap();
            let file = Reader::open(&path, "gadget").unwrap();
            let (_, h) = file.numbers("PartType0/SmoothingLength").unwrap().unwrap();
            for i in 0..h.len() {
                assert!((h.get(i) / expected - 1.0).abs() < 1e-6, "{d}: {} of {expected}", h.get(i));
            }
            // The radii come back, in single precision.
            let back = read(&path).unwrap();
            let radii = &back.species[0].table.column(names::SUPPORT_RADIUS).unwrap().values;
            assert!((0..radii.len()).all(|i| (radii.get(i) / 0.25 - 1.0).abs() < 1e-6), "{d}: {}", radii.get(0));
        }
    }
    let text = refusal("swift", &without(&particles(9, 3), &[names::DENSITY, names::SUPPORT_RADIUS]));
    assert!(text.contains("Masses and Density, or SupportRadius"), "{text}");
    // GADGET finds its own.
    write("gadget", &path, &without(&particles(9, 3), &[names::DENSITY, names::SUPPORT_RADIUS]), 0).unwrap();
    assert!(read(&path).unwrap().species[0].table.column(names::SUPPORT_RADIUS).is_none());
}

/// A GADGET file with other numbers in `Flag_Entropy_ICs` than ours.
fn with_entropies(path: &Path, density: bool) {
    let file = rust_hdf5::H5File::create(path).unwrap();
    let header = file.create_group("Header").unwrap();
    header.set_attr_array_numeric("NumPart_ThisFile", &[2_u32, 1, 0, 0, 0, 0]).unwrap();
    header.set_attr_array_numeric("Flag_Entropy_ICs", &[1_u32, 0, 0, 0, 0, 0]).unwrap();
    header.set_attr_array_numeric("BoxSize", &[1.0]).unwrap();
    for (part_type, n) in [(0, 2), (1, 1)] {
        let group = file.create_group(&format!("PartType{part_type}")).unwrap();
        let put = |name: &str, shape: &[usize], values: &[f64]| {
            group.new_dataset::<f64>().shape(shape).create(name).unwrap().write_raw(values).unwrap();
        };
        put("Coordinates", &[n, 3], &vec![0.5; 3 * n]);
        put("Masses", &[n], &vec![1.0; n]);
        put("InternalEnergy", &[n], &[2.0, 4.0][..n]);
        if density && part_type == 0 {
            put("Density", &[n], &[8.0, 27.0]);
        }
    }
    file.close().unwrap();
}

#[test]
fn entropies_become_energies_or_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ic.hdf5");
    with_entropies(&path, true);
    let p = read(&path).unwrap();
    let energies = |t: usize| p.species[t].table.column(names::INTERNAL_ENERGY).unwrap().values.to_f64();
    // u = A rho^(2/3) / (2/3): 2 * 4 * 1.5 and 4 * 9 * 1.5.
    for (found, expected) in energies(0).iter().zip([12.0, 54.0]) {
        assert!((found - expected).abs() < 1e-12, "{found} of {expected}");
    }
    assert_eq!(energies(1), [2.0]);
    let notes = &p.header.provenance;
    assert!(notes.iter().any(|(k, v)| k == "converted" && v.contains("gamma = 5/3")), "{notes:?}");
    with_entropies(&path, false);
    let error = read(&path).unwrap_err();
    assert!(matches!(error, FormatError::Unsupported { .. }), "{error}");
    assert!(error.to_string().contains("Flag_Entropy_ICs") && error.to_string().contains("Density"), "{error}");
}

/// What the header of a file made by hand has.
struct Header<'a> {
    totals: Option<[u32; 6]>,
    high: Option<[u32; 6]>,
    table: f64,
    masses: Option<[f64; 2]>,
    time: f64,
    units: &'a [(&'a str, f64)],
}

/// As a code would write it.
const FINE: Header<'_> = Header {
    totals: Some([2, 0, 0, 0, 0, 0]),
    high: Some([0; 6]),
    table: 0.0,
    masses: Some([1.0; 2]),
    time: 0.0,
    units: &[],
};

const SWIFT_UNITS: [(&str, f64); 3] =
    [("Unit length in cgs (U_L)", 2.0), ("Unit mass in cgs (U_M)", 3.0), ("Unit time in cgs (U_t)", 5.0)];

fn by_hand(path: &Path, made: &Header<'_>) {
    let file = rust_hdf5::H5File::create(path).unwrap();
    let header = file.create_group("Header").unwrap();
    header.set_attr_array_numeric("NumPart_ThisFile", &[2_u32, 0, 0, 0, 0, 0]).unwrap();
    if let Some(totals) = made.totals {
        header.set_attr_array_numeric("NumPart_Total", &totals).unwrap();
    }
    if let Some(high) = made.high {
        header.set_attr_array_numeric("NumPart_Total_HighWord", &high).unwrap();
    }
    header.set_attr_array_numeric("MassTable", &[made.table, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
    header.set_attr_array_numeric("BoxSize", &[1.0]).unwrap();
    header.set_attr_array_numeric("Time", &[made.time]).unwrap();
    if !made.units.is_empty() {
        let units = file.create_group("Units").unwrap();
        made.units.iter().for_each(|(name, unit)| units.set_attr_array_numeric(name, &[*unit]).unwrap());
    }
    let group = file.create_group("PartType0").unwrap();
    let put = |name: &str, shape: &[usize], values: &[f64]| {
        group.new_dataset::<f64>().shape(shape).create(name).unwrap().write_raw(values).unwrap();
    };
    put("Coordinates", &[2, 3], &[0.25, 0.5, 0.5, 0.75, 0.5, 0.5]);
    if let Some(masses) = made.masses {
        put("Masses", &[2], &masses);
    }
    file.close().unwrap();
}

#[test]
fn headers_that_contradict_the_file_or_lack_what_codes_read_say_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ic.hdf5");
    let said = |made: &Header<'_>, key: &str| {
        by_hand(&path, made);
        let facts = read(&path).unwrap().header.provenance;
        facts.into_iter().filter(|(k, _)| k == key).map(|(_, text)| text).collect::<Vec<_>>()
    };
    assert!(said(&FINE, DOUBT_KEY).is_empty() && said(&FINE, LACKS_KEY).is_empty());
    let wrong = [
        (Header { totals: Some([5, 0, 0, 0, 0, 0]), ..FINE }, "NumPart_Total says 5 particles of type 0"),
        (Header { totals: Some([2, 1, 0, 0, 0, 0]), ..FINE }, "says 1 particles of type 1, but the one file has 0"),
        (Header { high: Some([1, 0, 0, 0, 0, 0]), ..FINE }, "NumPart_Total says 4294967298 particles"),
        (Header { time: f64::NAN, ..FINE }, "time is NaN"),
    ];
    for (made, text) in &wrong {
        let found = said(made, DOUBT_KEY);
        assert!(found.len() == 1 && found[0].contains(text), "{text}: {found:?}");
    }
    let alone = said(&Header { table: 5.0, masses: None, ..FINE }, LACKS_KEY);
    assert!(alone.len() == 1 && alone[0].contains("MassTable has"), "{alone:?}");
}

/// GADGET reads no dataset where the table has a mass; SWIFT does not read the table.
#[test]
fn a_table_of_masses_beside_a_dataset_counts_as_the_code_reads_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ic.hdf5");
    let read = |made: &Header<'_>| {
        by_hand(&path, made);
        let file = read(&path).unwrap();
        let doubts = file.header.provenance.iter().filter(|(k, _)| k == DOUBT_KEY).count();
        (file.species[0].table.column(names::MASSES).unwrap().values.to_f64(), doubts)
    };
    let both = Header { table: 5.0, ..FINE };
    assert_eq!(read(&both), (vec![5.0; 2], 1));
    assert_eq!(read(&Header { units: &SWIFT_UNITS, ..both }), (vec![1.0; 2], 1));
    assert_eq!(read(&Header { table: 1.0, ..FINE }), (vec![1.0; 2], 0));
    assert_eq!(read(&Header { masses: None, units: &SWIFT_UNITS, ..both }), (vec![5.0; 2], 0));
}

#[test]
fn units_that_can_be_none_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ic.hdf5");
    by_hand(&path, &Header { units: &SWIFT_UNITS, ..FINE });
    assert_eq!(read(&path).unwrap().header.units.mass, 3.0);
    for bad in [-1.0, 0.0, f64::NAN, f64::INFINITY] {
        let mut units = SWIFT_UNITS;
        units[0].1 = bad;
        by_hand(&path, &Header { units: &units, ..FINE });
        let text = read(&path).unwrap_err().to_string();
        assert!(text.contains("Unit length in cgs (U_L)") && text.contains("positive"), "{text}");
    }
}

#[test]
fn double_precision_keeps_every_digit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.h5");
    let mut p = particles(3, 3);
    p.species[0].table.columns[1].values = Values::F64(vec![1e-50, 0.1, 1e50]);
    let options = WriteOptions { compression: 4, double_precision: true };
    let spec = detect_output(FORMATS, &path, None).unwrap();
    assert_eq!(spec.name, "gadget");
    (spec.write.unwrap())(&path, &p, options).unwrap();
    let back = read(&path).unwrap();
    let masses = back.species[0].table.column(names::MASSES).unwrap();
    assert_eq!(masses.values, Values::F64(vec![1e-50, 0.1, 1e50]));
}

/// GIZMO and AREPO are built for the other edges over the first.
#[test]
fn a_box_of_other_edges_is_read_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    for (format, d) in [("gizmo", 2), ("gizmo", 3), ("arepo", 2), ("arepo", 3)] {
        let path = folder.path().join(format!("{format}-{d}.hdf5"));
        let mut p = particles(3, d);
        let size = p.header.box_size[0];
        p.header.box_size[..d].copy_from_slice(&[size, 2.0 * size, 1.5 * size][..d]);
        let spec = detect_output(FORMATS, &path, Some(format)).unwrap();
        (spec.write.unwrap())(&path, &p, WriteOptions::default()).unwrap();
        let header = Reader::open(&path, format).unwrap().group_attributes("Header").unwrap();
        assert_eq!(header.numbers("BoxSize"), Some(vec![size]), "{format}");
        assert_eq!(read(&path).unwrap().header.box_size, p.header.box_size, "{format} in {d}-D");
    }
}

#[test]
fn particles_that_a_code_would_choke_on_are_refused_by_name() {
    assert_eq!(detect_output(FORMATS, Path::new("ic.hdf5"), None).unwrap().name, "swift");
    let with = |change: &dyn Fn(&mut ParticleFile)| {
        let mut p = particles(3, 3);
        change(&mut p);
        p
    };
    let set = |p: &mut ParticleFile, name: &str, x: f64| {
        let columns = &mut p.species[0].table.columns;
        let column = columns.iter_mut().find(|c| c.name == name).unwrap();
        column.values = Values::F64(vec![x; 3 * column.components]);
    };
    let text = refusal("swift", &with(&|p| set(p, names::MASSES, 1e39)));
    assert!(text.contains("'Masses' of particle 0 is 1e39") && text.contains("f32"), "{text}");
    let text = refusal("swift", &with(&|p| set(p, names::INTERNAL_ENERGY, f64::NAN)));
    assert!(text.contains("'InternalEnergy'") && text.contains("NaN"), "{text}");
    let text = refusal("swift", &with(&|p| set(p, names::COORDINATES, 2.5)));
    assert!(text.contains("within the box"), "{text}");
    let text = refusal("swift", &with(&|p| set(p, names::COORDINATES, 2.0)));
    assert!(text.contains("upper faces excluded"), "{text}");
    for format in ["swift", "gadget"] {
        let text = refusal(format, &with(&|p| set(p, names::INTERNAL_ENERGY, 0.0)));
        assert!(text.contains("'InternalEnergy' of particle 0 is 0e0, expected a positive value"), "{text}");
        let text = refusal(format, &with(&|p| set(p, names::MASSES, -1.0)));
        assert!(text.contains("'Masses'") && text.contains("positive"), "{text}");
    }
    let text = refusal("swift", &with(&|p| set(p, names::DENSITY, 0.0)));
    assert!(text.contains("'SmoothingLength'"), "{text}");
    let text = refusal("gadget", &with(&|p| p.header.box_size[1] = 3.0));
    assert!(text.contains("LONG_X_BITS") && text.contains("swift"), "{text}");
    let text = refusal("gadget", &with(&|p| p.header.box_size[1] = 0.0));
    assert!(text.contains("edge of 0"), "{text}");
    let text = refusal("gadget", &with(&|p| p.species[0].table.columns.retain(|c| c.name != names::INTERNAL_ENERGY)));
    assert!(text.contains("InternalEnergy") && text.contains("thermal.internal_energy"), "{text}");
    let text = refusal("gadget", &with(&|p| p.species[0].table.count = 4));
    assert!(text.contains("3 components") && text.contains("4 particles"), "{text}");
    let text = refusal("swift", &with(&|p| p.species[0].part_type = 6));
    assert!(text.contains("particle type 6"), "{text}");
}

#[test]
fn damaged_files_are_refused_or_read_without_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.hdf5");
    write("gadget", &path, &particles(200, 3), 4).unwrap();
    let whole = std::fs::read(&path).unwrap();
    let broken = folder.path().join("b.hdf5");
    for length in (8..whole.len()).step_by(whole.len() / 60) {
        replace(&broken, &whole[..length]);
        assert!(read(&broken).is_err(), "the first {length} bytes pass");
    }
    for i in (8..whole.len()).step_by(17) {
        let mut bytes = whole.clone();
        bytes[i] ^= if i % 3 == 0 { 0xff } else { 0x10 };
        replace(&broken, &bytes);
        let _ = read(&broken);
    }
}

#[test]
fn gizmo_and_arepo_get_the_headers_and_lengths_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    for format in ["gizmo", "arepo"] {
        let path = folder.path().join(format!("{format}.hdf5"));
        write(format, &path, &particles(5, 3), 4).unwrap();
        let file = Reader::open(&path, "gadget").unwrap();
        let header = file.group_attributes("Header").unwrap();
        assert_eq!(header.numbers("HubbleParam").unwrap(), [1.0]);
        assert_eq!(header.numbers("OmegaBaryon").is_some(), format == "arepo");
        assert_eq!(header.numbers("Flag_DoublePrecision").unwrap(), [0.0]);
        let support = read(&path).unwrap().species[0].table.column(names::SUPPORT_RADIUS).map(|c| c.values.get(0));
        assert_eq!(support, (format == "gizmo").then_some(0.25));
        let datasets = file.datasets("PartType0").unwrap();
        assert_eq!(datasets.iter().any(|d| d == "SmoothingLength"), format == "gizmo");
    }
    let mut outside = particles(3, 3);
    outside.species[0].table.columns[0].values = Values::F64(vec![2.0; 9]);
    assert!(refusal("arepo", &outside).contains("upper faces excluded"));
    write("gizmo", &folder.path().join("b.hdf5"), &outside, 0).unwrap();
}

#[test]
fn gadgets_units_are_stated_for_the_readers_that_look_for_them() {
    let folder = tempfile::tempdir().unwrap();
    let file = particles(5, 3);
    let u = file.header.units;
    let speed = u.length / u.time;
    for format in ["gadget", "gizmo", "arepo", "swift"] {
        let path = folder.path().join(format!("{format}.hdf5"));
        write(format, &path, &file, 4).unwrap();
        let reader = Reader::open(&path, "gadget").unwrap();
        let stated = |group: &str, name: &str| reader.group_attributes(group).ok().and_then(|a| a.number(name));
        for (name, value) in [
            ("UnitLength_in_cm", u.length),
            ("UnitMass_in_g", u.mass),
            ("UnitVelocity_in_cm_per_s", speed),
            ("UnitEnergy_in_cgs", u.mass * speed * speed),
        ] {
            // More than its own five in SWIFT's group is more than swiftsimio takes.
            let expected = (format != "swift").then_some(value);
            assert_eq!(stated("Units", name), expected, "{format}, {name}");
            assert_eq!(stated("Parameters", name), expected, "{format}, {name}");
        }
    }
}

/// Files of GADGET have three coordinates in any dimension, and no word of it: gas in one plane, or on one line, is that of a plane, or a line.
#[test]
fn gas_in_a_plane_is_read_in_two_dimensions() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, n: usize, d: usize, states: Option<i32>| {
        let path = folder.path().join(name);
        let file = sph_formats::common::hdf5::Writer::create(&path).unwrap();
        let header = file.group("Header").unwrap();
        for name in ["NumPart_ThisFile", "NumPart_Total"] {
            header.numbers(name, &[n as i32, 0, 0, 0, 0, 0]).unwrap();
        }
        header.numbers("MassTable", &[0.5, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
        header.numbers("BoxSize", &[1.0]).unwrap();
        if let Some(states) = states {
            header.numbers("Dimension", &[states]).unwrap();
        }
        let gas = file.group("PartType0").unwrap();
        let row = |i: usize| {
            let u = (i as f64 + 0.5) / n as f64;
            [u, if d > 1 { (3.7 * u).fract() } else { 0.5 }, if d > 2 { (7.3 * u).fract() } else { 0.25 }]
        };
        gas.dataset::<f64>("Coordinates", n, 3, 0, |range, out| {
            out.extend(range.flat_map(row));
            Ok(())
        })
        .unwrap();
        drop((header, gas));
        file.close().unwrap();
        path
    };
    let of = |name: &str, n: usize, d: usize, states: Option<i32>| read(&write(name, n, d, states)).unwrap();
    for d in 1..=3 {
        let file = of(&format!("{d}.hdf5"), 40, d, None);
        assert_eq!((file.header.dimension, file.species[0].table.columns[0].components), (d, d));
        assert_eq!(file.header.box_size.map(|l| l > 0.0), std::array::from_fn(|k| k < d));
        let told = file.header.provenance.iter().find(|fact| fact.1.contains("no Dimension"));
        assert_eq!(told.is_some(), d < 3, "{told:?}");
    }
    // Stated, or a few points that may lie so by chance.
    assert_eq!(of("stated.hdf5", 40, 2, Some(3)).header.dimension, 3);
    assert_eq!(of("few.hdf5", 4, 2, None).header.dimension, 3);
}
