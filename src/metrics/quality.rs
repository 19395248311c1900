//! The measure by which a stage's result is accepted: as a run's end is measured, over all particles.

use super::smoothed::smoothed_densities;
use super::{DensityError, ErrorFigures, Ledger, LedgerFigures, LedgerLevel, Measured, NoiseFigures};
use crate::target::{Positions, Target};
use sph::kernel::KernelName;
use sph::sums::support_guess;

/// How good an arrangement is.
#[derive(Debug, Clone, PartialEq)]
pub struct Quality {
    /// Mean and epsilon against the target or what the kernel makes of it, whichever is nearer, over all particles, with a
    /// factor on the mass that is no more than the bias of the self-contribution can be.
    pub mean: f64,
    pub epsilon: f64,
    /// Smallest distance of two particles in spacings.
    pub closest_pair: f64,
    /// Root mean square of the constant-pressure force, as a fraction of a Poisson set's.
    pub noise: f64,
    pub ledger: LedgerFigures,
}

/// What a stage is for, which decides what it may lose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aim {
    Density,
    /// One that has met a tolerance that was asked for has met what counts for the density.
    DensityMet,
    /// Distances across a jump, beside which no arrangement shows the target's density: what is parted there shows it somewhat worse.
    Contacts,
    /// A balance moves particles off the target's density on purpose, by as much as gravity, free surfaces and the scatter of
    /// forces ask for: a percent or two.
    Forces,
    /// The same of solids and liquids. Where these have little pressure for their stiffness, as at a free surface, nothing but
    /// their density keeps particles apart, in a code either: pairs and noise there are no loss.
    ForcesOfSolids,
}

/// What an arrangement may lose, in each figure, before it counts as worse: factors on errors and what is too little to
/// matter, the noise that is much.
const LOSS: f64 = 1.1;
const CONTACTS_LOSS: f64 = 1.15;
const EPSILON_LOSS: f64 = 1.5;
const LITTLE: f64 = 1e-3;
const LITTLE_EPSILON: f64 = 1e-6;
const MUCH_NOISE: f64 = 0.3;
/// The closest pair, in spacings, that is close.
const CLOSE: f64 = 0.4;
/// The same where forces are what counts: a few pairs of a hundred thousand that the code would make in its first steps are less
/// than twice the force on all others.
const CLOSE_FOR_FORCES: f64 = 0.3;
/// Mean density error, and deviation of boxes, that a balance may come to: beyond it, it is another body.
const FORCES_LITTLE: f64 = 0.03;
/// What a region may gain or lose beside one particle.
const REGION_SHARE: f64 = 1e-3;
/// Deviation of boxes of equal mass that is not much: sums that have the target's density in spite of the kernel's smoothing
/// take about as much.
const MISPLACED: f64 = 0.01;

/// Particles whose surroundings are compared with the target as the kernel sees it, at most.
const SAMPLES: usize = 4_000;

/// The error of every so many particles: the target's smoothing takes longer than all else.
fn sampled_error<const D: usize>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: &Positions<D>,
    measured: &Measured<D>,
) -> ErrorFigures {
    let every = positions[0].len().div_ceil(SAMPLES).max(1);
    let taken = |i: usize| i * every;
    let count = positions[0].len().div_ceil(every);
    let sample: Positions<D> = positions.each_ref().map(|x| (0..count).map(|i| x[taken(i)]).collect());
    let support: Vec<f64> = (0..count).map(|i| measured.support[taken(i)]).collect();
    let smoothed = smoothed_densities(kernel, target, &sample, &support, None);
    let density = (0..count).map(|i| measured.sums[taken(i)].weighted).collect::<Vec<_>>();
    let volume = (0..count).map(|i| 1.0 / measured.sums[taken(i)].number_density).collect::<Vec<_>>();
    DensityError::against_either((&density, &volume), &target.densities(&sample), &smoothed)
}

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
        let error = sampled_error(kernel, target, positions, &measured);
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
    pub fn loss_against(&self, earlier: &Self, aim: Aim) -> Option<String> {
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
        let (little, misplaced) = match aim {
            Aim::Forces | Aim::ForcesOfSolids => (FORCES_LITTLE, FORCES_LITTLE),
            _ => (LITTLE, MISPLACED),
        };
        let loss = if aim == Aim::Contacts { CONTACTS_LOSS } else { LOSS };
        if aim != Aim::DensityMet && !(self.mean <= loss * earlier.mean + little) {
            return Some(format!("the mean density error went {}", percent(self.mean, earlier.mean)));
        }
        if aim == Aim::Density && !(self.epsilon <= EPSILON_LOSS * earlier.epsilon + LITTLE_EPSILON) {
            return Some(format!(
                "epsilon over all particles went from {:.2e} to {:.2e}",
                earlier.epsilon, self.epsilon
            ));
        }
        let is_solid = aim == Aim::ForcesOfSolids;
        let close = if aim == Aim::Forces { CLOSE_FOR_FORCES } else { CLOSE };
        if !is_solid && self.closest_pair < close.min(0.5 * earlier.closest_pair) {
            let (now, before) = (self.closest_pair, earlier.closest_pair);
            return Some(format!("the closest pair went from {before:.2} to {now:.2} spacings"));
        }
        if !is_solid && self.noise > earlier.noise + MUCH_NOISE {
            return Some(format!("the force noise went {}", percent(self.noise, earlier.noise)));
        }
        let level = self.ledger.levels.iter().zip(&earlier.ledger.levels);
        let worse =
            |(now, before): &(&LedgerLevel, &LedgerLevel)| now.rms_deviation > 1.5 * before.rms_deviation + misplaced;
        let (now, before) = level.into_iter().find(worse)?;
        let change = percent(now.rms_deviation, before.rms_deviation);
        Some(format!("the mass in {} boxes of equal mass deviates more, on average {change}", now.boxes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::RegionFigures;

    fn good() -> Quality {
        let levels = vec![LedgerLevel { boxes: 2, largest_deviation: 1e-4, rms_deviation: 1e-4 }];
        let regions = vec![RegionFigures { wanted: 100.0, found: 100.0 }];
        let ledger = LedgerFigures { levels, in_place: 1.0, regions };
        Quality { mean: 2e-3, epsilon: 1e-5, closest_pair: 0.8, noise: 0.01, ledger }
    }

    #[test]
    fn each_figure_can_be_the_one_that_is_lost() {
        let losses: [(&str, fn(&mut Quality)); 6] = [
            ("mean", |q| q.mean = 0.1),
            ("epsilon", |q| q.epsilon = 1e-3),
            ("closest", |q| q.closest_pair = 0.2),
            ("noise", |q| q.noise = 0.5),
            ("boxes", |q| q.ledger.levels[0].rms_deviation = 0.1),
            ("region", |q| q.ledger.regions[0].found = 90.0),
        ];
        assert_eq!(good().loss_against(&good(), Aim::Density), None);
        for (word, worsen) in losses {
            let mut now = good();
            worsen(&mut now);
            let said = now.loss_against(&good(), Aim::Density);
            assert!(said.as_ref().is_some_and(|s| s.contains(word)), "{word}: {said:?}");
            assert_eq!(good().loss_against(&now, Aim::Density), None, "{word}");
        }
    }

    #[test]
    fn a_balance_may_leave_the_density_by_percents_and_no_more() {
        let mut now = good();
        (now.mean, now.epsilon, now.ledger.levels[0].rms_deviation) = (0.02, 1e-4, 0.015);
        assert!(now.loss_against(&good(), Aim::Density).is_some());
        assert_eq!(now.loss_against(&good(), Aim::Forces), None);
        now.mean = 0.1;
        assert!(now.loss_against(&good(), Aim::Forces).is_some());
        now = good();
        now.closest_pair = 0.1;
        assert!(now.loss_against(&good(), Aim::Forces).is_some());
    }
}
