//! Random scenes: expressions and tables, domains, boundaries, numbers of particles, units and methods by chance. Whatever
//! comes out is held to what the test knows of the scene by a quadrature of its own: the mass and where it lies, sums over
//! particles, pairs, no worse than the seeds, and no panic.
//!
//! A failure prints the number of the scene, which makes it again: `SPH_PREP_SCENES=17 cargo test --release --test all --
//! --ignored --nocapture random::`, or a range as `200..5200`; its files are kept then, in a folder that is printed.

mod check;
mod density;
mod domain;
mod draw;
mod quadrature;
mod scene;
mod solid;

use check::{Outcome, judge};
use scene::Drawn;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// Judges scenes, as many at once as there are processors, and says what went wrong.
fn check(scenes: &[Drawn], with_clock: bool) {
    let next = AtomicUsize::new(0);
    let found: Mutex<BTreeMap<u64, Outcome>> = Mutex::new(BTreeMap::new());
    let workers = std::thread::available_parallelism().map_or(1, |n| n.get());
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some(drawn) = scenes.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let outcome = judge(drawn, with_clock);
                    found.lock().unwrap().insert(drawn.number, outcome);
                }
            });
        }
    });
    let found = found.into_inner().unwrap();
    report(scenes, &found);
}

/// Prints what was refused and what took longest, and fails with what went wrong.
fn report(scenes: &[Drawn], found: &BTreeMap<u64, Outcome>) {
    let mut refusals: BTreeMap<String, usize> = BTreeMap::new();
    for refusal in found.values().filter_map(|outcome| outcome.refusal.as_ref()) {
        *refusals.entry(refusal.chars().take(60).collect()).or_default() += 1;
    }
    refusals.iter().for_each(|(refusal, number)| println!("{number} times: {refusal}"));
    let longest = found.iter().max_by_key(|(_, outcome)| outcome.time);
    let total: Duration = found.values().map(|outcome| outcome.time).sum();
    if let Some((number, outcome)) = longest {
        let seconds = [total, outcome.time].map(|t| t.as_secs_f64());
        println!("{} scenes in {:.1} s; scene {number} took {:.1} s", found.len(), seconds[0], seconds[1]);
    }
    let wrong: Vec<String> = scenes
        .iter()
        .filter_map(|drawn| {
            let outcome = &found[&drawn.number];
            let faults = outcome.faults.join("\n");
            (!outcome.faults.is_empty()).then(|| format!("{}{faults}\n", drawn.yaml("FOLDER")))
        })
        .collect();
    assert!(wrong.is_empty(), "{} of {} scenes went wrong:\n{}", wrong.len(), found.len(), wrong.join("\n"));
}

/// Scenes in the short form: those whose masses are found in no time. So many every time, and so many before a release.
const FEW: usize = 20;
const MORE: usize = 600;

/// The quick ones of these numbers, counted as such.
fn quick(numbers: Range<usize>) -> Vec<Drawn> {
    let quick = (0..).map(Drawn::new).filter(Drawn::is_quick);
    quick.skip(numbers.start).take(numbers.len()).collect()
}

#[test]
fn random_scenes_are_what_they_should_be() {
    check(&quick(0..FEW), false);
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn more_random_scenes_are_what_they_should_be() {
    check(&quick(FEW..MORE), false);
}

/// Two particles at a cusp, 1e-7 of the others' spacing apart: single precision resolves that to a thousandth.
#[test]
fn densities_at_a_cusp_are_those_of_its_particles() {
    check(&[763, 1709].map(Drawn::new), false);
}

/// The scenes that `SPH_PREP_SCENES` names, or as many as are worth a night.
#[test]
#[ignore = "long: hours for all of them"]
fn many_random_scenes_are_what_they_should_be() {
    let range = named_scenes(0..5000);
    check(&range.map(Drawn::new).collect::<Vec<_>>(), true);
}

/// Whether single scenes are asked for.
fn are_named() -> bool {
    std::env::var_os("SPH_PREP_SCENES").is_some()
}

/// The scenes that `SPH_PREP_SCENES` names, as a number or a range, or else all.
pub fn named_scenes(all: Range<u64>) -> Range<u64> {
    let Ok(named) = std::env::var("SPH_PREP_SCENES") else { return all };
    let number = |text: &str| text.trim().parse::<u64>().expect("SPH_PREP_SCENES is a number or a range as 0..5000");
    match named.split_once("..") {
        Some((from, to)) => number(from)..number(to),
        None => number(&named)..number(&named) + 1,
    }
}
