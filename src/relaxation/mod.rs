//! Relaxation of the seed: stages that move particles until their density matches the target.

mod afc;
#[cfg(test)]
mod afc_tests;
mod alaric;
mod arrangement;
mod balance;
mod conservation;
mod fit;
mod fluid;
#[cfg(test)]
mod force_tests;
#[cfg(test)]
mod gradient_tests;
mod lbfgs;
mod pairs;
mod snapshot;
mod solver;
mod splitting;
mod stiffness;
mod trimming;
mod wvt;

pub use afc::{AfcOptions, AfcSnapshot, away_from_closest, away_from_closest_kept};
pub use alaric::{
    AlaricOptions, AlaricSnapshot, SplittingSnapshot, alaric, alaric_by_splitting, alaric_by_splitting_kept,
    alaric_kept,
};
pub use balance::{BalanceOptions, Balanced, balance_pressure};
pub use conservation::{Drift, conservation};
pub use pairs::{COINCIDENT, PAIRED, part_pairs};
pub use snapshot::{Keep, Start, forget};
pub use solver::{SolverOptions, SolverSnapshot, solve_density, solve_density_kept, time_evaluation};
pub use sph::sums::{Bias, Weight};
pub use splitting::{children, coarse_count, split};
pub use trimming::{TrimOptions, trim_masses};
pub use wvt::{WvtOptions, WvtSnapshot, relax, relax_kept};

use serde::{Deserialize, Deserializer, Serialize};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// What a run may tell its stages, and they tell it.
pub struct Control<'a> {
    pub deadline: Option<Instant>,
    /// Set when the user interrupts.
    pub interrupted: &'a AtomicBool,
    /// Called after each iteration with the stage, iteration, last iteration and epsilon.
    pub observer: &'a (dyn Fn(&'static str, usize, usize, f64) + Sync),
}

impl Control<'_> {
    fn report(&self, stage: &'static str, iteration: usize, last: usize, epsilon: f64) {
        (self.observer)(stage, iteration, last, epsilon);
    }

    /// The outside reason to stop now, if there is one.
    fn stop_reason(&self) -> Option<StopReason> {
        if self.interrupted.load(Ordering::Relaxed) {
            Some(StopReason::Interrupted)
        } else if self.deadline.is_some_and(|t| Instant::now() >= t) {
            Some(StopReason::TimeLimit)
        } else {
            None
        }
    }
}

/// Why a stage ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StopReason {
    /// The error fell below the tolerance asked for.
    ToleranceReached,
    /// The error that a stage watches did, but not the one that is measured in the end.
    ToleranceMissed,
    /// The error no longer falls.
    Stagnated,
    /// The last iteration was used up with the error still falling.
    IterationLimit,
    /// The time limit was reached.
    TimeLimit,
    /// The user interrupted the run.
    Interrupted,
    /// There was nothing to do.
    NotNeeded,
}

/// Error of one iteration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    pub iteration: usize,
    /// epsilon with the mass re-fitted, at the target's own support radii.
    pub epsilon: f64,
    /// Mean |a + g| / |g| over the interior, where the stage balances forces.
    pub force_error: Option<f64>,
    /// Largest displacement over the local spacing.
    pub largest_step: f64,
    /// Seconds since the stage began.
    pub seconds: f64,
}

/// What a stage reports of itself.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StageReport {
    #[serde(deserialize_with = "stage_name")]
    pub stage: StageName,
    pub stop: StopReason,
    /// Iteration whose state is the result.
    pub best_iteration: usize,
    pub history: Vec<Progress>,
    pub seconds: f64,
}

/// One of [`STAGES`]. (A type of its own: serde takes a written reference for a borrow from what it reads.)
type StageName = &'static str;

/// Names of the stages that reports can be of.
const STAGES: [&str; 5] = ["wvt", "solver", "alaric", "afc", "trim"];

fn stage_name<'de, T: Deserializer<'de>>(from: T) -> Result<&'static str, T::Error> {
    let name = String::deserialize(from)?;
    let known = STAGES.into_iter().find(|s| *s == name);
    known.ok_or_else(|| serde::de::Error::custom(format!("'{name}' is no stage")))
}

impl StageReport {
    /// epsilon of the state that came out.
    pub fn epsilon(&self) -> Option<f64> {
        self.history.iter().find(|p| p.iteration == self.best_iteration).map(|p| p.epsilon)
    }
}
