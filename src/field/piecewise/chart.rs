//! Coordinates in which the surface of a domain is a face of the unit cube.

use super::integrand::Integrand;
use crate::field::{ScalarField, Trace};
use sph::domain::{Domain, Region};
use sph::geometry::unit_ball_volume;
use std::f64::consts::{PI, TAU};

/// A field over a domain as a function on the unit cube: balls by radius and angles, cylinders by radius, angle and
/// height.
pub(crate) struct Chart<'a, const D: usize> {
    field: &'a dyn ScalarField<D>,
    domain: &'a Domain<D>,
    volume: f64,
}

impl<'a, const D: usize> Chart<'a, D> {
    /// `None` within a hull, whose surface is no face.
    pub fn new(field: &'a dyn ScalarField<D>, domain: &'a Domain<D>) -> Option<Self> {
        let extent = domain.extent();
        let volume = match &domain.region {
            Region::Box => extent.iter().product(),
            Region::Ball { radius, .. } => unit_ball_volume(D) * radius.powi(D as i32),
            Region::Cylinder { axis, radius, .. } => unit_ball_volume(2) * radius.powi(2) * extent[*axis],
            Region::Hull(..) => return None,
        };
        Some(Self { field, domain, volume })
    }

    /// The place, and the volume about it per volume of the unit cube.
    fn place(&self, u: &[f64; D]) -> ([f64; D], f64) {
        let (lo, extent) = (self.domain.lo, self.domain.extent());
        match &self.domain.region {
            Region::Ball { center, inner_radius, radius, .. } => {
                let (offset, share) = on_spheres(u, inner_radius / radius);
                (std::array::from_fn(|k| center[k] + radius * offset[k]), share * self.volume)
            }
            Region::Cylinder { center, axis, inner_radius, radius, .. } => {
                let inner = inner_radius / radius;
                let q = inner + u[0] * (1.0 - inner);
                let (sin, cos) = (TAU * u[1]).sin_cos();
                let mut around = [cos, sin].into_iter();
                let x = std::array::from_fn(|k| match k == *axis {
                    true => lo[k] + u[D - 1] * extent[k],
                    false => center[k] + q * radius * around.next().unwrap_or(0.0),
                });
                (x, 2.0 * q * (1.0 - inner) * self.volume)
            }
            Region::Box | Region::Hull(..) => (std::array::from_fn(|k| lo[k] + u[k] * extent[k]), self.volume),
        }
    }
}

/// The place in a shell of the radii `inner` to 1, and the share of the ball's volume per volume of the unit cube.
///
/// The angle to the pole is a coordinate, not its cosine, of which the place is no smooth function there.
fn on_spheres<const D: usize>(u: &[f64; D], inner: f64) -> ([f64; 3], f64) {
    let width = 1.0 - inner;
    let q = inner + u[0] * width;
    match D {
        1 if u[0] < 0.5 => ([-1.0 + 2.0 * u[0] * width, 0.0, 0.0], width),
        1 => ([inner + (2.0 * u[0] - 1.0) * width, 0.0, 0.0], width),
        2 => {
            let (sin, cos) = (TAU * u[1]).sin_cos();
            ([q * cos, q * sin, 0.0], 2.0 * q * width)
        }
        _ => {
            let (ring, z) = (PI * u[1]).sin_cos();
            let (sin, cos) = (TAU * u[2]).sin_cos();
            ([q * ring * cos, q * ring * sin, q * z], 3.0 * q * q * width * 0.5 * PI * ring)
        }
    }
}

impl<const D: usize> Integrand<D> for Chart<'_, D> {
    fn value(&self, u: &[f64; D]) -> f64 {
        let (x, volume) = self.place(u);
        self.field.value(&x) * volume
    }

    fn trace(&self, u: &[f64; D]) -> Trace {
        self.field.trace(&self.place(u).0)
    }
}
