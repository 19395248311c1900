//! Compares the summed densities of the new particles of a refined snapshot with their targets.

use super::stages::Setting;
use crate::metrics::Measured;
use crate::target::{Positions, Target, at};
use sph::kernel::support_over_spacing;
use sph::parallel;

/// The sums of new particles against the density; none of those that see vacuum, whose sums lack what is not there.
pub(super) struct Sums {
    /// First particle that is new.
    first: usize,
    guess: Vec<f64>,
    pub wanted: Vec<Option<f64>>,
}

impl Sums {
    pub fn new<const D: usize>(
        (first, count): (usize, usize),
        setting: &Setting<'_, D>,
        target: &Target<'_, D>,
        positions: &Positions<D>,
    ) -> Self {
        let neighbors = setting.scene.kernel_neighbors(D);
        let support =
            |i: usize| target.support(target.number_density(&at(positions, i)), support_over_spacing(D, neighbors));
        let guess = parallel::map(count, support);
        let wanted = parallel::map(count - first, |j| {
            let (x, reach) = (at(positions, first + j), guess[first + j]);
            let is_filled = |k: usize, way: f64| {
                let mut y = x;
                y[k] += way * reach;
                target.domain.wrap(&mut y);
                target.density.value(&y) > 0.0
            };
            let is_within = (0..D).all(|k| is_filled(k, 1.0) && is_filled(k, -1.0));
            is_within.then(|| target.density.value(&x))
        });
        Self { first, guess, wanted }
    }

    /// Densities of new particles with these masses.
    pub fn summed<const D: usize>(
        &self,
        setting: &Setting<'_, D>,
        target: &Target<'_, D>,
        positions: &Positions<D>,
        masses: &[f64],
    ) -> Vec<f64> {
        let (kernel, neighbors) = (setting.scene.kernel(), setting.scene.kernel_neighbors(D));
        let measured = Measured::new(kernel, target.domain, positions, masses, &self.guess, neighbors);
        measured.sums[self.first..].iter().map(|sums| sums.weighted).collect()
    }

    /// By how much these are off on average; none where no sum can be right.
    pub fn off<const D: usize>(
        &self,
        setting: &Setting<'_, D>,
        target: &Target<'_, D>,
        positions: &Positions<D>,
        masses: &[f64],
    ) -> Option<f64> {
        let summed = self.summed(setting, target, positions, masses);
        let errors: Vec<f64> =
            self.wanted.iter().zip(&summed).filter_map(|(wanted, sum)| Some((sum / (*wanted)? - 1.0).abs())).collect();
        (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / errors.len() as f64)
    }
}
