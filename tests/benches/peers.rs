//! The problems on which other tools were measured, solved here: density error, CPU time and how they compare.
//!
//! `cargo bench --bench peers [-- FILTER]` prints a table; with SPH_PREP_RESULTS=docs/src/results it also
//! writes `peers.md` there. The other tools' figures are measurements of WVTICs (Donnert, Arth), SEAGen
//! (Kegerreis et al.) and OpenSPH (Sevecek) on a loaded two-core machine, in CPU seconds. Ours run on one thread: seconds
//! of the whole run, and of them those until the particles are in place, without the measuring that no other tool does
//! and the writing. Ratios within a row are fair, not exact.
//! Where a tool used Wendland C6 with 295 neighbors, so do we.

mod support;

use sph_prep::scene::Scene;
use std::fmt::Write;

/// Another tool's figures on a problem.
struct Peer {
    tool: &'static str,
    seconds: Option<f64>,
    /// Mean |rho/rho* - 1|, of the interior where the problem has an edge.
    mean: f64,
    epsilon: f64,
}

const fn peer(tool: &'static str, seconds: f64, mean: f64, epsilon: f64) -> Peer {
    Peer { tool, seconds: Some(seconds), mean, epsilon }
}

struct Problem {
    name: &'static str,
    count: usize,
    scene: &'static str,
    /// Roads of ours: name and further keys of the scene.
    ways: &'static [(&'static str, &'static str)],
    peers: &'static [Peer],
}

const BOX: &str = "domain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}\nthermal: {internal_energy: 1}\n";
const C6: &str = "kernel: wendland-c6\nneighbors: 295\n";
const DEFAULT: &[(&str, &str)] = &[("default", "")];
/// Few particles get many evaluations by default; with the usual number the time is less than the other tools'.
const BOXES: &[(&str, &str)] = &[("default", ""), ("60 evaluations", "solver: {evaluations: 60}\n")];
const SPHERES: &[(&str, &str)] = &[
    ("default", ""),
    BARE_SHELLS,
    ("shells, solver", "seeding: equal-area-shells\nwvt: {iterations: 0}\nsolver: {evaluations: 20}\n"),
];
const BARE_SHELLS: (&str, &str) = ("shells alone", "seeding: shells\nwvt: {iterations: 0}\npolish: none\n");
const POLYTROPE: &str = "input: {file: profiles/polytrope-1.5.nc}\nkernel: wendland-c6\nneighbors: 295\n";
const SPHERE: &str = "input: {expression: '1'}\ndomain: {ball: {center: [0, 0, 0], radius: 1}}\nthermal: {internal_energy: 1}\nkernel: wendland-c6\nneighbors: 295\n";
const PLANET: &str = "input: {expression: 'if(r < 0.55, 3 - 0.7 * r^2, 1.3 - 0.6 * r^2)'}\ndomain: {ball: {center: [0, 0, 0], radius: 1}}\nthermal: {internal_energy: 1}\nkernel: wendland-c6\nneighbors: 295\n";
const EVRARD: &str = "input: {expression: '1 / max(r, 1e-3)'}\ndomain: {ball: {center: [0, 0, 0], radius: 1}}\nthermal: {internal_energy: 1}\nkernel: wendland-c6\nneighbors: 295\n";

const PROBLEMS: &[Problem] = &[
    Problem {
        name: "constant",
        count: 10_000,
        scene: "input: {expression: '1'}\n",
        ways: BOXES,
        peers: &[
            peer("WVTICs, 41 iterations", 35.0, 9.6e-4, 1.4e-6),
            Peer { tool: "WVTICs, 513 iterations", seconds: None, mean: 5.4e-4, epsilon: 4.5e-7 },
        ],
    },
    Problem {
        name: "constant",
        count: 100_000,
        scene: "input: {expression: '1'}\n",
        ways: DEFAULT,
        peers: &[peer("WVTICs, 61 iterations", 463.0, 1.2e-3, 2.3e-6)],
    },
    Problem {
        name: "sine",
        count: 10_000,
        scene: "input: {expression: '1 + 0.5 * sin(tau * x)'}\n",
        ways: BOXES,
        peers: &[peer("WVTICs, 61 iterations", 54.0, 4.7e-2, 2.4e-3), peer("WVTICs (C2), 101", 28.0, 2.1e-2, 5.2e-4)],
    },
    Problem {
        name: "sine",
        count: 100_000,
        scene: "input: {expression: '1 + 0.5 * sin(tau * x)'}\n",
        ways: DEFAULT,
        peers: &[peer("WVTICs (C2), 61", 193.0, 1.0e-2, 1.5e-4)],
    },
    Problem {
        name: "top hat",
        count: 10_000,
        scene: "input: {expression: 'if(abs(x - 0.5) < 0.25, 2, 1)'}\n",
        ways: BOXES,
        peers: &[peer("WVTICs, 61", 81.0, 0.13, 2.5e-2)],
    },
    Problem {
        name: "Sod",
        count: 10_000,
        scene: "input: {expression: 'if(abs(x - 0.5) < 0.25, 1, 0.125)'}\n",
        ways: BOXES,
        peers: &[peer("WVTICs, 61", 150.0, 0.74, 0.58)],
    },
    Problem {
        name: "Evrard",
        count: 10_000,
        scene: EVRARD,
        ways: SPHERES,
        peers: &[peer("WVTICs, 61 (interior 0.29)", 53.0, 0.73, 0.21)],
    },
    Problem {
        name: "n = 1.5 polytrope",
        count: 10_000,
        scene: POLYTROPE,
        ways: SPHERES,
        peers: &[peer("WVTICs (C2), 101", 26.0, 2.4e-2, 1.6e-3), peer("SEAGen", 0.05, 1.1e-2, 1.5e-4)],
    },
    Problem {
        name: "n = 1.5 polytrope",
        count: 100_000,
        scene: POLYTROPE,
        ways: SPHERES,
        peers: &[
            Peer { tool: "WVTICs, 61", seconds: None, mean: 2.9e-2, epsilon: 1.2e-3 },
            peer("SEAGen", 0.14, 2.7e-3, 7.7e-6),
        ],
    },
    Problem {
        name: "n = 1.5 polytrope",
        count: 1_000_000,
        scene: POLYTROPE,
        ways: &[BARE_SHELLS],
        peers: &[peer("SEAGen", 1.1, 9.0e-4, 6.9e-7)],
    },
    Problem {
        name: "Earth-like, two layers",
        count: 100_000,
        scene: PLANET,
        ways: SPHERES,
        peers: &[peer("SEAGen", 0.24, 2.1e-3, 3.6e-6)],
    },
    Problem {
        name: "uniform sphere",
        count: 10_000,
        scene: SPHERE,
        ways: SPHERES,
        peers: &[peer("OpenSPH, 50", 1.4, 7e-3, 7e-5)],
    },
    Problem {
        name: "uniform sphere",
        count: 100_000,
        scene: SPHERE,
        ways: SPHERES,
        peers: &[peer("OpenSPH, 50", 29.0, 4e-3, 2e-5), peer("SEAGen", 0.14, 2.7e-4, 2.1e-7)],
    },
];

/// A row of ours; errors with the mass re-fitted.
struct Row {
    seconds: f64,
    /// Until the particles are in place.
    placing: f64,
    interior_mean: f64,
    interior_epsilon: f64,
    epsilon: f64,
}

fn solve(problem: &Problem, way: &str) -> Result<Row, String> {
    let mut text = format!("{}{way}particles: {}\n", problem.scene, problem.count);
    if !problem.scene.contains("domain") && !problem.scene.contains("file") {
        text += BOX;
    }
    if !problem.scene.contains("kernel") {
        text += C6;
    }
    let report = support::run(&Scene::parse(&text).map_err(|e| e.to_string())?)?;
    let after = |step: &str| ["measure", "write"].contains(&step);
    let placing = report.timing.iter().filter(|t| !after(t.step)).map(|t| t.seconds).sum();
    let inside = report.density_error.stated();
    Ok(Row {
        seconds: report.seconds,
        placing,
        interior_mean: inside.mean,
        interior_epsilon: inside.epsilon,
        epsilon: report.density_error.all_refitted.epsilon,
    })
}

fn main() {
    if let Err(problem) = rayon::ThreadPoolBuilder::new().num_threads(1).build_global() {
        support::fail(&problem.to_string());
    }
    let filter: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let mut table = String::from(
        "| problem | N | method | CPU s | placing | interior mean | interior epsilon | epsilon, whole |\n|---|---|---|---|---|---|---|---|\n",
    );
    let seconds = |s: Option<f64>| s.map_or("-".to_string(), |s| format!("{s:.2}"));
    for problem in PROBLEMS.iter().filter(|p| filter.is_empty() || filter.iter().any(|f| p.name.contains(f.as_str()))) {
        let start = table.len();
        for p in problem.peers {
            let (name, count, tool) = (problem.name, problem.count, p.tool);
            let _ = writeln!(
                table,
                "| {name} | {count} | {tool} | {} | | {:.1e} | | {:.1e} |",
                seconds(p.seconds),
                p.mean,
                p.epsilon
            );
        }
        for (way, keys) in problem.ways {
            let (name, count) = (problem.name, problem.count);
            let _ = match solve(problem, keys) {
                Ok(Row { seconds, placing, interior_mean, interior_epsilon, epsilon }) => writeln!(
                    table,
                    "| {name} | {count} | **sph-prep**, {way} | {seconds:.2} | {placing:.2} | {interior_mean:.1e} | {interior_epsilon:.1e} | {epsilon:.1e} |"
                ),
                Err(e) => writeln!(table, "| {name} | {count} | **sph-prep**, {way} | refused: {e} | | | | |"),
            };
        }
        print!("{}", &table[start..]);
    }
    let page = format!(
        "# Against other tools\n\n`SPH_PREP_RESULTS=docs/src/results cargo bench --bench peers` makes this page. Mass re-fitted. The other tools' means \
         are over the interior where the\nproblem has an edge, and their epsilons as stated by whoever measured them, by an independent sum. Ours run on one \
         thread: seconds of the whole\nrun, which measures and writes, and of it those until the particles are in place.\n\n{table}"
    );
    support::write_page("peers.md", &page);
}
