//! A density and carried variables that other fields share by reference.

use super::{CarriedField, CarriedInfo, Enclosure, MassEstimate, Patch, ScalarField, Trace};
use sph::domain::Domain;
use std::sync::Arc;

/// A density with other owners.
pub(crate) struct SharedDensity<const D: usize>(pub Arc<dyn ScalarField<D>>);

impl<const D: usize> ScalarField<D> for SharedDensity<D> {
    fn value(&self, x: &[f64; D]) -> f64 {
        self.0.value(x)
    }

    fn center(&self) -> Option<[f64; D]> {
        self.0.center()
    }

    fn log_slope(&self, x: &[f64; D]) -> Option<[f64; D]> {
        self.0.log_slope(x)
    }

    fn piece(&self, x: &[f64; D]) -> u64 {
        self.0.piece(x)
    }

    fn value_and_piece(&self, x: &[f64; D]) -> (f64, u64) {
        self.0.value_and_piece(x)
    }

    fn is_piecewise(&self) -> bool {
        self.0.is_piecewise()
    }

    fn keeps_apart(&self, a: u64, b: u64) -> bool {
        self.0.keeps_apart(a, b)
    }

    fn trace(&self, x: &[f64; D]) -> Trace {
        self.0.trace(x)
    }

    fn has_parts(&self) -> bool {
        self.0.has_parts()
    }

    fn enclosure(&self, patch: &Patch<D>) -> Option<Enclosure> {
        self.0.enclosure(patch)
    }

    fn integral(&self, domain: &Domain<D>) -> Option<MassEstimate> {
        self.0.integral(domain)
    }

    fn integral_of_box(&self, lo: &[f64; D], hi: &[f64; D], has: &dyn Fn(u64) -> bool) -> Option<f64> {
        self.0.integral_of_box(lo, hi, has)
    }

    fn piece_integrals(&self, domain: &Domain<D>) -> Option<Vec<(u64, MassEstimate)>> {
        self.0.piece_integrals(domain)
    }
}

/// A carried variable with other owners.
pub(crate) struct SharedCarried<const D: usize>(pub Arc<dyn CarriedField<D>>);

impl<const D: usize> CarriedField<D> for SharedCarried<D> {
    fn info(&self) -> &CarriedInfo {
        self.0.info()
    }

    fn evaluate(&self, x: &[f64; D], out: &mut [f64]) {
        self.0.evaluate(x, out);
    }
}
