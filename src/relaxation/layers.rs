//! Particles in layers thinner than their spacing, which move along these: across a layer no sum over neighbors tells where they belong. Free to leave
//! it, they make room for each other there, and the sheet buckles.

use super::snapshot::rows;
use crate::target::{Positions, Target, at};
use serde::{Deserialize, Serialize};
use sph::parallel;

/// The unit normal of the layer that each particle is in, in their order; zero of those that are in none.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Layers<const D: usize> {
    #[serde(with = "rows")]
    normals: Vec<[f64; D]>,
    /// All there is is one layer.
    pub are_all: bool,
}

impl<const D: usize> Layers<D> {
    /// Of a region that is one layer.
    pub const fn of_all(normals: Vec<[f64; D]>) -> Self {
        Self { normals, are_all: true }
    }

    /// Those of particles at `positions` for which `is_unresolved`, where n* is `number_density`; none where there are none.
    pub fn find(
        target: &Target<'_, D>,
        positions: &Positions<D>,
        number_density: &[f64],
        is_unresolved: impl Fn(usize) -> bool + Sync,
    ) -> Option<Self> {
        let normal = |i: usize| target.layer_normal(&at(positions, i), target.spacing(number_density[i]));
        let normals =
            parallel::map(number_density.len(), |i| is_unresolved(i).then(|| normal(i)).flatten().unwrap_or([0.0; D]));
        let is_in_one = |normal: &[f64; D]| normal.iter().any(|n| *n != 0.0);
        normals.iter().any(is_in_one).then_some(Self { normals, are_all: false })
    }

    /// The part of a vector at particle `i` that is along its layer.
    pub fn along(&self, i: usize, v: [f64; D]) -> [f64; D] {
        let normal = &self.normals[i];
        let across: f64 = (0..D).map(|k| v[k] * normal[k]).sum();
        sph::array(|k| v[k] - across * normal[k])
    }

    /// Follows particles into a new order.
    pub fn reorder(&mut self, order: &[u32]) {
        self.normals = parallel::reordered(&self.normals, order);
    }

    /// Whether these are of `count` particles.
    pub fn is_of(&self, count: usize) -> bool {
        self.normals.len() == count && self.normals.iter().flatten().all(|n| n.is_finite())
    }
}
