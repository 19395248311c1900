//! Measures of each particle, for figures; reports state their means and extremes.

use super::Measured;
use super::noise::{force_squares, poisson_force};
use crate::target::Positions;
use sph::domain::Domain;
use sph::kernel::KernelName;
use sph::{parallel, sums::support_guess};

/// Columns in the particles' order.
#[derive(Debug, Clone, Default)]
pub struct Detail {
    /// Support radii at which the number of neighbors is the one asked for, in the unit of the positions.
    pub support: Vec<f64>,
    /// Summed mass density, in the units of masses and positions.
    pub density: Vec<f64>,
    /// Force of a constant pressure over the root mean square of a random set's, see [`super::NoiseFigures`].
    pub noise: Vec<f64>,
    /// Distance of the nearest other particle over the spacing n^(-1/d); infinite where it is beyond the support.
    pub nearest: Vec<f64>,
    pub wanted: Option<Wanted>,
}

/// What was to be reached.
#[derive(Debug, Clone, Default)]
pub struct Wanted {
    /// Target density, in the unit of the summed one.
    pub target: Vec<f64>,
    /// The target as the kernel sees it; empty where that is not known.
    pub smoothed: Vec<f64>,
    /// Whether the kernel can follow the target here; empty where that is not known.
    pub resolved: Vec<bool>,
}

impl Detail {
    /// Of particles in a domain, whose target nobody knows. `spacing` is what there is to begin with at each.
    pub fn new<const D: usize>(
        (kernel, kernel_neighbors): (KernelName, f64),
        domain: &Domain<D>,
        (positions, masses): (&Positions<D>, &[f64]),
        spacing: impl Fn(usize) -> f64 + Sync,
    ) -> Self {
        let guess = support_guess::<D>(kernel_neighbors, masses.len(), spacing);
        let measured = Measured::new(kernel, domain, positions, masses, &guess, kernel_neighbors);
        Self::of_measured(&measured, kernel, domain, masses, kernel_neighbors)
    }

    fn of_measured<const D: usize>(
        measured: &Measured<D>,
        kernel: KernelName,
        domain: &Domain<D>,
        masses: &[f64],
        kernel_neighbors: f64,
    ) -> Self {
        let squares = force_squares(kernel, measured, domain, masses);
        let random = poisson_force::<D>(kernel, kernel_neighbors);
        Self {
            support: measured.support.clone(),
            density: measured.sums.iter().map(|s| s.weighted).collect(),
            noise: squares.iter().map(|s| s.sqrt() / random).collect(),
            nearest: measured.nearest_over_spacing(domain),
            wanted: None,
        }
    }

    /// Densities times `density`, radii times `length`.
    #[must_use]
    pub fn scaled(self, length: f64, density: f64) -> Self {
        let times = |v: Vec<f64>, factor: f64| parallel::map(v.len(), |i| v[i] * factor);
        Self {
            support: times(self.support, length),
            density: times(self.density, density),
            wanted: self.wanted.map(|w| Wanted {
                target: times(w.target, density),
                smoothed: times(w.smoothed, density),
                resolved: w.resolved,
            }),
            ..self
        }
    }
}
