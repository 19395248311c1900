//! What the density solver minimizes, and its gradient, see [`super::solver`].

use super::arrangement::Arrangement;
use super::fit::{Fit, fit, interior, resolved};
use super::interfaces::Interfaces;
use crate::target::at;
use serde::{Deserialize, Serialize};
use sph::kernel::{KernelName, support_over_spacing};
use sph::lanes::Real;
use sph::sums::{DensitySums, Search};
use sph::{parallel, reduce};

/// The objective of an arrangement that changes.
pub(super) struct Objective<'a, const D: usize, R> {
    pub arrangement: Arrangement<'a, D, R>,
    /// With the present kernel; none before the first evaluation with it.
    pub kappa: Option<f64>,
    /// The start is in order: where no sum can follow the target, nothing is better.
    pub settled: bool,
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
    /// What the pressure energy counts particles that see far more than their own surroundings; empty where there are none.
    pressure: Vec<f64>,
    /// Particles near jumps, and where the target is steep, which stay; empty without any.
    pub held: Vec<bool>,
    /// Spacing of each particle, the unit of its moves.
    pub spacing: Vec<f64>,
}

impl Frame {
    /// Follows the particles into a new order, see [`Arrangement::sort`].
    pub fn reorder(&mut self, order: &[u32]) {
        self.weights = parallel::reordered(&self.weights, order);
        self.spacing = parallel::reordered(&self.spacing, order);
        if !self.pressure.is_empty() {
            self.pressure = parallel::reordered(&self.pressure, order);
        }
        if !self.held.is_empty() {
            self.held = parallel::reordered(&self.held, order);
        }
    }

    /// Takes weight from particles of which more than [`CROWDED`] times their density is within their support: what they
    /// see is not theirs to change, and would drown what all others see.
    fn forget_crowds(&mut self, crowding: &[f64]) {
        let share = |i: usize| (CROWDED / crowding[i]).min(1.0);
        if crowding.iter().all(|c| *c <= CROWDED) {
            return;
        }
        parallel::update(&mut self.weights, |i, w| *w *= share(i).powi(4));
        self.pressure = parallel::map(crowding.len(), |i| share(i).powi(2));
    }

    fn pressure(&self, i: usize) -> f64 {
        self.pressure.get(i).copied().unwrap_or(1.0)
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
        Self { arrangement, kappa: None, settled: false, evaluations: 0 }
    }

    /// Goes on with another kernel.
    pub fn see_with(&mut self, kernel: KernelName, kernel_neighbors: f64) {
        let now = (self.arrangement.kernel, self.arrangement.kernel_neighbors);
        if now != (kernel, kernel_neighbors) {
            (self.arrangement.kernel, self.arrangement.kernel_neighbors) = (kernel, kernel_neighbors);
            self.kappa = None;
            self.see_interfaces(None);
        }
    }

    /// See [`Arrangement::see_interfaces`]; there are no pushes here.
    pub fn see_interfaces(&mut self, known: Option<Interfaces>) {
        self.arrangement.see_interfaces(known, &|_| 0.0);
    }

    /// Sum over particles of what their region lacks, as a part of its number density: the medium beyond feels them as they
    /// feel it.
    fn beyond(&self, support: &[f64], wanted: &[f64]) -> f64 {
        if self.arrangement.interfaces().is_none() {
            return 0.0;
        }
        let lacks = |i: usize| self.arrangement.missing(i, support[i]).map_or(0.0, |(m, medium)| medium * m.share);
        reduce::sum(wanted.len(), |i| lacks(i) / wanted[i])
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
        let weights = parallel::map(sharpness.len(), |i| resolved(sharpness[i]));
        let mut held = target.near_discontinuities(positions, &wanted, &sharpness, ratio);
        let most = if self.settled { STEEP_FOR_ORDER } else { STEEP };
        let steep = parallel::map(wanted.len(), |i| {
            weights[i] < 0.5 && target.steepness(&at(positions, i), target.support(wanted[i], ratio)) > most
        });
        if steep.contains(&true) {
            held.resize(steep.len(), false);
            held.iter_mut().zip(steep).for_each(|(held, steep)| *held |= steep);
        }
        let kappa = self.kappa.unwrap_or(1.0);
        let mut frame = Frame { lambda, kappa, weights, pressure: Vec::new(), held, spacing };
        // The first evaluation tells kappa; from then on it barely changes.
        let now = self.evaluate(&frame);
        if self.kappa.is_none() {
            frame.kappa = now.fit.factor;
            self.kappa = Some(frame.kappa);
        } else {
            self.evaluations -= 1;
        }
        frame.forget_crowds(&parallel::map(now.wanted.len(), |i| now.sums[i].number_density / now.wanted[i]));
        frame
    }

    pub fn evaluate(&mut self, frame: &Frame) -> Evaluation<D> {
        self.evaluations += 1;
        let wanted = self.arrangement.target_density();
        let support = self.supports(&wanted, frame.kappa);
        self.arrangement.medium = frame.kappa;
        self.arrangement.mirror(&support);
        let sums = self.arrangement.densities(&support);
        let (n, w) = (wanted.len(), &frame.weights);
        let q = |i: usize| sums[i].number_density / wanted[i];
        let [total, weighted, pressure] = reduce::sums(n, |i| [w[i], w[i] * q(i), frame.pressure(i) * q(i)]);
        let mean = weighted / total;
        let [squares] = reduce::sums(n, |i| [w[i] * (q(i) / mean - 1.0).powi(2)]);
        let energy = 0.5 * squares + frame.lambda * (pressure + self.beyond(&support, &wanted));
        let set = interior(self.arrangement.target.domain, &self.arrangement.positions, &support, Some(w));
        let fit = fit(set.as_deref(), &wanted, |i| sums[i].number_density);
        Evaluation { energy, fit, support, wanted, sums, mean, mean_square: squares / total }
    }

    /// dE/dx in units of the particles' spacings.
    pub fn gradient(&self, frame: &Frame, now: &Evaluation<D>) -> Vec<[f64; D]> {
        let strength = parallel::map(now.wanted.len(), |i| {
            let q = now.sums[i].number_density / now.wanted[i];
            let pressure = frame.lambda * frame.pressure(i);
            let response = frame.weights[i] * (q / now.mean - 1.0 - now.mean_square) / now.mean + pressure;
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
            let mut own = -strength[i] * (now.sums[i].number_density + through_support);
            if let Some((missing, medium)) = self.arrangement.missing(i, now.support[i]) {
                let weight = frame.lambda / now.wanted[i] * medium;
                (0..D).for_each(|k| g[k] += weight * missing.gradient[k]);
                own -= weight * missing.slope / D as f64;
            }
            *g = sph::array(|k| frame.spacing[i] * (g[k] + own * slope[k]));
        });
        out
    }

    /// Epsilon as it is measured in the end: at solved support radii, and over what is resolved now.
    pub fn measured(&mut self) -> f64 {
        let (wanted, kappa) = (self.arrangement.target_density(), self.kappa.unwrap_or(1.0));
        let solved = self.arrangement.solve(&self.supports(&wanted, kappa), Search::EXACT);
        let (target, positions) = (&self.arrangement.target, &self.arrangement.positions);
        let ratio = support_over_spacing(D, self.arrangement.kernel_neighbors);
        let support = parallel::map(solved.len(), |i| target.support(wanted[i], ratio));
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

/// Logarithm of the target's change over a support radius beyond which a particle stays where the seeding has put it; of a
/// start in order, nothing less steep is placed better either.
pub(super) const STEEP: f64 = 3.0;
const STEEP_FOR_ORDER: f64 = 0.4;

/// Density within the support, over the target's, beyond which a particle counts less.
const CROWDED: f64 = 3.0;

/// Step of the differences of the target, in spacings: truncation and rounding both stay below 1e-6.
const GRADIENT_STEP: f64 = 1e-6;
