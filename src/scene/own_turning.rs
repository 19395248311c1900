//! How a body by itself will turn among others.

use super::Quantity;

/// The spin of a body in the orientation that it has among others.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OwnTurning {
    pub spin: Vec<Quantity>,
    /// In degrees about the axes x, y and z, as its body has them.
    pub orientation: Vec<f64>,
}
