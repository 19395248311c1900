//! Mass trimming: at fixed positions the summed density is linear in the masses, and small changes of them
//! make it exact.
//!
//! Picard's iteration m_i <- m_i (rho*_i / (kappa rho_i))^1.5, with kappa = <rho*/rho> so that the total mass
//! stays, and each mass within a fraction of what it was.

use super::arrangement::Arrangement;
use super::fit::{fit, interior};
use super::{Control, Progress, StageReport, StopReason};
use crate::target::{Positions, Target};
use rayon::prelude::*;
use sph::kernel::KernelName;
use sph::reduce;
use std::time::Instant;

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

/// Trims `masses`, whose sum stays, towards rho* at `positions`. Particles at edges see mirror images beyond
/// them, so that masses do not pile up there.
pub fn trim_masses<const D: usize>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: &Positions<D>,
    masses: &mut [f64],
    options: &TrimOptions,
    control: &Control<'_>,
) -> StageReport {
    let start = Instant::now();
    let domain = target.domain.mirrored();
    let (mut state, order) =
        Arrangement::<D, f64>::with_order(kernel, target, &domain, positions.clone(), options.kernel_neighbors);
    let guess: Vec<f64> = state.target_supports();
    state.mirror(&guess);
    let support: Vec<f64> = state.solve(&guess).into_par_iter().map(|s| s.support).collect();
    state.mirror(&support);
    let wanted = target.densities(&state.positions);
    let first: Vec<f64> = order.par_iter().map(|&i| masses[i as usize]).collect();
    let total = reduce::sum(first.len(), |i| first[i]);
    let set = interior(target.domain, &state.positions, &support, None);
    let mut now = first.clone();
    let mut best = (f64::INFINITY, 0, first.clone());
    let mut history: Vec<Progress> = Vec::new();
    let mut stop = StopReason::IterationLimit;
    for iteration in 0..=options.iterations {
        let density = state.weighted(&support, &now);
        let fitted = fit(set.as_deref(), &wanted, |i| density[i]);
        let stagnated = fitted.epsilon > STAGNATION * best.0;
        if fitted.epsilon < best.0 {
            best = (fitted.epsilon, iteration, now.clone());
        }
        let seconds = start.elapsed().as_secs_f64();
        history.push(Progress { iteration, epsilon: fitted.epsilon, force_error: None, largest_step: 0.0, seconds });
        control.report("mass trimming", iteration, options.iterations, fitted.epsilon);
        let reason = if best.0 <= options.tolerance {
            Some(StopReason::ToleranceReached)
        } else if stagnated {
            Some(StopReason::Stagnated)
        } else {
            control.stop_reason()
        };
        if let Some(reason) = reason {
            stop = reason;
            break;
        }
        now.par_iter_mut().enumerate().for_each(|(i, m)| {
            let ratio = wanted[i] / (fitted.factor * density[i]);
            let bounds = (first[i] * (1.0 - options.largest_change), first[i] * (1.0 + options.largest_change));
            *m = (*m * ratio.powf(POWER)).clamp(bounds.0, bounds.1);
        });
        let factor = total / reduce::sum(now.len(), |i| now[i]);
        now.par_iter_mut().for_each(|m| *m *= factor);
    }
    for (m, &i) in best.2.iter().zip(&order) {
        masses[i as usize] = *m;
    }
    StageReport { stage: "trim", stop, best_iteration: best.1, history, seconds: start.elapsed().as_secs_f64() }
}
