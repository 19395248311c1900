//! Fields that are weighted sums of a file's numbers: grids, meshes and clouds share this shell.

use super::{CarriedField, CarriedInfo, MassEstimate, ScalarField};
use sph::domain::Domain;
use sph_formats::Values;
use std::sync::Arc;

/// What a sampler does with a point beyond its support.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outside {
    /// Report it.
    Reject,
    /// Use the nearest point of the support.
    Clamp,
}

/// Finds the values around a point and combines them.
pub(crate) trait Sampler<const D: usize>: Send + Sync {
    /// Writes the first `out.len()` of `stride` interleaved components at `x`. False, and nothing written,
    /// where `x` is outside and `outside` says so.
    fn sample(&self, values: &Values, stride: usize, x: &[f64; D], outside: Outside, out: &mut [f64]) -> bool;

    /// What samples variables that are carried along with a density, where that is not what samples the density.
    fn of_carried(&self) -> Option<Arc<dyn Sampler<D>>> {
        None
    }

    /// Closed-form or cell-wise integral of a scalar over `domain`, if this sampler has one.
    fn integral(&self, values: &Values, domain: &Domain<D>) -> Option<MassEstimate> {
        let _ = (values, domain);
        None
    }

    /// The same over a box of few values, of those whose places `is_own` is true of.
    fn integral_of_box(&self, values: &Values, of: [&[f64; D]; 2], is_own: &dyn Fn(usize) -> bool) -> Option<f64> {
        let _ = (values, of, is_own);
        None
    }
}

/// A scalar that is never negative.
pub(crate) struct SampledDensity<S> {
    pub(crate) sampler: Arc<S>,
    pub(crate) values: Values,
}

impl<const D: usize, S: Sampler<D>> ScalarField<D> for SampledDensity<S> {
    fn value(&self, x: &[f64; D]) -> f64 {
        let mut out = [0.0];
        if self.sampler.sample(&self.values, 1, x, Outside::Reject, &mut out) { out[0].max(0.0) } else { 0.0 }
    }

    fn integral(&self, domain: &Domain<D>) -> Option<MassEstimate> {
        self.sampler.integral(&self.values, domain)
    }

    fn integral_of_box(&self, lo: &[f64; D], hi: &[f64; D], _: &dyn Fn(u64) -> bool) -> Option<f64> {
        self.sampler.integral_of_box(&self.values, [lo, hi], &|_| true)
    }
}

/// A carried scalar or vector.
pub(crate) struct SampledCarried<const D: usize> {
    pub(crate) sampler: Arc<dyn Sampler<D>>,
    pub(crate) values: Values,
    /// Components in `values`; the first `info.components` of them are used.
    pub(crate) stride: usize,
    pub(crate) info: CarriedInfo,
}

impl<const D: usize> CarriedField<D> for SampledCarried<D> {
    fn info(&self) -> &CarriedInfo {
        &self.info
    }

    fn evaluate(&self, x: &[f64; D], out: &mut [f64]) {
        let n = self.info.components.min(out.len());
        self.sampler.sample(&self.values, self.stride, x, Outside::Clamp, &mut out[..n]);
    }
}
