//! What the density solver minimizes, and its gradient, see [`super::solver`].

use super::arrangement::Arrangement;
use super::fit::{Fit, fit, interior, resolved};
use crate::target::at;
use serde::{Deserialize, Serialize};
use sph::kernel::{KernelName, support_over_spacing};
use sph::lanes::Real;
use sph::sums::DensitySums;
use sph::{parallel, reduce};

/// The objective of an arrangement that changes.
pub(super) struct Objective<'a, const D: usize, R> {
    pub arrangement: Arrangement<'a, D, R>,
    /// With the present kernel; none before the first evaluation with it.
    pub kappa: Option<f64>,
    /// Made so far.
    pub evaluations: usize,
}

/// What is held within a descent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Frame {
    /// Weight of the pressure energy.
    pub lambda: f64,
    kappa: f64,
    pub weights: Vec<f64>,
    /// Particles near jumps, which stay; empty without any.
    pub held: Vec<bool>,
    /// Spacing of each particle, the unit of its moves.
    pub spacing: Vec<f64>,
}

impl Frame {
    /// Follows the particles into a new order, see [`Arrangement::sort`].
    pub fn reorder(&mut self, order: &[u32]) {
        self.weights = parallel::reordered(&self.weights, order);
        self.spacing = parallel::reordered(&self.spacing, order);
        if !self.held.is_empty() {
            self.held = parallel::reordered(&self.held, order);
        }
    }
}

/// The objective at one arrangement.
pub(super) struct Evaluation<const D: usize> {
    pub energy: f64,
    pub fit: Fit,
    support: Vec<f64>,
    wanted: Vec<f64>,
    sums: Vec<DensitySums<D>>,
    mean: f64,
    mean_square: f64,
}

impl<'a, const D: usize, R: Real> Objective<'a, D, R> {
    pub fn new(arrangement: Arrangement<'a, D, R>) -> Self {
        Self { arrangement, kappa: None, evaluations: 0 }
    }

    /// Goes on with another kernel.
    pub fn see_with(&mut self, kernel: KernelName, kernel_neighbors: f64) {
        let now = (self.arrangement.kernel, self.arrangement.kernel_neighbors);
        if now != (kernel, kernel_neighbors) {
            (self.arrangement.kernel, self.arrangement.kernel_neighbors) = (kernel, kernel_neighbors);
            self.kappa = None;
        }
    }

    fn supports(&self, wanted: &[f64], kappa: f64) -> Vec<f64> {
        let target = &self.arrangement.target;
        let ratio = support_over_spacing(D, self.arrangement.kernel_neighbors) * kappa.powf(1.0 / D as f64);
        parallel::map(wanted.len(), |i| ratio * target.spacing(wanted[i]).min(self.arrangement.domain.size()))
    }

    /// Fits kappa and freezes what a stage holds.
    pub fn frame(&mut self, lambda: f64) -> Frame {
        let target = &self.arrangement.target;
        let wanted = target.number_densities(&self.arrangement.positions);
        let positions = &self.arrangement.positions;
        let spacing = parallel::map(wanted.len(), |i| target.spacing(wanted[i]));
        let ratio = support_over_spacing(D, self.arrangement.kernel_neighbors);
        let sharpness = target.sharpnesses(positions, &wanted, ratio);
        let held = target.near_discontinuities(positions, &wanted, &sharpness, ratio);
        let weights = parallel::map(sharpness.len(), |i| resolved(sharpness[i]));
        let mut frame = Frame { lambda, kappa: self.kappa.unwrap_or(1.0), weights, held, spacing };
        // The first evaluation tells kappa; from then on it barely changes.
        if self.kappa.is_none() {
            frame.kappa = self.evaluate(&frame).fit.factor;
            self.kappa = Some(frame.kappa);
        }
        frame
    }

    pub fn evaluate(&mut self, frame: &Frame) -> Evaluation<D> {
        self.evaluations += 1;
        let wanted = self.arrangement.target_density();
        let support = self.supports(&wanted, frame.kappa);
        self.arrangement.mirror(&support);
        let sums = self.arrangement.densities(&support);
        let (n, w) = (wanted.len(), &frame.weights);
        let q = |i: usize| sums[i].number_density / wanted[i];
        let [total, weighted, pressure] = reduce::sums(n, |i| [w[i], w[i] * q(i), q(i)]);
        let mean = weighted / total;
        let [squares] = reduce::sums(n, |i| [w[i] * (q(i) / mean - 1.0).powi(2)]);
        let energy = 0.5 * squares + frame.lambda * pressure;
        let set = interior(self.arrangement.target.domain, &self.arrangement.positions, &support, Some(w));
        let fit = fit(set.as_deref(), &wanted, |i| sums[i].number_density);
        Evaluation { energy, fit, support, wanted, sums, mean, mean_square: squares / total }
    }

    /// dE/dx in units of the particles' spacings.
    pub fn gradient(&self, frame: &Frame, now: &Evaluation<D>) -> Vec<[f64; D]> {
        let strength = parallel::map(now.wanted.len(), |i| {
            let q = now.sums[i].number_density / now.wanted[i];
            let response = frame.weights[i] * (q / now.mean - 1.0 - now.mean_square) / now.mean + frame.lambda;
            response / now.wanted[i]
        });
        let mut out = self.arrangement.gradient(&now.support, &strength, &now.sums);
        let positions = &self.arrangement.positions;
        parallel::update(&mut out, |i, g| {
            if frame.held.get(i) == Some(&true) {
                *g = [0.0; D];
                return;
            }
            let slope = self.log_slope(&at(positions, i), now.wanted[i], frame.spacing[i]);
            // n* enters through q and through the support radius.
            let through_support =
                if self.arrangement.target.spacing_follows(now.wanted[i]) { now.sums[i].slope / D as f64 } else { 0.0 };
            let own = -strength[i] * (now.sums[i].number_density + through_support);
            *g = std::array::from_fn(|k| frame.spacing[i] * (g[k] + own * slope[k]));
        });
        out
    }

    /// Epsilon as it is measured in the end: at solved support radii, and over what is resolved now.
    pub fn measured(&mut self) -> f64 {
        let (wanted, kappa) = (self.arrangement.target_density(), self.kappa.unwrap_or(1.0));
        let solved = self.arrangement.solve(&self.supports(&wanted, kappa));
        let support = parallel::map(solved.len(), |i| solved[i].support);
        let (target, positions) = (&self.arrangement.target, &self.arrangement.positions);
        let weights =
            parallel::map(wanted.len(), |i| resolved(target.sharpness(&at(positions, i), wanted[i], support[i])));
        let set = interior(target.domain, positions, &support, Some(&weights));
        fit(set.as_deref(), &wanted, |i| solved[i].sums.number_density).epsilon
    }

    fn log_slope(&self, x: &[f64; D], wanted: f64, spacing: f64) -> [f64; D] {
        let step = GRADIENT_STEP * spacing.min(self.arrangement.domain.size());
        self.arrangement.target.log_slope(x, wanted, step)
    }
}

/// Step of the differences of the target, in spacings: truncation and rounding both stay below 1e-6.
const GRADIENT_STEP: f64 = 1e-6;
