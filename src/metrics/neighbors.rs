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
    /// Smallest distance of two particles (or of one and its periodic image) over the spacing n^(-1/d) there. The image of a particle
    /// in a wall is no other particle: it stands for the wall.
    pub closest_pair: f64,
    /// Smallest distance of a particle from a flat wall that mirrors, over the spacing there; none where there is no such wall.
    pub closest_wall: Option<f64>,
}

impl NeighborFigures {
    /// In words.
    pub fn describe(&self) -> String {
        let pair = match self.closest_pair.is_finite() {
            true => format!("closest pair {:.2} spacings apart", self.closest_pair),
            false => "no two within a support radius".to_owned(),
        };
        let wall = self.closest_wall.map_or_else(String::new, |wall| format!("; {wall:.2} from a wall that mirrors"));
        format!("{:.1} on average; {pair}{wall}", self.mean_count)
    }
}

impl<const D: usize> Measured<D> {
    /// Distance of each particle to the nearest other over the spacing n^(-1/d) there, in the particles' order; infinite where
    /// that is beyond the support.
    pub fn nearest_over_spacing(&self, domain: &Domain<D>) -> Vec<f64> {
        let support = self.tree.to_tree_order(&self.support);
        let domain = &domain.without_mirrors();
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
        // Of two particles, one is never nearer to the other's image in a wall than to the other.
        let apart = if domain.has_mirrors() { nearest(&domain.without_mirrors(), &sources) } else { found };
        let least = |of: &(dyn Fn(usize) -> f64 + Sync)| {
            -exchange.max(reduce::max(n, |i| if counted(i) { -of(i) / spacing(i) } else { f64::NEG_INFINITY }))
        };
        let from_wall = |i: usize| domain.distance_to_mirror(&self.tree.position(i));
        NeighborFigures {
            kernel_neighbors,
            mean_count: count / exchange.count(own).max(1) as f64,
            closest_pair: least(&|i| apart[i].nearest),
            closest_wall: domain.has_mirrors().then(|| least(&from_wall)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sph::domain::{Axis, Region};
    use sph::kernel::{KernelName, default_kernel_neighbors};

    /// Of places along the first axis, in the middle of the others; and the distances in units of the spacing, one by one.
    fn figures<const D: usize>(axis: Axis, places: &[f64]) -> (NeighborFigures, [f64; 2]) {
        let domain = Domain { lo: [0.0; D], hi: [1.0; D], axes: [axis; D], region: Region::Box };
        let positions = std::array::from_fn(|k| places.iter().map(|x| if k == 0 { *x } else { 0.5 }).collect());
        let (masses, guess) = (vec![1.0 / places.len() as f64; places.len()], vec![0.5; places.len()]);
        let neighbors = default_kernel_neighbors(D);
        let measured = Measured::new(KernelName::WendlandC4, &domain, &positions, &masses, &guess, neighbors);
        let spacing = |i: usize| measured.sums[i].number_density.powf(-1.0 / D as f64);
        let apart = |a: f64, b: f64| match axis {
            Axis::Periodic => (a - b).abs().min(1.0 - (a - b).abs()),
            Axis::Walls { .. } => (a - b).abs(),
        };
        let mut expected = [f64::INFINITY; 2];
        for (i, x) in places.iter().enumerate() {
            let others = places.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, y)| apart(*x, *y));
            expected[0] = expected[0].min(others.fold(f64::INFINITY, f64::min) / spacing(i));
            expected[1] = expected[1].min(x.min(1.0 - x) / spacing(i));
        }
        (measured.neighbors(&domain, neighbors), expected)
    }

    #[test]
    fn the_image_of_a_particle_in_a_wall_is_no_pair() {
        fn in_dimension<const D: usize>() {
            let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
            let places = [0.01, 0.15, 0.5, 0.9];
            let (walls, [pair, wall]) = figures::<D>(Axis::REFLECTING, &places);
            assert!(near(walls.closest_pair, pair), "{D}-D: {walls:?}, expected {pair}");
            assert!(near(walls.closest_wall.unwrap(), wall), "{D}-D: {walls:?}, expected {wall}");
            assert!(walls.describe().ends_with("from a wall that mirrors"), "{D}-D: {}", walls.describe());
            let (periodic, [pair, _]) = figures::<D>(Axis::Periodic, &places);
            assert!(near(periodic.closest_pair, pair), "{D}-D: {periodic:?}, expected {pair}");
            assert_eq!(periodic.closest_wall, None);
            let (one, _) = figures::<D>(Axis::REFLECTING, &[0.2]);
            assert!(one.describe().contains("no two within") && !one.describe().contains("inf"), "{}", one.describe());
        }
        in_dimension::<1>();
        in_dimension::<2>();
        in_dimension::<3>();
    }
}
