//! Carried variables: those that particles receive from the input in addition to its density.

use sph_formats::Unit;

/// What a carried variable is.
#[derive(Debug, Clone, PartialEq)]
pub struct CarriedInfo {
    /// As in the file.
    pub name: String,
    pub unit: Option<Unit>,
    /// 1 for a scalar, D for a vector.
    pub components: usize,
}

/// A variable carried along with the density.
pub trait CarriedField<const D: usize>: Send + Sync {
    /// Name, unit and number of components.
    fn info(&self) -> &CarriedInfo;
    /// Writes the `components` values at `x`, in the variable's own unit; `x` is clamped to the nearest point of the
    /// field's support.
    fn evaluate(&self, x: &[f64; D], out: &mut [f64]);
}
