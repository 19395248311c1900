//! Runs the methods of a comparison one after the other.

use super::comparison::{Comparison, MethodRun, MethodSheet, Omitted, State, Step};
use super::methods::{Compared, Variation};
#[cfg(feature = "plots")]
use super::picture::portrait;
use crate::error::{Error, Result};
use crate::input::ingest;
use crate::input::internal_units::Prepared;
use crate::metrics::Outcome;
use crate::relaxation::{BALANCE, Control, StageReport, TRIMMING};
use crate::run::plan::{Held, Plan};
use crate::run::stages::{self, Placed, Setting};
use crate::scene::Scene;
use crate::target::Positions;
use sph_formats::FormatSpec;
use std::time::{Duration, Instant};

/// What is compared.
pub struct Request<'a> {
    pub scene: &'a Scene,
    pub methods: &'a [Compared],
    pub counts: &'a [usize],
}

/// Numbers of particles where neither who asks nor the scene has one.
const COUNTS: [usize; 2] = [1000, 10_000];

/// The numbers of particles to compare with: those `given`, else the scene's, else 1000 and 10000; in order.
///
/// # Errors
/// A number that is named twice, or 0.
pub fn numbers(scene: &Scene, given: &[usize]) -> Result<Vec<usize>> {
    let own = || scene.particles.map_or_else(|| COUNTS.to_vec(), |n| vec![n]);
    let mut counts = if given.is_empty() { own() } else { given.to_vec() };
    counts.sort_unstable();
    if let Some(twice) = counts.windows(2).find(|w| w[0] == w[1]) {
        return Err(Error::scene("particles", format!("has {} twice; name each number once", twice[0])));
    }
    if counts.first() == Some(&0) {
        return Err(Error::scene("particles", "is 0, expected at least 1"));
    }
    Ok(counts)
}

/// Refuses scenes that cannot be compared: comparisons are of one body of gas.
///
/// # Errors
/// The key that makes it another one.
pub fn check(scene: &Scene) -> Result<()> {
    if !scene.bodies.is_empty() {
        return Err(Error::scene("bodies", "cannot be compared all at once; compare the scene of one of them"));
    }
    for (key, is_given) in [("gravity_of", !scene.gravity_of.is_empty()), ("dust", scene.dust.is_some())] {
        if is_given {
            return Err(Error::scene(key, "is not part of a comparison; leave it out"));
        }
    }
    Ok(())
}

/// Runs all methods.
///
/// # Errors
/// An input that cannot be used, an interrupt, or that no method can run on the scene.
pub fn compare(request: &Request<'_>, formats: &[FormatSpec], control: &Control<'_>) -> Result<Comparison> {
    check(request.scene)?;
    request.scene.validate()?;
    if request.methods.is_empty() || request.counts.is_empty() {
        return Err(Error::scene("methods", "is empty; name at least one method and one number of particles"));
    }
    let raw = ingest::read(request.scene, formats)?;
    match ingest::dimension(request.scene, &raw)? {
        1 => in_dimension::<1>(request, formats, control),
        2 => in_dimension::<2>(request, formats, control),
        _ => in_dimension::<3>(request, formats, control),
    }
}

fn in_dimension<const D: usize>(
    request: &Request<'_>,
    formats: &[FormatSpec],
    control: &Control<'_>,
) -> Result<Comparison> {
    let scene = request.scene;
    let mut out = Comparison {
        version: env!("CARGO_PKG_VERSION"),
        input: scene.input_name(),
        dimension: D,
        seed: scene.seed,
        kernel: scene.kernel().title(),
        kernel_neighbors: scene.kernel_neighbors(D),
        methods: request.methods.iter().map(sheet).collect(),
        runs: Vec::new(),
        left_out: Vec::new(),
        notes: Vec::new(),
    };
    let mut refusal = None;
    // Pictures are of the most particles.
    let is_shown = |count: usize| request.counts.iter().all(|other| *other <= count);
    for &count in request.counts {
        // The cut of the atmosphere depends on the number, so that each starts from the file.
        let prepared = Prepared::<D>::read(scene, formats, count)?;
        let fresh: Vec<String> = prepared.notes.iter().filter(|n| !out.notes.contains(n)).cloned().collect();
        out.notes.extend(fresh);
        for method in request.methods {
            let own = method.apply(scene);
            let other = if own.has_own_resolution() == scene.has_own_resolution() {
                None
            } else {
                Some(Prepared::<D>::read(&own, formats, count)?)
            };
            let prepared = other.as_ref().unwrap_or(&prepared);
            match run_method(method, scene, (prepared, out.kernel_neighbors), is_shown(count), control) {
                Ok(run) => out.runs.push(run),
                Err(error @ (Error::Scene { .. } | Error::Numeric { .. } | Error::Field { .. })) => {
                    out.left_out.push(Omitted { method: method.name(), particles: count, why: error.to_string() });
                    refusal = Some(error);
                }
                Err(error) => return Err(error),
            }
        }
    }
    match refusal {
        Some(error) if out.runs.is_empty() => Err(error),
        _ => Ok(out),
    }
}

fn sheet(method: &Compared) -> MethodSheet {
    let Variation { summary, reference, .. } = method.variation;
    match method.seeding {
        None => MethodSheet { name: method.name(), summary: (*summary).into(), reference: (*reference).into() },
        Some(seeding) => {
            let seed = seeding.method();
            MethodSheet {
                name: method.name(),
                summary: format!("{summary}; {}: {}", seed.stage, seed.summary),
                reference: format!("{reference}; {}", seed.reference),
            }
        }
    }
}

fn run_method<const D: usize>(
    method: &Compared,
    scene: &Scene,
    (prepared, neighbors): (&Prepared<D>, f64),
    is_shown: bool,
    control: &Control<'_>,
) -> Result<MethodRun> {
    #[cfg(not(feature = "plots"))]
    let _ = is_shown;
    let scene = method.apply(scene);
    scene.validate()?;
    let regions = prepared.target().find_regions(scene.region_contrast);
    let target = prepared.target().with_regions(regions.as_ref());
    let mut plan = Plan::new(&scene, &target, prepared.source.radial.is_some(), &Held::Not);
    // Each method has the scene's whole time; states are measured afterwards, so that measuring takes none of it.
    let limit = scene.time_limit.and_then(|s| Instant::now().checked_add(Duration::try_from_secs_f64(s).ok()?));
    let control = Control { deadline: limit.or(control.deadline), ..*control };
    let mut seen: Vec<(&'static str, Positions<D>)> = Vec::new();
    // Methods are compared by density: what comes after it is for one run.
    plan.stages.retain(|stage| *stage != BALANCE && *stage != TRIMMING);
    let setting = Setting::new(&scene, target, None, &control);
    let Placed { stages, timing, stop, .. } = stages::place_watched(&setting, &mut plan, &mut |stage, positions| {
        seen.push((stage, positions.clone()));
    })?;
    let seed_seconds = timing.first().map_or(0.0, |t| t.seconds);
    let (steps, ends) = steps(&stages, seed_seconds);
    let mut states = Vec::with_capacity(seen.len());
    #[cfg(feature = "plots")]
    let mut shown = None;
    for (stage, positions) in &seen {
        let target = target.with_count(positions[0].len());
        let particles = (positions, target.masses(positions));
        let by = (&target, setting.ledger());
        #[cfg(feature = "plots")]
        let outcome = if is_shown && states.len() + 1 == seen.len() {
            let (outcome, detail) = Outcome::with_detail(scene.kernel(), by, particles, neighbors, None);
            shown = Some(portrait(&scene, prepared, &target, positions, (&outcome, detail)));
            outcome
        } else {
            Outcome::new(scene.kernel(), by, particles, neighbors, None)
        };
        #[cfg(not(feature = "plots"))]
        let outcome = Outcome::new(scene.kernel(), by, particles, neighbors, None);
        let seconds = ends.iter().rev().find(|(name, _)| name == stage).map_or(seed_seconds, |(_, s)| *s);
        let Outcome { density_error, ledger, noise, neighbors, .. } = outcome;
        let in_place = ledger.in_place;
        states.push(State { stage, particles: target.count, seconds, density_error, in_place, noise, neighbors });
    }
    Ok(MethodRun {
        method: method.name(),
        particles: target.count,
        stop,
        seconds: ends.last().map_or(seed_seconds, |(_, s)| *s),
        steps,
        states,
        #[cfg(feature = "plots")]
        portrait: shown,
    })
}

/// The histories behind each other, and the time at which each stage ended.
fn steps(stages: &[StageReport], seed_seconds: f64) -> (Vec<Step>, Vec<(&'static str, f64)>) {
    let mut start = seed_seconds;
    let (mut steps, mut ends) = (Vec::new(), Vec::new());
    for report in stages {
        steps.extend(report.history.iter().map(|p| Step {
            stage: report.stage.name,
            step: p.iteration,
            seconds: start + p.seconds,
            epsilon: p.epsilon,
        }));
        start += report.seconds;
        ends.push((report.stage.name, start));
    }
    (steps, ends)
}
