//! The measure by which a stage's result is accepted: as a run's end is measured, over all particles.

use super::smoothed::smoothed_densities;
use super::{DensityError, Ledger, LedgerFigures, Measured, NoiseFigures};
use crate::target::{Positions, Target};
use sph::kernel::KernelName;
use sph::sums::support_guess;

/// How good an arrangement is.
#[derive(Debug, Clone, PartialEq)]
pub struct Quality {
    /// Mean and epsilon against the target as the kernel sees it, over all particles, with a factor on the mass that
    /// is no more than the bias of the self-contribution can be.
    pub mean: f64,
    pub epsilon: f64,
    /// Smallest distance of two particles in spacings.
    pub closest_pair: f64,
    /// Root mean square of the constant-pressure force, as a fraction of a Poisson set's.
    pub noise: f64,
    pub ledger: LedgerFigures,
}

/// What an arrangement may lose, in each figure, before it counts as worse: factors on errors and what is too little to
/// matter, the closest pair that is close, the noise that is much.
const LOSS: f64 = 1.1;
const LITTLE: f64 = 1e-3;
const LITTLE_EPSILON: f64 = 1e-6;
const CLOSE: f64 = 0.4;
const MUCH_NOISE: f64 = 0.3;
/// What a region may gain or lose beside one particle.
const REGION_SHARE: f64 = 1e-3;
/// Share of the mass that may leave its place.
const MISPLACED: f64 = 0.05;

impl Quality {
    /// Measures particles; `target.count` of them, with `masses` where they are not what the target says.
    pub fn new<const D: usize>(
        kernel: KernelName,
        target: &Target<'_, D>,
        ledger: &Ledger<D>,
        (positions, masses): (&Positions<D>, Option<&[f64]>),
        kernel_neighbors: f64,
    ) -> Self {
        let masses = masses.map_or_else(|| target.masses(positions), <[f64]>::to_vec);
        let number_density = target.number_densities(positions);
        let guess = support_guess::<D>(kernel_neighbors, masses.len(), |i| target.spacing(number_density[i]));
        let measured = Measured::new(kernel, target.domain, positions, &masses, &guess, kernel_neighbors);
        let smoothed = smoothed_densities(kernel, target, positions, &measured.support);
        let error = DensityError::within_bias(&measured, &smoothed);
        let noise = NoiseFigures::new(kernel, &measured, target.domain, &masses, kernel_neighbors);
        Self {
            mean: error.mean,
            epsilon: error.epsilon,
            closest_pair: measured.neighbors(target.domain, kernel_neighbors).closest_pair,
            noise: noise.all,
            ledger: ledger.figures(&measured, target, positions, &masses),
        }
    }

    /// In what it is worse than an earlier arrangement, if it is.
    pub fn loss_against(&self, earlier: &Self) -> Option<String> {
        let region = self.ledger.regions.iter().zip(&earlier.ledger.regions).find(|(now, before)| {
            !now.is_kept(REGION_SHARE) && (now.found - now.wanted).abs() > (before.found - before.wanted).abs()
        });
        let percent = |now: f64, before: f64| format!("from {:.3} to {:.3} %", 100.0 * before, 100.0 * now);
        if let Some((now, before)) = region {
            return Some(format!(
                "a region that should have {:.1} particles went from {:.1} to {:.1}",
                now.wanted, before.found, now.found
            ));
        }
        if !(self.mean <= LOSS * earlier.mean + LITTLE) {
            return Some(format!("the mean density error went {}", percent(self.mean, earlier.mean)));
        }
        if !(self.epsilon <= LOSS * earlier.epsilon + LITTLE_EPSILON) {
            return Some(format!(
                "epsilon over all particles went from {:.2e} to {:.2e}",
                earlier.epsilon, self.epsilon
            ));
        }
        if self.closest_pair < CLOSE.min(0.5 * earlier.closest_pair) {
            let (now, before) = (self.closest_pair, earlier.closest_pair);
            return Some(format!("the closest pair went from {before:.2} to {now:.2} spacings"));
        }
        if self.noise > earlier.noise + MUCH_NOISE {
            return Some(format!("the force noise went {}", percent(self.noise, earlier.noise)));
        }
        if self.ledger.in_place < earlier.ledger.in_place - MISPLACED {
            let lost = percent(self.ledger.in_place, earlier.ledger.in_place);
            return Some(format!("the share of the mass that is in its place went {lost}"));
        }
        None
    }
}
