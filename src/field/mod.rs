//! Interpolants: what a file's numbers, or an expression, say at any point.

use crate::domain::Domain;
use sph_formats::Unit;

/// A mass with the error of its quadrature (same unit, absolute).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassEstimate {
    pub value: f64,
    pub error: f64,
}

/// A scalar field: a mass density, a spacing, a number density.
pub trait ScalarField<const D: usize>: Send + Sync {
    /// Value at `x`: finite and, for a density, never negative; 0 outside the field's support.
    fn value(&self, x: &[f64; D]) -> f64;
}

/// What a carried variable is.
#[derive(Debug, Clone, PartialEq)]
pub struct CarriedInfo {
    pub name: String,
    pub unit: Option<Unit>,
    /// 1 for a scalar, D for a vector.
    pub components: usize,
}

/// A variable that rides along with the density.
pub trait CarriedField<const D: usize>: Send + Sync {
    fn info(&self) -> &CarriedInfo;
    /// Writes the `components` values at `x`, clamped to the nearest point of the field's support.
    fn evaluate(&self, x: &[f64; D], out: &mut [f64]);
}

/// Everything that placement needs to know of an input.
pub struct Source<const D: usize> {
    /// Mass density, in the input's own units.
    pub density: Box<dyn ScalarField<D>>,
    pub carried: Vec<Box<dyn CarriedField<D>>>,
    /// Where the input is defined: the default domain.
    pub domain: Domain<D>,
    /// Exact or better-than-quadrature mass within `domain`, where the interpolant knows it.
    pub mass: Option<MassEstimate>,
    /// Decisions of the interpolant, for the report.
    pub notes: Vec<String>,
}
