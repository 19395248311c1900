//! Gravity of particles on each other, by a tree (Barnes and Hut 1986) with quadrupoles.
//!
//! The constant of gravity is 1. In d dimensions the attraction between masses is S_d m / r^(d-1) with S = 2 pi, 2, 1: sheets,
//! filaments and points. Within the softening radius masses are spread as Wendland's C2 function (1 - u)^4 (1 + 4 u), as in
//! SWIFT. There are no periodic images.

use crate::neighbors::Tree;
use crate::parallel;
use pulp::Arch;

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
    /// Place, mass and second moments, each in an array of its own.
    nodes: [Vec<f64>; 10],
    points: [Vec<f64>; 4],
}

impl Attracting {
    fn clear(&mut self) {
        self.nodes.iter_mut().for_each(Vec::clear);
        self.points.iter_mut().for_each(Vec::clear);
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
    let by_leaf = parallel::tasks(tree.leaves.len().div_ceil(every), |sample| {
        let leaf = sample * every;
        let mut near = Attracting::default();
        collect(tree, masses, &moments, tree.leaves[leaf] as usize, opening_angle, softening, &mut near);
        let node = &tree.nodes[tree.leaves[leaf] as usize];
        let range = node.first as usize..(node.first + node.count) as usize;
        range.map(|i| (i, attraction::<D>(&tree.position(i), &near, softening))).collect::<Vec<_>>()
    });
    by_leaf.concat()
}

/// The same from all pairs.
pub fn direct_gravity<const D: usize>(
    positions: &[Vec<f64>; D],
    masses: &[f64],
    softening: f64,
    of: &[usize],
) -> Vec<Pull<D>> {
    let mut near = Attracting::default();
    for k in 0..D {
        near.points[k].extend(&positions[k]);
    }
    (D..3).for_each(|k| near.points[k].resize(masses.len(), 0.0));
    near.points[3].extend(masses);
    parallel::tasks(of.len(), |t| attraction::<D>(&crate::array(|k| positions[k][of[t]]), &near, softening))
}

fn moments<const D: usize>(tree: &Tree<D>, masses: &[f64]) -> Vec<Moments<D>> {
    let empty = Moments { mass: 0.0, center: [0.0; D], second: [[0.0; D]; D], radius: 0.0 };
    let mut all = vec![empty; tree.nodes.len()];
    for index in (0..all.len()).rev() {
        let node = &tree.nodes[index];
        let parts: Vec<Moments<D>> = if node.skip == index as u32 + 1 {
            let range = node.first as usize..(node.first + node.count) as usize;
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
    let mut index = 0;
    while let Some(node) = tree.nodes.get(index) {
        let m = &moments[index];
        let gap = |k: usize| (target.lo[k] - m.center[k]).max(m.center[k] - target.hi[k]).max(0.0);
        let distance = (0..D).map(|k| gap(k).powi(2)).sum::<f64>().sqrt();
        if m.radius < opening_angle * distance && distance - m.radius > softening {
            (0..3).for_each(|k| out.nodes[k].push(if k < D { m.center[k] } else { 0.0 }));
            out.nodes[3].push(m.mass);
            let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
            for (slot, (i, j)) in pairs.into_iter().enumerate() {
                out.nodes[4 + slot].push(if i < D && j < D { m.second[i][j] } else { 0.0 });
            }
            index = node.skip as usize;
        } else if node.skip == index as u32 + 1 {
            let range = node.first as usize..(node.first + node.count) as usize;
            for k in 0..3 {
                match tree.positions.get(k) {
                    Some(x) => out.points[k].extend(&x[range.clone()]),
                    None => out.points[k].resize(out.points[k].len() + range.len(), 0.0),
                }
            }
            out.points[3].extend(&masses[range]);
            index += 1;
        } else {
            index += 1;
        }
    }
}

/// What all that attracts adds up to at `x`.
fn attraction<const D: usize>(x: &[f64; D], near: &Attracting, softening: f64) -> Pull<D> {
    let place: [f64; 3] = crate::array(|k| x.get(k).copied().unwrap_or(0.0));
    let [points, nodes] = Arch::new().dispatch(
        #[inline(always)]
        || [of_points::<D>(&place, &near.points, softening), of_nodes::<D>(&place, &near.nodes)],
    );
    let s = strength(D);
    Pull { acceleration: crate::array(|k| s * (points[k] + nodes[k])), potential: s * (points[3] + nodes[3]) }
}

/// Acceleration and potential of points.
#[inline(always)]
fn of_points<const D: usize>(x: &[f64; 3], points: &[Vec<f64>; 4], softening: f64) -> [f64; 4] {
    let n = points[3].len();
    let [px, py, pz, m] = points.each_ref().map(|p| &p[..n]);
    let mut lanes = [[0.0; LANES]; 4];
    let softening_squared = softening * softening;
    let mut add = |lane: usize, i: usize| {
        let d = [px[i] - x[0], py[i] - x[1], pz[i] - x[2]];
        let r2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        // At the place itself there is no force, and what a particle is to itself is left out.
        let outside = r2 >= softening_squared && r2 > 0.0;
        let (far, potential) = bare::<D>(if outside { r2 } else { 1.0 });
        let factor = if outside { m[i] * far } else { 0.0 };
        lanes[0][lane] += factor * d[0];
        lanes[1][lane] += factor * d[1];
        lanes[2][lane] += factor * d[2];
        lanes[3][lane] += if outside { m[i] * potential } else { 0.0 };
    };
    for chunk in 0..n / LANES {
        for lane in 0..LANES {
            add(lane, chunk * LANES + lane);
        }
    }
    for (lane, i) in (n - n % LANES..n).enumerate() {
        add(lane, i);
    }
    let mut sum: [f64; 4] = crate::array(|k| lanes[k].iter().sum());
    if softening > 0.0 {
        for i in 0..n {
            let d = [px[i] - x[0], py[i] - x[1], pz[i] - x[2]];
            let r2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            if r2 > 0.0 && r2 < softening_squared {
                let (force, potential) = softened::<D>(r2.sqrt() / softening);
                let factor = m[i] * force / softening.powi(D as i32);
                (0..3).for_each(|k| sum[k] += factor * d[k]);
                sum[3] += m[i] * scaled_potential::<D>(potential, softening);
            }
        }
    }
    sum
}

/// Sums that run side by side, in the same order on every machine.
const LANES: usize = 8;

/// Acceleration and potential of nodes: of a mass in their center, and of their second moments.
#[inline(always)]
fn of_nodes<const D: usize>(x: &[f64; 3], nodes: &[Vec<f64>; 10]) -> [f64; 4] {
    let n = nodes[3].len();
    let [px, py, pz, m, xx, yy, zz, xy, xz, yz] = nodes.each_ref().map(|p| &p[..n]);
    let dimension = D as f64;
    let mut lanes = [[0.0; LANES]; 4];
    let mut add = |lane: usize, i: usize| {
        let d = [px[i] - x[0], py[i] - x[1], pz[i] - x[2]];
        let r2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let (far, potential) = bare::<D>(r2);
        let over = 1.0 / r2;
        // Q d, its trace, and d Q d.
        let q = [
            xx[i] * d[0] + xy[i] * d[1] + xz[i] * d[2],
            xy[i] * d[0] + yy[i] * d[1] + yz[i] * d[2],
            xz[i] * d[0] + yz[i] * d[1] + zz[i] * d[2],
        ];
        let trace = xx[i] + yy[i] + zz[i];
        let twice = (q[0] * d[0] + q[1] * d[1] + q[2] * d[2]) * over;
        let along = m[i] + 0.5 * dimension * over * ((dimension + 2.0) * twice - trace);
        let across = -dimension * over;
        lanes[0][lane] += far * (along * d[0] + across * q[0]);
        lanes[1][lane] += far * (along * d[1] + across * q[1]);
        lanes[2][lane] += far * (along * d[2] + across * q[2]);
        lanes[3][lane] += m[i] * potential + 0.5 * far * (trace - dimension * twice);
    };
    for chunk in 0..n / LANES {
        for lane in 0..LANES {
            add(lane, chunk * LANES + lane);
        }
    }
    for (lane, i) in (n - n % LANES..n).enumerate() {
        add(lane, i);
    }
    crate::array(|k| lanes[k].iter().sum())
}

/// r^-d and the potential of a unit mass at the squared distance.
#[inline(always)]
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
