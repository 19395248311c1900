//! Noise of the pressure force: what a fluid at rest under constant pressure feels (Diehl et al. 2015, sec. 5).
//!
//! The force a_i of a constant pressure should vanish. It is made dimensionless as |a_i| rho_i H_i and set
//! against its root mean square in a random (Poisson) set of points, summed by the same code with the same
//! kernel and neighbor number.

use super::Measured;
use crate::random::{Purpose, keyed};
use crate::target::Positions;
use rand::RngExt;
use serde::Serialize;
use sph::domain::{Axis, Domain, Region};
use sph::kernel::KernelName;
use sph::reduce;
use sph::sums::support_guess;

/// The constant-pressure force as a fraction of that of a Poisson set: root mean square against root mean square, median
/// against median. Where the density jumps, a few particles make the first of the two.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NoiseFigures {
    /// Over all particles.
    pub all: f64,
    /// The median over all particles.
    pub median: f64,
    /// Over particles whose support lies inside the domain.
    pub interior: Option<f64>,
}

impl NoiseFigures {
    /// The noise of `measured` with these masses; one Poisson set is measured beside it.
    pub fn new<const D: usize>(
        kernel: KernelName,
        measured: &Measured<D>,
        domain: &Domain<D>,
        masses: &[f64],
        kernel_neighbors: f64,
    ) -> Self {
        let squares = force_squares(kernel, measured, domain, masses);
        let random = poisson_squares::<D>(kernel, kernel_neighbors);
        let poisson = (reduce::sum(random.len(), |i| random[i]) / random.len() as f64).sqrt();
        let half = (median(&squares) / median(&random)).sqrt();
        let n = masses.len();
        let rms = |set: &(dyn Fn(usize) -> bool + Sync)| {
            let count = (0..n).filter(|&i| set(i)).count();
            let mean = reduce::sum(n, |i| if set(i) { squares[i] } else { 0.0 }) / count as f64;
            (count > 0).then(|| mean.sqrt() / poisson)
        };
        Self { all: rms(&|_| true).unwrap_or(0.0), median: half, interior: rms(&|i| measured.interior[i]) }
    }
}

/// (|a_i| rho_i H_i)^2 of every particle.
pub(super) fn force_squares<const D: usize>(
    kernel: KernelName,
    measured: &Measured<D>,
    domain: &Domain<D>,
    masses: &[f64],
) -> Vec<f64> {
    let forces = measured.constant_pressure_force(kernel, domain, masses);
    forces
        .iter()
        .zip(&measured.sums)
        .zip(&measured.support)
        .map(|((force, sums), support)| force.iter().map(|f| f * f).sum::<f64>() * (sums.weighted * support).powi(2))
        .collect()
}

/// Points of the reference set: its force is known to about 1 %.
const POISSON_POINTS: usize = 10_000;

/// Root mean square of |a| rho H over random points in a periodic unit box.
pub fn poisson_force<const D: usize>(kernel: KernelName, kernel_neighbors: f64) -> f64 {
    let squares = poisson_squares::<D>(kernel, kernel_neighbors);
    (reduce::sum(POISSON_POINTS, |i| squares[i]) / POISSON_POINTS as f64).sqrt()
}

fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// (|a| rho H)^2 of random points in a periodic unit box.
fn poisson_squares<const D: usize>(kernel: KernelName, kernel_neighbors: f64) -> Vec<f64> {
    let mut positions: Positions<D> = std::array::from_fn(|_| Vec::with_capacity(POISSON_POINTS));
    for i in 0..POISSON_POINTS {
        let mut rng = keyed(0, Purpose::Measure, 1 + i as u64);
        positions.iter_mut().for_each(|x| x.push(rng.random::<f64>()));
    }
    let domain = Domain { lo: [0.0; D], hi: [1.0; D], axes: [Axis::Periodic; D], region: Region::Box };
    let masses = vec![1.0 / POISSON_POINTS as f64; POISSON_POINTS];
    let spacing = (POISSON_POINTS as f64).powf(-1.0 / D as f64);
    let guess = support_guess::<D>(kernel_neighbors, POISSON_POINTS, |_| spacing);
    let measured = Measured::new(kernel, &domain, &positions, &masses, &guess, kernel_neighbors);
    force_squares(kernel, &measured, &domain, &masses)
}
