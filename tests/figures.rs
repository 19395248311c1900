//! The figures of the README and of the manual's page `measured.md`, measured again. A nightly run takes them in one command:
//!
//! ```sh
//! cargo test --release --test all -- --ignored --nocapture figures::
//! ```
//!
//! The tables themselves say what is run: each row is a scene, a number of particles and the stages. Errors and noise are
//! compared, times are not. Found and stated may differ by the factors below: another kind of CPU sums in another
//! order, and what the relaxation makes of that is another state of the same quality.

use sph_prep::relaxation::Control;
use sph_prep::run::pipeline;
use sph_prep::run::report::Report;
use sph_prep::scene::Scene;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// Means over 100 000 particles, as noise and balance are too, and the two digits that the page has of them.
const MEANS: f64 = 1.25;
/// Its square: epsilon is quadratic in the error.
const EPSILON: f64 = MEANS * MEANS;
/// The largest of 100 000 errors is that of one particle.
const LARGEST: f64 = 2.0;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Cells of the rows below the header that begins so.
fn table(header: &str) -> Vec<Vec<String>> {
    let page = std::fs::read_to_string(root().join("docs/src/measured.md")).unwrap();
    let below = page.lines().skip_while(|l| !l.starts_with(header)).skip(2).take_while(|l| l.starts_with('|'));
    let cells = |l: &str| l.trim_matches('|').split('|').map(|c| c.trim().to_string()).collect();
    below.map(cells).collect()
}

/// One run of the table of errors.
#[derive(Debug, Clone)]
struct Row {
    /// A scene or an input.
    file: PathBuf,
    count: usize,
    /// Keys that the row adds to the scene.
    rest: String,
    /// As stated: epsilon, mean and largest error, noise; where the table has them.
    stated: [Option<f64>; 4],
}

/// `0.44 %` as 0.0044, `3.1e-5` as it is.
fn number(cell: &str) -> Option<f64> {
    match cell.strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().ok().map(|p| p / 100.0),
        None => cell.parse().ok(),
    }
}

/// What stands between the first two back-quotes.
fn quoted(cell: &str) -> Option<&str> {
    cell.split('`').nth(1)
}

fn file(cell: &str) -> PathBuf {
    match quoted(cell) {
        Some(path) => root().join(path),
        None => {
            assert!(cell.contains("MESA"), "the page has a row without a file: '{cell}'");
            root().join("../shared/data/mesa/mesa2hydro_profile_mainsequence_logE.data")
        }
    }
}

fn errors() -> Vec<Row> {
    let mut scene = String::new();
    let mut rows = Vec::new();
    for cells in table("| scene | N | stages |") {
        let [name, count, stages, epsilon, mean, largest, noise, _] = cells.as_slice() else {
            panic!("the page has a row of {} cells", cells.len())
        };
        if !name.is_empty() {
            scene = name.clone();
        }
        let option = quoted(stages).map(|o| o.trim_start_matches("--").replacen(' ', ": ", 1));
        let rest = match (stages.as_str(), option) {
            ("WVT", _) => "polish: none".into(),
            ("WVT, solver" | "shells, solver", _) => String::new(),
            (same, Some(option)) if same.starts_with("the same") => format!("solver: {{{option}}}"),
            _ => panic!("the page has stages '{stages}'"),
        };
        rows.push(Row {
            file: file(&scene),
            count: count.replace(' ', "").parse().unwrap(),
            rest,
            stated: [epsilon, mean, largest, noise].map(|cell| number(cell)),
        });
    }
    rows
}

fn run(file: &Path, count: usize, rest: &str) -> Report {
    let is_scene = file.extension().is_some_and(|e| e == "yaml");
    let text = if is_scene {
        let scene = std::fs::read_to_string(file).unwrap();
        scene.lines().filter(|l| !l.starts_with("particles:")).map(|l| format!("{l}\n")).collect()
    } else {
        format!("input: {{file: '{}'}}\n", file.display())
    };
    placed(&format!("{text}{rest}\n"), count)
}

fn placed(text: &str, count: usize) -> Report {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = Scene::parse(&format!("{text}particles: {count}\n")).unwrap();
    scene.output.file = Some(folder.path().join("ic.hdf5"));
    let never = AtomicBool::new(false);
    let control = Control { deadline: None, interrupted: &never, observer: &|_| {} };
    pipeline::run(&scene, sph_formats::FORMATS, &control).unwrap()
}

/// What is further from what is stated than the factor admits.
fn differs(what: &str, stated: Option<f64>, found: f64, factor: f64) -> Option<String> {
    let stated = stated?;
    let near = found <= factor * stated && stated <= factor * found;
    (!near).then(|| format!("{what} is {found:.2e}, stated {stated:.2e}"))
}

#[test]
fn rows_name_files_that_are_there_and_figures() {
    let rows = errors();
    assert!(rows.len() > 8, "{rows:?}");
    for row in &rows {
        let present = row.file.is_file() || row.file.starts_with(root().join("../shared"));
        assert!(present && row.count >= 100_000 && row.stated[0].is_some() && row.stated[1].is_some(), "{row:?}");
    }
    assert!(rows.iter().any(|row| row.rest == "solver: {quietness: 0.5}"), "{rows:?}");
    let balance = table("| star | N | WVT alone |");
    assert!(!balance.is_empty() && balance.iter().all(|cells| cells[2..].iter().all(|c| number(c).is_some())));
    assert_eq!((number("0.44 %"), number("3.1e-5"), number("")), (Some(0.0044), Some(3.1e-5), None));
    assert!(differs("x", Some(1.0), 1.3, 1.25).is_some() && differs("x", Some(1.3), 1.0, 1.25).is_some());
    assert!(differs("x", Some(1.0), 1.2, 1.25).is_none() && differs("x", None, 9.0, 1.25).is_none());
}

#[test]
#[ignore = "minutes: every row at full size"]
fn errors_and_noise_are_those_of_the_manual() {
    let mut wrong = Vec::new();
    for row in errors() {
        let name = row.file.strip_prefix(root()).unwrap_or(&row.file).display().to_string();
        if !row.file.is_file() {
            println!("skipped: {name} is not here");
            continue;
        }
        let report = run(&row.file, row.count, &row.rest);
        let (e, noise) = (report.density_error.stated(), report.noise.interior.unwrap_or(report.noise.all));
        println!(
            "| {name} {} | {} | {:.1e} | {:.3} % | {:.2} % | {:.1} % |",
            row.rest,
            row.count,
            e.epsilon,
            100.0 * e.mean,
            100.0 * e.max,
            100.0 * noise
        );
        let found = [("epsilon", e.epsilon, EPSILON), ("mean error", e.mean, MEANS), ("max error", e.max, LARGEST)];
        let found = found.into_iter().chain([("noise", noise, MEANS)]);
        let faults: Vec<String> = found
            .zip(row.stated)
            .filter_map(|((what, value, factor), stated)| differs(what, stated, value, factor))
            .collect();
        wrong.extend(faults.iter().map(|fault| format!("{name} {} with {}: {fault}", row.rest, row.count)));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
#[ignore = "a minute"]
fn forces_on_stars_at_rest_are_those_of_the_manual() {
    let mut wrong = Vec::new();
    for cells in table("| star | N | WVT alone |") {
        let (star, count) = (file(&cells[0]), cells[1].replace(' ', "").parse().unwrap());
        for (cell, rest) in cells[2..].iter().zip(["polish: none", "", "solver: {quietness: 1}", "balance: {}"]) {
            let found = run(&star, count, rest).balance.unwrap().interior.unwrap();
            println!("{} with {count}, {rest}: {:.2} %", star.display(), 100.0 * found);
            wrong.extend(differs(rest, number(cell), found, MEANS));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The problems of the README's table, as `cargo bench --bench peers` has them.
fn problem(name: &str) -> &'static str {
    match name {
        "n = 1.5 polytrope" => "input: {file: profiles/polytrope-1.5.nc}\n",
        "constant" => "input: {expression: '1'}\ndomain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}\n",
        "uniform sphere" => "input: {expression: '1'}\ndomain: {ball: {center: [0, 0, 0], radius: 1}}\n",
        _ => panic!("the README has a problem '{name}'"),
    }
}

/// The number between the first `before` and the next `after`.
fn between(text: &str, before: &str, after: &str) -> Option<f64> {
    text.split(before).nth(1)?.split(after).next()?.trim().parse().ok()
}

#[test]
#[ignore = "a minute"]
fn figures_of_the_readme_are_found_again() {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    let rows = readme.lines().skip_while(|l| !l.starts_with("| problem | N |")).skip(2);
    let mut wrong = Vec::new();
    for line in rows.take_while(|l| l.starts_with('|')) {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let count = cells[1].replace(' ', "").parse().unwrap();
        let scene = format!("{}kernel: wendland-c6\nneighbors: 295\n", problem(cells[0]));
        let found = 100.0 * placed(&scene, count).density_error.stated().mean;
        println!("{} with {count}: {found:.4} %", cells[0]);
        wrong.extend(differs(line, between(cells[2], "default: ", " %"), found, MEANS));
    }
    let report = placed("input: {file: profiles/star.nc}\n", 100_000).text();
    for (before, after) in [("closest are ", " "), ("good   force noise    ", " %"), ("net force of ", " %")] {
        let [stated, found] = [&readme, &report].map(|text| between(text, before, after));
        println!("{before}{found:?}");
        wrong.extend(differs(before, Some(stated.unwrap()), found.unwrap(), MEANS));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
