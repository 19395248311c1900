//! Gravity of particles on each other, by a tree (Barnes and Hut 1986) with quadrupoles.
//!
//! The constant of gravity is 1. In d dimensions the attraction between masses is S_d m / r^(d-1) with S = 2 pi, 2, 1: sheets,
//! filaments and points. Within the softening radius masses are spread as Wendland's C2 function (1 - u)^4 (1 + 4 u), as in
//! SWIFT. There are no periodic images.

use crate::lanes::{MAX_LANES, Real};
use crate::neighbors::Tree;
use crate::parallel;
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// Nodes that seem larger than this from the nearest place in a leaf, in radians, are opened.
pub const OPENING_ANGLE: f64 = 0.4;

/// Softening radius in the smallest spacing: three times a Plummer-equivalent length of half of it.
const SOFTENING: f64 = 1.5;

/// The softening radius that suits particles of these number densities.
pub fn softening_radius<const D: usize>(number_density: impl Iterator<Item = f64>) -> f64 {
    SOFTENING * number_density.fold(0.0_f64, f64::max).powf(-1.0 / D as f64)
}

/// S_d.
pub fn strength(d: usize) -> f64 {
    [std::f64::consts::TAU, 2.0, 1.0][d - 1]
}

/// Acceleration and potential at a particle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pull<const D: usize> {
    pub acceleration: [f64; D],
    /// Per mass, without what a particle is to itself.
    pub potential: f64,
}

/// The mass below a node.
#[derive(Debug, Clone, Copy)]
struct Moments<const D: usize> {
    mass: f64,
    center: [f64; D],
    /// Sum of m s_i s_j, s from the center.
    second: [[f64; D]; D],
    /// Nothing of it is farther from its center.
    radius: f64,
}

/// Masses that attract a leaf: as nodes, and one by one.
#[derive(Debug, Default)]
struct Attracting {
    /// Origin and unit of lengths in single precision: the middle of the leaf, and its size.
    origin: [f64; 3],
    unit: f64,
    /// Unit of masses in single precision.
    mass: f64,
    /// Place, mass and second moments, each in an array of its own.
    nodes: [Vec<f32>; 10],
    /// Particles in leaves beyond the softening radius.
    far: [Vec<f32>; 4],
    /// All others, the leaf's own among them, as they are.
    near: [Vec<f64>; 4],
}

impl Attracting {
    fn clear(&mut self) {
        self.nodes.iter_mut().chain(&mut self.far).for_each(Vec::clear);
        self.near.iter_mut().for_each(Vec::clear);
    }

    /// Fills up the last registers with masses of zero that are far off.
    fn pad(&mut self) {
        pad(&mut self.near, AWAY * self.unit);
        pad(&mut self.far, AWAY as f32);
        pad(&mut self.nodes, AWAY as f32);
    }

    /// A coordinate relative to the leaf: differences keep seven digits, as kernels' sums do.
    fn relative(&self, k: usize, x: f64) -> f32 {
        ((x - self.origin[k]) / self.unit) as f32
    }
}

/// Leaves that a thread takes at once.
const SHARE: usize = 16;
/// Where masses of zero are, in sizes of a leaf.
const AWAY: f64 = 1e6;

/// Appends what has no mass. Places are the first three arrays.
fn pad<F: Copy + Default, const K: usize>(arrays: &mut [Vec<F>; K], away: F) {
    let padded = arrays[0].len().next_multiple_of(MAX_LANES);
    for (k, array) in arrays.iter_mut().enumerate() {
        array.resize(padded, if k < 3 { away } else { F::default() });
    }
}

/// What the particles of `tree`, with `masses` in its order, feel of each other; `softening` is the radius H beyond which a
/// mass is a point (2.8 to 3 times the Plummer-equivalent length).
pub fn gravity<const D: usize>(tree: &Tree<D>, masses: &[f64], softening: f64, opening_angle: f64) -> Vec<Pull<D>> {
    let sampled = sampled_gravity(tree, masses, softening, opening_angle, 1);
    parallel::map(sampled.len(), |i| sampled[i].1)
}

/// [`gravity`] of the particles in every so many leaves, with their places in the tree's order.
pub fn sampled_gravity<const D: usize>(
    tree: &Tree<D>,
    masses: &[f64],
    softening: f64,
    opening_angle: f64,
    every: usize,
) -> Vec<(usize, Pull<D>)> {
    let moments = moments(tree, masses);
    let leaves: Vec<usize> = tree.leaves.iter().step_by(every).map(|leaf| *leaf as usize).collect();
    let by_share = parallel::pieces(leaves.len(), SHARE, |share| {
        let mut all = Attracting::default();
        let mut found = Vec::new();
        for &leaf in &leaves[share] {
            collect(tree, masses, &moments, leaf, opening_angle, softening, &mut all);
            let node = &tree.nodes[leaf];
            let range = node.places();
            found.extend(range.map(|i| (i, attraction::<D>(&tree.position(i), &all, softening))));
        }
        found
    });
    by_share.concat()
}

/// The same from all pairs.
pub fn direct_gravity<const D: usize>(
    positions: &[Vec<f64>; D],
    masses: &[f64],
    softening: f64,
    of: &[usize],
) -> Vec<Pull<D>> {
    let mut near = Attracting { unit: 1.0, mass: 1.0, ..Attracting::default() };
    for k in 0..D {
        near.near[k].extend(&positions[k]);
    }
    (D..3).for_each(|k| near.near[k].resize(masses.len(), 0.0));
    near.near[3].extend(masses);
    near.pad();
    parallel::tasks(of.len(), |t| attraction::<D>(&crate::array(|k| positions[k][of[t]]), &near, softening))
}

fn moments<const D: usize>(tree: &Tree<D>, masses: &[f64]) -> Vec<Moments<D>> {
    let empty = Moments { mass: 0.0, center: [0.0; D], second: [[0.0; D]; D], radius: 0.0 };
    let mut all = vec![empty; tree.nodes.len()];
    for index in (0..all.len()).rev() {
        let node = &tree.nodes[index];
        let parts: Vec<Moments<D>> = if node.skip == index as u32 + 1 {
            let range = node.places();
            range.map(|i| Moments { mass: masses[i], center: tree.position(i), ..empty }).collect()
        } else {
            vec![all[index + 1], all[tree.nodes[index + 1].skip as usize]]
        };
        all[index] = united(&parts);
    }
    all
}

fn united<const D: usize>(parts: &[Moments<D>]) -> Moments<D> {
    let mass: f64 = parts.iter().map(|p| p.mass).sum();
    let center: [f64; D] = crate::array(|k| parts.iter().map(|p| p.mass * p.center[k]).sum::<f64>() / mass);
    let mut second = [[0.0; D]; D];
    let mut radius = 0.0_f64;
    for part in parts {
        let s: [f64; D] = crate::array(|k| part.center[k] - center[k]);
        for (i, row) in second.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                *value += part.second[i][j] + part.mass * s[i] * s[j];
            }
        }
        radius = radius.max(s.iter().map(|v| v * v).sum::<f64>().sqrt() + part.radius);
    }
    Moments { mass, center, second, radius }
}

/// Finds what attracts a leaf.
fn collect<const D: usize>(
    tree: &Tree<D>,
    masses: &[f64],
    moments: &[Moments<D>],
    leaf: usize,
    opening_angle: f64,
    softening: f64,
    out: &mut Attracting,
) {
    out.clear();
    let target = &tree.nodes[leaf];
    out.origin = crate::array(|k| if k < D { 0.5 * (target.lo[k] + target.hi[k]) } else { 0.0 });
    let size = (0..D).map(|k| target.hi[k] - target.lo[k]).fold(softening, f64::max);
    out.unit = if size > 0.0 { size } else { 1.0 };
    let total = moments.first().map_or(0.0, |all| all.mass);
    out.mass = if total > 0.0 { total } else { 1.0 };
    let mut index = 0;
    while let Some(node) = tree.nodes.get(index) {
        let m = &moments[index];
        let gap = |k: usize| (target.lo[k] - m.center[k]).max(m.center[k] - target.hi[k]).max(0.0);
        let distance = (0..D).map(|k| gap(k).powi(2)).sum::<f64>().sqrt();
        if m.radius < opening_angle * distance && distance - m.radius > softening {
            (0..3).for_each(|k| out.nodes[k].push(if k < D { out.relative(k, m.center[k]) } else { 0.0 }));
            out.nodes[3].push((m.mass / out.mass) as f32);
            let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
            for (slot, (i, j)) in pairs.into_iter().enumerate() {
                let second = if i < D && j < D { m.second[i][j] / out.mass / out.unit / out.unit } else { 0.0 };
                out.nodes[4 + slot].push(second as f32);
            }
            index = node.skip as usize;
        } else {
            if node.skip == index as u32 + 1 {
                let range = node.places();
                let apart = |k: usize| (target.lo[k] - node.hi[k]).max(node.lo[k] - target.hi[k]).max(0.0);
                let is_near = (0..D).map(|k| apart(k).powi(2)).sum::<f64>().sqrt() <= softening;
                if is_near { out.add_near(tree, masses, range) } else { out.add_far(tree, masses, range) }
            }
            index += 1;
        }
    }
    out.pad();
}

impl Attracting {
    fn add_near<const D: usize>(&mut self, tree: &Tree<D>, masses: &[f64], range: Range<usize>) {
        for k in 0..3 {
            match tree.positions.get(k) {
                Some(x) => self.near[k].extend(&x[range.clone()]),
                None => self.near[k].resize(self.near[k].len() + range.len(), 0.0),
            }
        }
        self.near[3].extend(&masses[range]);
    }

    fn add_far<const D: usize>(&mut self, tree: &Tree<D>, masses: &[f64], range: Range<usize>) {
        let (origin, over) = (self.origin, 1.0 / self.unit);
        for k in 0..3 {
            match tree.positions.get(k) {
                Some(x) => self.far[k].extend(x[range.clone()].iter().map(|x| ((x - origin[k]) * over) as f32)),
                None => self.far[k].resize(self.far[k].len() + range.len(), 0.0),
            }
        }
        self.far[3].extend(masses[range].iter().map(|m| (m / self.mass) as f32));
    }
}

/// What all that attracts adds up to at `x`.
fn attraction<const D: usize>(x: &[f64; D], all: &Attracting, softening: f64) -> Pull<D> {
    let place: [f64; 3] = crate::array(|k| x.get(k).copied().unwrap_or(0.0));
    let here: [f32; 3] = crate::array(|k| all.relative(k, place[k]));
    let [near, far, nodes] = Arch::new().dispatch(Sums::<D> { place, here, all, softening });
    // Lengths and masses of what is far are in units of their own.
    let (s, unit, mass) = (strength(D), all.unit, all.mass);
    let force = mass * unit.powi(1 - D as i32);
    let potential = match D {
        1 => unit * (far[3] + nodes[3]),
        2 => far[3] + nodes[3] + unit.ln() * all.far[3].iter().chain(&all.nodes[3]).map(|m| f64::from(*m)).sum::<f64>(),
        _ => (far[3] + nodes[3]) / unit,
    };
    Pull {
        acceleration: crate::array(|k| s * (near[k] + force * (far[k] + nodes[k]))),
        potential: s * (near[3] + mass * potential),
    }
}

/// Sums over all that attracts. A type, since the body of a closure would be compiled without the vector instructions.
struct Sums<'a, const D: usize> {
    place: [f64; 3],
    here: [f32; 3],
    all: &'a Attracting,
    softening: f64,
}

impl<const D: usize> WithSimd for Sums<'_, D> {
    type Output = [[f64; 4]; 3];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { place, here, all, softening } = self;
        [
            of_near::<D, S>(simd, &place, &all.near, softening),
            of_points::<D, f32, S>(simd, &here, &all.far, 0.0),
            of_nodes::<D, f32, S>(simd, &here, &all.nodes),
        ]
    }
}

/// Acceleration and potential of points that may be near, or the place itself.
#[inline(always)]
fn of_near<const D: usize, S: Simd>(simd: S, x: &[f64; 3], points: &[Vec<f64>; 4], softening: f64) -> [f64; 4] {
    if !(softening > 0.0) {
        return of_bare::<D>(x, points);
    }
    let squared = softening * softening;
    let mut sum = of_points::<D, f64, S>(simd, x, points, squared);
    let arrays = registers::<4, f64, S>(points);
    let (at, edge) = (splat::<f64, S>(simd, x), f64::splat(simd, squared));
    let width = points[3].len() / arrays[3].len().max(1);
    for j in 0..arrays[3].len() {
        let r2 = displacement::<f64, S>(simd, &arrays, &at, j).1;
        if f64::sum(simd, f64::sub(simd, <f64 as Real>::max(simd, r2, edge), r2)) > 0.0 {
            let inside = of_softened::<D>(x, points, j * width..(j + 1) * width, softening);
            for k in 0..4 {
                sum[k] += inside[k];
            }
        }
    }
    sum
}

/// Acceleration and potential of points without softening, but for the place itself.
fn of_bare<const D: usize>(x: &[f64; 3], points: &[Vec<f64>; 4]) -> [f64; 4] {
    let mut sum = [0.0; 4];
    for (i, m) in points[3].iter().enumerate() {
        let d: [f64; 3] = crate::array(|k| points[k][i] - x[k]);
        let r2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        if r2 > 0.0 {
            let (far, potential) = bare::<D>(r2);
            (0..3).for_each(|k| sum[k] += m * far * d[k]);
            sum[3] += m * potential;
        }
    }
    sum
}

/// What [`of_points`] lacks for points that are within the softening radius, and has too much for the place itself.
fn of_softened<const D: usize>(x: &[f64; 3], points: &[Vec<f64>; 4], range: Range<usize>, softening: f64) -> [f64; 4] {
    let mut sum = [0.0; 4];
    let (force_at_edge, potential_at_edge) = bare::<D>(softening * softening);
    for i in range {
        let (d, m): ([f64; 3], f64) = (crate::array(|k| points[k][i] - x[k]), points[3][i]);
        let r2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        if r2 < softening * softening {
            let (force, potential) = softened::<D>(r2.sqrt() / softening);
            let factor = m * (force / softening.powi(D as i32) - force_at_edge);
            (0..3).for_each(|k| sum[k] += factor * d[k]);
            let wanted = if r2 > 0.0 { scaled_potential::<D>(potential, softening) } else { 0.0 };
            sum[3] += m * (wanted - potential_at_edge);
        }
    }
    sum
}

/// Arrays as the registers that they fill.
#[inline(always)]
fn registers<const K: usize, R: Real, S: Simd>(arrays: &[Vec<R>; K]) -> [&[R::Vector<S>]; K] {
    let mut out: [&[R::Vector<S>]; K] = [&[]; K];
    for k in 0..K {
        out[k] = R::vectors::<S>(&arrays[k]);
    }
    out
}

/// A place in every lane.
#[inline(always)]
fn splat<R: Real, S: Simd>(simd: S, x: &[R; 3]) -> [R::Vector<S>; 3] {
    [R::splat(simd, x[0]), R::splat(simd, x[1]), R::splat(simd, x[2])]
}

/// Product of two vectors.
#[inline(always)]
fn dot<R: Real, S: Simd>(simd: S, a: &[R::Vector<S>; 3], b: &[R::Vector<S>; 3]) -> R::Vector<S> {
    R::mul_add(simd, a[2], b[2], R::mul_add(simd, a[1], b[1], R::mul(simd, a[0], b[0])))
}

/// Displacement of register `j` from a place, and its square.
#[inline(always)]
fn displacement<R: Real, S: Simd>(
    simd: S,
    arrays: &[&[R::Vector<S>]],
    at: &[R::Vector<S>; 3],
    j: usize,
) -> ([R::Vector<S>; 3], R::Vector<S>) {
    let mut d = *at;
    for k in 0..3 {
        d[k] = R::sub(simd, arrays[k][j], at[k]);
    }
    (d, dot::<R, S>(simd, &d, &d))
}

/// 1/r^d and r.
#[inline(always)]
fn falloff<const D: usize, R: Real, S: Simd>(simd: S, r2: R::Vector<S>) -> (R::Vector<S>, R::Vector<S>) {
    let one = R::splat(simd, R::from_f64(1.0));
    let root = R::sqrt(simd, r2);
    let over = R::div(simd, one, root);
    let far = match D {
        1 => over,
        2 => R::mul(simd, over, over),
        _ => R::mul(simd, over, R::mul(simd, over, over)),
    };
    (far, root)
}

/// Acceleration and potential of points; what is within the square root of `least` has the potential that it would have there, and a
/// force that grows up to there.
#[inline(always)]
fn of_points<const D: usize, R: Real, S: Simd>(simd: S, x: &[R; 3], points: &[Vec<R>; 4], least: f64) -> [f64; 4] {
    let arrays = registers::<4, R, S>(points);
    let (at, edge) = (splat::<R, S>(simd, x), R::splat(simd, R::from_f64(least)));
    let mut sum = [R::splat(simd, R::from_f64(0.0)); 4];
    for j in 0..arrays[3].len() {
        let (d, r2) = displacement::<R, S>(simd, &arrays, &at, j);
        let r2 = R::max(simd, r2, edge);
        let (far, root) = falloff::<D, R, S>(simd, r2);
        let factor = R::mul(simd, arrays[3][j], far);
        for k in 0..3 {
            sum[k] = R::mul_add(simd, d[k], factor, sum[k]);
        }
        match D {
            1 => sum[3] = R::mul_add(simd, arrays[3][j], root, sum[3]),
            2 => {}
            _ => sum[3] = R::sub(simd, sum[3], R::mul(simd, factor, r2)),
        }
    }
    let mut out = [0.0; 4];
    for k in 0..4 {
        out[k] = R::sum(simd, sum[k]);
    }
    out[3] += logarithms::<D, R>(x, [&points[0], &points[1], &points[3]], least);
    out
}

/// The potential of masses in the plane; 0 where space has another number of dimensions.
fn logarithms<const D: usize, R: Real>(x: &[R; 3], [px, py, m]: [&[R]; 3], least: f64) -> f64 {
    if D != 2 {
        return 0.0;
    }
    let of = |i: usize| {
        let d = [px[i].to_f64() - x[0].to_f64(), py[i].to_f64() - x[1].to_f64()];
        0.5 * m[i].to_f64() * (d[0] * d[0] + d[1] * d[1]).max(least).ln()
    };
    (0..m.len()).map(of).sum()
}

/// Acceleration and potential of nodes, in units of the leaf: of a mass in their center, and of their second moments.
#[inline(always)]
fn of_nodes<const D: usize, R: Real, S: Simd>(simd: S, x: &[R; 3], nodes: &[Vec<R>; 10]) -> [f64; 4] {
    let arrays = registers::<10, R, S>(nodes);
    let at = splat::<R, S>(simd, x);
    let half = R::splat(simd, R::from_f64(0.5));
    let dimension = R::splat(simd, R::from_f64(D as f64));
    let (next, half_dimension) =
        (R::splat(simd, R::from_f64(D as f64 + 2.0)), R::splat(simd, R::from_f64(0.5 * D as f64)));
    let one = R::splat(simd, R::from_f64(1.0));
    let mut sum = [R::splat(simd, R::from_f64(0.0)); 4];
    for j in 0..arrays[3].len() {
        let (d, r2) = displacement::<R, S>(simd, &arrays, &at, j);
        let (far, root) = falloff::<D, R, S>(simd, r2);
        let over = R::div(simd, one, r2);
        let [m, xx, yy, zz, xy, xz, yz] =
            [arrays[3][j], arrays[4][j], arrays[5][j], arrays[6][j], arrays[7][j], arrays[8][j], arrays[9][j]];
        // Q d, its trace, and d Q d.
        let q = [
            dot::<R, S>(simd, &[xx, xy, xz], &d),
            dot::<R, S>(simd, &[xy, yy, yz], &d),
            dot::<R, S>(simd, &[xz, yz, zz], &d),
        ];
        let trace = R::add(simd, xx, R::add(simd, yy, zz));
        let twice = R::mul(simd, dot::<R, S>(simd, &q, &d), over);
        let bent = R::sub(simd, R::mul(simd, next, twice), trace);
        let along = R::mul_add(simd, R::mul(simd, half_dimension, over), bent, m);
        let across = R::mul(simd, dimension, over);
        for k in 0..3 {
            let pull = R::sub(simd, R::mul(simd, along, d[k]), R::mul(simd, across, q[k]));
            sum[k] = R::mul_add(simd, far, pull, sum[k]);
        }
        let spread = R::sub(simd, trace, R::mul(simd, dimension, twice));
        sum[3] = R::mul_add(simd, R::mul(simd, half, far), spread, sum[3]);
        match D {
            1 => sum[3] = R::mul_add(simd, m, root, sum[3]),
            2 => {}
            _ => sum[3] = R::sub(simd, sum[3], R::mul(simd, m, R::mul(simd, far, r2))),
        }
    }
    let mut out = [0.0; 4];
    for k in 0..4 {
        out[k] = R::sum(simd, sum[k]);
    }
    out[3] += logarithms::<D, R>(x, [&nodes[0], &nodes[1], &nodes[3]], 0.0);
    out
}

/// r^-d and the potential of a unit mass at the squared distance.
fn bare<const D: usize>(r2: f64) -> (f64, f64) {
    let over = 1.0 / r2;
    match D {
        1 => (over.sqrt(), r2.sqrt()),
        2 => (over, 0.5 * r2.ln()),
        _ => (over * over.sqrt(), -over.sqrt()),
    }
}

/// The mass within u over u^d of a unit mass that is spread over u < 1, and its potential in units of the radius (in 2-D
/// less the logarithm of it).
pub(crate) fn softened<const D: usize>(u: f64) -> (f64, f64) {
    let polynomial = |c: &[f64]| c.iter().rev().fold(0.0, |sum, c| sum * u + c);
    match D {
        1 => (
            polynomial(&[3.0, 0.0, -10.0, 15.0, -9.0, 2.0]),
            polynomial(&[3.0 / 14.0, 0.0, 1.5, 0.0, -2.5, 3.0, -1.5, 2.0 / 7.0]),
        ),
        2 => (
            polynomial(&[7.0, 0.0, -35.0, 56.0, -35.0, 8.0]),
            polynomial(&[-529.0 / 420.0, 0.0, 3.5, 0.0, -8.75, 11.2, -35.0 / 6.0, 8.0 / 7.0]),
        ),
        _ => (
            polynomial(&[14.0, 0.0, -84.0, 140.0, -90.0, 21.0]),
            polynomial(&[-3.0, 0.0, 7.0, 0.0, -21.0, 28.0, -15.0, 3.0]),
        ),
    }
}

fn scaled_potential<const D: usize>(potential: f64, radius: f64) -> f64 {
    match D {
        1 => potential * radius,
        2 => potential + radius.ln(),
        _ => potential / radius,
    }
}
