//! Density errors around some positions, for more particles than fit in memory.

use super::density_error::{figures, refit};
use super::smoothed::{Looking, smoothed_densities};
use super::{ErrorFigures, Measured};
use crate::target::{Positions, Surroundings, Target, at};
use sph::exchange::Alone;
use sph::kernel::{KernelName, support_over_spacing};
use sph::sums::support_guess;

/// Support radii about a place of which the particles have to be known.
const REACH: f64 = 2.5;
/// How often that is widened where support radii came out larger than they were thought to be.
const WIDENED: usize = 4;

/// What was found so far, at particles within a support radius of each place.
#[derive(Debug, Clone, PartialEq)]
pub struct Patches {
    kernel: KernelName,
    kernel_neighbors: f64,
    density: Vec<f64>,
    volume: Vec<f64>,
    target: Vec<f64>,
    smoothed: Vec<f64>,
    closest_pair: f64,
    places: usize,
}

/// The figures over all places.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchFigures {
    pub places: usize,
    /// With the mass as given, against the target as the kernel sees it.
    pub smoothed: ErrorFigures,
    /// The same with the mass re-fitted, which takes out what is off everywhere alike, as a self-contribution is.
    pub smoothed_refitted: ErrorFigures,
    /// With the mass as given, against the target.
    pub all: ErrorFigures,
    /// In spacings n^(-1/d).
    pub closest_pair: f64,
}

impl Patches {
    pub fn new(kernel: KernelName, kernel_neighbors: f64) -> Self {
        Self {
            kernel,
            kernel_neighbors,
            density: Vec::new(),
            volume: Vec::new(),
            target: Vec::new(),
            smoothed: Vec::new(),
            closest_pair: f64::INFINITY,
            places: 0,
        }
    }

    /// Measures about `places`; `near` finds the positions of all particles within a distance of each of some places.
    ///
    /// # Errors
    /// Those of `near`.
    pub fn add<const D: usize, E>(
        &mut self,
        target: &Target<'_, D>,
        places: &[[f64; D]],
        near: impl Fn(&[Surroundings<D>]) -> Result<Vec<Positions<D>>, E>,
    ) -> Result<(), E> {
        let ratio = support_over_spacing(D, self.kernel_neighbors);
        let support = |x: &[f64; D]| target.support(target.number_density(x), ratio).min(target.domain.size());
        let of = |x: &[f64; D]| Surroundings { x: *x, reach: REACH * support(x) };
        let mut asked: Vec<Surroundings<D>> = places.iter().map(of).collect();
        for _ in 0..=WIDENED {
            if asked.is_empty() {
                break;
            }
            let found = near(&asked)?;
            let wider = asked.iter().zip(&found).filter_map(|(about, positions)| {
                let widest = self.measure(target, (about, support(&about.x)), positions)?;
                Some(Surroundings { x: about.x, reach: (1.1 * widest).min(target.domain.size()) })
            });
            asked = wider.collect();
        }
        Ok(())
    }

    /// Measures about a place, unless some sees farther than what is known: how far that is.
    fn measure<const D: usize>(
        &mut self,
        target: &Target<'_, D>,
        (about, support): (&Surroundings<D>, f64),
        positions: &Positions<D>,
    ) -> Option<f64> {
        let Surroundings { x, reach } = about;
        let (domain, n) = (target.domain, positions[0].len());
        let (kernel, neighbors) = (self.kernel, self.kernel_neighbors);
        let spacing = |i: usize| target.spacing(target.number_density(&at(positions, i))).min(domain.size());
        let guess = support_guess::<D>(neighbors, n, spacing);
        let masses = target.equal_masses(n);
        let measured = Measured::new(kernel, domain, positions, &masses, &guess, neighbors);
        let away = |i: usize| domain.displacement(x, &at(positions, i)).iter().map(|d| d * d).sum::<f64>().sqrt();
        let looked: Vec<usize> = (0..n).filter(|&i| away(i) <= support).collect();
        let widest = looked.iter().map(|&i| away(i) + measured.support[i]).fold(0.0, f64::max);
        if widest > *reach && *reach < domain.size() {
            return Some(widest);
        }
        self.take(target, (positions, &measured), &looked);
        None
    }

    fn take<const D: usize>(
        &mut self,
        target: &Target<'_, D>,
        (positions, measured): (&Positions<D>, &Measured<D>),
        looked: &[usize],
    ) {
        let some: Positions<D> = positions.each_ref().map(|axis| looked.iter().map(|&i| axis[i]).collect());
        let support: Vec<f64> = looked.iter().map(|&i| measured.support[i]).collect();
        let ratio = support_over_spacing(D, self.kernel_neighbors);
        let mut resolved: Vec<bool> = (0..looked.len()).map(|i| target.is_resolved_at(&at(&some, i), ratio)).collect();
        let looking = Looking { positions: &some, support: &support, together: None };
        self.smoothed.extend(smoothed_densities(self.kernel, (target, None), &looking, &mut resolved));
        self.target.extend(target.densities(&some));
        let nearest = measured.nearest_over_spacing(target.domain);
        for &i in looked {
            self.density.push(measured.sums[i].weighted);
            self.volume.push(1.0 / measured.sums[i].number_density);
            self.closest_pair = self.closest_pair.min(nearest[i]);
        }
        self.places += 1;
    }

    /// None where no place could be measured.
    pub fn figures(&self) -> Option<PatchFigures> {
        let known = |target: &[f64]| target.iter().map(|rho| *rho > 0.0).collect::<Vec<bool>>();
        let of = |target: &[f64], factor: f64| {
            figures(&Alone, (&self.density, factor), target, &self.volume, &known(target))
        };
        (self.places > 0).then(|| PatchFigures {
            places: self.places,
            smoothed: of(&self.smoothed, 1.0),
            smoothed_refitted: of(&self.smoothed, refit(&Alone, &self.density, &self.smoothed, &known(&self.smoothed))),
            all: of(&self.target, 1.0),
            closest_pair: self.closest_pair,
        })
    }
}
