//! The sharp edges of a closed surface.

use super::winding::Facet;
use crate::field::bvh::{Aabb, Bvh};
use crate::field::facets::{closest_on_segment, normal};
use nalgebra::SVector;
use std::collections::HashMap;

/// Facets whose normals have a larger cosine between them are smooth there: as mirror images about edges have it, and a little more, since faces
/// may turn into each other over several facets.
const SMOOTH: f64 = 0.85;

/// Of a segment.
type Ends<const D: usize> = [[f64; D]; 2];

/// Segments between two facets, or corners in a plane, at which the surface is not smooth.
#[derive(Debug)]
pub(super) struct Edges<const D: usize> {
    /// Both ends; the same twice in a plane.
    ends: Vec<Ends<D>>,
    tree: Bvh<D>,
}

impl<const D: usize> Edges<D> {
    /// Those between facets that share their corners to the bit.
    pub fn new(facets: &[Facet<D>]) -> Self {
        let mut sides: HashMap<[[u64; D]; 2], (Ends<D>, SVector<f64, D>)> = HashMap::new();
        let mut ends = Vec::new();
        for facet in facets {
            let own = normal(facet).normalize();
            for side in sides_of(facet) {
                let mut key = side.map(|corner| corner.map(|v| (v + 0.0).to_bits()));
                key.sort_unstable();
                match sides.remove(&key) {
                    Some((_, other)) if own.dot(&other) >= SMOOTH => {}
                    Some(_) => ends.push(side),
                    None => {
                        sides.insert(key, (side, own));
                    }
                }
            }
        }
        // Cracks, and what more than two facets share.
        ends.extend(sides.into_values().map(|(side, _)| side));
        let tree = Bvh::new((0..ends.len() as u32).collect(), &|i| Aabb::around(&ends[i as usize]));
        Self { ends, tree }
    }

    pub fn is_within(&self, x: &[f64; D], reach: f64) -> bool {
        let place = SVector::from(*x);
        let away = |i: u32| {
            let [a, b] = self.ends[i as usize].map(SVector::from);
            (closest_on_segment(&a, &b, &place) - place).norm_squared()
        };
        !self.ends.is_empty() && self.tree.nearest_below(x, reach * reach, away).is_some()
    }
}

/// Of a triangle, or the ends of a segment.
fn sides_of<const D: usize>(facet: &Facet<D>) -> Vec<Ends<D>> {
    (0..D).map(|i| if D == 2 { [facet[i], facet[i]] } else { [facet[i], facet[(i + 1) % D]] }).collect()
}
