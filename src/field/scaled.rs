//! Change of units by linear factors, without copying data.

use super::{CarriedField, CarriedInfo, MassEstimate, RadialSource, ScalarField, Source};
use crate::domain::{Domain, Hull, Region};
use std::sync::Arc;

impl<const D: usize> Source<D> {
    /// The same source with coordinates multiplied by `length` and densities by `density` (both positive and
    /// finite). Carried values are left as they are.
    #[must_use]
    pub fn scaled(self, length: f64, density: f64) -> Self {
        if length == 1.0 && density == 1.0 {
            return self;
        }
        let mass = density * length.powi(D as i32);
        Self {
            density: Box::new(ScaledField { inner: self.density, length, density }),
            carried: self
                .carried
                .into_iter()
                .map(|inner| Box::new(ScaledCarried { inner, length }) as Box<dyn CarriedField<D>>)
                .collect(),
            domain: scale_domain(&self.domain, length),
            mass: self.mass.map(|m| MassEstimate { value: m.value * mass, error: m.error * mass }),
            radial: self.radial.map(|r| RadialSource {
                profile: Arc::new(r.profile.scaled(length, density)),
                center: r.center.map(|c| c * length),
            }),
            notes: self.notes,
        }
    }
}

struct ScaledField<const D: usize> {
    inner: Box<dyn ScalarField<D>>,
    length: f64,
    density: f64,
}

impl<const D: usize> ScalarField<D> for ScaledField<D> {
    fn value(&self, x: &[f64; D]) -> f64 {
        self.density * self.inner.value(&x.map(|v| v / self.length))
    }

    fn center(&self) -> Option<[f64; D]> {
        self.inner.center().map(|c| c.map(|v| v * self.length))
    }

    fn integral(&self, domain: &Domain<D>) -> Option<MassEstimate> {
        let m = self.inner.integral(&scale_domain(domain, 1.0 / self.length))?;
        let factor = self.density * self.length.powi(D as i32);
        Some(MassEstimate { value: m.value * factor, error: m.error * factor })
    }
}

struct ScaledCarried<const D: usize> {
    inner: Box<dyn CarriedField<D>>,
    length: f64,
}

impl<const D: usize> CarriedField<D> for ScaledCarried<D> {
    fn info(&self) -> &CarriedInfo {
        self.inner.info()
    }

    fn evaluate(&self, x: &[f64; D], out: &mut [f64]) {
        self.inner.evaluate(&x.map(|v| v / self.length), out);
    }
}

/// A hull in other length units.
#[derive(Debug)]
struct ScaledHull<const D: usize> {
    inner: Arc<dyn Hull<D>>,
    length: f64,
}

impl<const D: usize> Hull<D> for ScaledHull<D> {
    fn contains(&self, x: &[f64; D]) -> bool {
        self.inner.contains(&x.map(|v| v / self.length))
    }

    fn nearest_on_surface(&self, x: &[f64; D]) -> [f64; D] {
        self.inner.nearest_on_surface(&x.map(|v| v / self.length)).map(|v| v * self.length)
    }

    fn volume(&self) -> f64 {
        self.inner.volume() * self.length.powi(D as i32)
    }
}

fn scale_domain<const D: usize>(domain: &Domain<D>, length: f64) -> Domain<D> {
    let region = match &domain.region {
        Region::Box => Region::Box,
        Region::Ball { center, inner_radius, radius, wall } => Region::Ball {
            center: center.map(|c| c * length),
            inner_radius: inner_radius * length,
            radius: radius * length,
            wall: *wall,
        },
        Region::Cylinder { center, axis, inner_radius, radius, wall } => Region::Cylinder {
            center: center.map(|c| c * length),
            axis: *axis,
            inner_radius: inner_radius * length,
            radius: radius * length,
            wall: *wall,
        },
        Region::Hull(hull, wall) => Region::Hull(Arc::new(ScaledHull { inner: Arc::clone(hull), length }), *wall),
    };
    Domain { lo: domain.lo.map(|v| v * length), hi: domain.hi.map(|v| v * length), axes: domain.axes, region }
}
