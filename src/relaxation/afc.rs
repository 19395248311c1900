//! AFC, away from the closest: every particle moves a fixed length away from its closest neighbor, and that length
//! falls linearly to zero (the ALARIC paper, sec. 5.3).
//!
//! Naive on purpose: it is what better methods are compared with. Where the target varies, "closest" is by the
//! distance in units of the pair's mean wanted spacing, and the length is in units of the particle's own. (The paper
//! leaves both open, as its target is uniform.) Walls mirror, so that a particle may flee its own image.

use super::arrangement::{Arrangement, SORT_INTERVAL};
use super::fit::{fit, interior};
use super::snapshot::{Best, Check, Keep, Start, Trace, axes, forget};
use super::{Control, Progress, StageReport, StopReason};
use crate::target::{Positions, Target, at};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sph::kernel::{KernelName, support_over_spacing};
use sph::reduce;
use sph::sums::Away;

/// Parameters of the stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AfcOptions {
    /// N_H = V_d n H^d of the density that is watched; the closest neighbor is looked for within H.
    pub kernel_neighbors: f64,
    pub steps: usize,
    /// First displacement, in spacings; the paper's mu.
    pub step: f64,
    /// Stop when epsilon (re-fitted) is below.
    pub tolerance: f64,
}

impl AfcOptions {
    /// The defaults in `D` dimensions.
    pub fn new(d: usize) -> Self {
        Self { kernel_neighbors: sph::kernel::default_kernel_neighbors(d), steps: 500, step: 0.1, tolerance: 0.0 }
    }
}

/// Moves `positions` and returns the best state met, by epsilon (re-fitted) at the target's support radii.
pub fn away_from_closest<const D: usize>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: Positions<D>,
    options: &AfcOptions,
    control: &Control<'_>,
) -> (Positions<D>, StageReport) {
    away_from_closest_kept(kernel, target, Start::New(positions), options, control, &mut forget())
}

/// [`away_from_closest`] from new positions or a snapshot, offering snapshots to `keep`.
pub fn away_from_closest_kept<const D: usize>(
    kernel: KernelName,
    target: &Target<'_, D>,
    start: Start<D, AfcSnapshot<D>>,
    options: &AfcOptions,
    control: &Control<'_>,
    keep: Keep<'_, AfcSnapshot<D>>,
) -> (Positions<D>, StageReport) {
    let domain = target.domain.mirrored();
    let neighbors = options.kernel_neighbors;
    let (mut state, first, mut best, mut trace) = match start {
        Start::New(positions) => {
            let state = Arrangement::<D, f32>::new(kernel, target, &domain, positions, neighbors);
            let best = Best { epsilon: f64::INFINITY, iteration: 0, positions: state.positions.clone() };
            (state, 0, best, Trace::new())
        }
        Start::Kept(kept) => {
            let AfcSnapshot { step, positions, moves, best, trace } = *kept;
            let state = Arrangement::of_sorted(kernel, target, &domain, positions, moves, neighbors);
            (state, step, best, trace.resumed())
        }
    };
    let mut stop = StopReason::IterationLimit;
    for step in first..=options.steps {
        let outside = control.stop_reason();
        keep(outside.is_some(), &|| AfcSnapshot {
            step,
            positions: state.positions.clone(),
            moves: state.moves(),
            best: best.clone(),
            trace: trace.kept(),
        });
        if state.is_stale(SORT_INTERVAL) {
            state.sort();
        }
        let support = state.target_supports();
        state.mirror(&support);
        let epsilon = epsilon(&state, &support);
        best.note(epsilon, step, &state.positions);
        let mut entry =
            Progress { iteration: step, epsilon, force_error: None, largest_step: 0.0, seconds: trace.seconds() };
        let reason = if epsilon <= options.tolerance { Some(StopReason::ToleranceReached) } else { outside };
        if reason.is_none() && step < options.steps {
            entry.largest_step =
                displace(&mut state, &support, options.step * (1.0 - step as f64 / options.steps as f64));
        }
        trace.history.push(entry);
        control.report("AFC", step, options.steps, epsilon);
        if let Some(reason) = reason {
            stop = reason;
            break;
        }
    }
    let seconds = trace.seconds();
    let report = StageReport { stage: "afc", stop, best_iteration: best.iteration, history: trace.history, seconds };
    (best.positions, report)
}

fn epsilon<const D: usize>(state: &Arrangement<'_, D, f32>, support: &[f64]) -> f64 {
    let sums = state.densities(support);
    let wanted = state.target.number_densities(&state.positions);
    let set = interior(state.target.domain, &state.positions, support, None);
    fit(set.as_deref(), &wanted, |i| sums[i].number_density).epsilon
}

/// Moves all particles by `step` spacings; returns the largest displacement in spacings.
fn displace<const D: usize>(state: &mut Arrangement<'_, D, f32>, support: &[f64], step: f64) -> f64 {
    let ratio = support_over_spacing(D, state.kernel_neighbors);
    let spacing: Vec<f64> = support.par_iter().map(|h| h / ratio).collect();
    let away = state.away_from_closest(support, &spacing);
    let (target, domain, positions) = (state.target, state.domain, &state.positions);
    let moved: Vec<([f64; D], f64)> = away
        .par_iter()
        .enumerate()
        .map(|(i, Away(direction))| {
            let from = at(positions, i);
            let mut x: [f64; D] = std::array::from_fn(|k| from[k] + step * spacing[i] * direction[k]);
            domain.confine(&from, &mut x);
            let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
            if target.admits(&x) { (x, step * length) } else { (from, 0.0) }
        })
        .collect();
    for k in 0..D {
        state.positions[k].par_iter_mut().zip(&moved).for_each(|(x, m)| *x = m.0[k]);
    }
    state.moved();
    reduce::max(moved.len(), |i| moved[i].1)
}

/// What goes on after an interrupt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AfcSnapshot<const D: usize> {
    step: usize,
    #[serde(with = "axes")]
    positions: Positions<D>,
    moves: usize,
    best: Best<D>,
    trace: Trace,
}

impl<const D: usize> AfcSnapshot<D> {
    /// The best positions, for a run that does not go on.
    pub fn into_positions(self) -> Positions<D> {
        self.best.positions
    }

    /// # Errors
    /// What is wrong with it for `count` particles.
    pub fn check(&self, count: usize) -> Result<(), String> {
        Check::new(count)
            .positions("positions", &self.positions)
            .positions("the best positions", &self.best.positions)
            .result()
    }
}
