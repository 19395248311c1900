//! Generalized winding numbers of surfaces.
//!
//! w(x) = sum over facets of the angle that they are seen under from x, with the sign of the side, over the whole angle: 1 within a
//! closed surface whose normals point outward, 0 without, and in between near holes (Jacobson, Kavan and Sorkine-Hornung 2013,
//! ACM Trans. Graph. 32, 33). What is far is taken together: a node of the tree counts by the first two terms of the expansion
//!
//! w = sum_i N_i G_i + sum_ij M_ij d_i G_j,  G(r) = r / (S |r|^D), N = sum a n, M = sum a (c - p) n,
//!
//! about the mean p of its facets by area, where it is farther than [`FAR`] times its radius (Barill et al. 2018, ACM Trans. Graph.
//! 37, 43, eq. 15); S is the surface of the unit ball. O(log n) each.

use super::super::bvh::Bvh;
use std::f64::consts::TAU;

/// Corners of a facet: as many as there are dimensions.
pub(crate) type Facet<const D: usize> = [[f64; D]; D];

/// Distance over radius from which a node is far: the error of the expansion is then below 1e-2.
const FAR: f64 = 2.0;

/// What a node of the tree counts for from afar.
#[derive(Debug, Clone)]
struct Moments<const D: usize> {
    area: f64,
    center: [f64; D],
    /// Of a ball about the center that holds the node.
    radius: f64,
    normal: [f64; D],
    /// `[i][j]`: offset i, normal j.
    skew: [[f64; D]; D],
}

/// Sums for a whole tree of facets.
#[derive(Debug)]
pub(crate) struct Winding<const D: usize> {
    nodes: Vec<Moments<D>>,
}

/// Area vector of a facet: its normal times its area (length).
pub(crate) fn area_vector<const D: usize>(p: &Facet<D>) -> [f64; D] {
    let mut n = [0.0; D];
    if D == 2 {
        (n[0], n[1]) = (p[1][1] - p[0][1], p[0][0] - p[1][0]);
    } else {
        let u: [f64; 3] = sph::array(|k| p[1][k] - p[0][k]);
        let v: [f64; 3] = sph::array(|k| p[2][k] - p[0][k]);
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        n.iter_mut().zip(cross).for_each(|(n, c)| *n = 0.5 * c);
    }
    n
}

pub(crate) fn length<const D: usize>(v: &[f64; D]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

pub(crate) fn centroid<const D: usize>(p: &Facet<D>) -> [f64; D] {
    sph::array(|k| p.iter().map(|c| c[k]).sum::<f64>() / D as f64)
}

/// The share of the whole angle under which a facet is seen from `x` (van Oosterom and Strackee 1983, IEEE Trans. Biomed. Eng. 30,
/// 125, eq. 8).
pub(crate) fn share<const D: usize>(p: &Facet<D>, x: &[f64; D]) -> f64 {
    let at = |k: usize| -> [f64; D] { sph::array(|c| p[k][c] - x[c]) };
    let dot = |a: &[f64; D], b: &[f64; D]| (0..D).map(|k| a[k] * b[k]).sum::<f64>();
    if D == 2 {
        let (a, b) = (at(0), at(1));
        return (a[0] * b[1] - a[1] * b[0]).atan2(dot(&a, &b)) / TAU;
    }
    let (a, b, c) = (at(0), at(1), at(2));
    let (la, lb, lc) = (length(&a), length(&b), length(&c));
    let volume =
        a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
    let below = la * lb * lc + dot(&a, &b) * lc + dot(&b, &c) * la + dot(&c, &a) * lb;
    if volume == 0.0 { 0.0 } else { volume.atan2(below) / TAU }
}

impl<const D: usize> Winding<D> {
    pub(crate) fn new(tree: &Bvh<D>, facets: &[Facet<D>]) -> Self {
        let leaf = |items: &[u32]| moments(items.iter().map(|&i| &facets[i as usize]));
        Self { nodes: tree.fold(leaf, joined) }
    }

    /// w at `x`.
    pub(crate) fn value(&self, tree: &Bvh<D>, facets: &[Facet<D>], x: &[f64; D]) -> f64 {
        let (mut far, mut near) = (0.0, 0.0);
        let enter = |node: usize| {
            let m = &self.nodes[node];
            let r: [f64; D] = sph::array(|k| m.center[k] - x[k]);
            let square = r.iter().map(|c| c * c).sum::<f64>();
            if !(square > (FAR * m.radius).powi(2)) {
                return true;
            }
            far += seen_from_afar(m, &r, square);
            false
        };
        let mut enter = enter;
        tree.walk(|node, _| enter(node), |i| near += share(&facets[i as usize], x));
        far + near
    }
}

fn seen_from_afar<const D: usize>(m: &Moments<D>, r: &[f64; D], square: f64) -> f64 {
    let whole = if D == 2 { TAU } else { 2.0 * TAU };
    let below = if D == 2 { square } else { square * square.sqrt() };
    let first: f64 = (0..D).map(|k| m.normal[k] * r[k]).sum();
    let trace: f64 = (0..D).map(|k| m.skew[k][k]).sum();
    let twice: f64 = (0..D).map(|i| (0..D).map(|j| r[i] * m.skew[i][j] * r[j]).sum::<f64>()).sum();
    (first + trace - D as f64 * twice / square) / (whole * below)
}

fn moments<'a, const D: usize>(facets: impl Iterator<Item = &'a Facet<D>> + Clone) -> Moments<D> {
    let mut m = Moments { area: 0.0, center: [0.0; D], radius: 0.0, normal: [0.0; D], skew: [[0.0; D]; D] };
    let mut count = 0.0;
    let mut plain = [0.0; D];
    for p in facets.clone() {
        let (n, c) = (area_vector(p), centroid(p));
        let area = length(&n);
        m.area += area;
        count += 1.0;
        for k in 0..D {
            m.center[k] += area * c[k];
            plain[k] += c[k];
        }
    }
    m.center = if m.area > 0.0 { m.center.map(|c| c / m.area) } else { plain.map(|c| c / count) };
    for p in facets {
        let (n, c) = (area_vector(p), centroid(p));
        for i in 0..D {
            m.normal[i] += n[i];
            for j in 0..D {
                m.skew[i][j] += (c[i] - m.center[i]) * n[j];
            }
        }
        let reach = |corner: &[f64; D]| length(&std::array::from_fn::<_, D, _>(|k| corner[k] - m.center[k]));
        m.radius = p.iter().map(reach).fold(m.radius, f64::max);
    }
    m
}

fn joined<const D: usize>(a: &Moments<D>, b: &Moments<D>) -> Moments<D> {
    let area = a.area + b.area;
    let share = if area > 0.0 { a.area / area } else { 0.5 };
    let center: [f64; D] = sph::array(|k| share * a.center[k] + (1.0 - share) * b.center[k]);
    let mut m = Moments { area, center, radius: 0.0, normal: [0.0; D], skew: [[0.0; D]; D] };
    for part in [a, b] {
        let shift: [f64; D] = sph::array(|k| part.center[k] - center[k]);
        for i in 0..D {
            m.normal[i] += part.normal[i];
            for j in 0..D {
                m.skew[i][j] += part.skew[i][j] + shift[i] * part.normal[j];
            }
        }
        m.radius = m.radius.max(length(&shift) + part.radius);
    }
    m
}

/// Volume (area) that facets enclose by the divergence theorem, counted as often as they go around it; from `origin`, which
/// should be near.
pub(crate) fn enclosed<const D: usize>(facets: &[Facet<D>], origin: &[f64; D]) -> f64 {
    let part = |i: usize| {
        let (n, c) = (area_vector(&facets[i]), centroid(&facets[i]));
        (0..D).map(|k| n[k] * (c[k] - origin[k])).sum::<f64>() / D as f64
    };
    sph::reduce::sum(facets.len(), part)
}

#[cfg(test)]
mod tests {
    use super::super::super::bvh::Aabb;
    use super::super::super::testing::Random;
    use super::*;

    #[test]
    fn a_tree_agrees_with_the_sum_over_all() {
        let mut random = Random::new(4);
        let facets: Vec<Facet<3>> = (0..3000)
            .map(|_| {
                let p = random.point::<3>();
                sph::array(|_| {
                    let q = random.point::<3>();
                    sph::array(|k| p[k] + 0.05 * q[k])
                })
            })
            .collect();
        let tree = Bvh::new((0..3000).collect(), &|i| Aabb::around(&facets[i as usize]));
        let winding = Winding::new(&tree, &facets);
        for _ in 0..200 {
            let x = random.point::<3>().map(|v| 3.0 * v - 1.0);
            let sum: f64 = facets.iter().map(|f| share(f, &x)).sum();
            let fast = winding.value(&tree, &facets, &x);
            assert!((fast - sum).abs() < 0.01, "{fast} {sum}");
        }
    }

    #[test]
    fn a_tetrahedron_and_a_square_are_gone_around_once() {
        let [o, a, b, c] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let solid = [[o, b, a], [o, a, c], [o, c, b], [a, b, c]];
        let w = |x: [f64; 3]| solid.iter().map(|f| share(f, &x)).sum::<f64>();
        assert!((w([0.1; 3]) - 1.0).abs() < 1e-14 && w([0.4; 3]).abs() < 1e-14);
        assert!((enclosed(&solid, &[5.0; 3]) - 1.0 / 6.0).abs() < 1e-14);
        let corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        let square: Vec<Facet<2>> = (0..4).map(|i| [corners[i], corners[(i + 1) % 4]]).collect();
        let w = |x: [f64; 2]| square.iter().map(|f| share(f, &x)).sum::<f64>();
        assert!((w([0.5, 1.9]) - 1.0).abs() < 1e-14 && w([2.5, 1.0]).abs() < 1e-14);
        assert!((enclosed(&square, &[-1.0, 3.0]) - 4.0).abs() < 1e-14);
    }
}
