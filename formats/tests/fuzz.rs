//! Readers against hostile files: a mutating fuzzer without further tools, deterministic by its seed.
//!
//! No file may make a reader panic, take more than 10 s, or take more than 1 GiB; an abort kills the test. Seeds are what our
//! own writers make, small files made by hand, and what earlier runs kept (`corpus/<format>/`). A mutant that gets an answer
//! that no file before it got (an error's text, without its numbers and names) becomes a seed itself.
//!
//! A second per reader runs with the other tests. In full, with the CPU seconds for each reader:
//!
//! ```sh
//! FUZZ_SECONDS=600 cargo test -p sph-formats --release --test fuzz -- --ignored --nocapture
//! ```
//!
//! `FUZZ_FORMAT=vtk` runs one reader alone, `FUZZ_SEED=7` begins elsewhere, `FUZZ_KEEP=formats/tests/corpus` keeps the small
//! ones among the new seeds. A finding is written to the temporary folder, whose name is printed.

#[path = "support/files.rs"]
mod files;
#[path = "fuzz/memory.rs"]
mod memory;
#[path = "fuzz/mutate.rs"]
mod mutate;
#[path = "fuzz/seeds.rs"]
mod seeds;

use files::replace;
use memory::Counting;
use mutate::Random;
use sph_formats::{FORMATS, FieldRequest, FileContent, FormatSpec, read};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Longest that a file of at most [`MAX_BYTES`] may take, in seconds of this thread's processor, so that a busy machine makes
/// no findings; a reader that waits for ever keeps the test from ending.
const MAX_SECONDS: f64 = 10.0;
/// Most memory that it may take.
const MAX_MEMORY: usize = 1 << 30;
/// Longest mutant.
const MAX_BYTES: usize = 1_000_000;

/// Most new seeds of a run, and the largest that is kept between runs.
const MAX_NEW_SEEDS: usize = 200;
const MAX_KEPT_BYTES: usize = 8192;

/// What a reader made of some bytes.
enum Answer {
    /// The kind of its answer, which numbers and names do not change.
    Fine(String),
    /// What it did wrong.
    Fault(String),
}

fn answer(spec: &FormatSpec, path: &Path, bytes: &[u8]) -> Answer {
    replace(path, bytes);
    memory::start();
    let clock = Clock::start();
    let outcome = std::panic::catch_unwind(|| match read(FORMATS, path, Some(spec.name), &FieldRequest::default()) {
        Ok(FileContent::Field(_)) => "a field".into(),
        Ok(FileContent::Particles(_)) => "particles".into(),
        Err(error) => kind(&error.to_string()),
    });
    let seconds = clock.seconds();
    let peak = memory::peak();
    match outcome {
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
            Answer::Fault(format!("panics: {}", text.unwrap_or("without a text")))
        }
        Ok(_) if seconds > MAX_SECONDS => Answer::Fault(format!("takes {seconds:.0} s")),
        Ok(_) if peak > MAX_MEMORY => Answer::Fault(format!("takes {} MiB", peak >> 20)),
        Ok(kind) => Answer::Fine(kind),
    }
}

/// The first words of an error's text, without what it quotes of the file.
fn kind(text: &str) -> String {
    let quotes = ['\'', '"', '`'];
    let path = text.split(", ").next().unwrap_or_default().len();
    let (before, behind) = text.split_at(path);
    let quoted = behind.find(quotes).zip(behind.rfind(quotes));
    let outside = quoted.map_or(String::from(behind), |(first, last)| [&behind[..first], &behind[last..]].concat());
    let words = outside.split_whitespace().filter(|w| w.chars().all(|c| c.is_ascii_alphabetic() || ",:;".contains(c)));
    let start = before.split_whitespace().filter(|w| w.chars().all(|c| c.is_ascii_alphabetic()));
    start.chain(words.take(12)).collect()
}

/// Time since a start, on the wall and of this thread's processor.
struct Clock {
    wall: Instant,
    processor: Option<f64>,
}

impl Clock {
    fn start() -> Self {
        Self { wall: Instant::now(), processor: Self::processor() }
    }

    /// Seconds that this thread has had a processor since; on the wall where the system does not count them.
    fn seconds(&self) -> f64 {
        let processor = Self::processor().zip(self.processor).map(|(now, then)| now - then);
        processor.unwrap_or_else(|| self.wall.elapsed().as_secs_f64())
    }

    /// Of this thread, by the kernel's own count.
    fn processor() -> Option<f64> {
        let stat = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        Some(1e-9 * stat.split_whitespace().next()?.parse::<f64>().ok()?)
    }
}

/// Files that earlier runs found or kept.
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
    let (mut corpus, mut findings, mut kinds) = (kept(spec), Vec::new(), BTreeSet::new());
    corpus.extend(seeds::of(spec.name, folder.path()));
    let found = |bytes: &[u8], what: String, findings: &mut Vec<String>| {
        let keep = std::env::temp_dir().join(format!("finding-{}-{}", spec.name, findings.len()));
        std::fs::write(&keep, bytes).unwrap();
        findings.push(format!("{} {what} (bytes in {})", spec.name, keep.display()));
    };
    for bytes in &corpus {
        match answer(spec, &path, bytes) {
            Answer::Fault(what) => found(bytes, what, &mut findings),
            Answer::Fine(kind) => drop(kinds.insert(kind)),
        }
    }
    let (clock, given) = (Clock::start(), corpus.len());
    let (mut random, mut runs) = (Random::new(seed), 0_u64);
    while clock.seconds() < seconds && clock.wall.elapsed() < wall && findings.len() < 10 {
        let mutant = random.mutant(&corpus, MAX_BYTES);
        runs += 1;
        match answer(spec, &path, &mutant) {
            Answer::Fault(what) => found(&mutant, what, &mut findings),
            Answer::Fine(kind) => {
                if kinds.insert(kind) && corpus.len() < given + MAX_NEW_SEEDS {
                    corpus.push(mutant);
                }
            }
        }
    }
    println!(
        "{}: {runs} mutants of {given} seeds and {} that they led to in {:.0} CPU s, {} kinds of answers, {} findings",
        spec.name,
        corpus.len() - given,
        clock.seconds(),
        kinds.len(),
        findings.len()
    );
    if let Some(folder) = std::env::var_os("FUZZ_KEEP") {
        keep(&Path::new(&folder).join(spec.name), &corpus[given..]);
    }
    findings
}

/// Writes the small ones among new seeds beside those that are kept.
fn keep(folder: &Path, seeds: &[Vec<u8>]) {
    std::fs::create_dir_all(folder).unwrap();
    let first = std::fs::read_dir(folder).unwrap().count();
    for (i, seed) in seeds.iter().filter(|s| s.len() <= MAX_KEPT_BYTES).enumerate() {
        std::fs::write(folder.join(format!("{:04}", first + i)), seed).unwrap();
    }
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
fn some_mutants_per_reader_do_no_harm() {
    all(0.3, Duration::from_millis(600));
}

#[test]
#[ignore = "minutes per reader"]
fn mutants_do_no_harm() {
    all(std::env::var("FUZZ_SECONDS").ok().and_then(|s| s.parse().ok()).unwrap_or(600.0), Duration::MAX);
}
