//! Readers against hostile files: a mutating fuzzer without further tools, deterministic by its seed.
//!
//! No file may make a reader panic, take more than 10 s, or take more than 1 GiB; an abort kills the test. Seeds are what our
//! own writers make, small files made by hand, and what was found before (`corpus/<format>/`).
//!
//! A second per reader runs with the other tests. In full, with the CPU seconds for each reader:
//!
//! ```sh
//! FUZZ_SECONDS=600 cargo test -p sph-formats --release --test fuzz -- --ignored --nocapture
//! ```
//!
//! `FUZZ_FORMAT=vtk` runs one reader alone, `FUZZ_SEED=7` begins elsewhere. A finding is written to the temporary folder,
//! whose name is printed.

#[path = "fuzz/memory.rs"]
mod memory;
#[path = "fuzz/mutate.rs"]
mod mutate;
#[path = "fuzz/seeds.rs"]
mod seeds;

use memory::Counting;
use mutate::Random;
use sph_formats::{FORMATS, FieldRequest, FormatSpec, read};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Longest that a file of at most [`MAX_BYTES`] may take; wall time, so that a hang is one.
const MAX_TIME: Duration = Duration::from_secs(10);
/// Most memory that it may take.
const MAX_MEMORY: usize = 1 << 30;
/// Longest mutant.
const MAX_BYTES: usize = 1_000_000;

/// What a reader did wrong with some bytes.
fn fault(spec: &FormatSpec, path: &Path, bytes: &[u8]) -> Option<String> {
    std::fs::write(path, bytes).unwrap();
    memory::start();
    let start = Instant::now();
    let request = FieldRequest::default();
    let outcome = std::panic::catch_unwind(|| drop(read(FORMATS, path, Some(spec.name), &request)));
    let (time, peak) = (start.elapsed(), memory::peak());
    match outcome {
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
            Some(format!("panics: {}", text.unwrap_or("without a text")))
        }
        Ok(()) if time > MAX_TIME => Some(format!("takes {time:?}")),
        Ok(()) if peak > MAX_MEMORY => Some(format!("takes {} MiB", peak >> 20)),
        Ok(()) => None,
    }
}

/// CPU seconds of this thread, from the kernel's own count; wall seconds elsewhere.
fn cpu_seconds(start: Instant) -> f64 {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = stat.split_whitespace().next().and_then(|t| t.parse::<f64>().ok());
    nanoseconds.map_or(start.elapsed().as_secs_f64(), |t| 1e-9 * t)
}

/// Files that were findings once, kept with the tests.
fn kept(spec: &FormatSpec) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(spec.name);
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    paths.sort();
    paths.iter().map(|p| std::fs::read(p).unwrap()).collect()
}

/// Runs one reader for so many CPU seconds, and at most `wall`; the findings.
fn fuzz(spec: &FormatSpec, seconds: f64, wall: Duration, seed: u64) -> Vec<String> {
    // In memory where that is possible: a file is written for every mutant.
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() }.unwrap();
    let path = folder.path().join("mutant");
    let (mut corpus, mut findings) = (kept(spec), Vec::new());
    corpus.extend(seeds::of(spec.name, folder.path()));
    let found = |bytes: &[u8], what: String, findings: &mut Vec<String>| {
        let keep = std::env::temp_dir().join(format!("finding-{}-{}", spec.name, findings.len()));
        std::fs::write(&keep, bytes).unwrap();
        findings.push(format!("{} {what} (bytes in {})", spec.name, keep.display()));
    };
    for bytes in &corpus {
        if let Some(what) = fault(spec, &path, bytes) {
            found(bytes, what, &mut findings);
        }
    }
    let start = Instant::now();
    let begin = cpu_seconds(start);
    let (mut random, mut runs) = (Random::new(seed), 0_u64);
    while cpu_seconds(start) - begin < seconds && start.elapsed() < wall && findings.len() < 10 {
        let mutant = random.mutant(&corpus, MAX_BYTES);
        runs += 1;
        if let Some(what) = fault(spec, &path, &mutant) {
            found(&mutant, what, &mut findings);
        }
    }
    println!(
        "{}: {runs} mutants of {} seeds in {:.0} CPU s, {} findings",
        spec.name,
        corpus.len(),
        cpu_seconds(start) - begin,
        findings.len()
    );
    findings
}

fn all(seconds: f64, wall: Duration) {
    let number = |key: &str| std::env::var(key).ok().and_then(|v| v.parse::<f64>().ok());
    let only = std::env::var("FUZZ_FORMAT").ok();
    let seed = number("FUZZ_SEED").unwrap_or(1.0) as u64;
    std::panic::set_hook(Box::new(|_| {}));
    let readers = FORMATS.iter().filter(|f| f.read.is_some() && only.as_ref().is_none_or(|o| o == f.name));
    let findings: Vec<String> = readers.flat_map(|spec| fuzz(spec, seconds, wall, seed)).collect();
    drop(std::panic::take_hook());
    assert!(findings.is_empty(), "{}", findings.join("\n"));
}

#[test]
fn a_second_of_mutants_per_reader_does_no_harm() {
    all(0.5, Duration::from_secs(1));
}

#[test]
#[ignore = "minutes per reader"]
fn mutants_do_no_harm() {
    all(std::env::var("FUZZ_SECONDS").ok().and_then(|s| s.parse().ok()).unwrap_or(600.0), Duration::MAX);
}
