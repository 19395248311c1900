//! The region of a grid in curvilinear coordinates that does not go all around: what a plane shape beside the z axis sweeps over
//! when it turns from one azimuth to another.
//!
//! The nearest point of the surface is in the half-plane of the same azimuth where that is swept, or in the first or last
//! half-plane, whatever is nearest.

use sph::domain::Hull;
use sph::geometry::distance;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A shape in the half-plane of distance from the axis and height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Meridian {
    /// Between two radii and two colatitudes.
    Annular { radius: [f64; 2], theta: [f64; 2] },
    /// Between two distances from the axis and two heights; without ends in a plane.
    Rectangle { distance: [f64; 2], height: [f64; 2] },
}

type Point = [f64; 2];

fn on_segment(p: Point, a: Point, b: Point) -> Point {
    let along = [b[0] - a[0], b[1] - a[1]];
    let square = along[0] * along[0] + along[1] * along[1];
    let t = ((p[0] - a[0]) * along[0] + (p[1] - a[1]) * along[1]) / square;
    let t = if square > 0.0 { t.clamp(0.0, 1.0) } else { 0.0 };
    [a[0] + t * along[0], a[1] + t * along[1]]
}

/// The distance from an axis, or the center: in units of the body, where `hypot`'s care is not needed and takes five times as long.
pub(super) fn across(a: f64, b: f64) -> f64 {
    (a * a + b * b).sqrt()
}

fn polar(radius: f64, theta: f64) -> Point {
    // Exactly on the axis at its end.
    let out = if theta >= PI { 0.0 } else { theta.sin() };
    [radius * out, radius * theta.cos()]
}

impl Meridian {
    fn contains(&self, p: Point) -> bool {
        let within = |x: f64, [lo, hi]: [f64; 2]| x >= lo && x <= hi;
        match *self {
            Self::Annular { radius, theta } => within(across(p[0], p[1]), radius) && within(p[0].atan2(p[1]), theta),
            Self::Rectangle { distance, height } => within(p[0], distance) && within(p[1], height),
        }
    }

    /// The nearest point of the outline; the axis is part of it where `has_axis` says so.
    fn nearest(&self, p: Point, has_axis: bool) -> Option<Point> {
        let mut all: Vec<Point> = Vec::new();
        match *self {
            Self::Annular { radius: [a, b], theta } => {
                let at = p[0].atan2(p[1]);
                for r in [a, b].into_iter().filter(|r| *r > 0.0) {
                    if at >= theta[0] && at <= theta[1] {
                        all.push(polar(r, at));
                    }
                    all.extend(theta.map(|t| polar(r, t)));
                }
                let is_axis = |t: f64| t <= 0.0 || t >= PI;
                for t in theta.into_iter().filter(|t| has_axis || !is_axis(*t)) {
                    all.push(on_segment(p, polar(a, t), polar(b, t)));
                }
            }
            Self::Rectangle { distance, height } => {
                for d in distance.into_iter().filter(|d| has_axis || *d > 0.0) {
                    all.push([d, p[1].clamp(height[0], height[1])]);
                }
                for z in height.into_iter().filter(|z| z.is_finite()) {
                    all.push([p[0].clamp(distance[0], distance[1]), z]);
                }
            }
        }
        let away = |q: &Point| (q[0] - p[0]).hypot(q[1] - p[1]);
        all.into_iter().min_by(|a, b| away(a).total_cmp(&away(b)))
    }

    /// Least and greatest distance from the axis, and height.
    fn bounds(&self) -> [[f64; 2]; 2] {
        match *self {
            Self::Rectangle { distance, height } => [distance, height],
            Self::Annular { radius: [a, b], theta: [c, d] } => {
                let sines = [c.sin().max(0.0), d.sin().max(0.0)];
                let widest = if c <= FRAC_PI_2 && d >= FRAC_PI_2 { 1.0 } else { sines[0].max(sines[1]) };
                let heights = [a * c.cos(), b * c.cos(), a * d.cos(), b * d.cos()];
                let low = heights.into_iter().fold(f64::INFINITY, f64::min);
                let high = heights.into_iter().fold(f64::NEG_INFINITY, f64::max);
                [[a * sines[0].min(sines[1]), b * widest], [low, high]]
            }
        }
    }
}

/// What a [`Meridian`] sweeps over; azimuths ascend by less than a circle, `None` is all of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sector<const D: usize> {
    pub(crate) meridian: Meridian,
    pub(crate) azimuth: Option<[f64; 2]>,
}

impl<const D: usize> Sector<D> {
    /// Corners of the smallest box along the axes.
    pub(crate) fn corners(&self) -> [[f64; D]; 2] {
        let [[inner, outer], [low, high]] = self.meridian.bounds();
        let [from, to] = self.azimuth.unwrap_or([0.0, TAU]);
        let quarters = (from / FRAC_PI_2).ceil() as i64..=(to / FRAC_PI_2).floor() as i64;
        let angles: Vec<f64> = quarters.map(|q| q as f64 * FRAC_PI_2).chain([from, to]).collect();
        let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for (angle, ring) in angles.iter().flat_map(|a| [(a, inner), (a, outer)]) {
            for (k, x) in [ring * angle.cos(), ring * angle.sin()].into_iter().enumerate() {
                lo[k] = lo[k].min(x);
                hi[k] = hi[k].max(x);
            }
        }
        (lo[2], hi[2]) = (low, high);
        [sph::array(|k| lo[k]), sph::array(|k| hi[k])]
    }

    fn is_swept(&self, x: &[f64; 3]) -> bool {
        let Some([from, to]) = self.azimuth else { return true };
        (x[1].atan2(x[0]) - from).rem_euclid(TAU) <= to - from
    }
}

fn full<const D: usize>(x: &[f64; D]) -> [f64; 3] {
    sph::array(|k| x.get(k).copied().unwrap_or(0.0))
}

impl<const D: usize> Hull<D> for Sector<D> {
    fn contains(&self, x: &[f64; D]) -> bool {
        let x = full(x);
        self.is_swept(&x) && self.meridian.contains([across(x[0], x[1]), x[2]])
    }

    fn nearest_on_surface(&self, x: &[f64; D]) -> [f64; D] {
        let p = full(x);
        let mut all: Vec<[f64; 3]> = Vec::new();
        if self.is_swept(&p) {
            let ring = across(p[0], p[1]);
            let (cos, sin) = if ring > 0.0 { (p[0] / ring, p[1] / ring) } else { (1.0, 0.0) };
            all.extend(self.meridian.nearest([ring, p[2]], false).map(|q| [q[0] * cos, q[0] * sin, q[1]]));
        }
        for angle in self.azimuth.into_iter().flatten() {
            let (sin, cos) = angle.sin_cos();
            let in_plane = [p[0] * cos + p[1] * sin, p[2]];
            let inside = self.meridian.contains(in_plane).then_some(in_plane);
            let q = inside.or_else(|| self.meridian.nearest(in_plane, true));
            all.extend(q.map(|q| [q[0] * cos, q[0] * sin, q[1]]));
        }
        let nearest = all.into_iter().min_by(|a, b| distance(a, &p).total_cmp(&distance(b, &p)));
        nearest.map_or(*x, |q| sph::array(|k| q[k]))
    }

    fn volume(&self) -> f64 {
        let turn = self.azimuth.map_or(TAU, |[from, to]| to - from);
        let squares = |[a, b]: [f64; 2]| 0.5 * (b * b - a * a);
        match self.meridian {
            Meridian::Annular { radius: [a, b], theta: [c, d] } => {
                turn * (b.powi(3) - a.powi(3)) / 3.0 * (c.cos() - d.cos())
            }
            Meridian::Rectangle { distance, .. } if D == 2 => turn * squares(distance),
            Meridian::Rectangle { distance, height } => turn * squares(distance) * (height[1] - height[0]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::*;

    fn shapes() -> Vec<Sector<3>> {
        let annular = |a: f64, c: f64, d: f64| Meridian::Annular { radius: [a, 2.0], theta: [c, d] };
        let rectangle = |a: f64| Meridian::Rectangle { distance: [a, 2.0], height: [-0.5, 1.0] };
        let mut all = Vec::new();
        for azimuth in [None, Some([0.3, 1.2]), Some([-2.0, 2.5]), Some([5.0, 7.5])] {
            for meridian in
                [annular(0.7, 1.0, 2.0), annular(0.0, 0.0, 1.2), annular(0.5, 0.0, PI), rectangle(0.6), rectangle(0.0)]
            {
                all.push(Sector { meridian, azimuth });
            }
        }
        all
    }

    #[test]
    fn volumes_are_those_of_points_inside() {
        let mut random = Random::new(3);
        for shape in shapes() {
            let [lo, hi] = shape.corners();
            let volume: f64 = (0..3).map(|k| hi[k] - lo[k]).product();
            let count = 40_000;
            let inside = (0..count)
                .filter(|_| {
                    let x: [f64; 3] = sph::array(|k| lo[k] + random.unit() * (hi[k] - lo[k]));
                    shape.contains(&x)
                })
                .count();
            let share = shape.volume() / volume;
            // Four standard deviations.
            let tolerance = 4.0 * (share * (1.0 - share).max(0.0) / f64::from(count)).sqrt() + 1e-12;
            assert!((inside as f64 / f64::from(count) - share).abs() < tolerance, "{shape:?}");
        }
    }

    /// No point of the other side is nearer than the nearest point of the surface, and some are little farther.
    #[test]
    fn the_nearest_point_of_the_surface_is_where_inside_ends() {
        let mut random = Random::new(9);
        for shape in shapes() {
            for _ in 0..60 {
                let x: [f64; 3] = sph::array(|_| 5.0 * random.unit() - 2.5);
                let is_inside = shape.contains(&x);
                let nearest = shape.nearest_on_surface(&x);
                let reach = distance(&nearest, &x);
                let toward = |length: f64, way: [f64; 3]| sph::array(|k| x[k] + length * way[k]);
                for _ in 0..40 {
                    let way: [f64; 3] = sph::array(|_| random.unit() - 0.5);
                    let size = distance(&way, &[0.0; 3]);
                    let near: [f64; 3] = toward(random.unit() * reach * (1.0 - 1e-9) / size, way);
                    assert_eq!(shape.contains(&near), is_inside, "{shape:?}: {x:?}, {near:?} within {reach}");
                }
                let changes = (0..200).any(|_| {
                    let near: [f64; 3] = sph::array(|k| nearest[k] + 1e-6 * (random.unit() - 0.5));
                    shape.contains(&near) != is_inside
                });
                assert!(changes, "{shape:?}: {x:?}, {nearest:?}");
            }
        }
    }

    #[test]
    fn a_sector_of_a_disc_is_one_in_a_plane() {
        let meridian = Meridian::Rectangle { distance: [1.0, 2.0], height: [f64::NEG_INFINITY, f64::INFINITY] };
        let shape = Sector::<2> { meridian, azimuth: Some([0.0, FRAC_PI_2]) };
        assert!((shape.volume() - 0.75 * PI).abs() < 1e-14);
        assert_eq!(shape.nearest_on_surface(&[1.5, 0.1]), [1.5, 0.0]);
        assert_eq!(shape.nearest_on_surface(&[3.0, 0.0]), [2.0, 0.0]);
        assert!(shape.contains(&[1.0, 1.0]) && !shape.contains(&[1.0, -0.1]));
        assert_eq!(shape.corners().map(|c| c.map(|x| (x * 1e9).round() / 1e9)), [[0.0; 2], [2.0; 2]]);
    }
}
