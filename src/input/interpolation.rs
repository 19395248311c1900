//! How a scene says that grids are interpolated.

use crate::field::Interpolation;
use crate::scene::InterpolationName;

/// What a name stands for.
pub(crate) fn interpolation(name: InterpolationName) -> Interpolation {
    match name {
        InterpolationName::PiecewiseLinear => Interpolation::PiecewiseLinear,
        InterpolationName::Linear => Interpolation::Linear,
        InterpolationName::Cubic => Interpolation::Cubic,
        InterpolationName::Nearest => Interpolation::Constant,
    }
}
