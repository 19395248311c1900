//! The sharp edges of a closed surface.

use super::winding::Facet;
use crate::field::bvh::{Aabb, Bvh};
use sph::geometry::distance;
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
        let mut sides: HashMap<[[u64; D]; 2], (Ends<D>, [f64; D])> = HashMap::new();
        let mut ends = Vec::new();
        for facet in facets {
            let own = normal(facet);
            for side in sides_of(facet) {
                let mut key = side.map(|corner| corner.map(|v| (v + 0.0).to_bits()));
                key.sort_unstable();
                match sides.remove(&key) {
                    Some((_, other)) if (0..D).map(|k| own[k] * other[k]).sum::<f64>() >= SMOOTH => {}
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
        let away = |i: u32| {
            let [a, b] = self.ends[i as usize];
            let (along, from): ([f64; D], [f64; D]) = (sph::array(|k| b[k] - a[k]), sph::array(|k| x[k] - a[k]));
            let square: f64 = along.iter().map(|v| v * v).sum();
            let share = (0..D).map(|k| along[k] * from[k]).sum::<f64>() / square;
            let share = if square > 0.0 { share.clamp(0.0, 1.0) } else { 0.0 };
            distance(x, &sph::array(|k| a[k] + share * along[k])).powi(2)
        };
        !self.ends.is_empty() && self.tree.nearest_below(x, reach * reach, away).is_some()
    }
}

/// Of a triangle, or the ends of a segment.
fn sides_of<const D: usize>(facet: &Facet<D>) -> Vec<Ends<D>> {
    (0..D).map(|i| if D == 2 { [facet[i], facet[i]] } else { [facet[i], facet[(i + 1) % D]] }).collect()
}

/// The outward normal of a facet, of length 1.
pub(super) fn normal<const D: usize>(facet: &Facet<D>) -> [f64; D] {
    let edge = |i: usize| -> [f64; D] { sph::array(|k| facet[i][k] - facet[0][k]) };
    let across: [f64; D] = match D {
        1 => sph::array(|_| 1.0),
        2 => sph::array(|k| if k == 0 { edge(1)[1] } else { -edge(1)[0] }),
        _ => {
            let (a, b) = (edge(1), edge(2));
            sph::array(|k| a[(k + 1) % D] * b[(k + 2) % D] - a[(k + 2) % D] * b[(k + 1) % D])
        }
    };
    let length = across.iter().map(|v| v * v).sum::<f64>().sqrt();
    if length > 0.0 { across.map(|v| v / length) } else { across }
}
