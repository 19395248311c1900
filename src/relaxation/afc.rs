//! AFC, away from the closest: every particle moves a fixed length away from its closest neighbor, and that length
//! falls linearly to zero (the ALARIC paper, sec. 5.3).
//!
//! Naive on purpose: it is what better methods are compared with. Where the target varies, "closest" is by the
//! distance in units of the pair's mean wanted spacing, and the length is in units of the particle's own. (The paper
//! leaves both open, as its target is uniform.) Walls mirror, so that a particle may flee its own image.

use super::arrangement::{Arrangement, SORT_INTERVAL};
use super::fit::{fit, interior};
use super::report::{Progress, StageName, StageReport, StopReason};
use super::snapshot::{Best, Check, Trace, axes, decode, encode};
use super::stage::{Particles, Relaxed, Running, Stage};
use crate::target::{Positions, Target};
use serde::{Deserialize, Serialize};
use sph::kernel::KernelName;
use sph::parallel;

pub const NAME: StageName = StageName { name: "afc", title: "AFC" };

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

/// The stage. What comes out is the best state met, by epsilon (re-fitted) at the target's support radii.
pub struct AwayFromClosest<'a, const D: usize> {
    pub kernel: KernelName,
    pub target: Target<'a, D>,
    pub options: AfcOptions,
}

impl<const D: usize> Stage<D> for AwayFromClosest<'_, D> {
    fn name(&self) -> StageName {
        NAME
    }

    fn begin(&self, particles: Particles<D>) -> Box<dyn Running<D> + '_> {
        let (positions, neighbors) = (particles.positions, self.options.kernel_neighbors);
        let state = Arrangement::new(self.kernel, self.target, self.target.domain.mirrored(), positions, neighbors);
        let best = Best { epsilon: f64::INFINITY, iteration: 0, positions: state.positions().clone() };
        Box::new(Run { options: &self.options, state, step: 0, best, trace: Trace::new() })
    }

    fn resume(&self, kept: &[u8]) -> Result<Box<dyn Running<D> + '_>, String> {
        let kept: Snapshot<D> = decode(kept)?;
        kept.check(self.target.count)?;
        let Snapshot { step, positions, moves, best, trace } = kept;
        let (mirrored, neighbors) = (self.target.domain.mirrored(), self.options.kernel_neighbors);
        let state = Arrangement::of_sorted(self.kernel, self.target, mirrored, positions, moves, neighbors);
        Ok(Box::new(Run { options: &self.options, state, step, best, trace: trace.resumed() }))
    }
}

/// What goes on after an interrupt.
#[derive(Serialize, Deserialize)]
struct Snapshot<const D: usize> {
    step: usize,
    #[serde(with = "axes")]
    positions: Positions<D>,
    moves: usize,
    best: Best<D>,
    trace: Trace,
}

impl<const D: usize> Snapshot<D> {
    /// # Errors
    /// What is wrong with it for `count` particles.
    fn check(&self, count: usize) -> Result<(), String> {
        Check::new(count)
            .positions("positions", &self.positions)
            .positions("the best positions", &self.best.positions)
            .result()
    }
}

/// The stage under way.
struct Run<'a, const D: usize> {
    options: &'a AfcOptions,
    state: Arrangement<'a, D, f32>,
    step: usize,
    best: Best<D>,
    trace: Trace,
}

impl<const D: usize> Running<D> for Run<'_, D> {
    fn advance(&mut self, outside: Option<StopReason>) -> Option<StopReason> {
        if self.state.is_stale(SORT_INTERVAL) {
            self.state.sort();
        }
        let (step, options) = (self.step, self.options);
        let support = self.state.target_supports();
        self.state.mirror(&support);
        let epsilon = self.epsilon(&support);
        self.best.note(epsilon, step, self.state.positions());
        let reason = if epsilon <= options.tolerance { Some(StopReason::ToleranceReached) } else { outside };
        let mut largest_step = 0.0;
        if reason.is_none() && step < options.steps {
            largest_step = self.displace(&support, options.step * (1.0 - step as f64 / options.steps as f64));
        }
        let seconds = self.trace.seconds();
        self.trace.history.push(Progress { iteration: step, epsilon, force_error: None, largest_step, seconds });
        self.step += 1;
        reason.or((step >= options.steps).then_some(StopReason::IterationLimit))
    }

    fn progress(&self) -> (&[Progress], usize) {
        (&self.trace.history, self.options.steps)
    }

    fn snapshot(&self, to: Vec<u8>) -> Result<Vec<u8>, String> {
        encode(
            &Snapshot {
                step: self.step,
                positions: self.state.positions().clone(),
                moves: self.state.moves(),
                best: self.best.clone(),
                trace: self.trace.kept(),
            },
            to,
        )
    }

    fn finish(self: Box<Self>, stop: StopReason) -> Relaxed<D> {
        let Self { best, trace, .. } = *self;
        let (best_iteration, seconds) = (best.iteration, trace.seconds());
        let report = StageReport { stage: NAME, stop, best_iteration, history: trace.history, seconds };
        Relaxed { particles: best.positions.into(), reports: vec![report], notes: Vec::new() }
    }
}

impl<const D: usize> Run<'_, D> {
    fn epsilon(&self, support: &[f64]) -> f64 {
        let (target, positions) = (&self.state.target, self.state.positions());
        let sums = self.state.densities(support);
        let density = target.number_densities(positions);
        let set = interior(target.domain, positions, support, None);
        fit(set.as_deref(), &density, |i| sums[i].number_density).epsilon
    }

    /// Moves all particles by `step` spacings; returns the largest displacement in spacings.
    fn displace(&mut self, support: &[f64], step: f64) -> f64 {
        let ratio = self.state.ratio();
        let spacing = parallel::map(support.len(), |i| support[i] / ratio);
        let away = self.state.away_from_closest(support, &spacing);
        self.state.shift(|i, from| {
            let direction = away[i].0;
            let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
            (sph::array(|k| from[k] + step * spacing[i] * direction[k]), step * length)
        })
    }
}
