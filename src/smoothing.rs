//! SPH sums: densities with their gradients, the support radii that belong to a neighbor number, and the
//! pressure force.
//!
//! With n_a = sum_b W(r_ab, H_a) (self included) the support radius solves n_a V_d H_a^d = N_H (ALARIC
//! sec. 1); rho_a = sum_b m_b W(r_ab, H_a).

use crate::domain::Domain;
use crate::kernel::{Kernel, KernelName, unit_ball_volume};
use crate::neighbors::lanes::Real;
use crate::neighbors::{Batch, Compiled, LeafPass, Reach, Shape, Sources, Tree, compiled, drive, in_shape};
use crate::with_kernel;
use pulp::Simd;
use rayon::prelude::*;
use std::any::Any;

/// Sums over the neighbors of one particle at a given support radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DensitySums<const D: usize> {
    /// Number density n = sum W.
    pub number_density: f64,
    /// d n / d ln H at fixed positions.
    pub slope: f64,
    /// sum w_b W; equals the number density where there are no weights.
    pub weighted: f64,
    /// sum w_b grad_a W, the gradient of the weighted sum at fixed H.
    pub gradient: [f64; D],
}

impl<const D: usize> Default for DensitySums<D> {
    fn default() -> Self {
        Self { number_density: 0.0, slope: 0.0, weighted: 0.0, gradient: [0.0; D] }
    }
}

/// Density and gradient at the targets' support radii, with `C` = 0 (no weights) or 1 (weights in channel 0).
struct DensityPass<K>(K);

impl<const D: usize, const C: usize, K: Kernel, R: Real> LeafPass<D, C, R> for DensityPass<K> {
    type Output = DensitySums<D>;

    #[inline(always)]
    fn leaf<S: Simd>(&self, simd: S, batch: &mut Batch<'_, D, C, R>, out: &mut [Self::Output]) {
        for (i, out) in batch.targets().zip(out) {
            *out = density_sums::<D, C, K, R, S>(simd, self.0, batch, i, batch.support(i));
        }
    }
}

#[inline(always)]
fn density_sums<const D: usize, const C: usize, K: Kernel, R: Real, S: Simd>(
    simd: S,
    kernel: K,
    batch: &Batch<'_, D, C, R>,
    i: usize,
    support: f64,
) -> DensitySums<D> {
    let (xs, channels) = batch.registers::<S>();
    let target = splat::<D, R, S>(simd, &batch.target(i));
    let length = batch.unit().length;
    let inverse = R::splat(simd, R::from_f64(length / support));
    let zero = R::splat(simd, R::from_f64(0.0));
    let (mut sum, mut bend, mut weighted, mut gradient) = (zero, zero, zero, [zero; D]);
    for j in 0..xs[0].len() {
        let (d, q) = separation::<D, R, S>(simd, &xs, &target, inverse, j);
        let (value, slope) = kernel.shape::<D, R, S>(simd, q);
        sum = R::add(simd, sum, value);
        bend = R::mul_add(simd, R::mul(simd, q, q), slope, bend);
        let pull = if C == 0 {
            slope
        } else {
            weighted = R::mul_add(simd, channels[0][j], value, weighted);
            R::mul(simd, channels[0][j], slope)
        };
        for k in 0..D {
            gradient[k] = R::mul_add(simd, d[k], pull, gradient[k]);
        }
    }
    let norm = K::SIGMA[D - 1] / support.powi(D as i32);
    let weight = if C == 0 { 1.0 } else { batch.unit().channels[0] };
    let number_density = norm * R::sum(simd, sum);
    // No closures here: they would be compiled without the vector instructions.
    let mut slopes = [0.0; D];
    for k in 0..D {
        slopes[k] = norm * weight * length / (support * support) * R::sum(simd, gradient[k]);
    }
    DensitySums {
        number_density,
        slope: norm * (R::sum(simd, bend) - D as f64 * R::sum(simd, sum)),
        weighted: if C == 0 { number_density } else { norm * weight * R::sum(simd, weighted) },
        gradient: slopes,
    }
}

/// A position in every lane. A loop, since a closure would be compiled without the vector instructions.
#[inline(always)]
pub(crate) fn splat<const D: usize, R: Real, S: Simd>(simd: S, x: &[R; D]) -> [R::Vector<S>; D] {
    let mut out = [R::splat(simd, x[0]); D];
    for k in 1..D {
        out[k] = R::splat(simd, x[k]);
    }
    out
}

/// Displacement from the target and q = r / H of register `j`.
#[inline(always)]
pub(crate) fn separation<const D: usize, R: Real, S: Simd>(
    simd: S,
    xs: &[&[R::Vector<S>]; D],
    target: &[R::Vector<S>; D],
    inverse_support: R::Vector<S>,
    j: usize,
) -> ([R::Vector<S>; D], R::Vector<S>) {
    let mut d = *target;
    for k in 0..D {
        d[k] = R::sub(simd, xs[k][j], target[k]);
    }
    let mut r2 = R::mul(simd, d[0], d[0]);
    for &dk in &d[1..] {
        r2 = R::mul_add(simd, dk, dk, r2);
    }
    (d, R::mul(simd, R::sqrt(simd, r2), inverse_support))
}

/// Sums at the support radii of the first of `sources` (tree order in and out).
pub fn density<const D: usize, const C: usize, R: Real>(
    kernel: KernelName,
    domain: &Domain<D>,
    sources: &[Sources<'_, D, C>],
) -> Vec<DensitySums<D>> {
    let pass = compiled::<D, C, R, DensitySums<D>>(|shape| density_pass(kernel, shape));
    drive(domain, sources, 1.0, &*pass)
}

fn density_pass(kernel: KernelName, shape: Shape) -> Box<dyn Any> {
    in_shape!(shape, D, R => with_kernel!(kernel, kernel => match shape.channels {
        0 => Box::new(Box::new(DensityPass(kernel)) as Compiled<D, 0, R, DensitySums<D>>),
        _ => Box::new(Box::new(DensityPass(kernel)) as Compiled<D, 1, R, DensitySums<D>>),
    }))
}

/// Support radius and the sums at it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Solved<const D: usize> {
    pub support: f64,
    pub sums: DensitySums<D>,
}

struct SolvePass<K> {
    kernel: K,
    kernel_neighbors: f64,
    largest: f64,
}

/// Relative accuracy of n V_d H^d = N_H; finer than what f32 sums resolve.
const SUPPORT_TOLERANCE: f64 = 1e-6;
/// Newton converges in three or four steps, bisection needs some forty.
const MAX_SUPPORT_STEPS: usize = 80;
/// Reach of the first gathering over the largest guess of the leaf.
const SOLVE_MARGIN: f64 = 1.15;

impl<const D: usize, const C: usize, K: Kernel, R: Real> LeafPass<D, C, R> for SolvePass<K> {
    type Output = Solved<D>;

    #[inline(always)]
    fn leaf<S: Simd>(&self, simd: S, batch: &mut Batch<'_, D, C, R>, out: &mut [Self::Output]) {
        for (i, out) in batch.targets().zip(out) {
            *out = self.solve::<D, C, R, S>(simd, batch, i);
        }
    }
}

impl<K: Kernel> SolvePass<K> {
    /// Newton in ln H on ln(n V_d H^d / N_H), bracketed; gathers anew where the root lies beyond the reach.
    #[inline(always)]
    fn solve<const D: usize, const C: usize, R: Real, S: Simd>(
        &self,
        simd: S,
        batch: &mut Batch<'_, D, C, R>,
        i: usize,
    ) -> Solved<D> {
        let target = self.kernel_neighbors / unit_ball_volume(D);
        let (mut lo, mut hi) = (0.0_f64, f64::INFINITY);
        let mut support = batch.support(i).min(self.largest);
        let mut sums = DensitySums::default();
        for _ in 0..MAX_SUPPORT_STEPS {
            if support > batch.unit().length {
                batch.gather_again(support * SOLVE_MARGIN);
            }
            sums = density_sums::<D, C, K, R, S>(simd, self.kernel, batch, i, support);
            let count = sums.number_density * support.powi(D as i32);
            let excess = (count / target).ln();
            if excess.abs() < SUPPORT_TOLERANCE || (support >= self.largest && excess < 0.0) {
                break;
            }
            if excess > 0.0 {
                hi = support
            } else {
                lo = support
            }
            if hi / lo < 1.0 + 1e-12 {
                break;
            }
            let rate = D as f64 + sums.slope / sums.number_density;
            let newton = support * (-excess / rate).clamp(-1.0, 1.0).exp();
            support = if rate > 0.0 && newton > lo && newton < hi {
                newton
            } else if hi.is_finite() {
                if lo > 0.0 { (lo * hi).sqrt() } else { 0.5 * hi }
            } else {
                2.0 * support
            }
            .min(self.largest);
        }
        Solved { support, sums }
    }
}

/// Solves n V_d H^d = N_H for every particle; `guess` in tree order, as is the result. No radius exceeds
/// `largest` (where fewer than N_H particles exist in an open domain, there is no solution).
pub fn solve_support_radii<const D: usize, const C: usize, R: Real>(
    kernel: KernelName,
    domain: &Domain<D>,
    sources: &[Sources<'_, D, C>],
    kernel_neighbors: f64,
    largest: f64,
) -> Vec<Solved<D>> {
    let pass = compiled::<D, C, R, Solved<D>>(|shape| solve_pass(kernel, kernel_neighbors, largest, shape));
    drive(domain, sources, SOLVE_MARGIN, &*pass)
}

fn solve_pass(kernel: KernelName, kernel_neighbors: f64, largest: f64, shape: Shape) -> Box<dyn Any> {
    in_shape!(shape, D, R => with_kernel!(kernel, kernel => {
        let pass = SolvePass { kernel, kernel_neighbors, largest };
        match shape.channels {
            0 => Box::new(Box::new(pass) as Compiled<D, 0, R, Solved<D>>),
            _ => Box::new(Box::new(pass) as Compiled<D, 1, R, Solved<D>>),
        }
    }))
}

/// Largest support radius that makes sense in a domain: with periodic or mirrored images any number of
/// neighbors can be had, in an open one no more than the particles that exist.
pub fn largest_support<const D: usize>(domain: &Domain<D>, count: usize, kernel_neighbors: f64) -> f64 {
    let mean = (kernel_neighbors * domain.volume() / (unit_ball_volume(D) * count.max(1) as f64)).powf(1.0 / D as f64);
    let diagonal = domain.extent().iter().map(|e| e * e).sum::<f64>().sqrt();
    2.0 * diagonal.max(mean)
}

struct ScatterPass<K>(K);

/// Channel 0: strength times sigma / H^(d+2); channel 1: 1 / H.
impl<const D: usize, K: Kernel, R: Real> LeafPass<D, 2, R> for ScatterPass<K> {
    type Output = Vector<D>;

    #[inline(always)]
    fn leaf<S: Simd>(&self, simd: S, batch: &mut Batch<'_, D, 2, R>, out: &mut [Self::Output]) {
        let length = batch.unit().length;
        let inverse_scale = R::splat(simd, R::from_f64(batch.unit().channels[1] * length));
        for (i, out) in batch.targets().zip(out) {
            let (xs, channels) = batch.registers::<S>();
            let target = splat::<D, R, S>(simd, &batch.target(i));
            let mut sum = [R::splat(simd, R::from_f64(0.0)); D];
            for j in 0..xs[0].len() {
                let inverse = R::mul(simd, channels[1][j], inverse_scale);
                let (d, q) = separation::<D, R, S>(simd, &xs, &target, inverse, j);
                let (_, slope) = self.0.shape::<D, R, S>(simd, q);
                let pull = R::mul(simd, channels[0][j], slope);
                for k in 0..D {
                    sum[k] = R::mul_add(simd, d[k], pull, sum[k]);
                }
            }
            let scale = batch.unit().channels[0] * length;
            for k in 0..D {
                out.0[k] = scale * R::sum(simd, sum[k]);
            }
        }
    }
}

/// A vector that a pass yields; the default is zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vector<const D: usize>(pub [f64; D]);

impl<const D: usize> Default for Vector<D> {
    fn default() -> Self {
        Self([0.0; D])
    }
}

/// Particles that act on others with a strength A_b at their own support radius; all in tree order.
pub struct Actors<'a, const D: usize> {
    pub tree: &'a Tree<D>,
    pub support: &'a [f64],
    pub strength: &'a [f64],
    /// Acted on but not acting; for the first of several only.
    pub silent: bool,
}

/// sum_b A_b grad_a W(r_ab, H_b) at every particle a of `actors[0]`: what the particles that see a add to a
/// gradient. With [`DensitySums::gradient`], what a itself sees, it makes up every conservative SPH force.
pub fn scatter_gradient<const D: usize, R: Real>(
    kernel: KernelName,
    domain: &Domain<D>,
    actors: &[Actors<'_, D>],
) -> Vec<Vector<D>> {
    let norm = kernel.sigma(D);
    let prepared: Vec<(Vec<f64>, Vec<f64>)> = actors
        .iter()
        .map(|a| {
            let coefficient =
                a.support.par_iter().zip(a.strength).map(|(h, s)| s * norm / h.powi(D as i32 + 2)).collect();
            (coefficient, a.support.par_iter().map(|h| 1.0 / h).collect())
        })
        .collect();
    let sources: Vec<_> = actors
        .iter()
        .zip(&prepared)
        .map(|(a, (coefficient, inverse))| {
            let sources = Sources::new(a.tree, a.support, [coefficient.as_slice(), inverse.as_slice()], Reach::Source);
            if a.silent { sources.silent() } else { sources }
        })
        .collect();
    let pass = compiled::<D, 2, R, Vector<D>>(|shape| scatter_pass(kernel, shape));
    drive(domain, &sources, 1.0, &*pass)
}

fn scatter_pass(kernel: KernelName, shape: Shape) -> Box<dyn Any> {
    in_shape!(shape, D, R => with_kernel!(kernel, kernel => {
        Box::new(Box::new(ScatterPass(kernel)) as Compiled<D, 2, R, Vector<D>>)
    }))
}
