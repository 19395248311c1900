//! The skin of a mesh: its outer faces as end points, edges or triangles.
//!
//! A face that belongs to one cell only lies outside; points at the same place count as one, since some writers
//! give every cell its own. Faces of four nodes that are not plane are divided about their middle.

use super::facets::{Corners, FacetTree, closest_on_facet, edge, normal};
use super::shapes::CellKind;
use nalgebra::SMatrix;
use rayon::prelude::*;
use std::collections::HashMap;

/// A facet, and the cell that it is of.
type Facet<const D: usize> = (Corners<D>, u32);

#[derive(Debug)]
pub(crate) struct Skin<const D: usize> {
    facets: Vec<Facet<D>>,
    tree: FacetTree<D>,
}

/// Sorted canonical nodes of a face; unused entries are the largest number.
type FaceKey = [u32; 4];

impl<const D: usize> Skin<D> {
    pub(crate) fn empty() -> Self {
        Self::over(Vec::new())
    }

    pub(crate) fn of<'a>(points: &[[f64; D]], cells: impl Iterator<Item = (u32, CellKind, &'a [usize])>) -> Self {
        let canonical = merge_points(points);
        let mut faces: Vec<(FaceKey, u32, [usize; 4], u8)> = Vec::new();
        for (cell, kind, nodes) in cells {
            for face in kind.faces() {
                let mut corners = [usize::MAX; 4];
                let mut key = [u32::MAX; 4];
                for (k, &local) in face.iter().enumerate() {
                    corners[k] = nodes[local];
                    key[k] = canonical[nodes[local]];
                }
                key.sort_unstable();
                faces.push((key, cell, corners, face.len() as u8));
            }
        }
        faces.par_sort_unstable_by_key(|f| (f.0, f.1));
        let mut facets = Vec::new();
        for group in faces.chunk_by(|a, b| a.0 == b.0) {
            if let [(_, cell, corners, count)] = group {
                let p: Vec<[f64; D]> = corners[..usize::from(*count)].iter().map(|&i| points[i]).collect();
                add_facets(&p, *cell, &mut facets);
            }
        }
        Self::over(facets)
    }

    /// The nearest point of the hull and the cell to which it belongs.
    pub(crate) fn nearest(&self, x: &[f64; D]) -> Option<([f64; D], u32)> {
        let item = self.tree.nearest_below(x, f64::INFINITY, |i| {
            let d = edge(x, &closest_on_facet(&self.facets[i as usize].0, x));
            d.dot(&d)
        })?;
        let (corners, cell) = &self.facets[item as usize];
        Some((closest_on_facet(corners, x), *cell))
    }

    /// Without the facets on both sides of which there is a cell: where neighbors divide their common face
    /// differently, each half seems to be the only one.
    pub(crate) fn without_inner(self, is_inside: &(dyn Fn(&[f64; D]) -> bool + Sync)) -> Self {
        let facets: Vec<Facet<D>> = self
            .facets
            .into_par_iter()
            .filter(|(corners, _)| {
                let step = normal(corners) * 1e-6;
                let middle: [f64; D] = sph::array(|k| corners.iter().map(|c| c[k]).sum::<f64>() / D as f64);
                ![1.0, -1.0].iter().all(|s| is_inside(&sph::array(|k| middle[k] + s * step[k])))
            })
            .collect();
        Self::over(facets)
    }

    fn over(facets: Vec<Facet<D>>) -> Self {
        let tree = FacetTree::new(facets.len(), |i| &facets[i as usize].0);
        Self { facets, tree }
    }

    #[cfg(test)]
    pub(crate) fn len(&self) -> usize {
        self.facets.len()
    }
}

/// One number for all points at the same place.
pub(crate) fn merge_points<const D: usize>(points: &[[f64; D]]) -> Vec<u32> {
    let mut seen: HashMap<[u64; D], u32> = HashMap::with_capacity(points.len());
    points
        .iter()
        .enumerate()
        // Adding 0 turns -0 into 0.
        .map(|(i, p)| *seen.entry(p.map(|v| (v + 0.0).to_bits())).or_insert(i as u32))
        .collect()
}

fn add_facets<const D: usize>(p: &[[f64; D]], cell: u32, facets: &mut Vec<Facet<D>>) {
    let mut push = |corners: &[[f64; D]]| facets.push((std::array::from_fn(|k| corners[k]), cell));
    if p.len() < 4 {
        push(p);
    } else if is_plane(p) {
        push(&[p[0], p[1], p[2]]);
        push(&[p[0], p[2], p[3]]);
    } else {
        let middle = sph::array(|k| 0.25 * (p[0][k] + p[1][k] + p[2][k] + p[3][k]));
        for k in 0..4 {
            push(&[p[k], p[(k + 1) % 4], middle]);
        }
    }
}

/// Whether the diagonals of a quad (nearly) meet the same plane: its corners span no volume.
fn is_plane<const D: usize>(p: &[[f64; D]]) -> bool {
    let edges = SMatrix::<f64, D, 3>::from_columns(&[edge(&p[0], &p[1]), edge(&p[0], &p[2]), edge(&p[0], &p[3])]);
    // The Gram determinant is the squared volume.
    let gram = edges.tr_mul(&edges);
    gram.determinant() <= 1e-14 * gram[(0, 0)] * gram[(1, 1)] * gram[(2, 2)]
}
