//! Finds a lattice of exactly N points that fits a periodic box: the edges of the box become integer vectors of the lattice.
//!
//! The points of a lattice with the basis B repeat with the edges E of a box if E = B M with a matrix M of integers, and
//! |det M| = N of them lie in it. Sought is the M for which E M^-1 is nearest to a rotated B: three vectors of the ideal lattice,
//! about as long as the edges and at right angles, that span exactly N cells. Two of them, for the shorter edges, are
//! taken from lists of vectors of about the right length. The third then solves a linear equation in integers, (a x b) . c = N;
//! of its solutions, a lattice in a plane, the one next to the right angle is taken. There are some N^2 strain^5
//! solutions, more with many divisors, so that N^(-2/5) is what can be hoped for.
//!
//! The measure is the strain: the largest |ln| of the three factors by which the ideal lattice is stretched to fit. No M can
//! have less than any two of its vectors need, so that vectors are left aside once a better M is known.

use super::integers::{Vector, cross, solve, solve_in_plane};
use nalgebra::Matrix3;

/// A lattice of one point per cell, and what is known of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Basis {
    /// Three vectors that span a cell of volume 1.
    pub vectors: [[f64; 3]; 3],
    /// How its symmetry divides directions.
    pub symmetry: PointGroup,
}

/// Rotations and reflections that leave a lattice as it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PointGroup {
    /// Of the cube: 48.
    Cubic,
    /// Of the hexagonal prism along z: 24.
    Hexagonal,
}

/// Edges of a box as vectors of a lattice, each in multiples of its basis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fitted<const D: usize> {
    pub edges: [[i64; D]; D],
    /// Largest |ln| of a stretch.
    pub strain: f64,
}

/// Pairs of vectors for which a third is sought: some tens of milliseconds.
const PAIRS: usize = 30_000;
/// Pairs that are looked at, at most, whatever their angle.
const LOOKS: usize = 25_000_000;
/// Vectors in a list, about.
const LISTED: f64 = 2e5;
/// Longer vectors are sampled rather than listed.
const LONG: f64 = 128.0;
/// Vectors that are sampled: of all directions, and about an axis.
const DIRECTIONS: usize = 1 << 17;
const TURNS: usize = 1 << 10;
/// The window of lengths widens by this factor until it holds what it must, up to a stretch that nothing needs.
const WIDENING: f64 = 1.6;
const FIRST_WINDOW: f64 = 0.05;
const WIDEST: f64 = 6.0;
/// A lattice that fits this well is not turned in search of a better one.
const GOOD: f64 = 1e-9;

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn length(a: &[f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// A vector of the lattice, in multiples of the basis and in space.
#[derive(Debug, Clone, Copy)]
struct Site {
    m: Vector,
    x: [f64; 3],
}

impl Basis {
    fn site(&self, m: Vector) -> Site {
        Site { m, x: sph::array(|k| (0..3).map(|i| m[i] as f64 * self.vectors[i][k]).sum()) }
    }

    /// Rows of the inverse: multiples of the basis from places.
    fn dual(&self) -> [[f64; 3]; 3] {
        let [a, b, c] = &self.vectors;
        let cross = |p: &[f64; 3], q: &[f64; 3]| {
            [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
        };
        [cross(b, c), cross(c, a), cross(a, b)]
    }

    /// One direction of those that the symmetry makes equal.
    fn is_distinct(&self, x: &[f64; 3]) -> bool {
        const ROUNDING: f64 = 1e-9;
        let [a, b, c] = *x;
        match self.symmetry {
            PointGroup::Cubic => a >= b - ROUNDING && b >= c - ROUNDING && c >= -ROUNDING,
            PointGroup::Hexagonal => b >= -ROUNDING && c >= -ROUNDING && b <= a * (1.0 / 3.0_f64).sqrt() + ROUNDING,
        }
    }

    /// Sites at `radius` from the origin, within a factor e^window, nearest first.
    fn at_distance(&self, radius: f64, window: f64) -> Vec<Site> {
        let window = window.min(LISTED / (8.0 * std::f64::consts::PI * radius.powi(3)));
        let (inner, outer) = (radius * (-window).exp(), radius * window.exp());
        let dual = self.dual();
        let reach = |i: usize| (outer * length(&dual[i])).ceil() as i64;
        let along = &self.vectors[2];
        let step = length(along);
        let mut found = Vec::new();
        for i in -reach(0)..=reach(0) {
            for j in -reach(1)..=reach(1) {
                let start = self.site([i, j, 0]).x;
                let middle = -dot(&start, along) / (step * step);
                let beside = dot(&start, &start) - (middle * step).powi(2);
                if beside > outer * outer {
                    continue;
                }
                let half = (outer * outer - beside).sqrt() / step;
                let hole = (inner * inner - beside).max(0.0).sqrt() / step;
                for k in (middle - half).ceil() as i64..=(middle + half).floor() as i64 {
                    if (k as f64 - middle).abs() >= hole - 1e-9 {
                        found.push(self.site([i, j, k]));
                    }
                }
            }
        }
        let miss = |site: &Site| (length(&site.x) / radius).ln().abs();
        found.retain(|site| site.m != [0; 3] && miss(site) <= window);
        found.sort_by(|p, q| miss(p).total_cmp(&miss(q)));
        found
    }

    /// The site whose multiples of the basis are those of `x`, rounded.
    fn near(&self, dual: &[[f64; 3]; 3], x: &[f64; 3]) -> Site {
        self.site(sph::array(|i| dot(&dual[i], x).round() as i64))
    }

    /// Candidates for the first vector.
    fn first(&self, radius: f64, window: f64) -> Vec<Site> {
        if radius <= LONG {
            let mut sites = self.at_distance(radius, window);
            sites.retain(|site| self.is_distinct(&site.x));
            return sites;
        }
        let dual = self.dual();
        // Points of a golden spiral, see the seeding by shells.
        let turn = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let direction = |i: usize| {
            let z = 1.0 - (2.0 * i as f64 + 1.0) / DIRECTIONS as f64;
            let across = (1.0 - z * z).sqrt();
            let (sin, cos) = (i as f64 * turn).sin_cos();
            [across * cos, across * sin, z]
        };
        let sites = (0..DIRECTIONS).map(direction).filter(|x| self.is_distinct(x));
        sites.map(|x| self.near(&dual, &x.map(|v| v * radius))).collect()
    }

    /// Candidates for the second vector beside `first`, where they are too long to be listed.
    fn around(&self, first: &Site, radius: f64) -> Vec<Site> {
        let dual = self.dual();
        let axis = first.x.map(|v| v / length(&first.x));
        let least = (0..3).fold(0, |best, k| if axis[k].abs() < axis[best].abs() { k } else { best });
        let mut u: [f64; 3] = sph::array(|k| f64::from(u8::from(k == least)) - axis[least] * axis[k]);
        let size = length(&u);
        u = u.map(|v| v / size);
        let v: [f64; 3] = sph::array(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            axis[i] * u[j] - axis[j] * u[i]
        });
        let at = |i: usize| {
            // Half a turn: the opposite vector makes the same lattice.
            let (sin, cos) = (std::f64::consts::PI * (i as f64 + 0.5) / TURNS as f64).sin_cos();
            self.near(&dual, &sph::array(|k| radius * (cos * u[k] + sin * v[k])))
        };
        (0..TURNS).map(at).collect()
    }

    /// The vector that spans `cells` cells with the two and is next to a right angle to both; none if there is none.
    fn third(&self, a: &Site, b: &Site, cells: i64) -> Option<Site> {
        let normal = cross(&a.m, &b.m);
        if normal == [0; 3] {
            return None;
        }
        let solved = solve(normal);
        if cells % solved.gcd != 0 {
            return None;
        }
        let [p, q] = self.reduced(if solved.gcd == 1 { [a.m, b.m] } else { solved.kernel });
        // Of the least one first, so that its multiple stays small.
        let one = self.nearest(solved.particular, [&p, &q], &[0.0; 3]);
        let some = one.map(|v| v * (cells / solved.gcd));
        Some(self.site(self.nearest(some, [&p, &q], &[0.0; 3])))
    }

    /// Gauss's reduction of two vectors: the shortest that span the same lattice.
    fn reduced(&self, [p, q]: [Vector; 2]) -> [Site; 2] {
        let (mut p, mut q) = (self.site(p), self.site(q));
        loop {
            if length(&p.x) > length(&q.x) {
                std::mem::swap(&mut p, &mut q);
            }
            let times = (dot(&p.x, &q.x) / dot(&p.x, &p.x)).round() as i64;
            let shorter = self.site(sph::array(|k| q.m[k] - times * p.m[k]));
            // Halfway between two of the same length, either is as short as can be.
            if !(length(&shorter.x) < (1.0 - 1e-12) * length(&q.x)) {
                return [p, q];
            }
            q = shorter;
        }
    }

    /// `m` shifted by multiples of the two, which are reduced, so that its part in their plane is next to that of `to`.
    fn nearest(&self, m: Vector, [p, q]: [&Site; 2], to: &[f64; 3]) -> Vector {
        let shifted = |m: &Vector| {
            let x = self.site(*m).x;
            let d: [f64; 3] = sph::array(|k| x[k] - to[k]);
            let (pp, pq, qq) = (dot(&p.x, &p.x), dot(&p.x, &q.x), dot(&q.x, &q.x));
            let (dp, dq) = (dot(&d, &p.x), dot(&d, &q.x));
            let area = pp * qq - pq * pq;
            let (s, t) = ((dp * qq - dq * pq) / area, (dq * pp - dp * pq) / area);
            let (s, t) = (s.round() as i64, t.round() as i64);
            sph::array(|k| m[k] - s * p.m[k] - t * q.m[k])
        };
        // Twice: the first time rounding may leave a step of large multiples.
        shifted(&shifted(&m))
    }
}

/// The strain that two vectors in the place of edges of these lengths need.
fn strain_of_two(a: &[f64; 3], b: &[f64; 3], edges: [f64; 2]) -> f64 {
    let (aa, bb) = (dot(a, a) / (edges[0] * edges[0]), dot(b, b) / (edges[1] * edges[1]));
    let ab = dot(a, b) / (edges[0] * edges[1]);
    let (mean, spread) = (0.5 * (aa + bb), (0.25 * (aa - bb).powi(2) + ab * ab).sqrt());
    let least = ((aa * bb - ab * ab) / (mean + spread)).max(f64::MIN_POSITIVE);
    0.5 * (mean + spread).ln().abs().max(least.ln().abs())
}

fn strain_of_three(sites: [&Site; 3], edges: &[f64; 3]) -> f64 {
    let gram = Matrix3::from_fn(|i, j| dot(&sites[i].x, &sites[j].x) / (edges[i] * edges[j]));
    let stretches = gram.symmetric_eigenvalues();
    stretches.iter().map(|s| 0.5 * s.max(f64::MIN_POSITIVE).ln().abs()).fold(0.0, f64::max)
}

/// Order of the edges from the shortest.
fn from_shortest<const D: usize>(edges: &[f64; D]) -> [usize; D] {
    let mut order: [usize; D] = sph::array(|k| k);
    order.sort_by(|&i, &j| edges[i].total_cmp(&edges[j]));
    order
}

/// The lattice of `cells` cells that fits a box best. `edges` are in units in which a cell has volume 1.
pub(super) fn fit_in_space(basis: &Basis, edges: &[f64; 3], cells: i64) -> Fitted<3> {
    let order = from_shortest(edges);
    let sorted = order.map(|k| edges[k]);
    let mut window = first_window(basis.symmetry, sorted[0] * sorted[1]);
    let mut search = Search { basis, edges: sorted, cells, best: None, pairs: PAIRS, looks: LOOKS };
    while window < WIDEST && !search.pass(window) {
        window *= WIDENING;
    }
    let (strain, sites) = search.best.unwrap_or_else(|| {
        let sites = [[1, 0, 0], [0, 1, 0], [0, 0, cells]].map(|m| basis.site(m));
        (strain_of_three(sites.each_ref(), &sorted), sites)
    });
    let mut found = [[0; 3]; 3];
    for (site, k) in sites.iter().zip(order) {
        found[k] = site.m;
    }
    Fitted { edges: found, strain }
}

/// The strain that about as many pairs as are to be tried have: of vectors at r and s there are (8 pi)^2 (r s strain)^3, less what
/// symmetry makes equal.
fn first_window(symmetry: PointGroup, lengths: f64) -> f64 {
    let equal = 2.0 * if symmetry == PointGroup::Cubic { 48.0 } else { 24.0 };
    let pairs = (8.0 * std::f64::consts::PI).powi(2) / equal;
    ((PAIRS as f64 / pairs).cbrt() / lengths).min(FIRST_WINDOW)
}

struct Search<'a> {
    basis: &'a Basis,
    /// From the shortest.
    edges: [f64; 3],
    cells: i64,
    best: Option<(f64, [Site; 3])>,
    /// Left to be tried and looked at.
    pairs: usize,
    looks: usize,
}

impl Search<'_> {
    fn strain(&self) -> f64 {
        self.best.map_or(f64::INFINITY, |(strain, _)| strain)
    }

    /// Tries vectors of no more strain than `window`; whether nothing better is left or to be afforded.
    fn pass(&mut self, window: f64) -> bool {
        let [short, middle, _] = self.edges;
        let listed = if middle <= LONG {
            let mut sites = self.basis.at_distance(middle, window);
            sites.retain(|site| site.m > [0; 3]);
            Some(sites)
        } else {
            None
        };
        for a in self.basis.first(short, window) {
            if (length(&a.x) / short).ln().abs() > window.min(self.strain()) {
                continue;
            }
            let sampled = if listed.is_none() { self.basis.around(&a, middle) } else { Vec::new() };
            let sites = listed.as_ref().unwrap_or(&sampled);
            self.looks = self.looks.saturating_sub(sites.len());
            // At this angle the two need more strain than the window has.
            let askew = length(&a.x) * middle * window.exp() * (2.0 * window).sinh();
            for b in sites.iter().filter(|b| dot(&a.x, &b.x).abs() <= askew) {
                self.try_pair(&a, b, window);
                if self.strain() < GOOD {
                    return true;
                }
            }
            if self.best.is_some() && (self.pairs == 0 || self.looks == 0) {
                return true;
            }
        }
        self.strain() <= window
    }

    fn try_pair(&mut self, a: &Site, b: &Site, window: f64) {
        let [short, middle, long] = self.edges;
        let limit = window.min(self.strain());
        if self.best.is_some() && self.pairs == 0 || strain_of_two(&a.x, &b.x, [short, middle]) > limit {
            return;
        }
        self.pairs = self.pairs.saturating_sub(1);
        let Some(c) = self.basis.third(a, b, self.cells) else { return };
        let beside = strain_of_two(&a.x, &c.x, [short, long]).max(strain_of_two(&b.x, &c.x, [middle, long]));
        if beside < self.strain() {
            let strain = strain_of_three([a, b, &c], &self.edges);
            if strain < self.strain() {
                self.best = Some((strain, [*a, *b, c]));
            }
        }
    }
}

/// The same in the plane, for a lattice with these two vectors, which span an area of 1.
pub(super) fn fit_in_plane(basis: &[[f64; 2]; 2], edges: &[f64; 2], cells: i64) -> Fitted<2> {
    let order = from_shortest(edges);
    let sorted = order.map(|k| edges[k]);
    let place = |m: [i64; 2]| -> [f64; 3] {
        let x = |k: usize| m[0] as f64 * basis[0][k] + m[1] as f64 * basis[1][k];
        [x(0), x(1), 0.0]
    };
    let mut best: Option<(f64, [[i64; 2]; 2])> = None;
    // Half of the vectors in a ring of this width.
    let mut window = (PAIRS as f64 / (std::f64::consts::TAU * sorted[0].powi(2))).min(FIRST_WINDOW);
    while window < WIDEST && best.is_none_or(|(strain, _)| strain > window) {
        for a in ring(basis, sorted[0], window) {
            let (gcd, one) = solve_in_plane(a);
            if cells % gcd != 0 {
                continue;
            }
            let some = one.map(|v| v * (cells / gcd));
            let (step, x) = (a.map(|v| v / gcd), place(a));
            let along = place(step);
            let shifted = |m: [i64; 2]| {
                let times = (dot(&place(m), &along) / dot(&along, &along)).round() as i64;
                [m[0] - times * step[0], m[1] - times * step[1]]
            };
            // Twice: the first time rounding may leave a step of large multiples.
            let b = shifted(shifted(some));
            let strain = strain_of_two(&x, &place(b), sorted);
            if best.is_none_or(|(least, _)| strain < least) {
                best = Some((strain, [a, b]));
            }
        }
        window *= WIDENING;
    }
    let (strain, vectors) = best.unwrap_or_else(|| {
        let vectors = [[1, 0], [0, cells]];
        (strain_of_two(&place(vectors[0]), &place(vectors[1]), sorted), vectors)
    });
    let mut found = [[0; 2]; 2];
    for (vector, k) in vectors.iter().zip(order) {
        found[k] = *vector;
    }
    Fitted { edges: found, strain }
}

/// Vectors of a plane lattice at `radius`, within a factor e^window, one of each pair of opposites; at most `PAIRS`.
fn ring(basis: &[[f64; 2]; 2], radius: f64, window: f64) -> Vec<[i64; 2]> {
    let (inner, outer) = (radius * (-window).exp(), radius * window.exp());
    let step = basis[1][0].hypot(basis[1][1]);
    let reach = (outer * step).ceil() as i64;
    let mut found = Vec::new();
    for i in 0..=reach {
        let start = basis[0].map(|v| v * i as f64);
        let middle = -(start[0] * basis[1][0] + start[1] * basis[1][1]) / (step * step);
        let beside = start[0].powi(2) + start[1].powi(2) - (middle * step).powi(2);
        if beside > outer * outer {
            continue;
        }
        let half = (outer * outer - beside).sqrt() / step;
        let hole = (inner * inner - beside).max(0.0).sqrt() / step;
        for j in (middle - half).ceil() as i64..=(middle + half).floor() as i64 {
            if (j as f64 - middle).abs() >= hole - 1e-9 && [i, j] > [0, 0] {
                found.push([i, j]);
            }
        }
    }
    let every = found.len().div_ceil(PAIRS).max(1);
    found.into_iter().step_by(every).collect()
}
