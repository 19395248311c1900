//! The skin of a mesh: its outer faces as end points, edges or triangles.
//!
//! A face that belongs to one cell only lies outside; points at the same place count as one, since some writers
//! give every cell its own. Faces of four nodes that are not plane are divided about their middle.

use super::bvh::{Aabb, Bvh};
use super::shapes::CellKind;
use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;
use std::collections::HashMap;

/// A facet has as many corners as there are dimensions.
type Facet<const D: usize> = ([[f64; D]; D], u32);

#[derive(Debug)]
pub(crate) struct Skin<const D: usize> {
    facets: Vec<Facet<D>>,
    tree: Bvh<D>,
}

/// Sorted canonical nodes of a face; unused entries are the largest number.
type FaceKey = [u32; 4];

impl<const D: usize> Skin<D> {
    pub(crate) fn empty() -> Self {
        Self { facets: vec![], tree: Bvh::new(vec![], &|_| Aabb::EMPTY) }
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
        let item = self.tree.nearest(x, |i| {
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
        let tree = Bvh::new((0..facets.len() as u32).collect(), &|i| Aabb::around(&facets[i as usize].0));
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

/// A vector across the facet, as long as the facet is wide.
pub(crate) fn normal<const D: usize>(p: &[[f64; D]; D]) -> SVector<f64, D> {
    let mut n = SVector::zeros();
    match D {
        1 => n[0] = p[0][0].abs().max(f64::MIN_POSITIVE),
        2 => (n[0], n[1]) = (p[1][1] - p[0][1], p[0][0] - p[1][0]),
        _ => {
            let (a, b) = (edge(&p[0], &p[1]), edge(&p[0], &p[2]));
            n = a.cross(&b) / a.dot(&a).max(b.dot(&b)).sqrt();
        }
    }
    n
}

/// Whether the diagonals of a quad (nearly) meet the same plane: its corners span no volume.
fn is_plane<const D: usize>(p: &[[f64; D]]) -> bool {
    let edges = SMatrix::<f64, D, 3>::from_columns(&[edge(&p[0], &p[1]), edge(&p[0], &p[2]), edge(&p[0], &p[3])]);
    // The Gram determinant is the squared volume.
    let gram = edges.tr_mul(&edges);
    gram.determinant() <= 1e-14 * gram[(0, 0)] * gram[(1, 1)] * gram[(2, 2)]
}

fn edge<const D: usize>(from: &[f64; D], to: &[f64; D]) -> SVector<f64, D> {
    SVector::from(*to) - SVector::from(*from)
}

pub(crate) fn closest_on_facet<const D: usize>(p: &[[f64; D]; D], x: &[f64; D]) -> [f64; D] {
    let at = |k: usize| SVector::from(p[k]);
    match D {
        1 => p[0],
        2 => closest_on_segment(&at(0), &at(1), &SVector::from(*x)).into(),
        _ => closest_on_triangle(&at(0), &at(1), &at(2), &SVector::from(*x)).into(),
    }
}

pub(crate) fn closest_on_segment<const D: usize>(
    a: &SVector<f64, D>,
    b: &SVector<f64, D>,
    x: &SVector<f64, D>,
) -> SVector<f64, D> {
    let ab = b - a;
    let length = ab.dot(&ab);
    let t = if length > 0.0 { ((x - a).dot(&ab) / length).clamp(0.0, 1.0) } else { 0.0 };
    a + ab * t
}

/// Projection onto the plane where it falls into the triangle, else the nearest edge.
fn closest_on_triangle<const D: usize>(
    a: &SVector<f64, D>,
    b: &SVector<f64, D>,
    c: &SVector<f64, D>,
    x: &SVector<f64, D>,
) -> SVector<f64, D> {
    let (u, v, w) = (b - a, c - a, x - a);
    let (uu, uv, vv, wu, wv) = (u.dot(&u), u.dot(&v), v.dot(&v), w.dot(&u), w.dot(&v));
    let det = uu * vv - uv * uv;
    if det > 0.0 {
        let (s, t) = ((vv * wu - uv * wv) / det, (uu * wv - uv * wu) / det);
        if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
            return a + u * s + v * t;
        }
    }
    let edges = [closest_on_segment(a, b, x), closest_on_segment(b, c, x), closest_on_segment(c, a, x)];
    let distance = |p: &SVector<f64, D>| (p - x).dot(&(p - x));
    edges.into_iter().min_by(|p, q| distance(p).total_cmp(&distance(q))).unwrap_or(*a)
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::*;

    #[test]
    fn nearest_points_of_triangles_agree_with_sampling() {
        let [a, b, c] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.2], [0.3, 1.0, -0.1]].map(SVector::from);
        let mut random = Random::new(9);
        for _ in 0..50 {
            let x = SVector::from(random.point::<3>().map(|v| 3.0 * v - 1.0));
            let p = closest_on_triangle(&a, &b, &c, &x);
            let d = (p - x).norm();
            for i in 0..=40 {
                for j in 0..=40 - i {
                    let (s, t) = (f64::from(i) / 40.0, f64::from(j) / 40.0);
                    let q = a + (b - a) * s + (c - a) * t;
                    assert!((q - x).norm() >= d - 1e-12);
                }
            }
        }
    }
}
