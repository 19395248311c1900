//! The same scene through several methods at several numbers of particles: error, noise and time of each.
//!
//! Every iteration gives the epsilon that its stage watches; the states that the seed and each stage leave are
//! measured as a run's result is. Times are those of seeding and relaxing, without the measuring.

mod figures;
mod html;
mod methods;
mod plots;
mod table;

pub use methods::{Compared, DEFAULT, VARIATIONS, Variation};
pub use table::{CSV_COLUMNS, csv};

use crate::error::{Error, Result};
use crate::input::ingest;
use crate::input::internal_units::Prepared;
use crate::metrics::{DensityError, NeighborFigures, NoiseFigures, Outcome};
use crate::relaxation::{BALANCE, Control, StageReport, StopReason, TRIMMING};
use crate::run::plan::Plan;
use crate::run::stages::{self, Placed, Setting};
use crate::scene::Scene;
use crate::target::{Positions, Target, at};
use serde::Serialize;
use sph::domain::Region;
use sph_formats::{FormatError, FormatSpec};
use std::path::Path;
use std::time::{Duration, Instant};

/// What is compared.
pub struct Request<'a> {
    pub scene: &'a Scene,
    pub methods: &'a [Compared],
    pub counts: &'a [usize],
}

/// Everything that a comparison says.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    pub version: &'static str,
    pub input: String,
    pub dimension: usize,
    pub seed: u64,
    pub kernel: &'static str,
    pub kernel_neighbors: f64,
    pub methods: Vec<MethodSheet>,
    pub runs: Vec<MethodRun>,
    /// Methods that this scene does not admit.
    pub left_out: Vec<Omitted>,
    pub notes: Vec<String>,
}

/// What a method is.
#[derive(Debug, Clone, Serialize)]
pub struct MethodSheet {
    pub name: String,
    pub summary: String,
    pub reference: String,
}

/// A method that could not run, and why.
#[derive(Debug, Clone, Serialize)]
pub struct Omitted {
    pub method: String,
    pub particles: usize,
    pub why: String,
}

/// One method at one number of particles.
#[derive(Debug, Clone, Serialize)]
pub struct MethodRun {
    pub method: String,
    pub particles: usize,
    pub stop: StopReason,
    /// Seconds of seeding and relaxing.
    pub seconds: f64,
    pub steps: Vec<Step>,
    pub states: Vec<State>,
    /// Particles for the pictures: too many for the JSON, which is for numbers.
    #[serde(skip)]
    picture: Vec<Sample>,
    /// Whether the density is shown against the radius.
    #[serde(skip)]
    radial: bool,
    /// The factor on the mass of [`State::shown_error`].
    #[serde(skip)]
    refit: f64,
}

impl MethodRun {
    /// The result.
    pub fn last(&self) -> Option<&State> {
        self.states.last()
    }
}

/// One iteration of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Step {
    pub stage: &'static str,
    pub step: usize,
    /// Since the seeding began.
    pub seconds: f64,
    /// epsilon as the stage watches it: mass re-fitted, at the target's own support radii, over the interior.
    pub epsilon: f64,
}

/// What the seed or a stage left, measured.
#[derive(Debug, Clone, Serialize)]
pub struct State {
    pub stage: &'static str,
    /// Fewer than the run's where splitting follows.
    pub particles: usize,
    /// Since the seeding began.
    pub seconds: f64,
    pub density_error: DensityError,
    pub noise: NoiseFigures,
    pub neighbors: NeighborFigures,
}

/// A particle of the result in units of the input.
#[derive(Debug, Clone, Copy)]
struct Sample {
    x: [f64; 3],
    /// Distance from the domain's center.
    r: f64,
    spacing: f64,
    density: f64,
    wanted: f64,
}

/// Runs all methods.
///
/// # Errors
/// An input that cannot be used, an interrupt, or that no method can run on the scene.
pub fn compare(request: &Request<'_>, formats: &[FormatSpec], control: &Control<'_>) -> Result<Comparison> {
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
        kernel: scene.kernel.title(),
        kernel_neighbors: scene.kernel_neighbors(D),
        methods: request.methods.iter().map(sheet).collect(),
        runs: Vec::new(),
        left_out: Vec::new(),
        notes: Vec::new(),
    };
    let mut refusal = None;
    for &count in request.counts {
        // The cut of the atmosphere depends on the number, so that each starts from the file.
        let prepared = Prepared::<D>::new(scene, formats, ingest::read(scene, formats)?, count)?;
        let fresh: Vec<String> = prepared.notes.iter().filter(|n| !out.notes.contains(n)).cloned().collect();
        out.notes.extend(fresh);
        for method in request.methods {
            let own = method.apply(scene);
            let other = if own.has_own_resolution() == scene.has_own_resolution() {
                None
            } else {
                Some(Prepared::<D>::new(&own, formats, ingest::read(&own, formats)?, count)?)
            };
            match run_method(method, scene, other.as_ref().unwrap_or(&prepared), out.kernel_neighbors, control) {
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
    prepared: &Prepared<D>,
    neighbors: f64,
    control: &Control<'_>,
) -> Result<MethodRun> {
    let scene = method.apply(scene);
    scene.validate()?;
    let target = prepared.target();
    let mut plan = Plan::new(&scene, &target, prepared.source.radial.is_some());
    // Each method has the scene's whole time; states are measured afterwards, so that measuring takes none of it.
    let limit = scene.time_limit.and_then(|s| Instant::now().checked_add(Duration::try_from_secs_f64(s).ok()?));
    let control = Control { deadline: limit.or(control.deadline), ..*control };
    let mut seen: Vec<(&'static str, Positions<D>)> = Vec::new();
    // Methods are compared by density: what comes after it is for one run.
    plan.stages.retain(|stage| *stage != BALANCE && *stage != TRIMMING);
    let setting = Setting { scene: &scene, target, equilibrium: None, control: &control };
    let Placed { stages, timing, stop, .. } = stages::place_watched(&setting, &mut plan, &mut |stage, positions| {
        seen.push((stage, positions.clone()));
    })?;
    let seed_seconds = timing.first().map_or(0.0, |t| t.seconds);
    let (steps, ends) = steps(&stages, seed_seconds);
    let mut states = Vec::with_capacity(seen.len());
    let mut picture = Vec::new();
    let last = seen.len().saturating_sub(1);
    for (i, (stage, positions)) in seen.iter().enumerate() {
        let target = target.with_count(positions[0].len());
        let outcome = Outcome::new(scene.kernel, &target, positions, target.masses(positions), neighbors, None);
        if i == last {
            picture = samples(prepared, &target, positions, &outcome);
        }
        let seconds = ends.iter().rev().find(|(name, _)| name == stage).map_or(seed_seconds, |(_, s)| *s);
        let Outcome { density_error, noise, neighbors, .. } = outcome;
        states.push(State { stage, particles: target.count, seconds, density_error, noise, neighbors });
    }
    let refit = states.last().map_or(1.0, State::shown_refit);
    Ok(MethodRun {
        refit,
        method: method.name(),
        particles: target.count,
        stop,
        seconds: ends.last().map_or(seed_seconds, |(_, s)| *s),
        steps,
        states,
        picture,
        radial: prepared.source.radial.is_some() || !matches!(target.domain.region, Region::Box),
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

/// The result in the input's units.
fn samples<const D: usize>(
    prepared: &Prepared<D>,
    target: &Target<'_, D>,
    positions: &Positions<D>,
    outcome: &Outcome,
) -> Vec<Sample> {
    let center = prepared.source.center();
    let density = prepared.mass.value / prepared.length.powi(D as i32);
    (0..outcome.density.len())
        .map(|i| {
            let x = at(positions, i);
            let offset: [f64; D] = std::array::from_fn(|k| x[k] - center[k]);
            Sample {
                x: std::array::from_fn(|k| if k < D { x[k] * prepared.length } else { 0.0 }),
                r: offset.iter().map(|v| v * v).sum::<f64>().sqrt() * prepared.length,
                spacing: target.spacing(target.number_density(&x)) * prepared.length,
                density: outcome.density[i] * density,
                wanted: outcome.target_density[i] * density,
            }
        })
        .collect()
}

/// The files of a comparison; the last two are figures of the page for the most particles, to show elsewhere: the
/// first one, and the density of the last method.
pub const FILES: [&str; 5] =
    ["compare.csv", "compare.json", "report.html", "error-against-time.svg", "density-profile.svg"];

/// Whether the files could be written; makes the folder. Asked before a long comparison.
///
/// # Errors
/// [`FormatError::Io`].
pub fn probe(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| FormatError::io(folder, "create the folder", e))?;
    FILES.iter().try_for_each(|name| Ok(sph_formats::output::probe(&folder.join(name))?))
}

/// Writes the files, each whole or not at all.
///
/// # Errors
/// [`FormatError::Io`], or a plot that cannot be drawn.
pub fn write(comparison: &Comparison, folder: &Path) -> Result<()> {
    let most = comparison.counts().last().copied().unwrap_or(0);
    let figure = figures::error_against_time(comparison, most).svg()?;
    let last = comparison.runs.iter().rfind(|r| r.particles == most);
    let profile = last.map_or(Ok(String::new()), |run| figures::profile(run).svg())?;
    let texts = [csv(comparison), json(comparison)?, html::page(comparison)?, figure, profile];
    for (name, text) in FILES.iter().zip(texts) {
        sph_formats::output::atomically(&folder.join(name), |path| {
            std::fs::write(path, text).map_err(|e| FormatError::io(path, "write", e))
        })?;
    }
    Ok(())
}

/// As JSON.
///
/// # Errors
/// A figure that JSON cannot hold.
pub fn json(comparison: &Comparison) -> Result<String> {
    serde_json::to_string_pretty(comparison)
        .map(|text| text + "\n")
        .map_err(|e| Error::Numeric { stage: "report", problem: e.to_string() })
}
