//! Linear cells in VTK's node order: shape functions, their inverse, faces and decomposition into simplices.
//!
//! Parametric coordinates lie in [0, 1]; triangles and tetrahedra (and a wedge's cross-section) have
//! `r + s (+ t) <= 1`. A pyramid is a hexahedron whose upper four nodes coincide, as in VTK.

use nalgebra::{SMatrix, SVector};

/// Tolerance of inside tests in parametric coordinates: neighbors overlap by it, so that no gap opens.
const INSIDE: f64 = 1e-9;
const MAX_NODES: usize = 8;

pub(crate) type Weights = [f64; MAX_NODES];
type Gradients = [[f64; 3]; MAX_NODES];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CellKind {
    Line,
    Triangle,
    Quad,
    Tetrahedron,
    Hexahedron,
    Wedge,
    Pyramid,
}

impl CellKind {
    /// By VTK's number.
    pub(crate) fn from_vtk(number: u8) -> Option<Self> {
        Some(match number {
            3 => Self::Line,
            5 => Self::Triangle,
            9 => Self::Quad,
            10 => Self::Tetrahedron,
            12 => Self::Hexahedron,
            13 => Self::Wedge,
            14 => Self::Pyramid,
            _ => return None,
        })
    }

    pub(crate) fn nodes(self) -> usize {
        match self {
            Self::Line => 2,
            Self::Triangle => 3,
            Self::Quad | Self::Tetrahedron => 4,
            Self::Pyramid => 5,
            Self::Wedge => 6,
            Self::Hexahedron => 8,
        }
    }

    pub(crate) fn dimension(self) -> usize {
        match self {
            Self::Line => 1,
            Self::Triangle | Self::Quad => 2,
            _ => 3,
        }
    }

    /// Faces as local nodes: end points, edges, triangles and quads.
    pub(crate) fn faces(self) -> &'static [&'static [usize]] {
        match self {
            Self::Line => &[&[0], &[1]],
            Self::Triangle => &[&[0, 1], &[1, 2], &[2, 0]],
            Self::Quad => &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
            Self::Tetrahedron => &[&[0, 1, 3], &[1, 2, 3], &[2, 0, 3], &[0, 2, 1]],
            Self::Hexahedron => {
                &[&[0, 4, 7, 3], &[1, 2, 6, 5], &[0, 1, 5, 4], &[3, 7, 6, 2], &[0, 3, 2, 1], &[4, 5, 6, 7]]
            }
            Self::Wedge => &[&[0, 1, 2], &[3, 5, 4], &[0, 3, 4, 1], &[1, 4, 5, 2], &[2, 5, 3, 0]],
            Self::Pyramid => &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]],
        }
    }

    /// Shape functions and their gradients at `u`.
    pub(crate) fn shape(self, [r, s, t]: [f64; 3]) -> (Weights, Gradients) {
        let mut n = [0.0; MAX_NODES];
        let mut g = [[0.0; 3]; MAX_NODES];
        match self {
            Self::Line => {
                n[..2].copy_from_slice(&[1.0 - r, r]);
                (g[0][0], g[1][0]) = (-1.0, 1.0);
            }
            Self::Triangle => {
                n[..3].copy_from_slice(&[1.0 - r - s, r, s]);
                g[..3].copy_from_slice(&[[-1.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
            }
            Self::Tetrahedron => {
                n[..4].copy_from_slice(&[1.0 - r - s - t, r, s, t]);
                g[0] = [-1.0; 3];
                for k in 0..3 {
                    g[k + 1][k] = 1.0;
                }
            }
            Self::Quad => quad(r, s, &mut n[..4], &mut g[..4]),
            Self::Hexahedron | Self::Pyramid => {
                let mut base = ([0.0; 4], [[0.0; 3]; 4]);
                quad(r, s, &mut base.0, &mut base.1);
                for k in 0..4 {
                    let (b, d) = (base.0[k], base.1[k]);
                    n[k] = b * (1.0 - t);
                    g[k] = [d[0] * (1.0 - t), d[1] * (1.0 - t), -b];
                    if self == Self::Hexahedron {
                        n[k + 4] = b * t;
                        g[k + 4] = [d[0] * t, d[1] * t, b];
                    }
                }
                if self == Self::Pyramid {
                    n[4] = t;
                    g[4] = [0.0, 0.0, 1.0];
                }
            }
            Self::Wedge => {
                let b = [1.0 - r - s, r, s];
                let d = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]];
                for k in 0..3 {
                    n[k] = b[k] * (1.0 - t);
                    n[k + 3] = b[k] * t;
                    g[k] = [d[k][0] * (1.0 - t), d[k][1] * (1.0 - t), -b[k]];
                    g[k + 3] = [d[k][0] * t, d[k][1] * t, b[k]];
                }
            }
        }
        (n, g)
    }

    fn center(self) -> [f64; 3] {
        match self {
            Self::Triangle | Self::Wedge => [1.0 / 3.0, 1.0 / 3.0, 0.5],
            Self::Pyramid => [0.5, 0.5, 0.25],
            Self::Tetrahedron => [0.25; 3],
            _ => [0.5; 3],
        }
    }

    fn is_inside(self, [r, s, t]: [f64; 3]) -> bool {
        let within = |v: f64| (-INSIDE..=1.0 + INSIDE).contains(&v);
        match self {
            Self::Line => within(r),
            Self::Triangle => r >= -INSIDE && s >= -INSIDE && r + s <= 1.0 + INSIDE,
            Self::Tetrahedron => r >= -INSIDE && s >= -INSIDE && t >= -INSIDE && r + s + t <= 1.0 + INSIDE,
            Self::Quad => within(r) && within(s),
            Self::Hexahedron | Self::Pyramid => within(r) && within(s) && within(t),
            Self::Wedge => r >= -INSIDE && s >= -INSIDE && r + s <= 1.0 + INSIDE && within(t),
        }
    }

    /// Gauss points and weights, exact for a linear field times the cell's Jacobian.
    pub(crate) fn quadrature(self) -> Vec<([f64; 3], f64)> {
        let line = super::quadrature::rule(2);
        let triangle = [[1.0 / 6.0, 1.0 / 6.0], [2.0 / 3.0, 1.0 / 6.0], [1.0 / 6.0, 2.0 / 3.0]];
        let square = || line.iter().flat_map(|&(r, a)| line.iter().map(move |&(s, b)| ([r, s], a * b)));
        match self {
            Self::Line => line.iter().map(|&(r, a)| ([r, 0.0, 0.0], a)).collect(),
            Self::Triangle => triangle.iter().map(|&[r, s]| ([r, s, 0.0], 1.0 / 6.0)).collect(),
            Self::Quad => square().map(|([r, s], a)| ([r, s, 0.0], a)).collect(),
            // One point is exact: the Jacobian is constant.
            Self::Tetrahedron => vec![([0.25; 3], 1.0 / 6.0)],
            Self::Hexahedron | Self::Pyramid => {
                square().flat_map(|([r, s], a)| line.iter().map(move |&(t, b)| ([r, s, t], a * b))).collect()
            }
            Self::Wedge => {
                triangle.iter().flat_map(|&[r, s]| line.iter().map(move |&(t, b)| ([r, s, t], b / 6.0))).collect()
            }
        }
    }

    /// Simplices that fill the cell, as weights of its nodes at their corners.
    fn simplices(self) -> Vec<Vec<Weights>> {
        let corner = |i: usize| {
            let mut w = [0.0; MAX_NODES];
            w[i] = 1.0;
            w
        };
        let mean = |nodes: &[usize]| {
            let mut w = [0.0; MAX_NODES];
            nodes.iter().for_each(|&i| w[i] = 1.0 / nodes.len() as f64);
            w
        };
        let n = self.nodes();
        if n == self.dimension() + 1 {
            return vec![(0..n).map(corner).collect()];
        }
        let all: Vec<usize> = (0..n).collect();
        let hub = mean(&all);
        let mut parts = Vec::new();
        for face in self.faces() {
            match face.len() {
                2 | 3 => parts.push(face.iter().map(|&i| corner(i)).chain([hub]).collect()),
                _ => {
                    let middle = mean(face);
                    for k in 0..4 {
                        parts.push(vec![corner(face[k]), corner(face[(k + 1) % 4]), middle, hub]);
                    }
                }
            }
        }
        parts
    }
}

fn quad(r: f64, s: f64, n: &mut [f64], g: &mut [[f64; 3]]) {
    let (p, q) = (1.0 - r, 1.0 - s);
    n.copy_from_slice(&[p * q, r * q, r * s, p * s]);
    g.copy_from_slice(&[[-q, -p, 0.0], [q, -r, 0.0], [s, r, 0.0], [-s, p, 0.0]]);
}

/// Volume element (signed) at `u`.
pub(crate) fn jacobian<const D: usize>(kind: CellKind, corners: &[[f64; D]], u: [f64; 3]) -> f64 {
    determinant(&tangents(&kind.shape(u).1, corners))
}

/// Weights of the nodes at `x`, if the cell holds it. Newton's method on the shape functions; cells that are
/// `skewed` (their Jacobian changes sign) and failures go by simplices, which keep linear fields exact.
pub(crate) fn locate<const D: usize>(
    kind: CellKind,
    corners: &[[f64; D]],
    skewed: bool,
    x: &[f64; D],
) -> Option<Weights> {
    if !skewed && let Some(u) = invert(kind, corners, x) {
        return kind.is_inside(u).then(|| kind.shape(u).0);
    }
    locate_in_simplices(kind, corners, x, -INSIDE)
}

/// Weights of the nodes at `x`, which lies in the cell or a little beyond: never negative, sum 1.
pub(crate) fn locate_nearest<const D: usize>(
    kind: CellKind,
    corners: &[[f64; D]],
    skewed: bool,
    x: &[f64; D],
) -> Weights {
    let mut w = locate(kind, corners, skewed, x)
        .or_else(|| locate_in_simplices(kind, corners, x, f64::NEG_INFINITY))
        .unwrap_or_else(|| {
            let mut w = [0.0; MAX_NODES];
            w[..kind.nodes()].fill(1.0 / kind.nodes() as f64);
            w
        });
    w.iter_mut().for_each(|v| *v = v.max(0.0));
    let sum: f64 = w.iter().sum();
    w.map(|v| v / sum)
}

/// Absolute volume of the cell by its simplices, with the integral of each shape function.
pub(crate) fn simplex_integrals<const D: usize>(kind: CellKind, corners: &[[f64; D]]) -> Weights {
    let mut total = [0.0; MAX_NODES];
    let factorial = [1.0, 1.0, 2.0, 6.0][D];
    for simplex in kind.simplices() {
        let p: Vec<[f64; D]> = simplex.iter().map(|w| combine(w, corners)).collect();
        let volume = determinant(&edges(&p)).abs() / factorial;
        for w in &simplex {
            for i in 0..kind.nodes() {
                total[i] += volume * w[i] / (D as f64 + 1.0);
            }
        }
    }
    total
}

/// The simplex in which `x` lies deepest decides, unless `x` is further out than `limit`.
fn locate_in_simplices<const D: usize>(
    kind: CellKind,
    corners: &[[f64; D]],
    x: &[f64; D],
    limit: f64,
) -> Option<Weights> {
    let mut best = (limit, None);
    for simplex in kind.simplices() {
        let p: Vec<[f64; D]> = simplex.iter().map(|w| combine(w, corners)).collect();
        let Some(b) = solve(edges(&p), SVector::from(*x) - SVector::from(p[0])) else {
            continue;
        };
        let first = 1.0 - b.iter().sum::<f64>();
        let depth = b.iter().fold(first, |a, &v| a.min(v));
        if depth >= best.0 && depth.is_finite() {
            let mut w = [0.0; MAX_NODES];
            for (j, s) in simplex.iter().enumerate() {
                let share = if j == 0 { first } else { b[j - 1] };
                (0..MAX_NODES).for_each(|i| w[i] += share * s[i]);
            }
            best = (depth, Some(w));
        }
    }
    best.1
}

/// Parametric coordinates of `x` (they may lie outside the cell); `None` where Newton's method fails.
fn invert<const D: usize>(kind: CellKind, corners: &[[f64; D]], x: &[f64; D]) -> Option<[f64; 3]> {
    let mut u = kind.center();
    for _ in 0..25 {
        let (n, g) = kind.shape(u);
        let at: [f64; D] = combine(&n, corners);
        let step = solve(tangents(&g, corners), SVector::from(*x) - SVector::from(at))?;
        let mut largest = 0.0_f64;
        for k in 0..D {
            // A long step leaves the region where the map is one to one.
            u[k] += step[k].clamp(-1.0, 1.0);
            largest = largest.max(step[k].abs());
        }
        // Convergence is quadratic: what is left is the square of the step.
        if largest < 1e-7 {
            return Some(u);
        }
        if !u.iter().all(|v| v.abs() < 1e3) {
            break;
        }
    }
    let at: [f64; D] = combine(&kind.shape(u).0, corners);
    let miss = (0..D).map(|k| (x[k] - at[k]).powi(2)).sum::<f64>().sqrt();
    (miss <= 1e-13 * super::bvh::Aabb::around(corners).diagonal()).then_some(u)
}

/// `sum_i w_i corners_i`.
pub(crate) fn combine<const D: usize>(w: &Weights, corners: &[[f64; D]]) -> [f64; D] {
    sph::array(|k| corners.iter().zip(w).map(|(c, w)| w * c[k]).sum())
}

/// Columns `dx/du_k`.
fn tangents<const D: usize>(g: &Gradients, corners: &[[f64; D]]) -> SMatrix<f64, D, D> {
    SMatrix::from_fn(|row, column| corners.iter().zip(g).map(|(c, g)| g[column] * c[row]).sum())
}

/// Columns from the first corner of a simplex to the others.
fn edges<const D: usize>(p: &[[f64; D]]) -> SMatrix<f64, D, D> {
    SMatrix::from_fn(|row, column| p[column + 1][row] - p[0][row])
}

/// `nalgebra` has determinants of matrices whose size is a number, not a parameter.
fn determinant<const D: usize>(m: &SMatrix<f64, D, D>) -> f64 {
    match D {
        1 => m[(0, 0)],
        2 => m.fixed_view::<2, 2>(0, 0).determinant(),
        _ => m.fixed_view::<3, 3>(0, 0).determinant(),
    }
}

/// Solves `m u = b`; `None` for a singular matrix.
pub(super) fn solve<const D: usize>(m: SMatrix<f64, D, D>, b: SVector<f64, D>) -> Option<SVector<f64, D>> {
    m.try_inverse().map(|inverse| inverse * b).filter(|u| u.iter().all(|v| v.is_finite()))
}

/// Whether the Jacobian changes sign over the corners and the center (the apex of a pyramid aside).
pub(crate) fn is_skewed<const D: usize>(kind: CellKind, corners: &[[f64; D]]) -> bool {
    if kind.nodes() == kind.dimension() + 1 {
        return false;
    }
    let at: Vec<[f64; 3]> = match kind {
        CellKind::Quad => vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]],
        CellKind::Wedge => (0..6).map(|i| [f64::from(i % 3 == 1), f64::from(i % 3 == 2), f64::from(i / 3)]).collect(),
        CellKind::Pyramid => (0..4).map(|i| [f64::from(i & 1), f64::from(i >> 1), 0.0]).collect(),
        _ => (0..8).map(|i| [f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)]).collect(),
    };
    let center = jacobian(kind, corners, kind.center());
    at.into_iter().any(|u| jacobian(kind, corners, u) * center.signum() < -1e-12 * center.abs()) || center == 0.0
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::*;

    pub(crate) fn unit_cell(kind: CellKind) -> Vec<[f64; 3]> {
        let q = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        match kind {
            CellKind::Tetrahedron => {
                vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
            }
            CellKind::Hexahedron => [0.0, 1.0].iter().flat_map(|&z| q.iter().map(move |p| [p[0], p[1], z])).collect(),
            CellKind::Wedge => {
                [0.0, 1.0].iter().flat_map(|&z| [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|p| [p[0], p[1], z])).collect()
            }
            _ => q.iter().map(|p| [p[0], p[1], 0.0]).chain([[0.5, 0.5, 1.0]]).collect(),
        }
    }

    const SOLIDS: [(CellKind, f64); 4] = [
        (CellKind::Tetrahedron, 1.0 / 6.0),
        (CellKind::Hexahedron, 1.0),
        (CellKind::Wedge, 0.5),
        (CellKind::Pyramid, 1.0 / 3.0),
    ];

    #[test]
    fn warped_cells_are_located_and_keep_linear_fields() {
        let mut random = Random::new(11);
        let f = |x: &[f64; 3]| 2.0 + x[0] - 3.0 * x[1] + 0.7 * x[2];
        for (kind, _) in SOLIDS {
            for _ in 0..50 {
                let corners: Vec<[f64; 3]> =
                    unit_cell(kind).iter().map(|c| c.map(|v| v + 0.3 * (random.unit() - 0.5))).collect();
                let values: Vec<f64> = corners.iter().map(f).collect();
                for _ in 0..20 {
                    // A convex mix of nodes lies inside a cell that is nearly convex; take shape functions' own.
                    let mut u: [f64; 3] = random.point();
                    if !kind.is_inside(u) {
                        u = kind.center();
                    }
                    let x = combine(&kind.shape(u).0, &corners);
                    let w = locate(kind, &corners, is_skewed(kind, &corners), &x).expect("inside");
                    let v: f64 = w.iter().zip(&values).map(|(w, v)| w * v).sum();
                    assert!((v - f(&x)).abs() < 1e-10, "{kind:?} {v} {}", f(&x));
                }
            }
            let corners = unit_cell(kind);
            assert!(locate(kind, &corners, false, &[1.2, 0.5, 0.5]).is_none());
            assert!(locate(kind, &corners, false, &[-1e-6, 0.1, 0.1]).is_none());
            for c in &corners {
                assert!(locate(kind, &corners, false, c).is_some(), "{kind:?} corner {c:?}");
            }
        }
    }

    #[test]
    fn volumes_by_gauss_and_by_simplices_agree() {
        for (kind, volume) in SOLIDS {
            let corners = unit_cell(kind);
            let gauss: f64 = kind.quadrature().iter().map(|(u, w)| w * jacobian(kind, &corners, *u)).sum();
            assert!((gauss - volume).abs() < 1e-14, "{kind:?}: {gauss}");
            let simplices: f64 = simplex_integrals(kind, &corners).iter().sum();
            assert!((simplices - volume).abs() < 1e-14, "{kind:?}: {simplices}");
        }
    }

    #[test]
    fn gradients_match_differences() {
        let u = [0.2, 0.3, 0.25];
        for kind in [CellKind::Line, CellKind::Triangle, CellKind::Quad].into_iter().chain(SOLIDS.map(|s| s.0)) {
            let (_, g) = kind.shape(u);
            for k in 0..kind.dimension() {
                let mut v = u;
                v[k] += 1e-6;
                let (b, a) = (kind.shape(v).0, kind.shape(u).0);
                for i in 0..kind.nodes() {
                    assert!(((b[i] - a[i]) / 1e-6 - g[i][k]).abs() < 1e-8, "{kind:?} {i} {k}");
                }
            }
        }
    }

    #[test]
    fn a_twisted_cell_is_recognized() {
        let mut corners = unit_cell(CellKind::Hexahedron);
        assert!(!is_skewed(CellKind::Hexahedron, &corners));
        corners.swap(4, 6);
        assert!(is_skewed(CellKind::Hexahedron, &corners));
    }
}
