//! The stiff-and-extreme suite: every scene in every dimension by every method gives exactly N finite particles
//! inside the domain with the mass of the target and none of them paired, no worse than the seed that it began
//! with, or is refused with a reason. Nothing panics.
//!
//! `cargo test --test all extreme::` is the short form; `cargo test --release --test all -- --ignored --nocapture extreme::`
//! the full one, which prints tables and writes them as Markdown into the folder that SPH_PREP_RESULTS names.

mod harness;
mod health;
mod scenes;
mod starts;
mod table;

use crate::cases::first;
use harness::{Case, Placed, Verdict, run};
use scenes::{Expected, Scene};
use sph_prep::seeding::{METHODS, Method, Seeding, Targets};
use table::{Row, Table};

/// Methods that relax; each starts from the bisection seed.
const RELAXING: [&str; 3] = ["default", "wvt", "alaric"];

/// Closest pair over spacing below which relaxed particles count as paired. A lattice has 1, a random set of a
/// thousand 0.05.
const PAIRED: f64 = 0.1;

/// A stage watches epsilon at the target's support radii and with mirrors at the surface, the measure has its own
/// radii and vacuum there: what one lowers slightly the other may raise slightly.
const RISE: f64 = 1.2;

/// What relaxation did that it must not do.
fn harm(placed: &Placed, seeded: Option<&Placed>) -> Vec<String> {
    let mut wrong = Vec::new();
    let paired = |p: &Placed| p.report.particles > 3 && p.closest() < PAIRED;
    if paired(placed) {
        let before = seeded.map_or(f64::NAN, |s| s.closest());
        wrong.push(format!("closest pair {:.3}, seed {before:.3}", placed.closest()));
    }
    let rises: Vec<(f64, f64)> = seeded.map_or_else(Vec::new, |s| placed.epsilons(s));
    // Particles at surfaces and jumps can have no other density; those inside may. Where there are none of these,
    // only what the vacuum beyond a surface does is compared, which stages do not see.
    if rises.len() > 1 && rises.iter().all(|(before, after)| *after > RISE * before) {
        let (before, after) = rises[0];
        wrong.push(format!("epsilon rose from {before:.2e} to {after:.2e}"));
    }
    wrong
}

/// Runs the methods on one case and says what is wrong; rows go into the table.
fn check(case: &Case, expected: Expected, methods: &[&str], count: usize, table: &mut Table) {
    let mut seeded: Option<Box<Placed>> = None;
    for method in ["seed"].iter().chain(methods) {
        let verdict = run(case, method, count);
        let mut wrong = Vec::new();
        if let Verdict::Placed(placed, faults) = &verdict {
            wrong.extend(faults.iter().cloned());
            if *method != "seed" && expected != Expected::Unresolved {
                wrong.extend(harm(placed, seeded.as_deref()));
            }
        }
        match &verdict {
            Verdict::Panicked(text) => wrong.push(format!("panicked: {text}")),
            Verdict::Refused(text) if expected != Expected::Refused => wrong.push(format!("refused: {text}")),
            Verdict::Refused(_) => {}
            Verdict::Placed(..) if expected == Expected::Refused => wrong.push("was not refused".into()),
            Verdict::Placed(..) => {}
        }
        table.push(Row::new(case, method, count, &verdict, wrong));
        if let ("seed", Verdict::Placed(placed, _)) = (*method, verdict) {
            seeded = Some(placed);
        }
    }
}

fn scenes_in(dimension: usize, methods: &[&str], count: usize) -> Table {
    let mut table = Table::default();
    for scene in scenes::all().iter().filter(|s| s.dimensions.contains(&dimension)) {
        check(&scene.in_dimension(dimension), scene.expected(dimension, count), methods, count, &mut table);
    }
    table
}

#[test]
fn scenes_in_1_d() {
    scenes_in(1, &RELAXING, 100).finish("scenes in 1-D");
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn scenes_in_2_d() {
    scenes_in(2, &["default", "alaric"], 120).finish("scenes in 2-D");
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn scenes_in_3_d() {
    scenes_in(3, &["default"], 400).finish("scenes in 3-D");
}

#[test]
fn grids() {
    let mut table = Table::default();
    for (case, expected) in scenes::grids() {
        check(&case, expected, &["default"], 150, &mut table);
    }
    table.finish("grids");
}

/// Whether a seed can show a scene, all of which are radial in a ball or depend on x alone: its data sheet says so.
fn admits(method: &Method, scene: &Scene, dimension: usize) -> bool {
    method.dimensions.contains(&dimension)
        && match method.targets {
            Targets::Any | Targets::Symmetric => true,
            Targets::Radial => scene.is_in_a_ball(),
            Targets::Massive => !scene.has_holes(),
        }
}

/// Glasses take long to make, and are the same for all scenes of a dimension: what differs is how they are stretched.
const FOR_GLASSES: [&str; 3] = ["contrast 1e2", "shock tube 8:1", "hole"];

fn is_glass(method: &Method) -> bool {
    matches!(method.seeding, Seeding::Glass | Seeding::GravitationalGlass)
}

/// Every seed on scenes that many of them admit, and on some that few do: it places where it can, and refuses the rest.
fn seeds_on(dimension: usize, count: usize) -> Table {
    let mut table = Table::default();
    for name in
        ["contrast 1e2", "stellar wind 1e6", "two-layer planet", "shock tube 8:1", "hole", "needle 1000:1", "shell"]
    {
        let scenes = scenes::all();
        let Some(scene) = scenes.iter().find(|s| s.case.name == name && s.dimensions.contains(&dimension)) else {
            continue;
        };
        for method in METHODS.iter().filter(|m| !is_glass(m) || FOR_GLASSES.contains(&name)) {
            let name = format!("seed:{}", method.name);
            let verdict = run(&scene.in_dimension(dimension), &name, count);
            let wrong = match &verdict {
                Verdict::Placed(_, faults) if admits(method, scene, dimension) => faults.clone(),
                Verdict::Placed(..) => vec!["was not refused".into()],
                Verdict::Refused(text) if admits(method, scene, dimension) => vec![format!("refused: {text}")],
                Verdict::Refused(text) if !text.contains("mass-bisection") => vec!["names no other seed".into()],
                Verdict::Refused(_) => Vec::new(),
                Verdict::Panicked(text) => vec![format!("panicked: {text}")],
            };
            table.push(Row::new(&scene.in_dimension(dimension), &name, count, &verdict, wrong));
        }
    }
    table
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn every_seed_places_what_it_can_show_and_refuses_the_rest() {
    (1..=3).for_each(|d| seeds_on(d, 100).finish(&format!("seeds in {d}-D")));
}

/// N from 1, neighbor numbers, and options off by a thousand either way.
fn ends(counts: &[usize]) -> Table {
    let mut table = Table::default();
    let box3 = "input: {expression: '2 + sin(2*pi*x)'}\ndomain: {box: [[0,0,0],[1,1,1]], boundary: [periodic]}";
    for &count in counts {
        for (d, b) in [(1, "[[0],[1]]"), (2, "[[0,0],[1,1]]"), (3, "[[0,0,0],[1,1,1]]")] {
            let yaml = format!("input: {{expression: '1 + x'}}\ndomain: {{box: {b}, boundary: [reflecting]}}");
            check(&Case::new(&format!("slope {d}-D"), yaml), Expected::Placed, &["default"], count, &mut table);
        }
    }
    for neighbors in first(3, [8, 27, 128, 400]) {
        let case = Case::new(&format!("{neighbors} neighbors"), format!("{box3}\nneighbors: {neighbors}"));
        // In 3-D Wendland C4 counts 20.6 at the particle's own place: fewer neighbors do not exist.
        let expected = if neighbors < 21 { Expected::Refused } else { Expected::Placed };
        check(&case, expected, &["default", "wvt"], 400, &mut table);
    }
    let box2 = box3.replace("[[0,0,0],[1,1,1]]", "[[0,0],[1,1]]");
    for option in [
        "alaric: {friction: 4e-3, steps: 60}",
        "alaric: {friction: 4e3, steps: 60}",
        "alaric: {courant: 3e-4, steps: 60}",
        "alaric: {courant: 300, steps: 60}",
        "alaric: {growth: 100, steps: 60}",
        "alaric: {growth: 1e-4, steps: 60}",
        "alaric: {rate_tolerance: 1e-11, steps: 60}",
        "alaric: {rate_tolerance: 1e-5, steps: 60}",
    ] {
        check(&Case::new(option, format!("{box2}\n{option}")), Expected::Placed, &["alaric"], 300, &mut table);
    }
    for option in
        ["wvt: {step: 4e-4}", "wvt: {step: 400}", "wvt: {final_step: 1e-3}", "tolerance: 1e-12", "tolerance: 10"]
    {
        check(&Case::new(option, format!("{box2}\n{option}")), Expected::Placed, &["default", "wvt"], 300, &mut table);
    }
    table
}

#[test]
fn few_particles_many_neighbors_and_options_far_off() {
    ends(&first(3, [1, 3, 30, 2, 400]).collect::<Vec<_>>()).finish("ends");
}

/// Lengths and densities scaled by powers of two give the same bits; other units the same to rounding, which the
/// relaxation makes grow.
#[test]
fn units_do_not_matter() {
    let star = |length: f64, density: f64, d: usize| {
        let center = vec!["0"; d].join(",");
        Case::new(
            &format!("star in units of {length:e} and {density:e}"),
            format!(
                "input: {{expression: '{density:e}*(1.001 - r/{length:e})^2'}}\n\
                 domain: {{ball: {{center: [{center}], radius: {length:e}}}}}\noutput: {{units: code}}"
            ),
        )
    };
    let positions = |case: &Case, method: &str| match run(case, method, 150) {
        Verdict::Placed(p, faults) if faults.is_empty() => {
            p.positions.iter().map(|x| x / p.box_size).collect::<Vec<_>>()
        }
        _ => panic!("{} by {method} was not placed", case.name),
    };
    for d in 1..=3 {
        for method in ["default", "alaric"] {
            let unit = positions(&star(1.0, 1.0, d), method);
            for (length, density) in [(2f64.powi(37), 2f64.powi(-20)), (2f64.powi(-90), 2f64.powi(150))] {
                let case = star(length, density, d);
                assert!(positions(&case, method) == unit, "{} in {d}-D by {method} differs", case.name);
            }
        }
        // A star in cm and g/cm^3, a planet in earth radii: few iterations, so that rounding stays rounding.
        let seed = positions(&star(1.0, 1.0, d), "seed");
        for (length, density) in [(7e10, 1.4), (0.3, 5500.0), (1e-40, 1e-100)] {
            let other = positions(&star(length, density, d), "seed");
            let worst = seed.iter().zip(&other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-9, "{worst:e} in units of {length:e} and {density:e}, {d}-D");
        }
    }
}

/// Starts that no seed makes, in every dimension.
#[test]
fn bad_starts() {
    let results = [starts::all::<1>(60), starts::all::<2>(120), starts::all::<3>(250)];
    println!("\n| start | stage | epsilon first | last | closest pair | stop |\n|---|---|---|---|---|---|");
    results.iter().for_each(|(rows, _)| print!("{rows}"));
    let wrong: Vec<&String> = results.iter().flat_map(|(_, wrong)| wrong).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Numerical health alone.
#[test]
#[ignore = "long: a minute or two"]
fn numerical_health() {
    let (page, wrong) = health::report();
    println!("{page}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Everything at size, with numerical health, as a page.
#[test]
#[ignore = "long: every scene by every method, up to a million particles"]
fn the_whole_suite() {
    let mut page = String::from(
        "# Stiff and extreme suite\n\nMade by `SPH_PREP_RESULTS=docs/src/results cargo test --release --test all -- --ignored \\\n\
         --nocapture extreme::`. epsilon, mean and max are over the interior with the mass re-fitted, or over all particles where less\n\
         than a tenth are inside; closest pair is in spacings n^(-1/d); noise is a fraction of random points'.\n",
    );
    let mut wrong = Vec::new();
    let mut add = |title: &str, table: &Table| {
        page += &format!("\n## {title}\n\n{}", table.markdown());
        wrong.extend(table.wrong());
    };
    for (d, count) in [(1, 1000), (2, 3000), (3, 5000)] {
        add(&format!("Scenes in {d}-D"), &scenes_in(d, &RELAXING, count));
        add(&format!("Seeding in {d}-D"), &seeds_on(d, count));
    }
    add("N, neighbors and options", &ends(&[1, 2, 3, 10, 100, 1000, 10_000, 100_000, 1_000_000]));
    let (health, unhealthy) = health::report();
    page += &health;
    wrong.extend(unhealthy);
    println!("{page}");
    if let Some(folder) = std::env::var_os("SPH_PREP_RESULTS") {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("extreme.md"), format!("{page}\n{}", crate::made::line())).unwrap();
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
