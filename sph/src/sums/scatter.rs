//! Contributions of particles to others within their own support radius: the half of a conservative force that a gather omits.

use super::registers::{separation, splat};
use crate::domain::Domain;
use crate::kernel::{Kernel, KernelName, with_kernel};
use crate::lanes::Real;
use crate::neighbors::{Batch, Compiled, LeafPass, Reach, Shape, Sources, Tree, compiled, in_shape};
use crate::parallel;
use pulp::Simd;
use std::any::Any;

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
#[derive(Debug, Clone, Copy)]
pub struct Actors<'a, const D: usize> {
    pub tree: &'a Tree<D>,
    pub support: &'a [f64],
    pub strength: &'a [f64],
    /// Acted on but not acting; for the first of several only.
    pub silent: bool,
}

/// sum_b A_b grad_a W(r_ab, H_b) at every particle a of `actors[0]`: what the particles that see a add to a
/// gradient. With [`super::DensitySums::gradient`], what a itself sees, it makes up every conservative SPH force.
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
                parallel::map(a.support.len(), |i| a.strength[i] * norm / a.support[i].powi(D as i32 + 2));
            (coefficient, parallel::map(a.support.len(), |i| 1.0 / a.support[i]))
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
    compiled::<D, 2, R, Vector<D>>(|shape| scatter_pass(kernel, shape)).drive(domain, &sources, 1.0)
}

fn scatter_pass(kernel: KernelName, shape: Shape) -> Box<dyn Any> {
    in_shape!(shape, D, R => with_kernel!(kernel, kernel => {
        Box::new(Compiled::<D, 2, R, Vector<D>>::new(ScatterPass(kernel)))
    }))
}
