//! The interface of stages: what a stage is, how it runs, and what it reports.
//!
//! A stage is its options. It begins with particles or goes on from what was kept of it, advances by iterations, and ends
//! with particles and a report; [`relax`] drives it, watches the clock and the user, and offers its state to be kept.

use super::control::{Control, Event};
use super::report::{Progress, StageName, StageReport, StopReason};
use crate::target::Positions;
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};

/// What goes from stage to stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Particles<const D: usize> {
    #[serde(with = "super::snapshot::axes")]
    pub positions: Positions<D>,
    /// Masses in the order of the positions; `None` where they are what the target says.
    pub masses: Option<Vec<f64>>,
    /// Specific internal energies that a balance needs, in internal units.
    pub internal_energy: Option<Vec<f64>>,
}

impl<const D: usize> From<Positions<D>> for Particles<D> {
    fn from(positions: Positions<D>) -> Self {
        Self { positions, masses: None, internal_energy: None }
    }
}

impl<const D: usize> Particles<D> {
    pub fn len(&self) -> usize {
        self.positions[0].len()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Some of them, in the order of `rows`.
    pub fn rows(&self, rows: impl IntoIterator<Item = usize> + Clone) -> Self {
        let of = |values: &Vec<f64>| rows.clone().into_iter().map(|i| values[i]).collect();
        Self {
            positions: self.positions.each_ref().map(of),
            masses: self.masses.as_ref().map(of),
            internal_energy: self.internal_energy.as_ref().map(of),
        }
    }

    /// All of several parts, one after the other.
    pub fn joined(parts: Vec<Self>) -> Self {
        let positions = std::array::from_fn(|k| parts.iter().flat_map(|p| p.positions[k].iter().copied()).collect());
        let all = |of: &dyn Fn(&Self) -> Option<&Vec<f64>>| -> Option<Vec<f64>> {
            parts.iter().map(of).collect::<Option<Vec<_>>>().map(|v| v.into_iter().flatten().copied().collect())
        };
        let (masses, internal_energy) = (all(&|p| p.masses.as_ref()), all(&|p| p.internal_energy.as_ref()));
        Self { positions, masses, internal_energy }
    }
}

/// Where a stage begins.
pub enum Start<'k, const D: usize> {
    New(Particles<D>),
    /// What [`Running::snapshot`] made.
    Kept(&'k [u8]),
}

/// What a stage comes to.
#[derive(Debug, Clone)]
pub struct Relaxed<const D: usize> {
    pub particles: Particles<D>,
    /// More than one where a stage splits particles on its way.
    pub reports: Vec<StageReport>,
    /// Decisions and findings, for the run's report.
    pub notes: Vec<String>,
}

impl<const D: usize> Relaxed<D> {
    /// The report of all of the stage but what came before the last splitting.
    ///
    /// # Panics
    /// Never: a stage reports at least once.
    pub fn report(&self) -> &StageReport {
        &self.reports[self.reports.len() - 1]
    }
}

/// A stage with its options and its target.
pub trait Stage<const D: usize>: Sync {
    fn name(&self) -> StageName;

    /// Begins with new particles.
    fn begin(&self, particles: Particles<D>) -> Box<dyn Running<D> + '_>;

    /// Goes on from a snapshot.
    ///
    /// # Errors
    /// What is wrong with it.
    fn resume(&self, kept: &[u8]) -> Result<Box<dyn Running<D> + '_>, String>;

    /// Whether all ranks make its steps together, so that their snapshots are of one state.
    fn goes_in_step(&self) -> bool {
        true
    }

    /// The particles of a snapshot, which may be that of one of several ranks.
    ///
    /// # Errors
    /// What is wrong with it.
    fn left(&self, kept: &[u8]) -> Result<Particles<D>, String> {
        Ok(self.resume(kept)?.finish(StopReason::Interrupted).particles)
    }
}

/// A stage under way.
pub trait Running<const D: usize>: Send {
    /// One iteration; why the stage ends, if it does. `outside` is the reason that the driver has: the stage then ends with
    /// it, having at most looked at where it is.
    fn advance(&mut self, outside: Option<StopReason>) -> Option<StopReason>;

    /// The history so far, and the last iteration that there can be.
    fn progress(&self) -> (&[Progress], usize);

    /// Appends all that it takes to go on bit for bit. Reads, and never changes, the state.
    ///
    /// # Errors
    /// What could not be encoded.
    fn snapshot(&self, to: Vec<u8>) -> Result<Vec<u8>, String>;

    /// The best state.
    fn finish(self: Box<Self>, stop: StopReason) -> Relaxed<D>;
}

/// Appends a state to what is in front of it in a file.
pub type Snapshot<'a> = &'a dyn Fn(Vec<u8>) -> Result<Vec<u8>, String>;

/// Takes a stage's state before each iteration: called with whether the stage is about to stop, and what makes the snapshot.
pub type Keep<'a> = &'a mut (dyn FnMut(bool, Snapshot<'_>) + Send);

/// Runs a stage to its end.
///
/// # Errors
/// What is wrong with a kept state.
pub fn relax<const D: usize>(
    stage: &dyn Stage<D>,
    start: Start<'_, D>,
    control: &Control<'_>,
    keep: Keep<'_>,
) -> Result<Relaxed<D>, String> {
    // Within the pool, where small passes need not be handed to another thread.
    rayon::scope(|_| {
        let running = match start {
            Start::New(particles) => stage.begin(particles),
            Start::Kept(bytes) => stage.resume(bytes)?,
        };
        Ok(drive(stage.name(), running, control, keep))
    })
}

fn drive<const D: usize>(
    stage: StageName,
    mut running: Box<dyn Running<D> + '_>,
    control: &Control<'_>,
    keep: Keep<'_>,
) -> Relaxed<D> {
    let (mut told, mut step) = (0, Duration::ZERO);
    loop {
        // What the last step took, the next one will.
        let outside = control.stop_reason_within(step);
        keep(outside.is_some(), &|to| running.snapshot(to));
        let begin = Instant::now();
        let stop = running.advance(outside);
        step = begin.elapsed();
        let (history, last) = running.progress();
        if let Some(now) = history.last().filter(|_| history.len() != told) {
            let Progress { iteration, epsilon, force_error, .. } = *now;
            let epsilon = force_error.unwrap_or(epsilon);
            control.tell(Event::Iteration { stage, iteration, last, epsilon });
        }
        told = history.len();
        if let Some(stop) = stop {
            return running.finish(stop);
        }
    }
}

/// [`relax`] from new positions, keeping nothing.
pub fn relax_new<const D: usize>(stage: &dyn Stage<D>, positions: Positions<D>, control: &Control<'_>) -> Relaxed<D> {
    rayon::scope(|_| drive(stage.name(), stage.begin(positions.into()), control, &mut |_, _| {}))
}
