//! Directions away from the closest neighbor.

use crate::domain::Domain;
use crate::neighbors::{Batch, Compiled, LeafPass, Shape, Sources, compiled, in_shape};
use pulp::Simd;
use std::any::Any;

/// Squared distance, in units of the leaf's reach, below which particles are at the same place.
const COINCIDENT: f64 = 1e-24;

/// Unit vector away from the closest neighbor; zero where there is none.
#[derive(Debug, Clone, Copy)]
pub struct Away<const D: usize>(pub [f64; D]);

impl<const D: usize> Default for Away<D> {
    fn default() -> Self {
        Self([0.0; D])
    }
}

/// Channel 0: the target spacing.
struct ClosestPass;

impl<const D: usize> LeafPass<D, 1, f64> for ClosestPass {
    type Output = Away<D>;

    #[inline(always)]
    fn leaf<S: Simd>(&self, _: S, batch: &mut Batch<'_, D, 1, f64>, out: &mut [Away<D>]) {
        for (i, out) in batch.targets().zip(out) {
            let target = batch.target(i);
            let own = batch.target_channel(0, i);
            let (mut nearest, mut away) = (f64::INFINITY, [0.0; D]);
            for j in 0..batch.len() {
                let x = batch.position(j);
                let d: [f64; D] = crate::array(|k| target[k] - x[k]);
                let r2 = d.iter().map(|v| v * v).sum::<f64>();
                let scaled = r2 / (own + batch.channel(0, j)).powi(2);
                if r2 >= COINCIDENT && scaled < nearest {
                    nearest = scaled;
                    away = crate::array(|k| d[k] / r2.sqrt());
                }
            }
            *out = Away(away);
        }
    }
}

/// The direction away from the closest neighbor of every particle of `sources[0]`, among those within its support radius.
/// Channel 0 is the spacing that distances are measured by: a pair's by the sum of both.
pub fn away_from_closest<const D: usize>(domain: &Domain<D>, sources: &[Sources<'_, D, 1>]) -> Vec<Away<D>> {
    compiled::<D, 1, f64, Away<D>>(closest_pass).drive(domain, sources, 1.0)
}

fn closest_pass(shape: Shape) -> Box<dyn Any> {
    in_shape!(shape, D => Box::new(Compiled::<D, 1, f64, Away<D>>::new(ClosestPass)))
}
