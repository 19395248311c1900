//! A fixed point mass with softened gravity in three dimensions; the gravitational constant is 1.
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

    /// H over the Plummer-equivalent length, with which codes state it: at the center the potential is that of a Plummer sphere of
    /// that length.
    pub const fn radius_over_plummer(self) -> f64 {
        match self {
            Self::CubicSpline => 2.8,
            Self::WendlandC2 => 3.0,
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
            acceleration: crate::array(|k| -self.mass * over_cube * (x[k] - self.center[k])),
            potential: self.mass * potential,
        }
    }
}
