//! Writing and reading particles as uncompressed SWIFT HDF5, beside a plain copy of as many bytes in the same run.
//! The mark is a ratio of 2. The seconds of processor time beside them suffer less from what else a machine does.
//!
//! `cargo bench --bench formats [-- N [FOLDER]]` (1e7 particles, 600 MB, in the system's folder for temporary files)

use sph_formats::common::particle_names as names;
use sph_formats::{
    Column, FORMATS, FieldRequest, FileContent, ParticleFile, ParticleTable, RunHeader, Species, UnitDimension,
    UnitSystem, Values, WriteOptions,
};
use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::time::Instant;

const REPEATS: usize = 3;
const BLOCK: usize = 1 << 20;

fn particles(n: usize) -> ParticleFile {
    let t = |i: usize| (i as f64 + 0.5) / n as f64;
    let column = |name: &str, components: usize, dimension| Column {
        name: name.into(),
        components,
        values: Values::F64((0..components * n).map(|i| t(i / components)).collect()),
        dimension,
    };
    let columns = vec![
        column(names::COORDINATES, 3, UnitDimension::LENGTH),
        column(names::VELOCITIES, 3, UnitDimension::VELOCITY),
        column(names::MASSES, 1, UnitDimension::MASS),
        column(names::DENSITY, 1, UnitDimension::mass_density(3)),
        column(names::INTERNAL_ENERGY, 1, UnitDimension::SPECIFIC_ENERGY),
    ];
    ParticleFile {
        header: RunHeader {
            dimension: 3,
            box_size: [1.0; 3],
            box_corner: None,
            periodic: [true; 3],
            units: UnitSystem::CODE,
            time: 0.0,
            kernel: "Wendland C2".into(),
            kernel_neighbors: 64.0,
            provenance: vec![],
            layouts: Vec::new(),
        },
        species: vec![Species { part_type: 0, table: ParticleTable { count: n, columns } }],
    }
}

/// Seconds of processor time that this process has taken, by the kernel's clock ticks (Linux; else 0).
fn processor() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(") ").next().unwrap_or_default();
    fields.split_whitespace().skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// The least of a few runs: wall and processor time in seconds.
fn best(mut run: impl FnMut()) -> [f64; 2] {
    let mut least = [f64::INFINITY; 2];
    for _ in 0..REPEATS {
        let (start, before) = (Instant::now(), processor());
        run();
        least = [least[0].min(start.elapsed().as_secs_f64()), least[1].min(processor() - before)];
    }
    least
}

/// Writes as many bytes from memory in large blocks and, as our writers do, waits for the disk.
fn plain_write(path: &Path, bytes: u64) {
    let block = vec![7; BLOCK];
    let mut file = File::create(path).unwrap();
    let mut left = bytes as usize;
    while left > 0 {
        let now = left.min(BLOCK);
        file.write_all(&block[..now]).unwrap();
        left -= now;
    }
    file.sync_all().unwrap();
}

fn plain_read(path: &Path) -> Vec<u8> {
    let mut bytes = Vec::new();
    File::open(path).unwrap().read_to_end(&mut bytes).unwrap();
    bytes
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let n = arguments.first().map_or(1e7, |a| a.parse().expect("N is a number")) as usize;
    let folder = match arguments.get(1) {
        Some(folder) => tempfile::tempdir_in(folder).unwrap(),
        None => tempfile::tempdir().unwrap(),
    };
    let (ours, plain) = (folder.path().join("a.hdf5"), folder.path().join("plain"));
    let original = particles(n);
    let options = WriteOptions { compression: 0, double_precision: false };
    let written = best(|| sph_formats::write(FORMATS, &ours, Some("swift"), &original, options).unwrap());
    drop(original);
    let bytes = std::fs::metadata(&ours).unwrap().len();
    let plain_written = best(|| plain_write(&plain, bytes));
    let plain_taken = best(|| assert_eq!(plain_read(&plain).len() as u64, bytes));
    let taken = best(|| match sph_formats::read(FORMATS, &ours, None, &FieldRequest::default()).unwrap() {
        FileContent::Particles(p) => assert_eq!(p.species[0].table.count, n),
        FileContent::Field(_) => panic!("read as a field"),
    });
    println!("{n} particles, {:.1} MB, the best of {REPEATS}", bytes as f64 / 1e6);
    println!("{:<16} {:>9} {:>9} {:>7}", "", "swift [s]", "plain [s]", "ratio");
    for (what, ours, plain) in [("write", written, plain_written), ("read", taken, plain_taken)] {
        for (time, ours, plain) in [("", ours[0], plain[0]), (", processor", ours[1], plain[1])] {
            println!("{:<16} {ours:>9.3} {plain:>9.3} {:>7.2}", format!("{what}{time}"), ours / plain);
        }
    }
}
