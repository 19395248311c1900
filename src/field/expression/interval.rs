//! Interval arithmetic (Moore 1966, "Interval Analysis"): all values that a function may take where its operands are anywhere in
//! theirs. Bounds are rounded to nearest, not outward: they are compared with what is larger than a last digit.

use std::f64::consts::{PI, TAU};

/// All of the values, perhaps more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Interval {
    pub lo: f64,
    pub hi: f64,
    /// Whether the function is a number everywhere.
    pub is_defined: bool,
}

impl Interval {
    pub const ANYTHING: Self = Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY, is_defined: false };

    /// Between two bounds in either order; anything, where one is no number.
    pub fn between(a: f64, b: f64) -> Self {
        if a.is_nan() || b.is_nan() {
            return Self::ANYTHING;
        }
        Self { lo: a.min(b), hi: a.max(b), is_defined: true }
    }

    pub fn point(v: f64) -> Self {
        Self::between(v, v)
    }

    /// A function of two arguments where both are at ends of theirs.
    pub fn corners(self, other: Self, f: impl Fn(f64, f64) -> f64) -> [f64; 4] {
        [f(self.lo, other.lo), f(self.lo, other.hi), f(self.hi, other.lo), f(self.hi, other.hi)]
    }

    /// Around all of some values.
    pub fn around(values: &[f64]) -> Self {
        let known = !values.iter().any(|v| v.is_nan());
        let fold = |f: fn(f64, f64) -> f64, start| values.iter().fold(start, |a, &b| f(a, b));
        if known {
            Self::between(fold(f64::min, f64::INFINITY), fold(f64::max, f64::NEG_INFINITY))
        } else {
            Self::ANYTHING
        }
    }

    /// As known as both operands are.
    fn from(self, operands: [Self; 2]) -> Self {
        Self { is_defined: self.is_defined && operands.iter().all(|o| o.is_defined), ..self }
    }

    pub fn is_single(&self) -> bool {
        self.lo == self.hi && self.is_defined
    }

    pub fn contains(&self, v: f64) -> bool {
        self.lo <= v && v <= self.hi
    }

    pub fn union(self, other: Self) -> Self {
        Self::between(self.lo.min(other.lo), self.hi.max(other.hi)).from([self, other])
    }

    /// What both hold.
    pub fn intersection(self, other: Self) -> Self {
        let (lo, hi) = (self.lo.max(other.lo), self.hi.min(other.hi));
        // Apart by rounding alone.
        if lo <= hi { Self { lo, hi, is_defined: self.is_defined } } else { self }
    }

    /// Of a function that rises throughout, or falls.
    pub fn monotone(self, f: impl Fn(f64) -> f64) -> Self {
        Self::between(f(self.lo), f(self.hi)).from([self, self])
    }

    /// Of a function that is the same on both sides of 0 and rises beyond.
    pub fn even(self, f: impl Fn(f64) -> f64) -> Self {
        let far = self.lo.abs().max(self.hi.abs());
        let near = if self.contains(0.0) { 0.0 } else { self.lo.abs().min(self.hi.abs()) };
        Self::between(f(near), f(far)).from([self, self])
    }

    pub fn plus(self, other: Self) -> Self {
        Self::between(self.lo + other.lo, self.hi + other.hi).from([self, other])
    }

    pub fn negated(self) -> Self {
        Self { lo: -self.hi, hi: -self.lo, ..self }
    }

    pub fn times(self, other: Self) -> Self {
        // 0 times what has no bound is 0 wherever the other is a number.
        let product = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
        Self::around(&self.corners(other, product)).from([self, other])
    }

    pub fn over(self, other: Self) -> Self {
        self.times(other.inverse()).from([self, other])
    }

    fn inverse(self) -> Self {
        match self {
            Self { lo, .. } if lo >= 0.0 => {
                Self::between(1.0 / self.hi, if lo == 0.0 { f64::INFINITY } else { 1.0 / lo })
            }
            Self { hi, .. } if hi <= 0.0 => self.negated().inverse().negated(),
            _ => Self::ANYTHING,
        }
    }

    /// Multiplied with itself.
    pub fn whole_power(self, k: i32) -> Self {
        if k < 0 {
            return self.whole_power(-k).inverse().from([self, self]);
        }
        if k % 2 == 0 { self.even(|v| v.powi(k)) } else { self.monotone(|v| v.powi(k)) }
    }

    /// The logarithm of a power is bilinear in that of the base and the exponent: its extremes are in the corners.
    pub fn power(self, exponent: Self) -> Self {
        if self.lo < 0.0 {
            return Self::ANYTHING;
        }
        Self::around(&self.corners(exponent, f64::powf)).from([self, exponent])
    }

    /// Of a function that falls and rises between extremes of 1 and -1, of which the crests are at `crest` + 2 pi n.
    pub fn wave(self, f: fn(f64) -> f64, crest: f64) -> Self {
        if !(self.lo.abs() < LARGEST_ANGLE && self.hi.abs() < LARGEST_ANGLE) {
            return Self {
                lo: -1.0,
                hi: 1.0,
                is_defined: self.is_defined && self.lo.is_finite() && self.hi.is_finite(),
            };
        }
        let holds = |place: f64| ((self.hi - place) / TAU).floor() >= ((self.lo - place) / TAU).ceil();
        let (a, b) = (f(self.lo), f(self.hi));
        let hi = if holds(crest) { 1.0 } else { a.max(b) };
        let lo = if holds(crest + PI) { -1.0 } else { a.min(b) };
        Self { lo, hi, is_defined: self.is_defined }
    }
}

/// Angles beyond have lost the digits that say where in a turn they are.
const LARGEST_ANGLE: f64 = 1e9;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_without_end_and_what_is_no_number() {
        let zero_up = Interval::between(0.0, f64::INFINITY);
        assert_eq!(zero_up.times(Interval::between(0.0, 2.0)), zero_up);
        assert_eq!(Interval::point(1.0).over(Interval::between(0.0, 2.0)), Interval::between(0.5, f64::INFINITY));
        assert_eq!(Interval::point(1.0).over(Interval::between(-1.0, 2.0)), Interval::ANYTHING);
        assert_eq!(Interval::between(f64::NAN, 1.0), Interval::ANYTHING);
        assert_eq!(Interval::between(-1.0, 4.0).monotone(f64::sqrt), Interval::ANYTHING);
        assert_eq!(Interval::between(-2.0, 1.0).whole_power(2), Interval::between(0.0, 4.0));
        assert_eq!(Interval::between(0.5, 2.0).power(Interval::between(-1.0, 1.0)), Interval::between(0.5, 2.0));
    }
}
