//! Time and peak memory of the main job, and the error it reaches, from a profile to a SWIFT file.
//!
//! `cargo bench --bench main_job [-- N...]` (by default 1e5 and 1e6). The peak is that of the process so far, so
//! give one N for a figure of its own: `-- 1e7`.

use sph_prep::relaxation::Control;
use sph_prep::run::pipeline;
use sph_prep::scene::Scene;
use std::sync::atomic::AtomicBool;

/// Peak resident memory in bytes, where the system tells.
fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    Some(1024.0 * line.split_whitespace().nth(1)?.parse::<f64>().ok()?)
}

fn main() {
    let given: Vec<usize> =
        std::env::args().filter_map(|a| a.parse::<f64>().ok()).filter(|n| *n >= 1.0).map(|n| n as usize).collect();
    let counts = if given.is_empty() { vec![100_000, 1_000_000] } else { given };
    let folder = tempfile::tempdir().unwrap();
    let profile = concat!(env!("CARGO_MANIFEST_DIR"), "/profiles/star.nc");
    let never = AtomicBool::new(false);
    let control = Control { deadline: None, interrupted: &never, observer: &|_| {} };
    println!("        N   seconds   bytes per particle   epsilon (interior)   steps");
    for n in counts {
        let out = folder.path().join("ic.hdf5");
        let text = format!("input: {{file: '{profile}'}}\noutput: {{file: '{}'}}\nparticles: {n}", out.display());
        let report = pipeline::run(&Scene::parse(&text).unwrap(), sph_formats::FORMATS, &control).unwrap();
        let memory = peak_memory().map_or("-".into(), |m| format!("{:.0}", m / n as f64));
        let epsilon = report.density_error.interior_refitted.map_or(f64::NAN, |e| e.epsilon);
        let steps: Vec<String> = report.timing.iter().map(|t| format!("{} {:.1}", t.step, t.seconds)).collect();
        println!("{n:>9} {:>9.1} {memory:>20} {epsilon:>20.2e}   {}", report.seconds, steps.join(", "));
    }
}
