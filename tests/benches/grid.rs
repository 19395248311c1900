//! A NetCDF grid of 512^3 f32 (512 MiB) until it is an interpolant, against reading its bytes into memory, and against a pass
//! over them that keeps none:
//!
//! ```sh
//! cargo bench --bench grid            # or: cargo bench --bench grid -- 256
//! ```
//!
//! Marks: under 4 times the time of reading it into memory, and under 2 times the file's size in memory (VmHWM, Linux). Each
//! part runs in a process of its own, since the peak of memory is that of a process; the file is in the cache for both.

use sph_formats::common::netcdf_classic::{ClassicFile, Data};
use sph_formats::{FORMATS, FieldRequest, FileContent};
use sph_prep::field::{FieldOptions, from_raw};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::Instant;

const PART: &str = "GRID_BENCH_PART";

fn density(i: usize, n: usize) -> f32 {
    let (x, y, z) = (i % n, i / n % n, i / n / n);
    1.0 + ((x * 7 + y * 5 + z * 3) % 101) as f32 / 101.0
}

fn make(path: &Path, n: usize) {
    let nodes: Vec<f64> = (0..n).map(|i| i as f64).collect();
    let values: Vec<f32> = (0..n.pow(3)).map(|i| density(i, n)).collect();
    let mut file = ClassicFile::new();
    let [z, y, x] = ["z", "y", "x"].map(|name| file.dimension(name, n));
    for (name, dimension) in [("z", z), ("y", y), ("x", x)] {
        file.variable(name, &[dimension], Data::F64(&nodes), &[]);
    }
    file.variable("density", &[z, y, x], Data::F32(&values), &[]);
    file.write(path).unwrap();
}

/// Peak of this process's memory in bytes.
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? << 10)
}

/// Reads the bytes and throws them away.
fn plain(path: &Path) {
    let start = Instant::now();
    let mut file = std::fs::File::open(path).unwrap();
    let mut buffer = vec![0; 1 << 20];
    let mut bytes = 0;
    loop {
        match file.read(&mut buffer).unwrap() {
            0 => break,
            read => bytes += read,
        }
    }
    println!("plain {} {bytes}", start.elapsed().as_secs_f64());
}

/// Reads the bytes into memory.
fn whole(path: &Path) {
    let start = Instant::now();
    let bytes = std::fs::read(path).unwrap();
    println!("whole {} {}", start.elapsed().as_secs_f64(), bytes.len());
}

fn interpolant(path: &Path, n: usize) {
    let start = Instant::now();
    let raw = match sph_formats::read(FORMATS, path, None, &FieldRequest::default()).unwrap() {
        FileContent::Field(raw) => raw,
        FileContent::Particles(_) => panic!("a grid was taken for particles"),
    };
    let read = start.elapsed().as_secs_f64();
    let source = from_raw::<3>(raw, &FieldOptions::default()).unwrap();
    let seconds = start.elapsed().as_secs_f64();
    let found = source.density.value(&[3.0, 2.0, 1.0]);
    assert!((found - f64::from(density(3 + n * (2 + n), n))).abs() < 1e-6, "{found}");
    println!("interpolant {seconds} {} {read}", peak().unwrap_or(0));
}

/// The numbers that this program prints as a part.
fn part(name: &str, path: &Path, n: usize) -> Vec<f64> {
    let program = std::env::current_exe().unwrap();
    let output = std::process::Command::new(program).env(PART, name).arg(path).arg(n.to_string()).output().unwrap();
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    text.split_whitespace().skip(1).map(|v| v.parse().unwrap()).collect()
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    if let (Ok(name), [path, n]) = (std::env::var(PART), arguments.as_slice()) {
        let (path, n) = (PathBuf::from(path), n.parse().unwrap());
        match name.as_str() {
            "make" => make(&path, n),
            "plain" => plain(&path),
            "whole" => whole(&path),
            _ => interpolant(&path, n),
        }
        return;
    }
    let n: usize = arguments.first().map_or(512, |n| n.parse().expect("a number of cells along an edge"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grid.nc");
    part("make", &path, n);
    let size = std::fs::metadata(&path).unwrap().len() as f64;
    let best = |name: &str| {
        let runs = (0..3).map(|_| part(name, &path, n));
        runs.min_by(|a, b| a[0].total_cmp(&b[0])).unwrap()
    };
    let (pass, read, field) = (best("plain"), best("whole"), best("interpolant"));
    println!("{n}^3 f32, {:.0} MiB", size / 1048576.0);
    println!("a pass          {:.3} s", pass[0]);
    println!("into memory     {:.3} s", read[0]);
    println!(
        "interpolant     {:.3} s ({:.3} s of it reading), {:.2} times; mark 4",
        field[0],
        field[2],
        field[0] / read[0]
    );
    println!("peak of memory  {:.0} MiB, {:.2} times the file; mark 2", field[1] / 1048576.0, field[1] / size);
}
