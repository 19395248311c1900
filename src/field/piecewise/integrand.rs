//! The interface of an integrand.

use crate::field::{Enclosure, Trace};

/// A piecewise smooth function on the unit cube.
pub(crate) trait Integrand<const D: usize>: Sync {
    fn value(&self, u: &[f64; D]) -> f64;
    fn trace(&self, u: &[f64; D]) -> Trace;
    /// Bounds between two corners, where they are known.
    fn enclosure(&self, lo: &[f64; D], hi: &[f64; D]) -> Option<Enclosure> {
        let _ = (lo, hi);
        None
    }
}
