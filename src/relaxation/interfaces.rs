//! Replaces the neighbors that are missing beyond a region's surface: its particles feel a medium of the same density that continues there.
//!
//! A region is relaxed by itself. A sum over neighbors that ends at its surface would drive particles onto it; here the
//! surface is a wall with as many neighbors beyond it as there are inside. Within reach of a particle it is taken as a plane
//! (or two, across a thin layer), so that what is missing is a function of the distance alone: with the kernel's mass
//! P(t) beyond the distance t the sum of W lacks n P(t/H), and pushes lack n S(t/H) along the normal.

use crate::field::Patch;
use crate::target::{Part, Positions, Target, at};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use sph::domain::{Axis, Domain};
use sph::exchange::Exchange;
use sph::kernel::{KernelName, evaluate, with_kernel};
use sph::parallel;

/// A plane at a distance from a particle; its unit normal leads away from the particle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Plane {
    normal: Vec<f64>,
    distance: f64,
    /// What is not of the region, over what lies beyond the plane: less than 1 about a hole, more about a bulge.
    part: f64,
}

/// Planes about each particle, and where it was when they were found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Interfaces {
    planes: Vec<Vec<Plane>>,
    /// Coordinates of each particle then.
    found_at: Vec<Vec<f64>>,
}

/// A move, in support radii, after which planes are looked for anew.
const STALE: f64 = 0.1;
/// Directions in which the surface is looked for, and halvings that lead to it.
const AZIMUTHS: usize = 16;
const HALVINGS: usize = 12;
/// Parts of a ray in which the surface is looked for.
const LOOKS: usize = 5;
/// Cosine of the angle to the nearest point's direction within which points belong to one plane.
const ONE_SIDE: f64 = 0.3;

/// Distance in support radii below which a surface counts as flat.
const PASSES: f64 = 0.1;
/// Most that may lie beyond a curved surface, over what lies beyond a plane.
const MOST_PART: f64 = 2.0;

impl Interfaces {
    /// For the particles of one region; none in a target that has no end but its domain's.
    pub fn find<const D: usize>(
        target: &Target<'_, D>,
        beyond: &Beyond,
        positions: &Positions<D>,
        support: &[f64],
    ) -> Option<Self> {
        target.part.filter(Part::is_cut)?;
        let mut found = Self { planes: vec![Vec::new(); support.len()], found_at: vec![Vec::new(); support.len()] };
        found.refresh(target, beyond, positions, support);
        Some(found)
    }

    /// Looks anew where a particle has moved too far; for how many.
    pub fn refresh<const D: usize>(
        &mut self,
        target: &Target<'_, D>,
        beyond: &Beyond,
        positions: &Positions<D>,
        support: &[f64],
    ) -> usize {
        let Some(part) = &target.part else { return 0 };
        let (found_at, directions) = (&self.found_at, directions());
        let fresh = parallel::map(support.len(), |i| {
            let x = at(positions, i);
            let stays = <[f64; D]>::try_from(found_at[i].as_slice()).is_ok_and(|from| {
                let moved = target.domain.displacement(&from, &x);
                moved.iter().map(|m| m * m).sum::<f64>() < (STALE * support[i]).powi(2)
            });
            (!stays).then(|| match is_clear(target, part, &x, support[i]) {
                true => Vec::new(),
                false => planes(target.domain, part, (beyond, &directions), &x, support[i]),
            })
        });
        let mut looked = 0;
        for (i, planes) in fresh.into_iter().enumerate() {
            if let Some(planes) = planes {
                looked += 1;
                self.planes[i] = planes;
                self.found_at[i] = at(positions, i).to_vec();
            }
        }
        looked
    }

    /// Follows particles into a new order.
    pub fn reorder(&mut self, order: &[u32]) {
        self.planes = order.iter().map(|&i| std::mem::take(&mut self.planes[i as usize])).collect();
        self.found_at = order.iter().map(|&i| std::mem::take(&mut self.found_at[i as usize])).collect();
    }

    /// Whether it is of `count` particles in `D` dimensions.
    pub fn is_of<const D: usize>(&self, count: usize) -> bool {
        let is_finite = |p: &Plane| p.normal.len() == D && p.normal.iter().chain([&p.distance]).all(|v| v.is_finite());
        self.planes.len() == count
            && self.found_at.len() == count
            && self.planes.iter().flatten().all(is_finite)
            && self.found_at.iter().all(|x| x.len() == D)
    }

    /// Whether there are no surfaces near any particle.
    pub fn are_none(&self) -> bool {
        self.planes.iter().all(Vec::is_empty)
    }

    /// Normals of the nearest surfaces, where most particles (of all ranks) have one on either side and the two are no farther apart than their
    /// `spacing`.
    pub fn normals_if_thin<const D: usize>(&self, exchange: &dyn Exchange, spacing: &[f64]) -> Option<Vec<[f64; D]>> {
        let is_between = |(planes, spacing): (&Vec<Plane>, &f64)| {
            planes.len() == 2 && planes.iter().map(|p| p.distance).sum::<f64>() < *spacing
        };
        let thin = self.planes.iter().zip(spacing).filter(|found| is_between(*found)).count();
        let normal = |planes: &Vec<Plane>| planes.first().map_or([0.0; D], |p| sph::array(|k| p.normal[k]));
        (2 * exchange.count(thin) > exchange.count(self.planes.len())).then(|| self.planes.iter().map(normal).collect())
    }

    /// What a particle at `x` lacks.
    pub fn missing<const D: usize>(
        &self,
        domain: &Domain<D>,
        beyond: &Beyond,
        i: usize,
        (x, support): (&[f64; D], f64),
    ) -> Missing<D> {
        let mut all = Missing { share: 0.0, slope: 0.0, gradient: [0.0; D], push: [0.0; D] };
        if self.planes[i].is_empty() {
            return all;
        }
        let from: [f64; D] = sph::array(|k| self.found_at[i][k]);
        let moved = domain.displacement(&from, x);
        for Plane { normal, distance, part } in &self.planes[i] {
            let along: f64 = (0..D).map(|k| normal[k] * moved[k]).sum();
            let (share, density, push) = beyond.at((distance - along) / support);
            let (share, density, push) = (part * share, part * density, part * push);
            all.share += share;
            all.slope += density * ((distance - along) / support);
            for k in 0..D {
                all.gradient[k] += density / support * normal[k];
                all.push[k] -= push * normal[k];
            }
        }
        all
    }
}

/// What lies beyond the planes about a particle, of a medium that fills all space.
#[derive(Debug, Clone, Copy)]
pub(super) struct Missing<const D: usize> {
    /// The share of the kernel's mass.
    pub share: f64,
    /// Its derivative by ln H.
    pub slope: f64,
    /// Its gradient.
    pub gradient: [f64; D],
    /// Integral of f(q) r^ d^dq away from it.
    pub push: [f64; D],
}

/// A ray that leaves the region.
#[derive(Clone, Copy)]
struct Ray<const D: usize> {
    direction: [f64; D],
    /// Where it does, in support radii.
    leaves: f64,
    /// The kernel's mass along it until it enters again.
    mass: f64,
}

/// Whether the bounds of the density say that all within a support radius is of the particle's region, without a look at any of it: nothing jumps there,
/// and nothing is empty.
fn is_clear<const D: usize>(target: &Target<'_, D>, part: &Part<'_, D>, x: &[f64; D], support: f64) -> bool {
    let (lo, hi) = (x.map(|v| v - support), x.map(|v| v + support));
    let is_inside = (0..D).all(|k| lo[k] >= target.domain.lo[k] && hi[k] <= target.domain.hi[k]);
    let bounds = || target.resolution_field().enclosure(&Patch::of_box(lo, hi));
    is_inside && bounds().is_some_and(|bounds| bounds.is_continuous && bounds.least > 0.0) && part.holds(x)
}

/// The planes about a particle of a region.
fn planes<const D: usize>(
    domain: &Domain<D>,
    part: &Part<'_, D>,
    (beyond, directions): (&Beyond, &[([f64; D], f64)]),
    x: &[f64; D],
    support: f64,
) -> Vec<Plane> {
    // Walls of the domain are mirrors: what is beyond them is no surface of the region.
    let is_beyond = |u: &[f64; D], q: f64| {
        let y = folded(domain, sph::array(|k| x[k] + q * support * u[k]));
        domain.contains(&y) && !part.holds(&y)
    };
    let mut rays = Vec::new();
    for (u, w) in directions {
        rays.extend(ray(u, *w, beyond, &is_beyond));
    }
    let nearest = |rays: &[Ray<D>]| rays.iter().copied().min_by(|p, q| p.leaves.total_cmp(&q.leaves));
    let Some(first) = nearest(&rays) else { return Vec::new() };
    let cosine = |ray: &Ray<D>| (0..D).map(|k| ray.direction[k] * first.direction[k]).sum::<f64>();
    let (near, far): (Vec<Ray<D>>, Vec<Ray<D>>) = rays.iter().copied().partition(|ray| cosine(ray) > 0.0);
    [near, far]
        .iter()
        .filter_map(|side| {
            let clear: Vec<Ray<D>> = side.iter().copied().filter(|ray| cosine(ray).abs() > ONE_SIDE).collect();
            let (normal, distance) = plane(&clear, nearest(&clear)?);
            let mass: f64 = side.iter().map(|ray| ray.mass).sum();
            let whole = beyond.at(distance).0;
            // Of a surface that passes right by the rule over rays is not good enough.
            let part = if distance > PASSES && whole > 0.0 { (mass / whole).min(MOST_PART) } else { 1.0 };
            Some(Plane { normal, distance: distance * support, part })
        })
        .collect()
}

/// A point beyond a face in the place of its mirror image.
fn folded<const D: usize>(domain: &Domain<D>, x: [f64; D]) -> [f64; D] {
    let mut y = domain.wrapped(&x);
    for k in (0..D).filter(|&k| domain.has_faces(k) && domain.axes[k] != Axis::Periodic) {
        if y[k] < domain.lo[k] {
            y[k] = 2.0 * domain.lo[k] - y[k];
        } else if y[k] > domain.hi[k] {
            y[k] = 2.0 * domain.hi[k] - y[k];
        }
    }
    y
}

/// Where a ray of the weight `w` leaves the region, if it does within the support radius.
fn ray<const D: usize>(
    u: &[f64; D],
    w: f64,
    beyond: &Beyond,
    is_beyond: &dyn Fn(&[f64; D], f64) -> bool,
) -> Option<Ray<D>> {
    let place = |look: usize| look as f64 / LOOKS as f64;
    let crossing = |from: usize, leaves: bool| {
        let (mut a, mut b) = (place(from - 1), place(from));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (a + b);
            if is_beyond(u, middle) == leaves { b = middle } else { a = middle }
        }
        0.5 * (a + b)
    };
    let out = (1..=LOOKS).find(|&look| is_beyond(u, place(look)))?;
    let leaves = crossing(out, true);
    let enters = (out + 1..=LOOKS).find(|&look| !is_beyond(u, place(look))).map_or(1.0, |look| crossing(look, false));
    Some(Ray { direction: *u, leaves, mass: w * (beyond.outside(leaves) - beyond.outside(enters)) })
}

/// The plane through the ends of rays by least squares; near ones count more.
fn plane<const D: usize>(rays: &[Ray<D>], nearest: Ray<D>) -> (Vec<f64>, f64) {
    let across = (nearest.direction.to_vec(), nearest.leaves);
    if rays.len() <= D {
        return across;
    }
    let weight = |ray: &Ray<D>| (1.0 - ray.leaves).max(0.0).powi(2) + 1e-3;
    let total: f64 = rays.iter().map(weight).sum();
    let place = |ray: &Ray<D>, k: usize| ray.direction[k] * ray.leaves;
    let mean: [f64; D] = sph::array(|k| rays.iter().map(|r| weight(r) * place(r, k)).sum::<f64>() / total);
    let spread = DMatrix::from_fn(D, D, |a, b| {
        rays.iter().map(|r| weight(r) * (place(r, a) - mean[a]) * (place(r, b) - mean[b])).sum::<f64>() / total
    });
    let eigen = spread.symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    let normal: Vec<f64> = eigen.eigenvectors.column(least).iter().copied().collect();
    let distance: f64 = (0..D).map(|k| normal[k] * mean[k]).sum();
    let cosine: f64 = (0..D).map(|k| normal[k] * nearest.direction[k]).sum();
    let sign = if cosine < 0.0 { -1.0 } else { 1.0 };
    if !(sign * distance >= 0.0) || cosine.abs() < ONE_SIDE {
        return across;
    }
    (normal.iter().map(|n| sign * n).collect(), sign * distance)
}

/// Unit vectors all around with weights that add up to 1: both ways in one dimension, a fan in two, faces, edges and
/// corners of a cube and directions between them in three (Lebedev's rule of degree 11).
fn directions<const D: usize>() -> Vec<([f64; D], f64)> {
    match D {
        1 => [1.0, -1.0].into_iter().map(|c| ([c; D], 0.5)).collect(),
        2 => (0..AZIMUTHS)
            .map(|a| std::f64::consts::TAU * (a as f64 + 0.5) / AZIMUTHS as f64)
            .map(|angle| sph::array(|k| if k == 0 { angle.cos() } else { angle.sin() }))
            .map(|u| (u, 1.0 / AZIMUTHS as f64))
            .collect(),
        _ => {
            let cube = (0..3_usize.pow(D as u32))
                .map(|code| sph::array(|k| (code / 3_usize.pow(k as u32) % 3) as f64 - 1.0))
                .filter_map(|step: [f64; D]| {
                    let size: f64 = step.iter().map(|s| s * s).sum();
                    let weight = LEBEDEV.get((size as usize).checked_sub(1)?)?;
                    Some((step.map(|s| s / size.sqrt()), *weight))
                });
            let (short, long) = (11_f64.sqrt().recip(), 3.0 / 11_f64.sqrt());
            let between = (0..3 << D).map(|code: usize| {
                let sign = |k: usize| if code >> k & 1 == 0 { 1.0 } else { -1.0 };
                let u: [f64; D] = sph::array(|k| sign(k) * if k == code >> D { long } else { short });
                (u, LEBEDEV[3])
            });
            cube.chain(between).collect()
        }
    }
}

/// Weights of the directions to the faces, edges and corners of a cube, and to (1, 1, 3).
const LEBEDEV: [f64; 4] = [4.0 / 315.0, 64.0 / 2835.0, 27.0 / 1280.0, 14641.0 / 725_760.0];

/// Integrals over what lies beyond a plane, as functions of its distance in support radii.
pub(super) struct Beyond {
    /// Share of the kernel's mass, its density at the plane, and the push, at equal steps from 0 to 1.
    table: Vec<[f64; 3]>,
    /// Share of the kernel's mass outside of a radius, at equal steps from 0 to 1.
    outside: Vec<f64>,
}

const STEPS: usize = 256;
/// Panels of the midpoint rule in the radius.
const PANELS: usize = 512;

impl Beyond {
    /// With the weight `f` of pushes.
    pub fn new<const D: usize>(kernel: KernelName, f: &dyn Fn(f64) -> f64) -> Self {
        let shape = |q: f64| with_kernel!(kernel, kernel => evaluate::<_, D>(kernel, q).0);
        let norm: f64 = with_kernel!(kernel, kernel => sigma(kernel)[D - 1]);
        let row = |step: usize| {
            let t = step as f64 / STEPS as f64;
            if step == STEPS {
                return [0.0; 3];
            }
            // With q^2 = t^2 + s^2 (1 - t^2) the integrands are smooth at the plane.
            let integral = |g: &dyn Fn(f64, f64) -> f64| -> f64 {
                let width = (1.0 - t * t).max(0.0).sqrt();
                let at = |p: usize| {
                    let s = width * (p as f64 + 0.5) / PANELS as f64;
                    let q = (t * t + s * s).sqrt();
                    g(q, s) * s / q
                };
                (0..PANELS).map(at).sum::<f64>() * width / PANELS as f64
            };
            let (sphere, ring) = (std::f64::consts::TAU, 2.0);
            match D {
                1 => {
                    let width = (1.0 - t) / PANELS as f64;
                    let sum = |g: &dyn Fn(f64) -> f64| {
                        (0..PANELS).map(|p| g(t + width * (p as f64 + 0.5))).sum::<f64>() * width
                    };
                    [norm * sum(&shape), norm * shape(t), sum(f)]
                }
                2 => [
                    norm * ring * integral(&|q, _| shape(q) * q * (t / q).min(1.0).acos()),
                    norm * ring * integral(&|q, s| shape(q) * q / s),
                    ring * integral(&|q, s| f(q) * s),
                ],
                _ => [
                    norm * sphere * integral(&|q, _| shape(q) * q * (q - t)),
                    norm * sphere * integral(&|q, _| shape(q) * q),
                    0.5 * sphere * integral(&|q, s| f(q) * s * s),
                ],
            }
        };
        let shell = |p: usize| {
            let q = (p as f64 + 0.5) / STEPS as f64;
            shape(q) * q.powi(D as i32 - 1)
        };
        let mut outside = vec![0.0; STEPS + 1];
        (0..STEPS).rev().for_each(|p| outside[p] = outside[p + 1] + shell(p));
        let whole = outside[0];
        outside.iter_mut().for_each(|m| *m /= whole);
        Self { table: (0..=STEPS).map(row).collect(), outside }
    }

    /// The share of the kernel's mass beyond the radius `q`.
    fn outside(&self, q: f64) -> f64 {
        let place = q.clamp(0.0, 1.0) * STEPS as f64;
        let step = (place as usize).min(STEPS - 1);
        self.outside[step] + (place - step as f64) * (self.outside[step + 1] - self.outside[step])
    }

    /// Share, density and push at the distance `t`. A particle beyond its plane is taken to be at it.
    fn at(&self, t: f64) -> (f64, f64, f64) {
        if !(t < 1.0) {
            return (0.0, 0.0, 0.0);
        }
        let place = t.max(0.0) * STEPS as f64;
        let step = (place as usize).min(STEPS - 1);
        let (u, width) = (place - step as f64, 1.0 / STEPS as f64);
        let ([p0, m0, s0], [p1, m1, s1]) = (self.table[step], self.table[step + 1]);
        // Hermite's cubic through shares and slopes, and its derivative.
        let (d0, d1) = (-m0 * width, -m1 * width);
        let (c2, c3) = (3.0 * (p1 - p0) - 2.0 * d0 - d1, 2.0 * (p0 - p1) + d0 + d1);
        let share = p0 + u * (d0 + u * (c2 + u * c3));
        let slope = (d0 + u * (2.0 * c2 + 3.0 * u * c3)) / width;
        (share, -slope, s0 + u * (s1 - s0))
    }
}

fn sigma<K: sph::kernel::Kernel>(_: K) -> [f64; 3] {
    K::SIGMA
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half of the kernel lies beyond a plane through the particle, and shares fall as their density says.
    #[test]
    fn half_of_the_kernel_is_beyond_a_plane_through_the_particle() {
        fn check<const D: usize>() {
            for kernel in [KernelName::WendlandC4, KernelName::CubicSpline] {
                let beyond = Beyond::new::<D>(kernel, &|q| (1.0 - q).max(0.0));
                assert!((beyond.at(0.0).0 - 0.5).abs() < 2e-4, "{D}-D: {}", beyond.at(0.0).0);
                assert_eq!(beyond.at(1.0).0, 0.0);
                for i in 1..20 {
                    let (t, h) = (0.05 * f64::from(i), 1e-3);
                    let change =
                        (beyond.at(t - h).0 - beyond.at((t + h).min(1.0)).0) / (t + h - (t - h)).min(1.0 + h - t);
                    assert!((change - beyond.at(t).1).abs() < 2e-3, "{D}-D at {t}: {change} {:?}", beyond.at(t));
                }
            }
        }
        check::<1>();
        check::<2>();
        check::<3>();
    }

    /// f = 1 - q: pi/3 (1/2 - 1/3... ) in closed form: the integral of (1 - q) cos over the half ball.
    #[test]
    fn pushes_have_their_closed_forms() {
        let f = |q: f64| 1.0 - q;
        let one = Beyond::new::<1>(KernelName::WendlandC4, &f).at(0.0).2;
        assert!((one - 0.5).abs() < 1e-5, "{one}");
        // 2-D: int (1 - q) q dq int cos = 2/6; 3-D: pi int (1 - q) q^2 dq = pi/12.
        let two = Beyond::new::<2>(KernelName::WendlandC4, &f).at(0.0).2;
        assert!((two - 1.0 / 3.0).abs() < 1e-4, "{two}");
        let three = Beyond::new::<3>(KernelName::WendlandC4, &f).at(0.0).2;
        assert!((three - std::f64::consts::PI / 12.0).abs() < 1e-4, "{three}");
    }

    /// What is left out by bounds has no planes, by looks along all rays.
    #[test]
    fn what_bounds_leave_out_has_no_planes() {
        fn check<const D: usize>(text: &str, count: usize) {
            let domain = Domain::new([0.0; D], [1.0; D], [Axis::Periodic; D], sph::domain::Region::Box).unwrap();
            let field = crate::field::AnalyticField::<D>::new("density", text, [0.5; D]).unwrap();
            let mass = crate::field::total_mass(&field, &domain, 1e-4).unwrap().value;
            let whole = Target::of_equal_masses(&domain, &field, count, mass);
            let regions = whole.find_regions(None).unwrap();
            let (beyond, directions) = (Beyond::new::<D>(KernelName::WendlandC4, &|q| 1.0 - q), directions::<D>());
            let (mut clear, mut near) = (0, 0);
            for region in 0..regions.number() {
                let target = whole.selected(&regions, crate::target::Selected::Region(region), count);
                let part = target.part.unwrap();
                let places = (0..count).map(|i| sph::array(|k| (0.5 + i as f64 * STEPS_OF[k]).fract()));
                for x in places.filter(|x: &[f64; D]| part.holds(x)) {
                    let found = planes(&domain, &part, (&beyond, &directions), &x, 0.1);
                    let is_left_out = is_clear(&target, &part, &x, 0.1);
                    assert!(!is_left_out || found.is_empty(), "{text}, {x:?}: {found:?}");
                    clear += usize::from(is_left_out);
                    near += usize::from(!found.is_empty());
                }
            }
            assert!(clear > count / 20 && near > count / 20, "{text}: {clear} clear, {near} near of {count}");
        }
        check::<1>("if(abs(x - 0.5) < 0.2, 5, 1)", 400);
        check::<2>("if(abs(x - 0.5) < 0.2, 5, 1 + 0.5*sin(6.283185307*y))", 400);
        check::<3>("if((x - 0.5)^2 + (y - 0.5)^2 + (z - 0.5)^2 < 0.12, 5, 1)", 800);
        // Bodies in a vacuum that begins where their density ends.
        check::<2>("max(1 - 4*abs(x - 0.3), 0) + if(abs(x - 0.75) < 0.1, 2 + y, 0)", 4000);
    }

    /// Places that fill a box evenly.
    const STEPS_OF: [f64; 3] = [0.754_877_666, 0.569_840_296, 0.682_327_803];
}
