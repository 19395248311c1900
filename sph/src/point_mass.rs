//! A point mass at a fixed place whose attraction is softened, in three dimensions; the constant of gravity is 1.
//!
//! Beyond the softening radius H it attracts as a point. Within, its mass is spread as a kernel of that support: the cubic spline, as in
//! Phantom (H = 2 hsoft; Price & Monaghan 2007, MNRAS 374, 1347), GADGET and AREPO (H = 2.8 times the Plummer-equivalent length;
//! Springel, Yoshida & White 2001, New Astronomy 6, 79), or Wendland's C2 function, as in SWIFT (H = 3 times that length).

use crate::geometry::distance;
use crate::gravity::{Pull, softened};

/// How the mass is spread within the softening radius.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Softening {
    CubicSpline,
    WendlandC2,
}

impl Softening {
    /// The part of the mass within u = r/H, u < 1, over u^3, and the potential in units of the mass over H.
    fn within(self, u: f64) -> (f64, f64) {
        match self {
            Self::WendlandC2 => softened::<3>(u),
            Self::CubicSpline if u < 0.5 => {
                (32.0 / 3.0 + u * u * (32.0 * u - 38.4), -2.8 + u * u * (16.0 / 3.0 + u * u * (6.4 * u - 9.6)))
            }
            Self::CubicSpline => (
                64.0 / 3.0 - 48.0 * u + 38.4 * u * u - 32.0 / 3.0 * u.powi(3) - 1.0 / (15.0 * u.powi(3)),
                -3.2 + 1.0 / (15.0 * u) + u * u * (32.0 / 3.0 + u * (-16.0 + u * (9.6 - 32.0 / 15.0 * u))),
            ),
        }
    }

    /// The part of the mass that attracts at r = u H.
    pub fn enclosed(self, u: f64) -> f64 {
        if u < 1.0 { u.powi(3) * self.within(u).0 } else { 1.0 }
    }
}

/// A softened mass at its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointMass<const D: usize> {
    pub center: [f64; D],
    pub mass: f64,
    /// H, beyond which it is a point.
    pub radius: f64,
    pub softening: Softening,
}

impl<const D: usize> PointMass<D> {
    /// The mass that attracts at the distance `r`.
    pub fn enclosed_mass(&self, r: f64) -> f64 {
        self.mass * self.softening.enclosed(r / self.radius)
    }

    /// Acceleration and potential at `x`.
    pub fn pull(&self, x: &[f64; D]) -> Pull<D> {
        let r = distance(x, &self.center);
        let (over_cube, potential) = if r < self.radius {
            let (part, potential) = self.softening.within(r / self.radius);
            (part / self.radius.powi(3), potential / self.radius)
        } else {
            (r.powi(-3), -1.0 / r)
        };
        Pull {
            acceleration: std::array::from_fn(|k| -self.mass * over_cube * (x[k] - self.center[k])),
            potential: self.mass * potential,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: [Softening; 2] = [Softening::CubicSpline, Softening::WendlandC2];

    /// Both are continuous at H with the point's, and at the spline's inner knot.
    #[test]
    fn pulls_are_those_of_a_point_from_the_softening_radius_on() {
        for softening in BOTH {
            let point = PointMass { center: [1.0, 0.0, -1.0], mass: 3.0, radius: 0.5, softening };
            for (r, tolerance) in [(0.5 - 1e-9, 1e-7), (0.5, 1e-14), (2.0, 1e-14)] {
                let pull = point.pull(&[1.0, r, -1.0]);
                assert!((pull.acceleration[1] * r * r / -3.0 - 1.0).abs() < tolerance, "{softening:?} {r}: {pull:?}");
                assert!((pull.potential * r / -3.0 - 1.0).abs() < tolerance);
                assert_eq!([pull.acceleration[0], pull.acceleration[2]], [0.0; 2]);
            }
            let at = |u: f64| (softening.enclosed(u), softening.within(u).1);
            let (a, b) = (at(0.5 - 1e-12), at(0.5 + 1e-12));
            assert!((a.0 - b.0).abs() < 1e-10 && (a.1 - b.1).abs() < 1e-10);
            assert_eq!(point.pull(&point.center).acceleration, [0.0; 3]);
        }
    }

    /// The mass within is the integral of the kernel, and the pull the slope of the potential.
    #[test]
    fn softened_masses_are_those_of_their_kernels() {
        use crate::kernel::{CubicSpline, WendlandC2, evaluate};
        for softening in BOTH {
            let value = |u: f64| match softening {
                Softening::CubicSpline => evaluate::<_, 3>(CubicSpline, u).0,
                Softening::WendlandC2 => evaluate::<_, 3>(WendlandC2, u).0,
            };
            let steps = 4000;
            let mut mass = 0.0;
            for i in 0..steps {
                let u = (f64::from(i) + 0.5) / f64::from(steps);
                mass += 4.0 * std::f64::consts::PI * u * u * value(u) / f64::from(steps);
                let end = f64::from(i + 1) / f64::from(steps);
                assert!((softening.enclosed(end) - mass).abs() < 1e-6, "{softening:?} {end}");
            }
            let point = PointMass::<3> { center: [0.0; 3], mass: 2.0, radius: 1.0, softening };
            for x in [0.1, 0.45, 0.55, 0.9, 1.3] {
                let phi = |x: f64| point.pull(&[x, 0.0, 0.0]).potential;
                let slope = (phi(x + 1e-5) - phi(x - 1e-5)) / 2e-5;
                assert!((slope + point.pull(&[x, 0.0, 0.0]).acceleration[0]).abs() < 1e-8);
            }
        }
    }
}
