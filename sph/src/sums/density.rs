//! Densities and their gradients at given support radii.
//!
//! n_a = sum_b W(r_ab, H_a), the particle itself included, and rho_a = sum_b w_b W(r_ab, H_a) (ALARIC sec. 1).

use super::registers::{separation, splat};
use crate::domain::Domain;
use crate::kernel::{Kernel, KernelName, with_kernel};
use crate::lanes::Real;
use crate::neighbors::{Batch, Compiled, LeafPass, Shape, Sources, compiled, in_shape};
use pulp::Simd;
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
    /// d weighted / d ln H at fixed positions.
    pub weighted_slope: f64,
    /// sum w_b grad_a W, the gradient of the weighted sum at fixed H.
    pub gradient: [f64; D],
}

impl<const D: usize> Default for DensitySums<D> {
    fn default() -> Self {
        Self { number_density: 0.0, slope: 0.0, weighted: 0.0, weighted_slope: 0.0, gradient: [0.0; D] }
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
pub(super) fn density_sums<const D: usize, const C: usize, K: Kernel, R: Real, S: Simd>(
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
    let (mut sum, mut bend, mut weighted, mut weighted_bend, mut gradient) = (zero, zero, zero, zero, [zero; D]);
    for j in 0..xs[0].len() {
        let (d, q) = separation::<D, R, S>(simd, &xs, &target, inverse, j);
        let (value, slope) = kernel.shape::<D, R, S>(simd, q);
        sum = R::add(simd, sum, value);
        bend = R::mul_add(simd, R::mul(simd, q, q), slope, bend);
        let pull = if C == 0 {
            slope
        } else {
            weighted = R::mul_add(simd, channels[0][j], value, weighted);
            let pull = R::mul(simd, channels[0][j], slope);
            weighted_bend = R::mul_add(simd, R::mul(simd, q, q), pull, weighted_bend);
            pull
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
    let slope = norm * (R::sum(simd, bend) - D as f64 * R::sum(simd, sum));
    let weighted = R::sum(simd, weighted);
    DensitySums {
        number_density,
        slope,
        weighted: if C == 0 { number_density } else { norm * weight * weighted },
        weighted_slope: if C == 0 {
            slope
        } else {
            norm * weight * (R::sum(simd, weighted_bend) - D as f64 * weighted)
        },
        gradient: slopes,
    }
}

/// Sums at the support radii of the first of `sources` (tree order in and out).
pub fn density<const D: usize, const C: usize, R: Real>(
    kernel: KernelName,
    domain: &Domain<D>,
    sources: &[Sources<'_, D, C>],
) -> Vec<DensitySums<D>> {
    compiled::<D, C, R, DensitySums<D>>(|shape| density_pass(kernel, shape)).drive(domain, sources, 1.0)
}

fn density_pass(kernel: KernelName, shape: Shape) -> Box<dyn Any> {
    in_shape!(shape, D, R => with_kernel!(kernel, kernel => match shape.channels {
        0 => Box::new(Compiled::<D, 0, R, DensitySums<D>>::new(DensityPass(kernel))),
        _ => Box::new(Compiled::<D, 1, R, DensitySums<D>>::new(DensityPass(kernel))),
    }))
}
