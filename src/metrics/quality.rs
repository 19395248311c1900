//! The measure that decides whether a stage's result is accepted: the same as at the end of a run, over all particles.

use super::smoothed::{Looking, smoothed_densities};
use super::{DensityError, Ledger, LedgerFigures, LedgerLevel, Measured, NoiseFigures, RegionFigures};
use crate::target::{Positions, Target, at};
use sph::exchange::{Alone, Exchange};
use sph::kernel::{KernelName, support_over_spacing};
use sph::parallel;
use sph::sums::support_guess;

/// How good an arrangement is.
#[derive(Debug, Clone, PartialEq)]
pub struct Quality {
    /// Mean and epsilon against the target or what the kernel makes of it, whichever is nearer, over all particles, with a
    /// factor on the mass that is no more than the bias of the self-contribution can be.
    pub mean: f64,
    /// The mean with a factor no more than that of an even arrangement.
    pub mean_if_even: f64,
    pub epsilon: f64,
    /// Mean against the target, with the mass re-fitted, where the target is resolved; none where it is nowhere.
    pub resolved: Option<f64>,
    /// Smallest distance of two particles in spacings.
    pub closest_pair: f64,
    /// Median of the constant-pressure force, as a fraction of a Poisson set's: where densities jump, a few particles make the mean.
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
/// The factor for what is made at least twice as good where the target is resolved: the layers at surfaces, which no arrangement
/// has right, may pay for it.
const LOSS_FOR_GAIN: f64 = 1.5;
const GAIN: f64 = 0.5;
const EPSILON_LOSS_FOR_GAIN: f64 = LOSS_FOR_GAIN * LOSS_FOR_GAIN;
const CONTACTS_LOSS: f64 = 1.15;
const EPSILON_LOSS: f64 = 1.5;
const LITTLE: f64 = 1e-3;
/// What is no better than this part of an earlier figure is as it was.
const SEEN: f64 = 0.98;
const LITTLE_EPSILON: f64 = 1e-6;
const MUCH_NOISE: f64 = 0.3;
/// Noise may grow by a fourth in any case. Where it is more than that of a random set from the first, as about a surface that few
/// particles show, or nothing is resolved, as of a layer thinner than a spacing, it says nothing of the arrangement.
const NOISE_LOSS: f64 = 1.25;
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

/// The same for what is of use where what was before it is not, by its densities: of layers thinner than a spacing their sums depend on how particles
/// lie, and what makes them even moves a few in a hundred.
const MISPLACED_FOR_USE: f64 = 0.03;
/// Mean density error from which on an arrangement is of no use.
const OF_NO_USE: f64 = 0.05;

/// Particles whose surroundings are compared with the target as the kernel sees it, at most.
const SAMPLES: usize = 4_000;

/// Distance of the closest pair, in spacings, below which an arrangement is worse than one whose closest pair is as far apart as `earlier`.
pub(crate) fn least_closest_pair(earlier: f64) -> f64 {
    least_distance(CLOSE, earlier)
}

fn least_distance(close: f64, earlier: f64) -> f64 {
    close.min(0.5 * earlier)
}

/// What a self-contribution can do to a density: in an even arrangement, and in a sheet, where neighbors leave less room about a particle.
pub(crate) const BIAS: f64 = 0.03;
const BIAS_OF_SHEETS: f64 = 0.1;

/// Density errors of a sample, see [`Quality`].
struct Errors {
    mean: f64,
    mean_if_even: f64,
    epsilon: f64,
    resolved: Option<f64>,
}

/// The error of every so many particles, over all of these and where the target is resolved: the target's smoothing takes longer
/// than all else.
fn sampled_error<const D: usize>(
    exchange: &dyn Exchange,
    kernel: KernelName,
    (target, ledger): (&Target<'_, D>, &Ledger<D>),
    positions: &Positions<D>,
    measured: &Measured<D>,
    kernel_neighbors: f64,
) -> Errors {
    let every = exchange.count(positions[0].len()).div_ceil(SAMPLES).max(1);
    let taken = |i: usize| i * every;
    let count = positions[0].len().div_ceil(every);
    let sample: Positions<D> = positions.each_ref().map(|x| (0..count).map(|i| x[taken(i)]).collect());
    let support: Vec<f64> = (0..count).map(|i| measured.support[taken(i)]).collect();
    let ratio = support_over_spacing(D, kernel_neighbors);
    let mut resolved = parallel::map(count, |i| target.is_resolved_at(&at(&sample, i), ratio));
    let looking = Looking { positions: &sample, support: &support, together: None };
    // Each rank would need the points of mass of all.
    let ledger = Some(ledger).filter(|_| exchange.is_alone());
    let smoothed = smoothed_densities(kernel, (target, ledger), &looking, &mut resolved);
    let density = (0..count).map(|i| measured.sums[taken(i)].weighted).collect::<Vec<_>>();
    let volume = (0..count).map(|i| 1.0 / measured.sums[taken(i)].number_density).collect::<Vec<_>>();
    let wanted = target.densities(&sample);
    let by = (density.as_slice(), volume.as_slice());
    let (mean, epsilon) = DensityError::against_either(exchange, by, &wanted, &smoothed, BIAS_OF_SHEETS);
    let (mean_if_even, _) = DensityError::against_either(exchange, by, &wanted, &smoothed, BIAS);
    Errors { mean, mean_if_even, epsilon, resolved: DensityError::mean_refitted(exchange, by, &wanted, &resolved) }
}

impl Quality {
    /// Measures particles; `target.count` of them, with `masses` where they are not what the target says.
    pub fn new<const D: usize>(
        kernel: KernelName,
        target: &Target<'_, D>,
        ledger: &Ledger<D>,
        particles: (&Positions<D>, Option<&[f64]>),
        kernel_neighbors: f64,
    ) -> Self {
        Self::among(&Alone, kernel, (target, ledger), particles, kernel_neighbors)
    }

    /// [`Self::new`] of those of `target.count` particles that this rank has, the same on all ranks, which call it together.
    pub fn among<const D: usize>(
        exchange: &dyn Exchange,
        kernel: KernelName,
        (target, ledger): (&Target<'_, D>, &Ledger<D>),
        (positions, masses): (&Positions<D>, Option<&[f64]>),
        kernel_neighbors: f64,
    ) -> Self {
        let masses = masses.map_or_else(|| target.masses(positions), <[f64]>::to_vec);
        let spacing = |i: usize| target.spacing(target.number_density(&at(positions, i)));
        let guess = support_guess::<D>(kernel_neighbors, masses.len(), spacing);
        let domain = target.domain;
        let measured = Measured::among(exchange, kernel, domain, positions, &masses, &guess, kernel_neighbors);
        drop(guess);
        let errors = sampled_error(exchange, kernel, (target, ledger), positions, &measured, kernel_neighbors);
        let noise = NoiseFigures::among(exchange, kernel, &measured, domain, &masses, kernel_neighbors);
        Self {
            mean: errors.mean,
            mean_if_even: errors.mean_if_even,
            epsilon: errors.epsilon,
            resolved: errors.resolved,
            closest_pair: measured.neighbors_among(exchange, domain, kernel_neighbors).closest_pair,
            noise: noise.median,
            ledger: ledger.figures_among(exchange, &measured, target, positions, &masses),
        }
    }

    /// Whether it is much better where the target is resolved.
    fn gains_on(&self, earlier: &Self) -> bool {
        let both = self.resolved.zip(earlier.resolved);
        both.is_some_and(|(now, before)| before > LITTLE && now < GAIN * before)
    }

    /// Whether its densities are of use where those of an earlier arrangement are not.
    fn mends(&self, earlier: &Self) -> bool {
        earlier.mean > OF_NO_USE && self.mean < GAIN * earlier.mean && self.mean < OF_NO_USE
    }

    /// Whether some figure is better than that of an earlier arrangement, by more than it takes to see. Pairs that are not close are none.
    fn gains_something_on(&self, earlier: &Self) -> bool {
        let is_less = |now: f64, before: f64| now < SEEN * before;
        let resolved = self.resolved.zip(earlier.resolved);
        let off = |region: &RegionFigures| (region.found - region.wanted).abs();
        let mut regions = self.ledger.regions.iter().zip(&earlier.ledger.regions);
        let mut levels = self.ledger.levels.iter().zip(&earlier.ledger.levels);
        is_less(self.mean, earlier.mean)
            || is_less(self.epsilon, earlier.epsilon)
            || is_less(self.noise, earlier.noise)
            || resolved.is_some_and(|(now, before)| is_less(now, before))
            || is_less(1.0 - self.ledger.in_place, 1.0 - earlier.ledger.in_place)
            || regions.any(|(now, before)| !before.is_kept(REGION_SHARE) && off(now) < off(before))
            || levels
                .any(|(now, before)| before.rms_deviation > LITTLE && is_less(now.rms_deviation, before.rms_deviation))
            || earlier.closest_pair < CLOSE && is_less(earlier.closest_pair, self.closest_pair)
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
            Aim::Density if self.mends(earlier) => (LITTLE, MISPLACED_FOR_USE),
            _ => (LITTLE, MISPLACED),
        };
        let (loss, epsilon_loss) = match aim {
            Aim::Contacts => (CONTACTS_LOSS, EPSILON_LOSS),
            Aim::Density if self.gains_on(earlier) => (LOSS_FOR_GAIN, EPSILON_LOSS_FOR_GAIN),
            _ => (LOSS, EPSILON_LOSS),
        };
        // Who parts a few particles leaves the rest as even as it was.
        let mean = |quality: &Self| if aim == Aim::Contacts { quality.mean_if_even } else { quality.mean };
        if aim != Aim::DensityMet && !(mean(self) <= loss * mean(earlier) + little) {
            return Some(format!("the mean density error went {}", percent(mean(self), mean(earlier))));
        }
        if aim == Aim::Density && !(self.epsilon <= epsilon_loss * earlier.epsilon + LITTLE_EPSILON) {
            return Some(format!(
                "epsilon over all particles went from {:.2e} to {:.2e}",
                earlier.epsilon, self.epsilon
            ));
        }
        let is_solid = aim == Aim::ForcesOfSolids;
        let close = if aim == Aim::Forces { CLOSE_FOR_FORCES } else { CLOSE };
        if !is_solid && self.closest_pair < least_distance(close, earlier.closest_pair) {
            let (now, before) = (self.closest_pair, earlier.closest_pair);
            return Some(format!("the closest pair went from {before:.2} to {now:.2} spacings"));
        }
        let tells = earlier.noise < 1.0 && earlier.resolved.is_some();
        if !is_solid && tells && self.noise > NOISE_LOSS * earlier.noise + MUCH_NOISE {
            return Some(format!("the force noise went {}", percent(self.noise, earlier.noise)));
        }
        let level = self.ledger.levels.iter().zip(&earlier.ledger.levels);
        let worse =
            |(now, before): &(&LedgerLevel, &LedgerLevel)| now.rms_deviation > 1.5 * before.rms_deviation + misplaced;
        if let Some((now, before)) = level.into_iter().find(worse) {
            let change = percent(now.rms_deviation, before.rms_deviation);
            return Some(format!("the mass in {} boxes of equal mass deviates more, on average {change}", now.boxes));
        }
        let is_better = aim != Aim::Density || self.gains_something_on(earlier);
        let (density, noise) = (percent(self.mean, earlier.mean), percent(self.noise, earlier.noise));
        let unchanged =
            format!("nothing became better; the mean density error went {density}, the force noise {noise}");
        (!is_better).then_some(unchanged)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn good() -> Quality {
        let levels = vec![LedgerLevel { boxes: 2, largest_deviation: 1e-4, rms_deviation: 1e-4 }];
        let regions = vec![RegionFigures { wanted: 100.0, found: 100.0, shift: None }];
        let ledger = LedgerFigures { levels, in_place: 1.0, regions };
        Quality {
            mean: 2e-3,
            mean_if_even: 2e-3,
            epsilon: 1e-5,
            resolved: Some(4e-3),
            closest_pair: 0.8,
            noise: 0.01,
            ledger,
        }
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
        for (word, worsen) in losses {
            let mut now = good();
            worsen(&mut now);
            let said = now.loss_against(&good(), Aim::Density);
            assert!(said.as_ref().is_some_and(|s| s.contains(word)), "{word}: {said:?}");
            assert_eq!(good().loss_against(&now, Aim::Density), None, "{word}");
        }
    }

    /// A stage that costs time is for something.
    #[test]
    fn what_makes_nothing_better_is_not_taken() {
        let said = good().loss_against(&good(), Aim::Density);
        assert!(said.is_some_and(|s| s.contains("nothing became better")));
        assert_eq!(good().loss_against(&good(), Aim::Forces), None);
        let gains: [fn(&mut Quality); 5] = [
            |q| q.mean = 1.9e-3,
            |q| q.epsilon = 9e-6,
            |q| q.noise = 9e-3,
            |q| q.resolved = Some(3e-3),
            |q| q.ledger.in_place = 1.0,
        ];
        for gain in gains {
            let mut before = good();
            before.ledger.in_place = 0.99;
            let mut now = before.clone();
            gain(&mut now);
            assert_eq!(now.loss_against(&before, Aim::Density), None, "{now:?}");
        }
    }

    #[test]
    fn surfaces_may_pay_for_what_is_resolved_and_by_no_more_than_half() {
        let before = Quality { mean: 0.02, ..good() };
        let after = |mean, resolved| {
            Quality { mean, epsilon: 9e-6, resolved: Some(resolved), ..good() }.loss_against(&before, Aim::Density)
        };
        assert!(after(0.028, 4e-3).is_some());
        assert_eq!(after(0.028, 1e-4), None);
        assert!(after(0.032, 1e-4).is_some());
    }

    #[test]
    fn more_mass_may_move_where_that_makes_densities_of_use() {
        let after = |before, mean, deviation| {
            let mut now = Quality { mean, ..good() };
            now.ledger.levels[0].rms_deviation = deviation;
            now.loss_against(&Quality { mean: before, ..good() }, Aim::Density)
        };
        assert_eq!(after(0.08, 0.03, 0.02), None);
        assert!(after(0.08, 0.03, 0.04).is_some());
        assert!(after(0.08, 0.045, 0.02).is_some());
        assert!(after(0.04, 0.01, 0.02).is_some());
    }

    #[test]
    fn noise_may_grow_by_a_fourth_and_counts_below_that_of_a_random_set_alone() {
        let after = |before, noise| {
            Quality { noise, mean: 1e-3, ..good() }.loss_against(&Quality { noise: before, ..good() }, Aim::Density)
        };
        assert_eq!(after(0.8, 1.25), None);
        assert!(after(0.8, 1.35).is_some());
        assert_eq!(after(9.0, 12.0), None);
        let unresolved = |noise, mean| Quality { noise, mean, resolved: None, ..good() };
        assert_eq!(unresolved(1.35, 1e-3).loss_against(&unresolved(0.8, 2e-3), Aim::Density), None);
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
