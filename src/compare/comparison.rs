//! The result of a comparison: methods, their runs, and the states after the seeding and after each stage.

use crate::metrics::{DensityError, ErrorFigures, NeighborFigures, NoiseFigures};
#[cfg(feature = "plots")]
use crate::page::Portrait;
use crate::relaxation::StopReason;
use serde::Serialize;

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
    /// Its particles, where the page shows them; too many numbers for the JSON.
    #[cfg(feature = "plots")]
    #[serde(skip)]
    pub(super) portrait: Option<Portrait>,
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

/// Measures of the state after the seeding or after a stage.
#[derive(Debug, Clone, Serialize)]
pub struct State {
    pub stage: &'static str,
    /// Fewer than the run's where splitting follows.
    pub particles: usize,
    /// Since the seeding began.
    pub seconds: f64,
    pub density_error: DensityError,
    /// Share of the mass in boxes of equal mass that hold what they should to 1 %.
    pub in_place: f64,
    pub noise: NoiseFigures,
    pub neighbors: NeighborFigures,
}

impl State {
    /// The figures that the text and the plots show: mass re-fitted, over the interior where there is one.
    pub(super) fn shown_error(&self) -> &ErrorFigures {
        self.density_error.stated()
    }

    /// Mean error of all particles, the mass as given, from the target as the kernel sees it, or from the target itself.
    pub(super) fn overall_error(&self) -> f64 {
        self.density_error.smoothed.unwrap_or(self.density_error.all).mean
    }

    /// Force noise over the interior where there is one.
    pub(super) fn shown_noise(&self) -> f64 {
        self.noise.interior.unwrap_or(self.noise.all)
    }
}
