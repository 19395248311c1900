//! Neighbor counts and closest pairs of every particle.

use super::Measured;
use crate::domain::Domain;
use crate::neighbors::{Batch, LeafPass, Reach, Sources, for_each_target};
use crate::reduce;
use pulp::Simd;
use serde::Serialize;

/// Neighbor numbers of the final arrangement.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NeighborFigures {
    /// N_H that was asked for.
    pub kernel_neighbors: f64,
    /// Mean number of particles within the support, itself and images included.
    pub mean_count: f64,
    /// Smallest distance of two particles (or of one and its image) over the spacing n^(-1/d) there.
    pub closest_pair: f64,
}

/// Count within the support radius, and squared distance of the nearest other in units of it.
#[derive(Debug, Clone, Copy)]
struct Near {
    count: u32,
    nearest: f64,
}

impl Default for Near {
    fn default() -> Self {
        Self { count: 0, nearest: f64::INFINITY }
    }
}

/// Squared distance, in units of the leaf's reach, below which particles are at the same place.
const COINCIDENT: f64 = 1e-24;

struct NearestPass<'a> {
    support: &'a [f64],
}

impl<const D: usize> LeafPass<D, 0, f64> for NearestPass<'_> {
    type Output = Near;

    #[inline(always)]
    fn leaf<S: Simd>(&self, _: S, batch: &mut Batch<'_, D, 0, f64>, out: &mut [Near]) {
        let length = batch.unit().length;
        for (i, out) in batch.targets().zip(out) {
            let target = batch.target(i);
            let limit = (self.support[i] / length).powi(2);
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

pub(super) fn neighbor_figures<const D: usize>(
    measured: &Measured<D>,
    domain: &Domain<D>,
    kernel_neighbors: f64,
) -> NeighborFigures {
    let support = measured.tree.to_tree_order(&measured.support);
    let sources = [Sources::<D, 0>::new(&measured.tree, &support, [], Reach::Target)];
    let found = for_each_target::<D, 0, f64, _>(domain, &sources, 1.0, &NearestPass { support: &support });
    let order = measured.tree.order();
    let spacing = |i: usize| measured.sums[order[i] as usize].number_density.powf(-1.0 / D as f64);
    let n = found.len();
    NeighborFigures {
        kernel_neighbors,
        mean_count: reduce::sum(n, |i| f64::from(found[i].count)) / n.max(1) as f64,
        closest_pair: -reduce::max(n, |i| -found[i].nearest / spacing(i)),
    }
}
