//! The comparison of methods: its files agree with each other and with runs of the same scenes.

use sph_formats::FORMATS;
use sph_prep::compare::{CSV_COLUMNS, Compared, Comparison, FILES, Request, advice, compare, csv, json, probe, write};
use sph_prep::relaxation::Control;
use sph_prep::run::pipeline;
use sph_prep::run::report::Report;
use sph_prep::scene::Scene;
use std::path::Path;
use std::sync::atomic::AtomicBool;

const LINE: &str = "input: {expression: '2 + sin(2*pi*x)'}\ndomain: {box: [[0], [1]], boundary: [periodic]}\n\
                    seed: 3\nwvt: {iterations: 6}\nsolver: {evaluations: 8}\nalaric: {steps: 6}\n";
const DISC: &str = "input: {expression: 'exp(-2*r)'}\ndomain: {ball: {center: [0, 0], radius: 1}}\n\
                    wvt: {iterations: 4}\nsolver: {evaluations: 6}\nalaric: {steps: 5}\n";

fn scene(text: &str) -> Scene {
    Scene::parse(text).unwrap()
}

fn compared(text: &str, methods: &str, counts: &[usize]) -> sph_prep::Result<Comparison> {
    let stop = AtomicBool::new(false);
    let control = Control { deadline: None, interrupted: &stop, observer: &|_| {} };
    let methods = Compared::parse_list(methods)?;
    compare(&Request { scene: &scene(text), methods: &methods, counts }, FORMATS, &control)
}

/// A run of one method's scene to a file.
fn run(text: &str, method: &str, count: usize) -> Report {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = Compared::parse(method).unwrap().apply(&scene(text));
    scene.particles = Some(count);
    scene.output.file = Some(folder.path().join("out.hdf5"));
    let stop = AtomicBool::new(false);
    let control = Control { deadline: None, interrupted: &stop, observer: &|_| {} };
    pipeline::run(&scene, FORMATS, &control).unwrap()
}

/// Cells of the table, without its header.
fn rows(text: &str) -> Vec<Vec<String>> {
    let mut lines = text.lines();
    assert_eq!(lines.next().unwrap(), CSV_COLUMNS.join(","));
    lines.map(|l| l.split(',').map(String::from).collect()).collect()
}

fn cell<'a>(row: &'a [String], column: &str) -> &'a str {
    &row[CSV_COLUMNS.iter().position(|c| *c == column).unwrap()]
}

/// serde_json reads the last bit as it likes.
fn same(cell: &str, value: &serde_json::Value) -> bool {
    match (cell.parse::<f64>().ok(), value.as_f64()) {
        (Some(a), Some(b)) => (a - b).abs() <= 1e-15 * b.abs(),
        (a, b) => a == b,
    }
}

/// A density that jumps at a periodic face: what brings the densities of a few particles in the middle about moves the others.
#[test]
fn a_method_that_has_the_mass_elsewhere_is_not_advised() {
    let scene = "input: {expression: '2 + z'}\nparticles: 300\n\
                 domain: {box: [[-0.5, -0.9, -1], [0.5, 0.9, 1]], boundary: [periodic, open, periodic]}\n";
    let text = compared(scene, "seed,solver,alaric:cubic", &[300]).unwrap().text();
    let advice = text.lines().find(|line| line.trim_start().starts_with("Take ")).unwrap();
    assert!(
        advice.contains("Take solver") && advice.contains("particles whose density is farther off: seed"),
        "{text}"
    );
}

#[test]
fn every_method_has_its_rows_and_the_table_agrees_with_the_json() {
    let methods = "seed,wvt,wvt-inverse-square,wvt-plain,alaric,alaric-split,solver,solver-exact,solver-quiet,scene";
    let comparison = compared(LINE, methods, &[40, 80]).unwrap();
    assert!(comparison.left_out.is_empty(), "{:?}", comparison.left_out);
    let rows = rows(&csv(&comparison));
    let value: serde_json::Value = serde_json::from_str(&json(&comparison).unwrap()).unwrap();
    let runs = value["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 2 * methods.split(',').count());
    for run in runs {
        let (name, count) = (run["method"].as_str().unwrap(), run["particles"].as_u64().unwrap().to_string());
        let mine = rows.iter().filter(|r| cell(r, "method") == name && cell(r, "particles") == count);
        let (states, steps): (Vec<_>, Vec<_>) = mine.partition(|r| cell(r, "row") == "state");
        assert_eq!(cell(states[0], "stage"), "seed");
        let (in_json, in_steps) = (run["states"].as_array().unwrap(), run["steps"].as_array().unwrap());
        assert_eq!((states.len(), steps.len()), (in_json.len(), in_steps.len()), "{name}");
        for (row, step) in steps.iter().zip(in_steps) {
            assert!(same(cell(row, "epsilon_watched"), &step["epsilon"]), "{row:?}");
            assert!(same(cell(row, "seconds"), &step["seconds"]), "{row:?}");
        }
        for (row, state) in states.iter().zip(in_json) {
            let error = &state["density_error"];
            for (column, expected) in [
                ("epsilon", &error["all"]["epsilon"]),
                ("mean_error_refitted", &error["all_refitted"]["mean"]),
                ("interior_max_error", &error["interior"]["max"]),
                ("interior_epsilon_refitted", &error["interior_refitted"]["epsilon"]),
                ("noise", &state["noise"]["all"]),
                ("closest_pair", &state["neighbors"]["closest_pair"]),
                ("seconds", &state["seconds"]),
            ] {
                assert!(same(cell(row, column), expected), "{name}, {column}");
            }
        }
        let seconds: Vec<f64> = in_steps.iter().map(|s| s["seconds"].as_f64().unwrap()).collect();
        assert!(seconds.is_sorted() && seconds.last().is_none_or(|s| *s <= run["seconds"].as_f64().unwrap()), "{name}");
    }
}

#[test]
fn figures_are_those_of_a_single_run() {
    for (text, count) in [(LINE, 60), (DISC, 150)] {
        let comparison = compared(text, "wvt,solver-quiet,seed:low-discrepancy", &[count]).unwrap();
        assert_eq!(comparison.runs.len(), 3);
        for method in &comparison.runs {
            let (report, state) = (run(text, &method.method, count), method.last().unwrap());
            assert_eq!(state.density_error, report.density_error, "{}", method.method);
            assert_eq!((state.noise, state.neighbors), (report.noise, report.neighbors), "{}", method.method);
            assert_eq!((method.stop, state.particles), (report.stop, count));
            let watched: Vec<f64> = report.stages.iter().flat_map(|s| &s.history).map(|p| p.epsilon).collect();
            assert_eq!(method.steps.iter().map(|s| s.epsilon).collect::<Vec<_>>(), watched);
        }
    }
}

#[test]
fn the_page_needs_nothing_else_and_names_all_methods() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new");
    probe(&out).unwrap();
    let comparison = compared(DISC, "seed,seed:shells,solver,seed:quaquaversal", &[80, 160]).unwrap();
    write(&comparison, &out).unwrap();
    let mut names: Vec<String> =
        std::fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    let mut expected = FILES;
    expected.sort_unstable();
    assert_eq!(names, expected, "and nothing temporary");
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    // Namespaces of SVG are names, not addresses to fetch.
    // Pictures are within, and their letters may spell anything.
    let parts: Vec<&str> = page.split("href=\"data:image/png;base64,").collect();
    let rest = parts[1..].iter().map(|part| part.split_once('"').unwrap().1);
    let drawn: String = [parts[0]].into_iter().chain(rest).collect();
    let fetched = drawn.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for mark in ["http", "src=", "href", "url(", "@import", "<script", "<link"] {
        assert!(!fetched.contains(mark), "{mark}");
    }
    for name in ["seed", "seed:shells", "solver", "seed:quaquaversal"] {
        assert!(page.contains(&format!("<tr><td>{name}</td><td>")), "{name}");
    }
    // Two figures per N, three against N; particles, density and profile of the three methods that ran.
    assert_eq!(page.matches("<svg").count(), 2 * 2 + 3 + 3 * 3);
    // Which to take comes first, in a sentence.
    let advice = advice(&comparison).unwrap();
    let method = advice.strip_prefix("Take ").unwrap().split(": with 160 particles").next().unwrap();
    let error = |run: &sph_prep::compare::MethodRun| run.last().unwrap().density_error.stated().mean;
    let ran: Vec<_> = comparison.runs.iter().filter(|r| r.particles == 160).collect();
    // Forces as noisy as half of a random set's are no good start, however near the density is.
    let noise = |run: &sph_prep::compare::MethodRun| {
        let noise = &run.last().unwrap().noise;
        noise.interior.unwrap_or(noise.all)
    };
    let is_loud = |run: &sph_prep::compare::MethodRun| noise(run) > 0.5;
    let all_are = ran.iter().all(|r| is_loud(r));
    let usable = || ran.iter().filter(|r| all_are || !is_loud(r));
    assert!(usable().any(|r| r.method == method), "{advice}");
    let least = usable().map(|r| error(r)).fold(f64::INFINITY, f64::min);
    assert!(ran.iter().any(|r| r.method == method && error(r) <= (1.5 * least).max(1e-3)), "{advice}");
    assert!(page.find("Take ") < page.find("<h2>"), "{page:.2000}");
    assert!(!drawn.contains("NaN") && page.len() < 1_000_000, "{} bytes", page.len());
    // The tiling is no method for two dimensions: told, and no reason to give up the others.
    assert_eq!(comparison.left_out.len(), 2);
    assert!(comparison.left_out[0].why.contains("3-D only"), "{}", comparison.left_out[0].why);
    assert!(comparison.text().contains("left out  seed:quaquaversal with 80"), "{}", comparison.text());
}

#[test]
fn what_cannot_be_compared_is_refused_with_the_names() {
    let error = compared(LINE, "wvt,sovler", &[40]).unwrap_err().to_string();
    assert!(error.contains("'sovler'") && error.contains("solver-exact"), "{error}");
    let error = compared(DISC, "seed:quaquaversal", &[40]).unwrap_err().to_string();
    assert!(error.contains("3-D only"), "{error}");
    assert!(compared(LINE, "wvt", &[]).is_err());
}

#[test]
fn an_interrupt_ends_the_comparison() {
    let stop = AtomicBool::new(true);
    let control = Control { deadline: None, interrupted: &stop, observer: &|_| {} };
    let methods = Compared::parse_list("wvt,seed").unwrap();
    let request = Request { scene: &scene(LINE), methods: &methods, counts: &[40] };
    let error = compare(&request, FORMATS, &control).unwrap_err();
    assert!(matches!(error, sph_prep::Error::Interrupted), "{error}");
}

fn binary(arguments: &[&str], folder: &Path) -> std::process::Output {
    assert_cmd::Command::cargo_bin("sph-prep").unwrap().current_dir(folder).args(arguments).output().unwrap()
}

#[test]
fn the_command_writes_its_files_and_prints_a_line_per_run() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("line.yaml"), LINE).unwrap();
    let start = ["compare", "--scene", "line.yaml", "--out", "out"];
    let ran = binary(&[&start[..], &["-n", "30,60", "--methods", "wvt,solver:random"]].concat(), folder.path());
    let text = String::from_utf8(ran.stdout).unwrap();
    assert!(ran.status.success() && text.matches("\n  solver:random ").count() == 2, "{text}");
    assert!(FILES.iter().all(|name| folder.path().join("out").join(name).is_file()));
    let refused = binary(&[&start[..], &["--methods", "nothing"]].concat(), folder.path());
    let text = String::from_utf8(refused.stderr).unwrap();
    assert!(refused.status.code() == Some(2) && text.contains("wvt-inverse-square"), "{text}");
    let twice = binary(&[&start[..], &["-n", "30,30"]].concat(), folder.path());
    assert_eq!(twice.status.code(), Some(2));
}
