//! Neighbor counts and nearest neighbors.

use crate::domain::Domain;
use crate::neighbors::{Batch, Compiled, LeafPass, Shape, Sources, compiled, in_shape};
use pulp::Simd;
use std::any::Any;

/// Particles within the support radius, images and the particle itself included, and the nearest other.
#[derive(Debug, Clone, Copy)]
pub struct Near {
    pub count: u32,
    /// Distance of the nearest other; infinite where there is none.
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
    fn leaf<S: Simd>(&self, _: S, batch: &mut Batch<'_, D, 0, f64>, out: &mut [Near]) {
        let length = batch.unit().length;
        for (i, out) in batch.targets().zip(out) {
            let target = batch.target(i);
            let limit = (batch.support(i) / length).powi(2);
            // The particle itself is at distance 0 but for rounding; a second one there coincides with it.
            let (mut count, mut coincident, mut nearest) = (0, 0, f64::INFINITY);
            for j in 0..batch.len() {
                let x = batch.position(j);
                let r2 = (0..D).map(|k| (x[k] - target[k]).powi(2)).sum::<f64>();
                count += u32::from(r2 < limit);
                coincident += u32::from(r2 < COINCIDENT);
                nearest = if r2 >= COINCIDENT && r2 < nearest { r2 } else { nearest };
            }
            *out = Near { count, nearest: if coincident > 1 { 0.0 } else { nearest.sqrt() * length } };
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
