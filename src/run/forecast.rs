//! The forecast of a run that is not carried out: its stages with the expected time and memory of each.
//!
//! The times of stages are those of [`duration`](super::duration), times how much slower this machine is, now, than the one whose
//! figures those are: the densities of a few thousand particles are summed for a fifth of a second.

use super::duration::{Expected, total};
use super::memory;
use super::plan::{LeftOut, Plan};
use crate::metrics::Measured;
use crate::seeding::Seeding;
use serde::Serialize;
use sph::domain::{Axis, Domain, Region};
use sph::kernel::KernelName;
use sph::sums::support_guess;
use std::fmt::Write;
use std::time::Instant;

/// A run that is planned.
#[derive(Debug, Clone, Serialize)]
pub struct Forecast {
    pub input: String,
    pub dimension: usize,
    pub particles: usize,
    /// Of the input within the domain, in the input's units.
    pub mass: f64,
    pub seeding: Seeding,
    pub stages: Vec<Foreseen>,
    pub left_out: Vec<LeftOut>,
    /// How many times slower this machine is than the one that the times of stages are from.
    pub slowness: f64,
    /// What reading and interpolating have taken, which is done.
    pub seconds_so_far: f64,
    /// Bytes that the machine has; none where it does not tell.
    pub memory: Option<f64>,
    /// Bytes that the run takes beside those of its stages.
    pub beside: f64,
    pub warnings: Vec<String>,
    pub notes: Vec<String>,
}

/// A stage with what it takes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Foreseen {
    pub stage: &'static str,
    /// At most; none where it is not known.
    pub seconds: Option<f64>,
    /// Bytes while it runs.
    pub memory: f64,
}

/// Runs of several bodies that are planned.
#[derive(Debug, Clone, Serialize)]
pub struct ForecastOfBodies {
    /// Without point masses.
    pub bodies: Vec<ForeseenBody>,
    /// What is planned for the medium about them.
    pub ambient: Option<ForeseenMedium>,
    pub notes: Vec<String>,
}

/// A medium with what is planned for it.
#[derive(Debug, Clone, Serialize)]
pub struct ForeseenMedium {
    /// As the scene has it.
    pub density: String,
    /// Its particles if it filled the bodies' places too; none where their spacing is that of the bodies, which are not placed yet.
    pub most: Option<usize>,
    /// For so many.
    pub forecast: Option<Forecast>,
}

/// A body with what is planned for it.
#[derive(Debug, Clone, Serialize)]
pub struct ForeseenBody {
    pub name: String,
    /// The body before it that it is a copy of.
    pub same_as: Option<String>,
    /// Whether it was placed before and kept.
    pub is_cached: bool,
    /// None where nothing is to be done.
    pub forecast: Option<Forecast>,
}

/// Particles whose densities are summed, and for how long: long enough to feel what else the machine does.
const SAMPLE: usize = 4000;
const SECONDS: f64 = 0.2;
const REPETITIONS: usize = 200;
/// Evaluations that the sums of a sample cost, in which radii are solved for.
const PASSES: f64 = 1.5;

impl Forecast {
    /// Stages of a plan with what they take.
    pub fn stages(plan: &Plan, expected: &[Expected], count: usize) -> Vec<Foreseen> {
        let of = |name: &'static str| expected.iter().find(|e| e.step == name).map(|e| e.seconds);
        let stage = |s: &crate::relaxation::StageName| Foreseen {
            stage: s.name,
            seconds: of(s.name),
            memory: memory::needed(count, std::slice::from_ref(s)),
        };
        plan.stages.iter().map(stage).collect()
    }

    /// As JSON.
    pub fn json(&self) -> String {
        json(self)
    }

    /// For people.
    pub fn text(&self) -> String {
        written(|out| {
            writeln!(out, "{NOTHING}")?;
            self.write_text(out)
        })
    }

    /// At most, of all stages whose time is known.
    fn seconds(&self) -> f64 {
        let known = |s: &Foreseen| Some(Expected { step: s.stage, seconds: s.seconds? });
        total(&self.stages.iter().filter_map(known).collect::<Vec<_>>())
    }

    /// Bytes of the stage that needs most.
    fn peak(&self) -> f64 {
        self.beside + self.stages.iter().map(|s| s.memory).fold(memory::needed(self.particles, &[]), f64::max)
    }

    fn write_text(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "  input            {}, read in {:.2} s", self.input, self.seconds_so_far)?;
        writeln!(
            out,
            "  particles        {} in {}-D, mass {:.6e} in the input's units",
            self.particles, self.dimension, self.mass
        )?;
        writeln!(out, "  seeding          {}", self.seeding.method().name)?;
        for Foreseen { stage, seconds, memory } in &self.stages {
            let time = seconds
                .map_or_else(|| "time not known".to_owned(), |s| format!("at most {}", super::duration::rounded(s)));
            writeln!(out, "  stage            {stage:<20} {time}, {:.2} GiB", memory / GIB)?;
        }
        write_all(out, self.seconds(), self.peak(), self.memory)?;
        writeln!(
            out,
            "  this machine     takes {:.1} times as long as the one that the estimates were measured on",
            self.slowness
        )?;
        for LeftOut { what, why } in &self.left_out {
            writeln!(out, "  left out         {what}: {why}")?;
        }
        self.warnings.iter().try_for_each(|w| writeln!(out, "  WARNING          {w}"))?;
        self.notes.iter().try_for_each(|n| writeln!(out, "  note             {n}"))
    }
}

impl ForecastOfBodies {
    /// As JSON.
    pub fn json(&self) -> String {
        json(self)
    }

    /// For people.
    pub fn text(&self) -> String {
        written(|out| self.write_text(out))
    }

    fn write_text(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "{NOTHING}")?;
        for body in &self.bodies {
            writeln!(out, "body {}", body.name)?;
            match (&body.forecast, &body.same_as) {
                (Some(forecast), _) => forecast.write_text(out)?,
                (None, Some(other)) => writeln!(out, "  a copy of body {other}")?,
                (None, None) => writeln!(out, "  was placed before, and is taken from the cache")?,
            }
        }
        if let Some(ForeseenMedium { density, most, forecast }) = &self.ambient {
            writeln!(out, "ambient")?;
            writeln!(out, "  density          {density}, in what bodies leave of the box")?;
            match most {
                Some(most) => writeln!(
                    out,
                    "  particles        at most {most}, of the bodies' mass; what follows is for so many"
                )?,
                None => writeln!(
                    out,
                    "  particles        as many as their spacing makes, which is known when the bodies are placed"
                )?,
            }
            forecast.iter().try_for_each(|f| f.write_text(out))?;
        }
        let of_medium = self.ambient.iter().filter_map(|m| m.forecast.as_ref());
        let all = || self.bodies.iter().filter_map(|b| b.forecast.as_ref()).chain(of_medium.clone());
        let what = if self.ambient.is_some() { "all bodies and the medium" } else { "all bodies" };
        writeln!(out, "{what}")?;
        // One after the other.
        let peak = all().map(Forecast::peak).fold(0.0, f64::max);
        write_all(out, all().map(Forecast::seconds).sum(), peak, all().find_map(|f| f.memory))?;
        self.notes.iter().try_for_each(|n| writeln!(out, "  note             {n}"))
    }
}

const GIB: f64 = (1_u64 << 30) as f64;
const NOTHING: &str = "dry run: nothing is placed, nothing is written";

pub(super) fn json(forecast: &impl Serialize) -> String {
    serde_json::to_string_pretty(forecast).map_or_else(|e| format!("{{\"error\": \"{e}\"}}\n"), |text| text + "\n")
}

fn written(write: impl FnOnce(&mut String) -> std::fmt::Result) -> String {
    let mut out = String::new();
    write(&mut out).expect("writing to a string cannot fail");
    out
}

fn write_all(out: &mut String, seconds: f64, peak: f64, memory: Option<f64>) -> std::fmt::Result {
    let there = memory.map_or_else(String::new, |m| format!(" of {:.1} GiB", m / GIB));
    writeln!(out, "  all stages       at most {}, {:.2} GiB{there}", super::duration::rounded(seconds), peak / GIB)
}

/// How many times as long as expected this machine takes for densities, with all its threads as they are used now.
pub fn slowness<const D: usize>(kernel: KernelName, neighbors: f64) -> f64 {
    let Ok(domain) = Domain::<D>::new([0.0; D], [1.0; D], [Axis::Periodic; D], Region::Box) else { return 1.0 };
    // The fractional parts of multiples of irrational numbers are even.
    let steps = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2, 0.419_725_143_363_985_6];
    let positions = std::array::from_fn(|k| (1..=SAMPLE).map(|i| (i as f64 * steps[k]).fract()).collect());
    let masses = vec![1.0; SAMPLE];
    let spacing = (1.0 / SAMPLE as f64).powf(1.0 / D as f64);
    let guess = support_guess::<D>(neighbors, SAMPLE, |_| spacing);
    let start = Instant::now();
    let mut sums = 0;
    while sums < REPETITIONS * SAMPLE && (sums == 0 || start.elapsed().as_secs_f64() < SECONDS) {
        sums += Measured::new(kernel, &domain, &positions, &masses, &guess, neighbors).sums.len();
    }
    let seconds = start.elapsed().as_secs_f64() * SAMPLE as f64 / sums as f64;
    let threads = rayon::current_num_threads();
    let expected = PASSES * super::duration::evaluation(SAMPLE, neighbors, threads);
    let ratio = seconds / expected;
    if ratio.is_finite() && ratio > 0.0 { ratio } else { 1.0 }
}
