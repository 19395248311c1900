//! The default on every bundled input and, where it is there, every file of `../shared/data`: error and
//! time with and without the polish.
//!
//! `cargo bench --bench inputs [-- N]` prints a table; with SPH_PREP_RESULTS=docs/src/results it also writes
//! `inputs.md` there.

mod support;

use sph_prep::run::report::Report;
use sph_prep::scene::Scene;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Files below `folder`, sorted.
fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|e| e.path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() { files(&path, found) } else { found.push(path) }
    }
}

fn scene(path: &Path) -> Result<Scene, String> {
    if path.extension().is_some_and(|e| e == "yaml") {
        return Scene::load(path).map_err(|e| e.to_string());
    }
    let mut scene = Scene::default();
    scene.input.file = Some(path.into());
    Ok(scene)
}

fn run(path: &Path, count: usize, polish: bool) -> Result<Report, String> {
    let mut scene = scene(path)?;
    scene.particles = Some(count);
    scene.tolerance = None;
    if !polish {
        scene.polish = Some(sph_prep::scene::Polish::None);
    }
    support::run(&scene)
}

/// Interior epsilon where there is an interior, with a mark where all particles count.
fn error(report: &Report) -> String {
    match report.density_error.interior_refitted {
        Some(inside) => format!("{:.1e} | {:.3} %", inside.epsilon, 100.0 * inside.mean),
        None => format!(
            "{:.1e} (all) | {:.3} %",
            report.density_error.all_refitted.epsilon,
            100.0 * report.density_error.all_refitted.mean
        ),
    }
}

/// Names of files without where this machine has them.
fn without_folders(text: &str, root: &Path) -> String {
    text.replace(&format!("{}/../shared/data/", root.display()), "").replace(&format!("{}/", root.display()), "")
}

fn main() {
    let count = std::env::args().filter_map(|a| a.parse::<f64>().ok()).next().unwrap_or(1e5) as usize;
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = Vec::new();
    files(&root.join("profiles"), &mut paths);
    paths.retain(|p| p.extension().is_some_and(|e| e == "nc" || e == "yaml"));
    let bundled = paths.len();
    files(&root.join("../shared/data"), &mut paths);
    paths.retain(|p| p.extension().is_none_or(|e| e != "md"));
    if paths.len() == bundled {
        println!("skipped: ../shared/data is not here");
    }
    let mut table = String::from(
        "| input | WVT alone: epsilon | mean | s | default: epsilon | mean | s |\n|---|---|---|---|---|---|---|\n",
    );
    for path in &paths {
        let name = path.strip_prefix(root).unwrap_or(path).display().to_string().replace("../shared/data/", "");
        let start = table.len();
        let _ = match (run(path, count, false), run(path, count, true)) {
            (Ok(wvt), Ok(solved)) => writeln!(
                table,
                "| {name} | {} | {:.1} | {} | {:.1} |",
                error(&wvt),
                wvt.seconds,
                error(&solved),
                solved.seconds
            ),
            (Err(e), _) | (_, Err(e)) => writeln!(table, "| {name} | {} | | | | | |", e.replace('|', "/")),
        };
        print!("{}", without_folders(&table[start..], root));
    }
    let page = format!(
        "# Every input\n\n`SPH_PREP_RESULTS=docs/src/results cargo bench --bench inputs -- {count}` makes this page: {count} particles, density error \
         (interior, mass re-fitted) and seconds of the whole run, by WVT alone (60 iterations) and by the default. Files outside \
         `profiles/` are not part of the project.\n\n{}",
        without_folders(&table, root)
    );
    support::write_page("inputs.md", &page);
}
