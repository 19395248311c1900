//! DualSPHysics' files: blocks and counts, the layout by a reader of its own, the code's outputs, and damage.

use crate::support::{column, read_back, replace};
use sph_formats::common::particle_names as names;
use sph_formats::dualsphysics::Liquid;
use sph_formats::{
    FORMATS, FormatError, ParticleFile, ParticleTable, RunHeader, Species, UnitDimension, UnitSystem, Values,
    WriteOptions,
};
use std::path::Path;

/// Depth of the water, and its particles along each axis.
const DEPTH: f64 = 2.0;
const SIDE: usize = 8;
const GRAVITY: f64 = 9.81;

/// Water at rest on a floor of walls in SI units.
fn tank(d: usize) -> ParticleFile {
    let step = DEPTH / SIDE as f64;
    let count = SIDE.pow(d as u32);
    let place = |i: usize, k: usize| step * ((i / SIDE.pow(k as u32) % SIDE) as f64 + 0.5);
    let up = d - 1;
    let mass = 1000.0 * step.powi(d as i32);
    let line = |n: usize, f: &dyn Fn(usize) -> f64| Values::F64((0..n).map(f).collect());
    let rows = |n: usize, f: &dyn Fn(usize, usize) -> f64| Values::F64((0..n * d).map(|i| f(i / d, i % d)).collect());
    let pressure = move |i: usize| 1000.0 * GRAVITY * (DEPTH - place(i, up)) + 7.0;
    let water = vec![
        column(names::COORDINATES, d, rows(count, &place), UnitDimension::LENGTH),
        column(names::MASSES, 1, line(count, &|_| mass), UnitDimension::new(d as i8 - 3, 1, 0, 0)),
        column(names::DENSITY, 1, line(count, &|i| 1000.0 - place(i, up)), UnitDimension::mass_density(3)),
        column(names::SUPPORT_RADIUS, 1, line(count, &|_| 3.0 * step), UnitDimension::LENGTH),
        column(names::VELOCITIES, d, rows(count, &|i, k| 1e-3 * (i + k) as f64), UnitDimension::VELOCITY),
        column(names::PRESSURE, 1, line(count, &pressure), UnitDimension::PRESSURE),
        column(names::PARTICLE_IDS, 1, Values::I64((1..=count as i64).collect()), UnitDimension::NONE),
    ];
    let floor = SIDE.pow(d as u32 - 1);
    let normal = move |_: usize, k: usize| f64::from(u8::from(k == up));
    let below = move |i: usize, k: usize| if k == up { -0.5 * step } else { place(i, k) };
    let walls = vec![
        column(names::COORDINATES, d, rows(floor, &below), UnitDimension::LENGTH),
        column(names::MASSES, 1, line(floor, &|_| 1.5 * mass), UnitDimension::new(d as i8 - 3, 1, 0, 0)),
        column(names::DENSITY, 1, line(floor, &|_| 1000.0), UnitDimension::mass_density(3)),
        column(names::SUPPORT_RADIUS, 1, line(floor, &|_| 3.0 * step), UnitDimension::LENGTH),
        column("Normals", d, rows(floor, &normal), UnitDimension::NONE),
        column("SurfaceDistance", 1, line(floor, &|_| 0.5 * step), UnitDimension::LENGTH),
        column(
            names::PARTICLE_IDS,
            1,
            Values::I64((0..floor).map(|i| (count + i + 1) as i64).collect()),
            UnitDimension::NONE,
        ),
    ];
    ParticleFile {
        header: RunHeader {
            dimension: d,
            box_size: std::array::from_fn(|k| if k < d { DEPTH } else { 0.0 }),
            box_corner: None,
            periodic: std::array::from_fn(|k| k == 0),
            units: UnitSystem::si(),
            time: 0.0,
            kernel: "Wendland C2".into(),
            kernel_neighbors: 28.0,
            provenance: vec![("Seed".into(), "3".into())],
            layouts: Vec::new(),
        },
        species: vec![
            Species { part_type: 0, table: ParticleTable { count, columns: water } },
            Species { part_type: 5, table: ParticleTable { count: floor, columns: walls } },
        ],
    }
}

fn written(path: &Path, file: &ParticleFile, double: bool) -> Vec<u8> {
    let options = WriteOptions { compression: 0, double_precision: double };
    sph_formats::write(FORMATS, path, None, file, options).unwrap();
    std::fs::read(path).unwrap()
}

/// Bytes behind the definition of an array of this name, which hold its kind, count and size, and then its numbers.
fn array<'a>(bytes: &'a [u8], name: &str) -> (u32, usize, &'a [u8]) {
    let mut sought = (name.len() as u32).to_le_bytes().to_vec();
    sought.extend(name.as_bytes());
    let behind = |at: usize| bytes[..at].ends_with(b"\nARRAY");
    let at =
        (0..bytes.len()).find(|&i| bytes[i..].starts_with(&sought) && behind(i)).unwrap_or_else(|| panic!("{name}"));
    let rest = &bytes[at + sought.len() + 4..];
    let word = |i: usize| u32::from_le_bytes(*rest[4 * i..].first_chunk().unwrap());
    (word(0), word(1) as usize, &rest[12..12 + word(2) as usize])
}

/// The bytes behind a value's name and kind.
fn value<'a>(bytes: &'a [u8], name: &str) -> &'a [u8] {
    let mut sought = (name.len() as u32).to_le_bytes().to_vec();
    sought.extend(name.as_bytes());
    let at = (0..bytes.len()).find(|&i| bytes[i..].starts_with(&sought)).unwrap_or_else(|| panic!("{name}"));
    &bytes[at + sought.len() + 4..]
}

fn whole(bytes: &[u8], name: &str) -> u64 {
    u64::from_le_bytes(*value(bytes, name).first_chunk().unwrap())
}

fn reals(bytes: &[u8]) -> Vec<f64> {
    bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect()
}

fn singles(bytes: &[u8]) -> Vec<f64> {
    bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b).into()).collect()
}

#[test]
fn walls_come_first_and_the_header_counts_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tank.bi4");
    for d in [2, 3] {
        let file = tank(d);
        let bytes = written(&path, &file, false);
        assert!(bytes.starts_with(b"#FileJBD JPartDataBi4 ") && bytes[58..64] == *b"\n\0\0\0\0\0");
        let (water, floor) = (SIDE.pow(d as u32), SIDE.pow(d as u32 - 1));
        let counts = ["CaseNp", "CaseNfixed", "CaseNmoving", "CaseNfloat", "CaseNfluid"].map(|n| whole(&bytes, n));
        assert_eq!(counts, [water + floor, floor, 0, 0, water].map(|n| n as u64));
        assert_eq!(value(&bytes, "Data2d")[0], u8::from(d == 2));
        let (kind, count, ids) = array(&bytes, "Idp");
        assert_eq!((kind, count), (8, water + floor));
        let ids = ids.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b) as usize);
        assert!(ids.eq(0..water + floor));
        let (kind, count, places) = array(&bytes, "Posd");
        assert_eq!((kind, count), (23, water + floor));
        let places = reals(places);
        // The floor lies below z = 0, and a plane is that of x and z.
        let is_below = |i: usize| places[3 * i + 2] < 0.0;
        assert!((0..floor).all(is_below) && !(floor..water + floor).any(is_below));
        assert_eq!(d == 2, (0..water + floor).all(|i| places[3 * i + 1] == 0.0));
        let (kind, count, to_surface) = array(&bytes, "BoundNor");
        assert_eq!((kind, count), (22, floor));
        let step = DEPTH / SIDE as f64;
        let rows = singles(to_surface);
        assert!(rows.as_chunks::<3>().0.iter().all(|row| *row == [0.0, 0.0, 0.5 * step]), "{rows:?}");
        // Half a spacing is left for the period.
        let low = reals(&value(&bytes, "CasePosMin")[..24]);
        let high = reals(&value(&bytes, "CasePosMax")[..24]);
        assert!((low[0] - 0.5 * step).abs() < 1e-12 && (high[0] - (DEPTH - 0.5 * step)).abs() < 1e-12);
        assert_eq!((low[2], high[2]), (-0.5 * step, DEPTH - 0.5 * step));
    }
}

/// Tait's equation, undone by hand.
#[test]
fn densities_are_those_of_the_pressures() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tank.bi4");
    let file = tank(3);
    let bytes = written(&path, &file, false);
    let liquid = Liquid::of(&file).unwrap();
    let step = DEPTH / SIDE as f64;
    assert!((liquid.spacing - step).abs() < 1e-12 && (liquid.smoothing_length - 1.5 * step).abs() < 1e-12);
    let driven = GRAVITY * (DEPTH - step);
    let sound = liquid.sound_speed.unwrap();
    assert!((sound - 20.0 * driven.sqrt()).abs() < 1e-9 * sound, "{sound}");
    let of = |name: &str| reals(&value(&bytes, name)[..8])[0];
    assert_eq!((of("Rhop0"), of("Gamma")), (1000.0, 7.0));
    assert_eq!((of("MassFluid"), of("MassBound")), (1000.0 * step.powi(3), 1500.0 * step.powi(3)));
    assert!((of("B") - sound * sound * 1000.0 / 7.0).abs() < 1e-9 * of("B"));
    let densities = singles(array(&bytes, "Rhop").2);
    let floor = SIDE * SIDE;
    assert!(densities[..floor].iter().all(|rho| *rho == 1000.0));
    let pressures = file.species[0].table.column(names::PRESSURE).unwrap();
    for (i, rho) in densities[floor..].iter().enumerate() {
        let pressure = of("B") * ((rho / 1000.0).powi(7) - 1.0) + liquid.least_pressure;
        // A rounding of f4 is one of c^2 rho in the pressure.
        let rounding = 1000.0 * sound * sound * 6e-8;
        assert!((pressure - pressures.values.get(i)).abs() < rounding, "{i}: {pressure}");
    }
}

#[test]
fn fluid_and_walls_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tank.bi4");
    for (d, double) in [(2, false), (2, true), (3, false), (3, true)] {
        let file = tank(d);
        written(&path, &file, double);
        let back = read_back(&path).unwrap();
        assert_eq!((back.header.dimension, back.header.periodic), (d, file.header.periodic));
        assert_eq!((back.header.units, back.header.box_size), (file.header.units, file.header.box_size));
        assert_eq!(back.header.provenance, file.header.provenance);
        for old in &file.species {
            let new = back.species.iter().find(|s| s.part_type == old.part_type).unwrap();
            assert_eq!(new.table.count, old.table.count);
            for column in &old.table.columns {
                let found = new.table.column(&column.name).unwrap_or_else(|| panic!("{d}: {}", column.name));
                assert_eq!(found.dimension, column.dimension, "{d}: {}", column.name);
                for i in 0..column.values.len() {
                    let (a, b) = (column.values.get(i), found.values.get(i));
                    assert!((a - b).abs() <= 6e-8 * a.abs(), "{d}: {} is {b} of {a}", column.name);
                    let is_exact = double && !["Normals", "SurfaceDistance"].contains(&column.name.as_str());
                    assert!(a == b || !is_exact, "{d}: {} is {b} of {a}", column.name);
                }
            }
        }
    }
}

/// An output of the code has none of our arrays and texts, and lacks particles that left the domain.
#[test]
fn outputs_of_the_code_are_in_si_and_have_pressures() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("Part_0003.bi4");
    for d in [2, 3] {
        let file = tank(d);
        let mut bytes = written(&path, &file, false);
        // Our names become others that mean nothing.
        for name in [&b"SphPrep"[..], b"Pressure", b"Density", b"ParticleIDs", b"SupportRadius"] {
            while let Some(at) = bytes.windows(name.len()).position(|w| w == name) {
                bytes[at] = b'_';
            }
        }
        replace(&path, &bytes);
        let back = read_back(&path).unwrap();
        assert_eq!(back.header.units, UnitSystem::si());
        assert_eq!((back.header.dimension, back.header.periodic), (d, [true, false, false]));
        assert_eq!(back.header.adiabatic_index(), 7.0);
        let water = &back.species.iter().find(|s| s.part_type == 0).unwrap().table;
        let walls = &back.species.iter().find(|s| s.part_type == 5).unwrap().table;
        assert!(walls.column(names::PRESSURE).is_none() && walls.column("Normals").is_some());
        let ids: Vec<f64> = water.column(names::PARTICLE_IDS).unwrap().values.to_f64();
        assert_eq!(ids[0], walls.count as f64);
        // Masses of a plane are per length, and densities per volume.
        let kinds = [names::MASSES, names::DENSITY, names::PRESSURE].map(|n| water.column(n).unwrap().dimension);
        let mass = UnitDimension::new(d as i8 - 3, 1, 0, 0);
        assert_eq!(kinds, [mass, UnitDimension::mass_density(3), UnitDimension::PRESSURE]);
        let liquid = Liquid::of(&file).unwrap();
        let (least, most, bad) = water.column(names::PRESSURE).unwrap().values.range();
        let driven = 1000.0 * GRAVITY * (DEPTH - DEPTH / SIDE as f64);
        let rounding = 1000.0 * liquid.sound_speed.unwrap().powi(2) * 6e-8;
        assert!(bad == 0 && least.abs() <= rounding && (most - driven).abs() <= rounding, "{least} {most}");
        let support = water.column(names::SUPPORT_RADIUS).unwrap().values.range();
        assert_eq!(support, (2.0 * liquid.smoothing_length, 2.0 * liquid.smoothing_length, 0));
    }
}

#[test]
fn what_the_code_has_no_place_for_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bi4");
    let refusal = |file: &ParticleFile| {
        let refused = sph_formats::write(FORMATS, &path, None, file, WriteOptions::default()).unwrap_err();
        assert!(matches!(refused, FormatError::Output { .. }) && !path.exists());
        refused.to_string()
    };
    let mut stars = tank(3);
    stars.species[1].part_type = 4;
    assert!(refusal(&stars).contains("particles of type 4"));
    let mut alone = tank(3);
    alone.species.remove(0);
    assert!(refusal(&alone).contains("no particles of fluid"));
    let mut unequal = tank(2);
    let Values::F64(masses) = &mut unequal.species[0].table.columns[1].values else { panic!("no f64") };
    masses[3] *= 1.1;
    assert!(refusal(&unequal).contains("one mass for its fluid"));
    let mut line = tank(2);
    line.header.dimension = 1;
    line.species.truncate(1);
    let count = line.species[0].table.count;
    for c in line.species[0].table.columns.iter_mut().filter(|c| c.components == 2) {
        (c.components, c.values) = (1, Values::F64(vec![0.5; count]));
    }
    assert!(refusal(&line).contains("has two, x and z, or three"));
}

#[test]
fn files_cut_short_and_sizes_beyond_them_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bi4");
    let whole = written(&path, &tank(2), false);
    for length in (0..whole.len()).step_by(7) {
        replace(&path, &whole[..length]);
        let refused = read_back(&path).unwrap_err();
        let is_known = match refused {
            FormatError::Detection { .. } => length < 22,
            FormatError::Limit { .. } | FormatError::Input { .. } => true,
            _ => false,
        };
        assert!(is_known, "{length}: {refused}");
    }
    let place = |name: &[u8]| whole.windows(name.len()).position(|w| w == name).unwrap() + name.len();
    let with = |at: usize, new: &[u8]| {
        let mut bytes = whole.clone();
        bytes[at..at + new.len()].copy_from_slice(new);
        replace(&path, &bytes);
        read_back(&path).unwrap_err()
    };
    // Count and bytes of positions, which agree and are not there.
    let many = [(1_u32 << 27).to_le_bytes(), (24_u32 << 27).to_le_bytes()].concat();
    let refused = with(place(b"Posd") + 8, &many);
    assert!(matches!(refused, FormatError::Limit { .. }) && refused.to_string().contains("'Posd'"), "{refused}");
    let refused = with(place(b"Posd") + 8, &5_u32.to_le_bytes());
    assert!(refused.to_string().contains("5 numbers are said to take"), "{refused}");
    let refused = with(place(b"Posd") + 4, &99_u32.to_le_bytes());
    assert!(refused.to_string().contains("kind 99"), "{refused}");
    let refused = with(60, &[1]);
    assert!(matches!(refused, FormatError::Unsupported { .. }), "{refused}");
    let refused = with(place(b"Npiece") + 4, &2_u32.to_le_bytes());
    assert!(matches!(refused, FormatError::Unsupported { .. }), "{refused}");
    let refused = with(place(b"MassFluid") + 4, &0_f64.to_le_bytes());
    assert!(refused.to_string().contains("MassFluid"), "{refused}");
}
