//! Neighbor counts and closest pairs of every particle.

use super::Measured;
use serde::Serialize;
use sph::domain::Domain;
use sph::exchange::{Alone, Exchange};
use sph::neighbors::{Reach, Sources};
use sph::reduce;
use sph::sums::nearest;

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

impl<const D: usize> Measured<D> {
    /// Distance of each particle to the nearest other over the spacing n^(-1/d) there, in the particles' order; infinite where
    /// that is beyond the support.
    pub fn nearest_over_spacing(&self, domain: &Domain<D>) -> Vec<f64> {
        let support = self.tree.to_tree_order(&self.support);
        let found = nearest(domain, &[Sources::<D, 0>::new(&self.tree, &support, [], Reach::Target)]);
        let mut out = vec![f64::INFINITY; found.len()];
        for (near, &i) in found.iter().zip(self.tree.order()) {
            out[i as usize] = near.nearest / self.sums[i as usize].number_density.powf(-1.0 / D as f64);
        }
        out
    }

    /// Counts and closest pair over all particles.
    pub fn neighbors(&self, domain: &Domain<D>, kernel_neighbors: f64) -> NeighborFigures {
        self.neighbors_among(&Alone, domain, kernel_neighbors)
    }

    /// [`Self::neighbors`] of particles that are over several ranks.
    pub fn neighbors_among(
        &self,
        exchange: &dyn Exchange,
        domain: &Domain<D>,
        kernel_neighbors: f64,
    ) -> NeighborFigures {
        let support = self.tree.to_tree_order(&self.support);
        let sources = [Sources::<D, 0>::new(&self.tree, &support, [], Reach::Target)];
        let found = nearest(domain, &sources);
        let (order, own) = (self.tree.order(), self.own());
        let spacing = |i: usize| self.sums[order[i] as usize].number_density.powf(-1.0 / D as f64);
        let counted = |i: usize| (order[i] as usize) < own;
        let n = found.len();
        let count = exchange.sum(reduce::sum(n, |i| if counted(i) { f64::from(found[i].count) } else { 0.0 }));
        let closest = reduce::max(n, |i| if counted(i) { -found[i].nearest / spacing(i) } else { f64::NEG_INFINITY });
        NeighborFigures {
            kernel_neighbors,
            mean_count: count / exchange.count(own).max(1) as f64,
            closest_pair: -exchange.max(closest),
        }
    }
}
