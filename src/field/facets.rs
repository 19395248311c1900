//! Facets of surfaces: the nearest point of one, and the search for the nearest of many.
//!
//! An axis-aligned box around a tilted facet extends far beyond it. A search by such boxes alone has to examine every facet whose box is
//! closer than the nearest facet, and on a fine surface this number grows as facets become smaller. Each node therefore also has a plate, a flat
//! cylinder along the mean normal of its facets, so that this number depends only on the curvature of the surface.

use super::bvh::{Aabb, Bvh};
use nalgebra::SVector;

/// As many corners as there are dimensions.
pub(crate) type Corners<const D: usize> = [[f64; D]; D];

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

pub(crate) fn edge<const D: usize>(from: &[f64; D], to: &[f64; D]) -> SVector<f64, D> {
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

/// Grows plates, by the size of the whole, so that rounding excludes nothing.
const MARGIN: f64 = 1e-12;

/// What the facets of a node are within: a cylinder along the normal.
#[derive(Debug, Clone, Copy)]
struct Plate<const D: usize> {
    center: SVector<f64, D>,
    normal: SVector<f64, D>,
    /// Half of it.
    height: f64,
    radius: f64,
}

impl<const D: usize> Plate<D> {
    /// Lengths of the parts of a vector along the normal and across it. Their squares add up to its own, but that difference has lost half of
    /// its digits where one of them is small, and a bound must not.
    fn parts(normal: &SVector<f64, D>, v: &SVector<f64, D>) -> (f64, f64) {
        let along = normal.dot(v);
        (along.abs(), (v - normal * along).norm())
    }

    fn around(facets: &[&Corners<D>]) -> (Self, SVector<f64, D>) {
        let corners = || facets.iter().flat_map(|f| f.iter()).map(|c| SVector::from(*c));
        let center = corners().sum::<SVector<f64, D>>() / (facets.len() * D) as f64;
        let across = facets.iter().map(|f| normal(f)).sum();
        let mut plate = Self { center, normal: unit(&across), height: 0.0, radius: 0.0 };
        for corner in corners() {
            let (along, aside) = Self::parts(&plate.normal, &(corner - center));
            plate.height = plate.height.max(along);
            plate.radius = plate.radius.max(aside);
        }
        (plate, across)
    }

    fn joined(
        (a, a_across): &(Self, SVector<f64, D>),
        (b, b_across): &(Self, SVector<f64, D>),
    ) -> (Self, SVector<f64, D>) {
        let across = a_across + b_across;
        let mut plate = Self { center: (a.center + b.center) * 0.5, normal: unit(&across), height: 0.0, radius: 0.0 };
        for part in [a, b] {
            let (along, aside) = Self::parts(&plate.normal, &(part.center - plate.center));
            let (cosine, sine) = Self::parts(&plate.normal, &part.normal);
            plate.height = plate.height.max(along + cosine * part.height + sine * part.radius);
            plate.radius = plate.radius.max(aside + sine * part.height + part.radius);
        }
        (plate, across)
    }

    /// No facet is nearer to `x`.
    fn distance_squared(&self, x: &SVector<f64, D>) -> f64 {
        let (along, aside) = Self::parts(&self.normal, &(x - self.center));
        (along - self.height).max(0.0).powi(2) + (aside - self.radius).max(0.0).powi(2)
    }
}

fn unit<const D: usize>(v: &SVector<f64, D>) -> SVector<f64, D> {
    // Normals that cancel leave any direction as good.
    v.try_normalize(0.0).filter(|n| n.iter().all(|c| c.is_finite())).unwrap_or_else(|| {
        let mut axis = SVector::zeros();
        axis[0] = 1.0;
        axis
    })
}

/// A tree over facets.
#[derive(Debug)]
pub(crate) struct FacetTree<const D: usize> {
    pub tree: Bvh<D>,
    plates: Vec<Plate<D>>,
}

impl<const D: usize> FacetTree<D> {
    /// Over so many facets, which `corners` tells.
    pub fn new<'a>(count: usize, corners: impl Fn(u32) -> &'a Corners<D>) -> Self {
        let tree = Bvh::new((0..count as u32).collect(), &|i| Aabb::around(corners(i)));
        let leaf = |items: &[u32]| Plate::around(&items.iter().map(|i| corners(*i)).collect::<Vec<_>>());
        let margin = MARGIN * tree.bounds().map_or(0.0, |b| b.reach());
        let grown = |(plate, _): (Plate<D>, SVector<f64, D>)| Plate {
            height: plate.height + margin,
            radius: plate.radius + margin,
            ..plate
        };
        let plates = tree.fold(leaf, Plate::joined).into_iter().map(grown).collect();
        Self { tree, plates }
    }

    /// As [`Bvh::nearest_below`].
    pub fn nearest_below(&self, x: &[f64; D], limit: f64, distance_squared: impl FnMut(u32) -> f64) -> Option<u32> {
        let y = SVector::from(*x);
        let bound = |node: usize, bounds: &Aabb<D>, best: f64| {
            let by_box = bounds.distance_squared(x);
            if by_box < best { by_box.max(self.plates[node].distance_squared(&y)) } else { by_box }
        };
        self.tree.nearest_by(bound, limit, distance_squared)
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::*;
    use sph::geometry::distance;
    use std::cell::Cell;

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

    /// A torus of `n` by `2 n` quads about an axis askew, each in two.
    fn torus(n: usize) -> Vec<Corners<3>> {
        let at = |i: usize, j: usize| {
            let [u, v] = [i as f64 / (2 * n) as f64, j as f64 / n as f64].map(|t| t * std::f64::consts::TAU);
            let [x, y, z] = [(1.0 + 0.4 * v.cos()) * u.cos(), (1.0 + 0.4 * v.cos()) * u.sin(), 0.4 * v.sin()];
            [0.6 * x - 0.8 * z, y, 0.8 * x + 0.6 * z]
        };
        let quads = (0..2 * n).flat_map(|i| (0..n).map(move |j| (i, j)));
        quads
            .flat_map(|(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]])
            .collect()
    }

    #[test]
    fn the_nearest_of_curved_flat_and_scattered_facets_is_found() {
        let mut random = Random::new(5);
        let scattered: Vec<Corners<3>> = (0..300)
            .map(|_| {
                let at: [f64; 3] = random.point();
                std::array::from_fn(|_| sph::array(|k| at[k] + 0.2 * random.unit()))
            })
            .collect();
        let flat = torus(16).into_iter().map(|f| f.map(|c| [c[0], c[1], 0.3 * c[0]])).collect();
        for facets in [torus(16), flat, scattered] {
            let tree = FacetTree::new(facets.len(), |i| &facets[i as usize]);
            for _ in 0..200 {
                let x = random.point::<3>().map(|v| 4.0 * v - 2.0);
                let away = |i: u32| distance(&x, &closest_on_facet(&facets[i as usize], &x)).powi(2);
                let found = tree.nearest_below(&x, f64::INFINITY, away).map(away).unwrap();
                let expected = (0..facets.len() as u32).map(away).fold(f64::INFINITY, f64::min);
                assert_eq!(found, expected, "{x:?}");
                assert_eq!(tree.nearest_below(&x, expected, away), None);
            }
        }
        let outline: Vec<Corners<2>> =
            (0..100).map(|i| [i, i + 1].map(|i| (f64::from(i) * 0.0628).sin_cos()).map(|(s, c)| [c, s])).collect();
        let tree = FacetTree::new(outline.len(), |i| &outline[i as usize]);
        for _ in 0..200 {
            let x = random.point::<2>().map(|v| 4.0 * v - 2.0);
            let away = |i: u32| distance(&x, &closest_on_facet(&outline[i as usize], &x)).powi(2);
            let found = tree.nearest_below(&x, f64::INFINITY, away).map(away);
            assert_eq!(found, Some((0..100).map(away).fold(f64::INFINITY, f64::min)), "{x:?}");
        }
    }

    /// Many times as many facets are little more work.
    #[test]
    fn few_facets_are_looked_at_of_a_surface_of_many() {
        let looks = |n: usize| {
            let facets = torus(n);
            let tree = FacetTree::new(facets.len(), |i| &facets[i as usize]);
            let (mut random, looks) = (Random::new(7), Cell::new(0));
            for _ in 0..500 {
                let [u, v]: [f64; 2] = random.point::<2>().map(|t| t * std::f64::consts::TAU);
                let depth = 0.4 * (0.5 + 0.4 * random.unit());
                let [x, y, z] = [(1.0 + depth * v.cos()) * u.cos(), (1.0 + depth * v.cos()) * u.sin(), depth * v.sin()];
                let x = [0.6 * x - 0.8 * z, y, 0.8 * x + 0.6 * z];
                tree.nearest_below(&x, f64::INFINITY, |i| {
                    looks.set(looks.get() + 1);
                    distance(&x, &closest_on_facet(&facets[i as usize], &x)).powi(2)
                });
            }
            f64::from(looks.get()) / 500.0
        };
        let (few, many) = (looks(20), looks(160));
        assert!(many < 2.0 * few && many < 80.0, "{few} of 1600, {many} of 102400");
    }
}
