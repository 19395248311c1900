//! An input in the form that placement uses.

use super::{CarriedField, MassEstimate, RadialProfile, ScalarField};
use sph::domain::Domain;
use std::sync::Arc;

/// A radial profile and its center, in the unit of the source's domain.
#[derive(Debug, Clone)]
pub struct RadialSource<const D: usize> {
    /// Density and enclosed mass by radius.
    pub profile: Arc<RadialProfile>,
    pub center: [f64; D],
}

impl<const D: usize> RadialSource<D> {
    /// A place at the radius `r`.
    pub fn at(&self, r: f64) -> [f64; D] {
        sph::array(|k| self.center[k] + if k == 0 { r } else { 0.0 })
    }
}

/// What placement needs of an input.
pub struct Source<const D: usize> {
    /// Mass density, in the input's own units.
    pub density: Box<dyn ScalarField<D>>,
    /// Variables that the particles take at their places.
    pub carried: Vec<Box<dyn CarriedField<D>>>,
    /// Where the input is defined: the default domain.
    pub domain: Domain<D>,
    /// Exact or better-than-quadrature mass within `domain`, where the interpolant knows it.
    pub mass: Option<MassEstimate>,
    /// The profile itself, where the density is a function of the radius alone.
    pub radial: Option<RadialSource<D>>,
    /// Decisions of the interpolant, for the report.
    pub notes: Vec<String>,
}

impl<const D: usize> Source<D> {
    /// The point from which radii count, in the unit of `domain`: the profile's center, else the domain's.
    pub fn center(&self) -> [f64; D] {
        self.radial.as_ref().map_or_else(|| self.domain.center(), |radial| radial.center)
    }
}
