//! The names of the stages, and their reports.

use serde::{Deserialize, Serialize, Serializer};

/// A stage by name: one constant beside each stage, used by plan, progress, report and checkpoint alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StageName {
    /// In JSON, tables and checkpoints.
    pub name: &'static str,
    /// In prose.
    pub title: &'static str,
}

impl Serialize for StageName {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.name)
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

impl StopReason {
    pub const ALL: [Self; 7] = [
        Self::ToleranceReached,
        Self::ToleranceMissed,
        Self::Stagnated,
        Self::IterationLimit,
        Self::TimeLimit,
        Self::Interrupted,
        Self::NotNeeded,
    ];

    /// Whether the stage was cut short from outside, so that it can go on.
    pub fn is_cut(self) -> bool {
        matches!(self, Self::TimeLimit | Self::Interrupted)
    }
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

/// What a stage reports of itself. In checkpoints its name is text.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageReport<N = StageName> {
    pub stage: N,
    pub stop: StopReason,
    /// Iteration whose state is the result.
    pub best_iteration: usize,
    pub history: Vec<Progress>,
    pub seconds: f64,
}

impl<N> StageReport<N> {
    /// Of a stage that was ended before it began.
    pub fn not_begun(stage: N, stop: StopReason) -> Self {
        Self { stage, stop, best_iteration: 0, history: Vec::new(), seconds: 0.0 }
    }

    /// epsilon of the state that came out.
    pub fn epsilon(&self) -> Option<f64> {
        self.history.iter().find(|p| p.iteration == self.best_iteration).map(|p| p.epsilon)
    }

    /// The same report under another name.
    pub fn with_name<M>(self, stage: M) -> StageReport<M> {
        let Self { stop, best_iteration, history, seconds, .. } = self;
        StageReport { stage, stop, best_iteration, history, seconds }
    }
}
