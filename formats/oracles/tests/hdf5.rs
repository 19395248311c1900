//! The C library as an oracle for HDF5: it reads our snapshots, and we read what it writes.

use sph_formats::common::particle_names as names;
use sph_formats::registry::detect;
use sph_formats::{
    Column, FORMATS, FieldRequest, FileContent, ParticleFile, ParticleTable, RunHeader, Species, UnitDimension,
    UnitSystem, Values, WriteOptions,
};
use std::path::Path;

/// More than one chunk.
const COUNT: usize = 70_001;

fn position(i: usize) -> f64 {
    (i as f64 + 0.5) / COUNT as f64
}

fn ours() -> ParticleFile {
    let line = |f: &dyn Fn(usize) -> f64| Values::F64((0..COUNT).map(f).collect());
    let column =
        |name: &str, components, values, dimension| Column { name: name.into(), components, values, dimension };
    let places = (0..COUNT).flat_map(|i| [position(i), 0.5, position(i) / 3.0]).collect();
    let columns = vec![
        column(names::COORDINATES, 3, Values::F64(places), UnitDimension::LENGTH),
        column(names::MASSES, 1, line(&|_| 0.125), UnitDimension::MASS),
        column(names::DENSITY, 1, line(&|i| 1.0 + position(i)), UnitDimension::mass_density(3)),
        column(names::SUPPORT_RADIUS, 1, line(&|i| 0.25 + position(i)), UnitDimension::LENGTH),
        column(names::INTERNAL_ENERGY, 1, line(&|i| 10.0 + position(i)), UnitDimension::SPECIFIC_ENERGY),
    ];
    ParticleFile {
        header: RunHeader {
            dimension: 3,
            box_size: [1.0; 3],
            box_corner: None,
            periodic: [true; 3],
            units: UnitSystem { length: 7e10, mass: 2e33, time: 1.6e3, temperature: 1.0 },
            time: 0.5,
            kernel: "Wendland C4".into(),
            kernel_neighbors: 120.0,
            provenance: vec![("Seed".into(), "é 42".into()), ("Scene".into(), "é: 1\n".repeat(20_000))],
            layouts: Vec::new(),
        },
        species: vec![Species { part_type: 0, table: ParticleTable { count: COUNT, columns } }],
    }
}

fn write(format: &str, path: &Path, options: WriteOptions) {
    let spec = FORMATS.iter().find(|f| f.name == format).unwrap();
    (spec.write.unwrap())(path, &ours(), options).unwrap();
}

fn read(path: &Path) -> ParticleFile {
    let spec = detect(FORMATS, path, Some("gadget")).unwrap();
    match (spec.read.unwrap())(path, &FieldRequest::default()).unwrap() {
        FileContent::Particles(particles) => particles,
        FileContent::Field(_) => panic!("a field"),
    }
}

#[test]
fn the_c_library_reads_snapshots_of_ours() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ours.hdf5");
    for format in ["swift", "gadget"] {
        for (compression, double_precision) in [(0, false), (4, false), (9, true)] {
            write(format, &path, WriteOptions { compression, double_precision });
            let theirs = ::hdf5::File::open(&path).unwrap();
            let header = theirs.group("Header").unwrap();
            let attribute = |name: &str| header.attr(name).unwrap();
            assert_eq!(attribute("BoxSize").read_raw::<f64>().unwrap(), [1.0]);
            assert_eq!(attribute("NumPart_Total").read_raw::<u32>().unwrap(), [COUNT as u32, 0, 0, 0, 0, 0]);
            assert_eq!(attribute("MassTable").shape(), [6]);
            let units = theirs.group("Units").unwrap();
            // Readers of GADGET's family look for their own names beside SWIFT's.
            let in_cm = units.attr_names().unwrap().contains(&"UnitLength_in_cm".to_owned());
            assert_eq!(
                (units.attr_names().unwrap().len(), in_cm),
                if format == "gadget" { (9, true) } else { (5, false) }
            );
            let gas = theirs.group("PartType0").unwrap();
            let places: Vec<f64> = gas.dataset("Coordinates").unwrap().read_raw().unwrap();
            assert!((0..COUNT).all(|i| places[3 * i..3 * i + 3] == [position(i), 0.5, position(i) / 3.0]));
            let ids: Vec<u64> = gas.dataset("ParticleIDs").unwrap().read_raw().unwrap();
            assert!(ids.iter().copied().eq(1..=COUNT as u64));
            let density = gas.dataset("Density").unwrap();
            assert_eq!(density.dtype().unwrap().size(), if double_precision { 8 } else { 4 });
            // The library widens f32 exactly.
            let stored = |x: f64| if double_precision { x } else { f64::from(x as f32) };
            let values: Vec<f64> = density.read_raw().unwrap();
            assert!((0..COUNT).all(|i| values[i] == stored(1.0 + position(i))));
            assert_eq!(density.attr("U_L exponent").unwrap().read_raw::<f32>().unwrap(), [-3.0]);
            let lengths: Vec<f64> = gas.dataset("SmoothingLength").unwrap().read_raw().unwrap();
            let expected = |i: usize| match format {
                "gadget" => 0.25 + position(i),
                _ => 1.2348 * (0.125 / (1.0 + position(i))).cbrt(),
            };
            assert!((0..COUNT).all(|i| (lengths[i] / expected(i) - 1.0).abs() < 1e-6));
            let own = theirs.group("SphPrep").unwrap();
            let seed: ::hdf5::types::FixedUnicode<64> = own.attr("Seed").unwrap().read_scalar().unwrap();
            assert_eq!(seed.as_str(), "é 42");
            // Longer than the 64 kB that an object header holds.
            let scene: ::hdf5::types::FixedUnicode<131_072> = own.attr("Scene").unwrap().read_scalar().unwrap();
            assert_eq!(scene.as_str(), "é: 1\n".repeat(20_000));
            let kept = read(&path).header.provenance;
            for pair in ours().header.provenance {
                assert!(
                    kept.contains(&pair),
                    "{} is not among {:?}",
                    pair.0,
                    kept.iter().map(|k| (&k.0, k.1.len())).collect::<Vec<_>>()
                );
            }
        }
    }
}

/// A snapshot with scalar attributes, mixed types, filters and a second species, as codes write them.
fn write_theirs(path: &Path, latest: bool) {
    let file = match latest {
        true => ::hdf5::File::with_options().with_fapl(|p| p.libver_latest()).create(path),
        false => ::hdf5::File::create(path),
    };
    let file = file.unwrap();
    let header = file.create_group("Header").unwrap();
    header.new_attr_builder().with_data(&[3u32, 2, 0, 0, 0, 0]).create("NumPart_ThisFile").unwrap();
    header.new_attr_builder().with_data(&[0.0f64, 0.75, 0.0, 0.0, 0.0, 0.0]).create("MassTable").unwrap();
    header.new_attr::<f32>().create("BoxSize").unwrap().write_scalar(&8.0f32).unwrap();
    header.new_attr::<i64>().create("NumFilesPerSnapshot").unwrap().write_scalar(&1i64).unwrap();
    header.new_attr::<f64>().create("Time").unwrap().write_scalar(&0.25f64).unwrap();
    let gas = file.create_group("PartType0").unwrap();
    let places = gas.new_dataset::<f32>().chunk((2, 3)).shuffle().deflate(6).fletcher32().shape((3, 3));
    let numbers: Vec<f32> = (0..9).map(|i| i as f32 * 0.5).collect();
    places.create("Coordinates").unwrap().write_raw(&numbers).unwrap();
    gas.new_dataset::<f64>().shape(3).create("Masses").unwrap().write_raw(&[1.0, 2.0, 3.0]).unwrap();
    gas.new_dataset::<u32>().shape(3).create("ParticleIDs").unwrap().write_raw(&[7u32, 9, 4_000_000_000]).unwrap();
    gas.new_dataset::<i8>().chunk(2).shape(3).create("Flag").unwrap().write_raw(&[-1i8, 0, 1]).unwrap();
    let halo = file.create_group("PartType1").unwrap();
    halo.new_dataset::<f64>().shape((2, 3)).create("Coordinates").unwrap().write_raw(&[1.5f64; 6]).unwrap();
}

#[test]
fn snapshots_of_the_c_library_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("theirs.hdf5");
    for latest in [false, true] {
        write_theirs(&path, latest);
        let particles = read(&path);
        assert_eq!(particles.header.box_size, [8.0; 3]);
        assert_eq!(particles.header.time, 0.25);
        let [gas, halo] = particles.species.as_slice() else { panic!("{} species", particles.species.len()) };
        let values = |species: &Species, name: &str| species.table.column(name).unwrap().values.clone();
        let places = (0..9).map(|i| i as f32 * 0.5).collect();
        assert_eq!(values(gas, names::COORDINATES), Values::F32(places), "latest {latest}");
        assert_eq!(values(gas, names::MASSES), Values::F64(vec![1.0, 2.0, 3.0]));
        assert_eq!(values(gas, names::PARTICLE_IDS), Values::I64(vec![7, 9, 4_000_000_000]));
        assert_eq!(values(gas, "Flag"), Values::I64(vec![-1, 0, 1]));
        assert_eq!((halo.part_type, halo.table.count), (1, 2));
        assert_eq!(values(halo, names::MASSES), Values::F64(vec![0.75; 2]));
    }
}
