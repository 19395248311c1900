//! Conversion of numbers between columns and files.

/// A number on its way into a file; integers keep all their digits.
#[derive(Clone, Copy)]
pub(crate) enum Number {
    Float(f64),
    Int(i64),
}

impl Number {
    pub(crate) fn float(self) -> f64 {
        match self {
            Self::Float(x) => x,
            Self::Int(i) => i as f64,
        }
    }

    pub(crate) fn whole(self) -> Option<i64> {
        match self {
            Self::Int(i) => Some(i),
            // 2^53: beyond it a float does not say which integer is meant.
            Self::Float(x) if x.fract() == 0.0 && x.abs() <= 9_007_199_254_740_992.0 => Some(x as i64),
            Self::Float(_) => None,
        }
    }
}

pub(crate) fn id(x: Number) -> Option<u64> {
    u64::try_from(x.whole()?).ok()
}

#[cfg(any(feature = "hdf5-layer", feature = "phantom"))]
pub(crate) fn int(x: Number) -> Option<i32> {
    i32::try_from(x.whole()?).ok()
}

/// `None` where it is beyond f32; if `strict` also of what is no number and of what has fewer digits than it should: less than `least`.
pub(crate) fn single((strict, least): (bool, f32), x: f64) -> Option<f32> {
    let y = x as f32;
    let lost = (x.is_finite() && !y.is_finite()) || (strict && (!x.is_finite() || (x != 0.0 && y.abs() < least)));
    (!lost).then_some(y)
}

/// x^(1/d), which is a root of its own in 1 to 3 dimensions.
pub(crate) fn root(x: f64, d: usize) -> f64 {
    match d {
        1 => x,
        2 => x.sqrt(),
        _ => x.cbrt(),
    }
}
