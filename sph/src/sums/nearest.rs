//! Neighbor counts and nearest neighbors.

use super::registers::{splat, squared_distance};
use crate::domain::Domain;
use crate::neighbors::{Batch, Compiled, LeafPass, Shape, Sources, compiled, in_shape};
use pulp::Simd;
use std::any::Any;

/// Particles within the support radius, images and the particle itself included, and the nearest other.
#[derive(Debug, Clone, Copy)]
pub struct Near {
    pub count: u32,
    /// Distance of the nearest other within the support radius; infinite where there is none.
    pub nearest: f64,
}

impl Default for Near {
    fn default() -> Self {
        Self { count: 0, nearest: f64::INFINITY }
    }
}

/// Squared distance, in units of the leaf's reach, below which particles are at the same place.
const COINCIDENT: f64 = 1e-24;

struct NearestPass;

impl<const D: usize> LeafPass<D, 0, f64> for NearestPass {
    type Output = Near;

    #[inline(always)]
    fn leaf<S: Simd>(&self, simd: S, batch: &mut Batch<'_, D, 0, f64>, out: &mut [Near]) {
        let length = batch.unit().length;
        let (zero, one) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0));
        let (none, same) = (simd.splat_f64s(f64::INFINITY), simd.splat_f64s(COINCIDENT));
        for (i, out) in batch.targets().zip(out) {
            let (xs, _) = batch.registers::<S>();
            let target = splat::<D, f64, S>(simd, &batch.target(i));
            let support = batch.support(i) / length;
            let limit = simd.splat_f64s(support * support);
            // The particle itself is at distance 0 but for rounding; a second one there coincides with it.
            let (mut count, mut coincident, mut nearest) = (zero, zero, none);
            for j in 0..xs[0].len() {
                let r2 = squared_distance::<D, f64, S>(simd, &xs, &target, j);
                let is_same = simd.less_than_f64s(r2, same);
                count = simd.add_f64s(count, simd.select_f64s(simd.less_than_f64s(r2, limit), one, zero));
                coincident = simd.add_f64s(coincident, simd.select_f64s(is_same, one, zero));
                nearest = simd.min_f64s(nearest, simd.select_f64s(is_same, none, r2));
            }
            let nearest = match simd.reduce_min_f64s(nearest) {
                _ if simd.reduce_sum_f64s(coincident) > 1.0 => 0.0,
                r2 if r2 < support * support => r2.sqrt() * length,
                _ => f64::INFINITY,
            };
            *out = Near { count: simd.reduce_sum_f64s(count) as u32, nearest };
        }
    }
}

/// Counts and nearest neighbors of every particle of `sources[0]` within its support radius.
pub fn nearest<const D: usize>(domain: &Domain<D>, sources: &[Sources<'_, D, 0>]) -> Vec<Near> {
    compiled::<D, 0, f64, Near>(nearest_pass).drive(domain, sources, 1.0)
}

fn nearest_pass(shape: Shape) -> Box<dyn Any> {
    in_shape!(shape, D => Box::new(Compiled::<D, 0, f64, Near>::new(NearestPass)))
}
