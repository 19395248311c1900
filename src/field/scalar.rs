//! Scalar fields: a mass density, a spacing, a number density.

use super::{Enclosure, Patch, Trace};
use sph::domain::Domain;

/// A mass with the error of its quadrature (same unit, absolute).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassEstimate {
    pub value: f64,
    /// A bound or an estimate of |value - exact|, never negative.
    pub error: f64,
}

/// A scalar field: a mass density, a spacing, a number density.
pub trait ScalarField<const D: usize>: Send + Sync {
    /// Value at `x`: finite and, for a density, never negative; 0 outside the field's support.
    fn value(&self, x: &[f64; D]) -> f64;

    /// The center of a field that depends on the distance from one point alone; its gradient then takes one
    /// difference instead of D.
    fn center(&self) -> Option<[f64; D]> {
        None
    }

    /// The gradient of the logarithm at `x`, where it takes less than differences of values.
    fn log_slope(&self, x: &[f64; D]) -> Option<[f64; D]> {
        let _ = x;
        None
    }

    /// A number for the piece of a piecewise smooth field that `x` lies in: the same at two points that no discontinuity
    /// known to the field separates (pieces need not be connected). 0 everywhere by default; fields that know their
    /// discontinuities keep 0 for where they vanish.
    fn piece(&self, x: &[f64; D]) -> u64 {
        let _ = x;
        0
    }

    /// [`Self::value`] and [`Self::piece`] at once, for fields that get both from one evaluation.
    fn value_and_piece(&self, x: &[f64; D]) -> (f64, u64) {
        (self.value(x), self.piece(x))
    }

    /// Whether [`Self::piece`] can differ between points at which the field does not vanish.
    fn is_piecewise(&self) -> bool {
        false
    }

    /// Whether two pieces next to each other stay apart however little the density changes between them.
    fn keeps_apart(&self, a: u64, b: u64) -> bool {
        let _ = (a, b);
        false
    }

    /// What an integral needs to know of `x`: the piece by default, and kinks and levels where the field has them.
    fn trace(&self, x: &[f64; D]) -> Trace {
        Trace::of_piece(self.piece(x))
    }

    /// Whether the part that [`Self::trace`] tells can differ between points.
    fn has_parts(&self) -> bool {
        self.is_piecewise()
    }

    /// Bounds of the value over all of a patch, where the field knows them; they need not be narrow. By these an integral finds
    /// what lies between the points at which it looks.
    fn enclosure(&self, patch: &Patch<D>) -> Option<Enclosure> {
        let _ = patch;
        None
    }

    /// The integral over `domain`, where the interpolant has a better one than sampling gives.
    fn integral(&self, domain: &Domain<D>) -> Option<MassEstimate> {
        let _ = domain;
        None
    }

    /// The integral over a box of what lies in the pieces that `has` is true of, to rounding, where that takes no more than a few evaluations.
    fn integral_of_box(&self, lo: &[f64; D], hi: &[f64; D], has: &dyn Fn(u64) -> bool) -> Option<f64> {
        let _ = (lo, hi, has);
        None
    }

    /// The integral over each piece within `domain`, by the piece's number, where it is known without sampling.
    fn piece_integrals(&self, domain: &Domain<D>) -> Option<Vec<(u64, MassEstimate)>> {
        let _ = domain;
        None
    }
}
