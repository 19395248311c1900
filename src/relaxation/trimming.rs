//! Mass trimming: at fixed positions the summed density is linear in the masses, and small changes of them
//! make it exact.
//!
//! Picard's iteration m_i <- m_i (rho*_i / (kappa rho_i))^1.5, with kappa = <rho*/rho> so that the total mass
//! stays, and each mass within a fraction of what it was.

use super::arrangement::Arrangement;
use super::fit::{fit, interior};
use super::report::{Progress, StageName, StageReport, StopReason};
use super::snapshot::{Check, Trace, decode, encode};
use super::stage::{Particles, Relaxed, Running, Stage};
use crate::target::Target;
use serde::{Deserialize, Serialize};
use sph::kernel::KernelName;
use sph::sums::Search;
use sph::{parallel, reduce};

pub const NAME: StageName = StageName { name: "trim", title: "mass trimming" };

/// Parameters of the trimming.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrimOptions {
    /// N_H = V_d n H^d.
    pub kernel_neighbors: f64,
    /// Largest relative change of a mass.
    pub largest_change: f64,
    pub iterations: usize,
    /// Stop when epsilon (re-fitted) is below.
    pub tolerance: f64,
}

/// Over-relaxation: 1 converges half as fast, 2 no longer.
const POWER: f64 = 1.5;
/// Improvement of epsilon per iteration below which it has stagnated.
const STAGNATION: f64 = 0.999;

/// The stage: trims masses, whose sum stays, towards rho* at the particles' positions. Particles at edges see mirror images
/// beyond them, so that masses do not pile up there.
pub struct MassTrimming<'a, const D: usize> {
    pub kernel: KernelName,
    pub target: Target<'a, D>,
    pub options: TrimOptions,
}

impl<const D: usize> Stage<D> for MassTrimming<'_, D> {
    fn name(&self) -> StageName {
        NAME
    }

    fn begin(&self, particles: Particles<D>) -> Box<dyn Running<D> + '_> {
        let sums = Fixed::new(self, &particles);
        let best = Best { epsilon: f64::INFINITY, iteration: 0, masses: sums.first.clone() };
        let masses = sums.first.clone();
        Box::new(Run { options: &self.options, particles, sums, masses, best, iteration: 0, trace: Trace::new() })
    }

    fn resume(&self, kept: &[u8]) -> Result<Box<dyn Running<D> + '_>, String> {
        let Snapshot { particles, masses, best, iteration, trace } = decode(kept)?;
        Check::new(self.target.count)
            .positions("positions", &particles.positions)
            .scalars("masses", &masses)
            .scalars("the best masses", &best.masses)
            .result()?;
        let (sums, trace) = (Fixed::new(self, &particles), trace.resumed());
        Ok(Box::new(Run { options: &self.options, particles, sums, masses, best, iteration, trace }))
    }
}

/// What the positions, which stay, decide; in tree order.
struct Fixed<'a, const D: usize> {
    state: Arrangement<'a, D, f64>,
    /// The particle at each place of the tree.
    order: Vec<u32>,
    support: Vec<f64>,
    target_density: Vec<f64>,
    interior: Option<Vec<bool>>,
    /// Masses before the trimming, and their sum.
    first: Vec<f64>,
    total: f64,
}

impl<'a, const D: usize> Fixed<'a, D> {
    fn new(stage: &MassTrimming<'a, D>, particles: &Particles<D>) -> Self {
        let (target, positions) = (stage.target, particles.positions.clone());
        let (mirrored, neighbors) = (target.domain.mirrored(), stage.options.kernel_neighbors);
        let (mut state, order) = Arrangement::with_order(stage.kernel, target, mirrored, positions, neighbors);
        let guess = state.target_supports();
        state.mirror(&guess);
        let solved = state.solve(&guess, Search::EXACT);
        let support = parallel::map(solved.len(), |i| solved[i].support);
        state.mirror(&support);
        let target_density = target.densities(state.positions());
        let given = particles.masses.clone().unwrap_or_else(|| target.masses(&particles.positions));
        let first = parallel::reordered(&given, &order);
        let total = reduce::sum(first.len(), |i| first[i]);
        let interior = interior(target.domain, state.positions(), &support, None);
        Self { state, order, support, target_density, interior, first, total }
    }
}

/// The best masses so far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Best {
    epsilon: f64,
    iteration: usize,
    masses: Vec<f64>,
}

/// What goes on after an interrupt.
#[derive(Serialize, Deserialize)]
struct Snapshot<const D: usize> {
    /// As the stage began with them.
    particles: Particles<D>,
    masses: Vec<f64>,
    best: Best,
    iteration: usize,
    trace: Trace,
}

/// The stage under way.
struct Run<'a, const D: usize> {
    options: &'a TrimOptions,
    particles: Particles<D>,
    sums: Fixed<'a, D>,
    masses: Vec<f64>,
    best: Best,
    iteration: usize,
    trace: Trace,
}

impl<const D: usize> Running<D> for Run<'_, D> {
    fn advance(&mut self, outside: Option<StopReason>) -> Option<StopReason> {
        let Self { options, sums, iteration, .. } = self;
        let (iteration, target) = (*iteration, &sums.target_density);
        let density = sums.state.weighted(&sums.support, &self.masses);
        let fitted = fit(sums.interior.as_deref(), target, |i| density[i]);
        let stagnated = fitted.epsilon > STAGNATION * self.best.epsilon;
        if fitted.epsilon < self.best.epsilon {
            self.best = Best { epsilon: fitted.epsilon, iteration, masses: self.masses.clone() };
        }
        let (epsilon, seconds) = (fitted.epsilon, self.trace.seconds());
        self.trace.history.push(Progress { iteration, epsilon, force_error: None, largest_step: 0.0, seconds });
        let reason = if self.best.epsilon <= options.tolerance {
            Some(StopReason::ToleranceReached)
        } else if stagnated {
            Some(StopReason::Stagnated)
        } else {
            outside
        };
        if reason.is_some() || iteration >= options.iterations {
            return reason.or(Some(StopReason::IterationLimit));
        }
        let change = options.largest_change;
        parallel::update(&mut self.masses, |i, m| {
            let ratio = target[i] / (fitted.factor * density[i]);
            *m = (*m * ratio.powf(POWER)).clamp(sums.first[i] * (1.0 - change), sums.first[i] * (1.0 + change));
        });
        let masses = &self.masses;
        let factor = sums.total / reduce::sum(masses.len(), |i| masses[i]);
        parallel::update(&mut self.masses, |_, m| *m *= factor);
        self.iteration += 1;
        None
    }

    fn progress(&self) -> (&[Progress], usize) {
        (&self.trace.history, self.options.iterations)
    }

    fn snapshot(&self, to: Vec<u8>) -> Result<Vec<u8>, String> {
        encode(
            &Snapshot {
                particles: self.particles.clone(),
                masses: self.masses.clone(),
                best: self.best.clone(),
                iteration: self.iteration,
                trace: self.trace.kept(),
            },
            to,
        )
    }

    fn finish(self: Box<Self>, stop: StopReason) -> Relaxed<D> {
        let Self { mut particles, sums, best, trace, .. } = *self;
        let mut masses = vec![0.0; particles.len()];
        for (m, &i) in best.masses.iter().zip(&sums.order) {
            masses[i as usize] = *m;
        }
        particles.masses = Some(masses);
        let (best_iteration, seconds) = (best.iteration, trace.seconds());
        let report = StageReport { stage: NAME, stop, best_iteration, history: trace.history, seconds };
        Relaxed { particles, reports: vec![report], notes: Vec::new() }
    }
}
