//! A box of the unit cube to which an integrand is restricted.

use super::integrand::Integrand;
use crate::field::Trace;
use crate::field::cubature::Seen;
use std::cell::Cell as Counter;

/// Distance from the faces at which parts are told apart, as a share of the box: what ends right at a face does so
/// outside.
const INSET: f64 = 1e-11;

/// A box, which counts how often the integrand is evaluated in it.
pub(super) struct Window<'a, const D: usize> {
    integrand: &'a dyn Integrand<D>,
    pub lo: [f64; D],
    pub hi: [f64; D],
    evaluations: Counter<usize>,
    seen: Seen,
}

impl<'a, const D: usize> Window<'a, D> {
    pub fn new(integrand: &'a dyn Integrand<D>, lo: [f64; D], hi: [f64; D]) -> Self {
        Self { integrand, lo, hi, evaluations: Counter::new(0), seen: Seen::default() }
    }

    pub fn value(&self, u: &[f64; D]) -> f64 {
        self.evaluations.set(self.evaluations.get() + 1);
        self.seen.noted(self.integrand.value(u))
    }

    /// A value that is no part of a rule.
    pub fn value_beside(&self, u: &[f64; D]) -> f64 {
        self.evaluations.set(self.evaluations.get() + 1);
        self.integrand.value(u)
    }

    pub fn trace(&self, u: &[f64; D]) -> Trace {
        self.evaluations.set(self.evaluations.get() + 1);
        self.integrand.trace(u)
    }

    pub fn evaluations(&self) -> usize {
        self.evaluations.get()
    }

    /// The least and the largest value met.
    pub fn seen(&self) -> [f64; 2] {
        self.seen.range()
    }

    pub fn volume(&self) -> f64 {
        (0..D).map(|k| self.hi[k] - self.lo[k]).product()
    }

    /// The place at shares of the way from face to face, -1 to 1, just within the faces.
    pub fn place(&self, shares: [f64; D]) -> [f64; D] {
        sph::array(|k| {
            let (middle, half) = (0.5 * (self.lo[k] + self.hi[k]), 0.5 * (self.hi[k] - self.lo[k]));
            middle + shares[k] * half * (1.0 - INSET)
        })
    }

    /// Places just within both faces across `axis`.
    pub fn inner_faces(&self, axis: usize) -> [f64; 2] {
        [-1.0, 1.0].map(|share| self.place([share; D])[axis])
    }
}
