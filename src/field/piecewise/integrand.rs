//! What is integrated.

use crate::field::Trace;

/// A piecewise smooth function on the unit cube.
pub(crate) trait Integrand<const D: usize>: Sync {
    fn value(&self, u: &[f64; D]) -> f64;
    fn trace(&self, u: &[f64; D]) -> Trace;
}
