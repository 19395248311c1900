//! A number density from a spacing.

use crate::field::{ScalarField, Trace};

/// n = spacing^-d.
pub(super) struct FromSpacing<const D: usize>(pub Box<dyn ScalarField<D>>);

impl<const D: usize> ScalarField<D> for FromSpacing<D> {
    fn value(&self, x: &[f64; D]) -> f64 {
        let spacing = self.0.value(x);
        if spacing > 0.0 { spacing.powi(-(D as i32)) } else { 0.0 }
    }

    fn piece(&self, x: &[f64; D]) -> u64 {
        self.0.piece(x)
    }

    fn is_piecewise(&self) -> bool {
        self.0.is_piecewise()
    }

    fn trace(&self, x: &[f64; D]) -> Trace {
        self.0.trace(x)
    }

    fn has_parts(&self) -> bool {
        self.0.has_parts()
    }

    fn center(&self) -> Option<[f64; D]> {
        self.0.center()
    }
}
