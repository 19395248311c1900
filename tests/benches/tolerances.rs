//! Error against run time for every method on four scenes, which to use when, and what leaving stages out saves.
//!
//! `cargo bench --bench tolerances [-- N]` prints the tables (10 000 particles by default); with
//! SPH_PREP_RESULTS=docs/src/results it also writes `tolerances.md` there.

mod support;

use sph_prep::compare::{Compared, MethodRun, Request, VARIATIONS, compare};
use sph_prep::relaxation::StopReason;
use sph_prep::run::plan::LeftOut;
use sph_prep::run::report::Report;
use sph_prep::scene::{Polish, Scene};
use sph_prep::seeding::METHODS;
use std::fmt::Write;
use std::path::Path;
use support::{control, run};

/// Bundled scenes: even, a star, a pattern without symmetry, a density jump.
const SCENES: [(&str, &str); 4] = [
    ("uniform-3d.yaml", "A uniform periodic box"),
    ("star-1.5.yaml", "A star (polytrope n = 1.5)"),
    ("spiral-2d.yaml", "Spiral arms in a disc, 2-D"),
    ("planet.yaml", "A planet with a jump"),
];

/// A method is worth its time if it halves the error of all that are faster, and meets the first goal.
const WORTH: f64 = 0.5;
/// Targets of the advice: the fastest method with a mean error below.
const GOALS: [f64; 3] = [1e-2, 3e-3, 1e-3];
/// Tolerances on epsilon that the plan is timed for.
const TOLERANCES: [f64; 4] = [1e-4, 1e-5, 1e-6, 1e-7];

/// Every seeding alone, then every variation with the scene's own.
fn methods() -> Vec<Compared> {
    let seeds = METHODS.iter().map(|m| format!("seed:{}", m.name));
    let others = VARIATIONS.iter().map(|v| v.name.to_string()).filter(|name| name != "seed");
    seeds.chain(others).map(|name| Compared::parse(&name).expect("a name from the lists")).collect()
}

/// Figures of a result by which methods are set against each other.
struct Way<'a> {
    name: &'a str,
    seconds: f64,
    epsilon: f64,
    mean: f64,
    noise: f64,
}

impl<'a> Way<'a> {
    fn new(run: &'a MethodRun) -> Option<Self> {
        let state = run.last()?;
        let error = state.density_error.stated();
        let noise = state.noise.interior.unwrap_or(state.noise.all);
        Some(Self { name: &run.method, seconds: run.seconds, epsilon: error.epsilon, mean: error.mean, noise })
    }
}

/// Those that are worth their time, the fastest first.
fn worthwhile(ways: &[Way<'_>]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..ways.len()).collect();
    order.sort_by(|&a, &b| ways[a].seconds.total_cmp(&ways[b].seconds));
    let mut best = GOALS[0] / WORTH;
    order.retain(|&i| {
        let worth = ways[i].mean < WORTH * best;
        best = if worth { ways[i].mean } else { best };
        worth
    });
    order
}

fn table(ways: &[Way<'_>]) -> String {
    let kept = worthwhile(ways);
    let mut out = String::from(
        "| method | s | epsilon | mean error | force noise | worth its time |\n|---|---|---|---|---|---|\n",
    );
    for (i, r) in ways.iter().enumerate() {
        let mark = if kept.contains(&i) { "yes" } else { "" };
        let (mean, noise) = (100.0 * r.mean, 100.0 * r.noise);
        let _ = writeln!(
            out,
            "| {} | {:.2} | {:.1e} | {mean:.3} % | {noise:.1} % | {mark} |",
            r.name, r.seconds, r.epsilon
        );
    }
    out
}

fn advice(ways: &[Way<'_>]) -> String {
    let mut out = String::new();
    for goal in GOALS {
        let fastest = ways.iter().filter(|r| r.mean < goal).min_by(|a, b| a.seconds.total_cmp(&b.seconds));
        let text = fastest.map_or("no method".into(), |r| format!("`{}` ({:.2} s)", r.name, r.seconds));
        let _ = writeln!(out, "- mean error below {} %: {text}", 100.0 * goal);
    }
    if let Some(quiet) = ways.iter().filter(|r| r.mean < GOALS[0]).min_by(|a, b| a.noise.total_cmp(&b.noise)) {
        let _ = writeln!(
            out,
            "- quietest of those below {} %: `{}` ({:.1} %)",
            100.0 * GOALS[0],
            quiet.name,
            100.0 * quiet.noise
        );
    }
    out
}

/// Seconds of seeding and relaxing.
fn placing(report: &Report) -> f64 {
    report
        .timing
        .iter()
        .filter(|t| !["read", "interpolate", "measure", "write"].contains(&t.step))
        .map(|t| t.seconds)
        .sum()
}

/// The plan against the same with WVT run to its full length before the polish, and against twice the evaluations.
fn saved(scene: &Scene) -> Result<String, String> {
    let planned = run(scene)?;
    let mut out = String::from("| what is run | s | epsilon | mean error |\n|---|---|---|---|\n");
    let mut long = scene.clone();
    long.wvt.iterations = Some(60);
    let mut twice = scene.clone();
    twice.solver.evaluations = Some(2 * planned.plan.evaluations.max(1));
    for (name, report) in [
        ("the plan", &planned),
        ("with 60 iterations of WVT first", &run(&long)?),
        ("with twice the evaluations", &run(&twice)?),
    ] {
        let error = report.density_error.stated();
        let _ =
            writeln!(out, "| {name} | {:.2} | {:.1e} | {:.3} % |", placing(report), error.epsilon, 100.0 * error.mean);
    }
    out += "\nLeft out:\n\n";
    for LeftOut { what, why } in &planned.plan.left_out {
        let _ = writeln!(out, "- {what}: {why}");
    }
    Ok(out)
}

/// Seconds until a tolerance is met: the plan for it, WVT to its end and then the solver, WVT alone, ALARIC.
fn soonest(scene: &Scene) -> Result<String, String> {
    let mut out = String::from(
        "| tolerance on epsilon | plan | 40 WVT, solver | WVT | ALARIC | ALARIC over plan |\n|---|---|---|---|---|---|\n",
    );
    for tolerance in TOLERANCES {
        let with = |change: &dyn Fn(&mut Scene)| -> Result<(String, Option<f64>), String> {
            let mut scene = scene.clone();
            scene.tolerance = Some(tolerance);
            change(&mut scene);
            let report = run(&scene)?;
            let seconds = placing(&report);
            let reached = report.stop == StopReason::ToleranceReached;
            let text = if reached { format!("{seconds:.2} s") } else { format!("not within {seconds:.1} s") };
            Ok((text, reached.then_some(seconds)))
        };
        let plan = with(&|_| {})?;
        let long = with(&|scene| scene.wvt.iterations = Some(40))?;
        let wvt = with(&|scene| scene.polish = Some(Polish::None))?;
        let alaric = with(&|scene| scene.polish = Some(Polish::Alaric))?;
        let ratio = plan.1.zip(alaric.1).map_or("-".into(), |(plan, alaric)| format!("{:.1}", alaric / plan));
        let _ = writeln!(out, "| {tolerance:e} | {} | {} | {} | {} | {ratio} |", plan.0, long.0, wvt.0, alaric.0);
    }
    Ok(out)
}

fn section(file: &str, title: &str, count: usize) -> Result<String, String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("profiles").join(file);
    let mut scene = Scene::load(&path).map_err(|e| e.to_string())?;
    scene.particles = Some(count);
    let methods = methods();
    let request = Request { scene: &scene, methods: &methods, counts: &[count] };
    let comparison = compare(&request, sph_formats::FORMATS, &control()).map_err(|e| e.to_string())?;
    let ways: Vec<Way<'_>> = comparison.runs.iter().filter_map(Way::new).collect();
    let mut out = format!("\n## {title} (`profiles/{file}`)\n\n{}\n{}\n", table(&ways), advice(&ways));
    let refused: Vec<&str> = comparison.left_out.iter().map(|o| o.method.as_str()).collect();
    if !refused.is_empty() {
        let _ = writeln!(out, "Not for this scene: {}.\n", refused.join(", "));
    }
    Ok(out + &soonest(&scene)? + "\n" + &saved(&scene)?)
}

fn page(count: usize) -> Result<String, String> {
    let mut page = format!(
        "# Errors within a given time\n\n`SPH_PREP_RESULTS=docs/src/results cargo bench --bench tolerances -- {count}` makes this page: {count} particles, seconds of \
         seeding and relaxing,\ndensity error (interior, mass re-fitted) and force noise (interior; a fraction of random points'). A method is \
         worth its time where\nits mean error is below 1 % and half of that of every faster one.\n\nWhat follows from it: where the target is uniform or a function \
         of one coordinate a lattice or glass is there at once, and only its\npreferred directions or its repetition speak against it. Everything else takes \
         the default (`scene`), which seeds by mass and solves for the\ndensity; WVT alone suits 1e7 particles and more, where the solver's memory \
         counts. ALARIC and damped relaxation follow a fluid in time:\nmany times the run time of the solver, and more force noise for what density error they gain.\n"
    );
    for (file, title) in SCENES {
        let part = section(file, title, count)?;
        println!("{part}");
        page += &part;
    }
    Ok(page)
}

fn main() {
    let count = std::env::args().filter_map(|a| a.parse::<f64>().ok()).next().unwrap_or(1e4) as usize;
    match page(count) {
        Ok(page) => support::write_page("tolerances.md", &page),
        Err(problem) => support::fail(&problem),
    }
}
