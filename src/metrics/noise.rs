//! Noise of the pressure force: what a fluid at rest under constant pressure feels (Diehl et al. 2015, sec. 5).
//!
//! The force a_i of a constant pressure should vanish. It is made dimensionless as |a_i| rho_i H_i and set
//! against its root mean square in a Poisson distribution of the same mean density. There, at fixed H, the sum
//! 2 m/rho^2 sum grad W has the variance (2 m/rho^2)^2 n int |grad W|^2, hence
//! rms |a| rho H = 2 sigma sqrt(V_d I / N_H), I = A_d int_0^1 K'^2 q^(d-1) dq.

use super::Measured;
use crate::domain::Domain;
use crate::kernel::{Kernel, evaluate, unit_ball_volume};
use crate::reduce;
use serde::Serialize;

/// Root mean square of the constant-pressure force as a fraction of that of a Poisson set.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NoiseFigures {
    pub all: f64,
    /// Over particles whose support lies inside the domain.
    pub interior: Option<f64>,
}

impl NoiseFigures {
    pub fn new<const D: usize, K: Kernel>(
        kernel: K,
        measured: &Measured<D>,
        domain: &Domain<D>,
        masses: &[f64],
        kernel_neighbors: f64,
    ) -> Self {
        let forces = measured.constant_pressure_force(kernel, domain, masses);
        let square = |i: usize| {
            let f2: f64 = forces[i].iter().map(|f| f * f).sum();
            f2 * (measured.sums[i].weighted * measured.support[i]).powi(2)
        };
        let n = masses.len();
        let poisson = poisson_force::<D, K>(kernel, kernel_neighbors);
        let rms = |set: &(dyn Fn(usize) -> bool + Sync)| {
            let count = (0..n).filter(|&i| set(i)).count();
            let mean = reduce::sum(n, |i| if set(i) { square(i) } else { 0.0 }) / count as f64;
            (count > 0).then(|| mean.sqrt() / poisson)
        };
        Self { all: rms(&|_| true).unwrap_or(0.0), interior: rms(&|i| measured.interior[i]) }
    }
}

/// rms |a| rho H of a Poisson set.
pub fn poisson_force<const D: usize, K: Kernel>(kernel: K, kernel_neighbors: f64) -> f64 {
    const STEPS: usize = 1000;
    let integral: f64 = (0..STEPS)
        .map(|i| {
            let q = (i as f64 + 0.5) / STEPS as f64;
            let slope = q * evaluate::<K, D>(kernel, q).1;
            slope * slope * q.powi(D as i32 - 1) / STEPS as f64
        })
        .sum();
    let area = D as f64 * unit_ball_volume(D);
    2.0 * K::SIGMA[D - 1] * (unit_ball_volume(D) * area * integral / kernel_neighbors).sqrt()
}
