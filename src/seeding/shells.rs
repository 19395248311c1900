//! Concentric shells of a radial target (rings in two dimensions), each rotated at random.
//!
//! Shells are as thick as the spacing n*^(-1/d) at their radius. Each takes the whole number of particles that
//! keeps the enclosed mass right to half a particle; its bounds then follow from these numbers. On the sphere the
//! particles lie either
//! - on the golden spiral, which takes any number (after the templates of Diehl et al. 2015, sec. 3.2.4, which
//!   relax random points instead; Gonzalez 2010, Math. Geosci. 42, 49), or
//! - in collars of regions of equal area (SEAGen: Kegerreis et al. 2019, MNRAS 487, 5029; Leopardi 2006), without
//!   SEAGen's shift of the collars next to the poles.
//!
//! The radius of a shell is where a sum over neighbors sees the same of it as of the layer that it stands for. In three
//! dimensions the mean of W over a sphere of radius s, seen from r, is (F(|r - s|) - F(r + s)) / (2 r s), F(u) being the
//! integral of W x dx beyond u. Times r that is a convolution in one dimension, in which a layer counts with the
//! integral of rho s ds, and its shell with the layer's mass over the shell's radius. With
//! integral(rho s^2) / integral(rho s) for the radius these are the same, and the shell lies at the layer's center in that
//! convolution. A shell that halves its layer's mass instead leaves a hole of 13 % about the center, where now 2 %
//! remain. In two dimensions rho s^(1/2) takes the place of rho s, to leading order in 1/r.

use super::cumulative::Cumulative;
use super::methods::{self, Method};
use super::seeded::{Seeded, to_positions};
use super::symmetry::{self, spherical_mean};
use crate::error::{Error, Result};
use crate::random::{Purpose, keyed};
use crate::target::{Positions, Surroundings, Target};
use rand::RngExt;
use sph::domain::Region;
use sph::parallel;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// How points lie on a sphere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Covering {
    Spiral,
    EqualArea,
}

/// A sphere and the particles on it.
struct Shell {
    radius: f64,
    first: usize,
    count: usize,
}

/// The particles of a radial target on shells, counted from the inside out: any of them without the rest.
pub(super) struct Shells<const D: usize> {
    center: [f64; D],
    covering: Covering,
    seed: u64,
    shells: Vec<Shell>,
}

impl<const D: usize> Shells<D> {
    /// # Errors
    /// A domain that is no ball, and a target that is not radial.
    pub fn new(target: &Target<'_, D>, covering: Covering, method: &Method, seed: u64) -> Result<Self> {
        let Region::Ball { center, inner_radius, radius, .. } = &target.domain.region else {
            let others = methods::for_any_target(method.name);
            return Err(Error::scene(
                "seeding",
                format!(
                    "'{}' needs a ball or spherical shell for its domain, found another; use {others}",
                    method.name
                ),
            ));
        };
        // In a ball of two or three dimensions all that is found is radial or uniform.
        symmetry::detect(target, method.name)?;
        let density = |r: f64| spherical_mean(target, center, r);
        let mass = Cumulative::new(|r| r.powi(D as i32 - 1) * density(r), *inner_radius, *radius);
        let seen = Cumulative::new(|r| r.powf(0.5 * (D as f64 - 1.0)) * density(r), *inner_radius, *radius);
        // Of the shell with particles `first` to `end`.
        let shell_radius = |first: usize, end: usize| {
            let inside = |n: usize| mass.inverse(n as f64 / target.count as f64);
            let (inner, outer) = (inside(first), inside(end));
            let share = (mass.at(outer) - mass.at(inner)) / (seen.at(outer) - seen.at(inner));
            let radius = share.powf(2.0 / (D as f64 - 1.0));
            if radius >= inner && radius <= outer { radius } else { 0.5 * (inner + outer) }
        };
        let layers = Cumulative::new(|r| density(r).powf(1.0 / D as f64), *inner_radius, *radius);
        let hollow = *inner_radius > 0.0 || !target.admits(center);
        let shells = shells(target.count, hollow, *radius, &mass, &layers, &shell_radius);
        Ok(Self { center: *center, covering, seed, shells })
    }

    pub fn seeded(&self) -> Seeded<D> {
        let count = self.shells.last().map_or(0, |s| s.first + s.count);
        let notes = vec![format!("{count} particles on {} shells", self.shells.len())];
        Seeded { positions: self.positions(0..count), notes }
    }

    /// Particles within a distance of a place.
    pub fn near(&self, about: &Surroundings<D>) -> Positions<D> {
        let Surroundings { x, reach } = *about;
        let mut all: Positions<D> = std::array::from_fn(|_| Vec::new());
        let from_center: [f64; D] = sph::array(|k| x[k] - self.center[k]);
        let distance = from_center.iter().map(|v| v * v).sum::<f64>().sqrt();
        for (s, shell) in self.shells.iter().enumerate().filter(|(_, s)| (s.radius - distance).abs() <= reach) {
            let direction = Directions::<D>::new(shell.count, self.covering, self.seed, s as u64);
            // Under which the surroundings are seen from the center.
            let angle = if reach < distance { (reach / distance).asin() } else { PI };
            for i in direction.within(&from_center, angle) {
                let u = direction.at(i);
                let place: [f64; D] = sph::array(|k| self.center[k] + shell.radius * u[k]);
                if about.holds(&sph::array(|k| place[k] - x[k])) {
                    all.iter_mut().zip(place).for_each(|(axis, v)| axis.push(v));
                }
            }
        }
        all
    }

    /// Particles by their numbers.
    pub fn positions(&self, particles: Range<usize>) -> Positions<D> {
        let mut all: Positions<D> = std::array::from_fn(|_| Vec::with_capacity(particles.len()));
        let inner = self.shells.partition_point(|s| s.first + s.count <= particles.start);
        for (s, shell) in self.shells.iter().enumerate().skip(inner).take_while(|(_, s)| s.first < particles.end) {
            let clamp = |i: usize| i.clamp(shell.first, shell.first + shell.count) - shell.first;
            let (start, end) = (clamp(particles.start), clamp(particles.end));
            let direction = Directions::<D>::new(shell.count, self.covering, self.seed, s as u64);
            let points = parallel::map(end - start, |i| {
                let u = direction.at(start + i);
                sph::array(|k| self.center[k] + shell.radius * u[k])
            });
            all.iter_mut().zip(to_positions::<D>(&points)).for_each(|(all, one)| all.extend(one));
        }
        all
    }
}

/// Shells from the inside out. `layers` counts spacings along the radius. No particle may be at the center of a
/// `hollow` one (or of a cusp, whose density is beyond bounds there).
fn shells(
    count: usize,
    hollow: bool,
    outer: f64,
    mass: &Cumulative<'_>,
    layers: &Cumulative<'_>,
    radius_of: &dyn Fn(usize, usize) -> f64,
) -> Vec<Shell> {
    let number = layers.total().round().clamp(1.0, count as f64) as usize;
    let mut shells = Vec::with_capacity(number);
    let mut first = 0;
    for s in 1..=number {
        let edge = if s == number { outer } else { layers.inverse(s as f64 / number as f64) };
        let enclosed = if s == number { count } else { (mass.at(edge) / mass.total() * count as f64).round() as usize };
        let enclosed = enclosed.clamp(first, count);
        if enclosed > first {
            // One particle alone in the innermost shell stands for a ball around the center.
            let alone = first == 0 && enclosed == 1 && !hollow;
            let radius = if alone { 0.0 } else { radius_of(first, enclosed).min(outer * (1.0 - 1e-12)) };
            shells.push(Shell { radius, first, count: enclosed - first });
        }
        first = enclosed;
    }
    debug_assert_eq!(shells.last().map(|s| s.first + s.count), Some(count));
    shells
}

/// Unit vectors of one shell, rotated at random.
struct Directions<const D: usize> {
    count: usize,
    turn: f64,
    rotation: [[f64; 3]; 3],
    /// None of a spiral.
    collars: Option<Collars>,
}

impl<const D: usize> Directions<D> {
    fn new(count: usize, covering: Covering, seed: u64, shell: u64) -> Self {
        let mut rng = keyed(seed, Purpose::ShellRotation, shell);
        let turn = TAU * rng.random::<f64>();
        let rotation = random_rotation([rng.random(), rng.random(), rng.random()]);
        let collars = (D == 3 && covering == Covering::EqualArea).then(|| Collars::new(count));
        Self { count, turn, rotation, collars }
    }

    /// Numbers of the points whose heights are those of points within `angle` of a direction, among them all of these: both coverings go
    /// from pole to pole.
    fn within(&self, direction: &[f64; D], angle: f64) -> Range<usize> {
        let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        if D < 3 || !(length > 0.0) {
            return 0..self.count;
        }
        // Along the axis of the poles, before the rotation.
        let height = (0..3).map(|k| self.rotation[k][2] * direction[k]).sum::<f64>() / length;
        let polar = height.clamp(-1.0, 1.0).acos();
        let (top, bottom) = ((polar - angle).max(0.0).cos(), (polar + angle).min(PI).cos());
        let first_below = |z: f64| first_where(self.count, |i| self.unrotated(i)[2] < z);
        first_below(top + ROUNDING)..first_below(bottom - ROUNDING)
    }

    fn unrotated(&self, i: usize) -> [f64; 3] {
        self.collars.as_ref().map_or_else(|| on_spiral(i, self.count), |collars| collars.point(i))
    }

    fn at(&self, i: usize) -> [f64; D] {
        if D < 3 {
            let (sin, cos) = (self.turn + TAU * i as f64 / self.count as f64).sin_cos();
            return sph::array(|k| [cos, sin][k]);
        }
        let point = self.unrotated(i);
        sph::array(|k| (0..3).map(|j| self.rotation[k][j] * point[j]).sum())
    }
}

/// What heights are compared to.
const ROUNDING: f64 = 1e-12;

/// The first of `count` numbers from which on `holds` does; `count` where it never does.
fn first_where(count: usize, holds: impl Fn(usize) -> bool) -> usize {
    let (mut first, mut end) = (0, count);
    while first < end {
        let middle = first + (end - first) / 2;
        if holds(middle) { end = middle } else { first = middle + 1 }
    }
    first
}

/// Uniform in the rotation group (Shoemake 1992): the quaternion from three uniform numbers.
fn random_rotation([a, b, c]: [f64; 3]) -> [[f64; 3]; 3] {
    let ((s1, c1), (s2, c2)) = ((TAU * b).sin_cos(), (TAU * c).sin_cos());
    let (p, q) = ((1.0 - a).sqrt(), a.sqrt());
    let (x, y, z, w) = (p * s1, p * c1, q * s2, q * c2);
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

fn on_sphere(z: f64, azimuth: f64) -> [f64; 3] {
    let r = (1.0 - z * z).max(0.0).sqrt();
    [r * azimuth.cos(), r * azimuth.sin(), z]
}

/// Equal steps in height, the golden angle in azimuth.
fn on_spiral(i: usize, count: usize) -> [f64; 3] {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    on_sphere(1.0 - (2.0 * i as f64 + 1.0) / count as f64, golden * i as f64)
}

/// Two caps and collars between them, all cut into regions of the same area.
struct Collars {
    /// Of all points.
    count: usize,
    /// Points north of each collar, and of the south pole at the end.
    before: Vec<usize>,
}

impl Collars {
    fn new(count: usize) -> Self {
        if count < 2 {
            return Self { count, before: Vec::new() };
        }
        let n = count as f64;
        // A cap of one region reaches to this angle.
        let cap = (1.0 - 2.0 / n).acos();
        let collars =
            if count == 2 { 0 } else { ((PI - 2.0 * cap) / (2.0 * PI.sqrt() / n.sqrt())).round().max(1.0) as usize };
        let mut before = vec![1];
        for c in 1..=collars {
            let edge = cap + (PI - 2.0 * cap) * c as f64 / collars as f64;
            // Regions north of the ideal edge, as a whole number: what rounding takes here the next collar gets.
            let enclosed = if c == collars { count - 1 } else { (0.5 * n * (1.0 - edge.cos())).round() as usize };
            before.push(enclosed.clamp(before[c - 1], count - 1));
        }
        Self { count, before }
    }

    fn point(&self, i: usize) -> [f64; 3] {
        if i == 0 {
            return [0.0, 0.0, 1.0];
        }
        // The last of those that begin no later.
        let c = self.before.partition_point(|b| *b <= i);
        let (Some(&first), Some(&end)) = (self.before.get(c.wrapping_sub(1)), self.before.get(c)) else {
            return [0.0, 0.0, -1.0];
        };
        // The height that halves the collar's area.
        let z = 1.0 - (first + end) as f64 / self.count as f64;
        let turn = if c % 2 == 0 { 0.0 } else { 0.5 };
        on_sphere(z, TAU * ((i - first) as f64 + turn) / (end - first) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn closest(points: &[[f64; 3]]) -> f64 {
        let mut least = f64::INFINITY;
        for (i, a) in points.iter().enumerate() {
            for b in &points[..i] {
                least = least.min((0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt());
            }
        }
        least
    }

    #[test]
    fn coverings_have_any_number_of_points_well_apart() {
        for count in (2..40).chain([100, 333, 1000]) {
            let spacing = (4.0 * PI / count as f64).sqrt();
            let collars = Collars::new(count);
            let spiral: Vec<_> = (0..count).map(|i| on_spiral(i, count)).collect();
            let equal_area: Vec<_> = (0..count).map(|i| collars.point(i)).collect();
            for (name, points) in [("spiral", spiral), ("equal area", equal_area)] {
                assert_eq!(points.len(), count, "{name}");
                assert!(points.iter().all(|p| (p.iter().map(|v| v * v).sum::<f64>() - 1.0).abs() < 1e-12));
                assert!(closest(&points) > 0.6 * spacing, "{name} {count}: {}", closest(&points) / spacing);
            }
        }
    }

    #[test]
    fn rotations_are_orthogonal() {
        for u in [[0.1, 0.2, 0.3], [0.9, 0.01, 0.5], [0.0, 0.0, 0.0]] {
            let r = random_rotation(u);
            for i in 0..3 {
                for j in 0..3 {
                    let dot: f64 = (0..3).map(|k| r[i][k] * r[j][k]).sum();
                    assert!((dot - f64::from(u8::from(i == j))).abs() < 1e-14);
                }
            }
        }
    }
}
