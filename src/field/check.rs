//! Checks that the numbers of a file are a valid density. Errors name the first invalid number.

use super::Missing;
use super::quadrature::binade;
use crate::error::{Error, Result};
use sph_formats::Values;

/// Checks that `values` can be a density and replaces missing entries where asked. `place` names the position
/// of a value. Returns the largest value and how many were missing.
///
/// # Errors
/// No values, values that are not finite (unless [`Missing::Zero`] makes missing ones 0), negative values, or
/// zero everywhere.
pub(crate) fn check_density(
    name: &str,
    values: &mut Values,
    missing: Missing,
    place: &dyn Fn(usize) -> String,
) -> Result<(f64, usize)> {
    if values.is_empty() {
        return Err(Error::field(name, "has no values; a density needs at least one"));
    }
    let replaced = match missing {
        Missing::Zero => replace_missing(values),
        Missing::Error => 0,
    };
    let (lowest, peak, bad) = values.range();
    if lowest >= 0.0 && peak > 0.0 && bad == 0 {
        return Ok((peak, replaced));
    }
    let mut unusable = Offenders::default();
    let mut negative = Offenders::default();
    for i in 0..values.len() {
        let v = values.get(i);
        if !v.is_finite() {
            unusable.add(i, v);
        } else if v < 0.0 {
            negative.add(i, v);
        }
    }
    let total = values.len();
    if let Some((i, v)) = unusable.first {
        let remedy =
            if v.is_nan() { "set `missing: zero` in the scene if nothing is there" } else { "correct the file" };
        return Err(Error::field(
            name,
            format!(
                "{} of {total} values are missing or not finite, the first is {v} at {}; {remedy}",
                unusable.count,
                place(i)
            ),
        ));
    }
    if let Some((i, v)) = negative.first {
        return Err(Error::field(
            name,
            format!(
                "{} of {total} values are negative, the first is {v:e} at {}; a density must not be: choose another \
                 variable as the density or correct the file",
                negative.count,
                place(i)
            ),
        ));
    }
    Err(Error::field(
        name,
        format!("all {total} values are zero; there is no mass to place: choose another variable as the density"),
    ))
}

/// Sets NaN to 0 in place; returns how many there were.
pub(crate) fn replace_missing(values: &mut Values) -> usize {
    let mut count = 0;
    match values {
        Values::F32(v) => v.iter_mut().filter(|x| x.is_nan()).for_each(|x| {
            *x = 0.0;
            count += 1;
        }),
        Values::F64(v) => v.iter_mut().filter(|x| x.is_nan()).for_each(|x| {
            *x = 0.0;
            count += 1;
        }),
        Values::I64(_) => {}
    }
    count
}

/// Largest magnitude of finite values as a power of two, for sums that must not overflow.
pub(crate) fn magnitude(values: &Values) -> f64 {
    let (lo, hi, _) = values.range();
    binade(lo.abs().max(hi.abs()))
}

/// `(x, y, z)` with few digits, for messages.
pub(crate) fn point_text(x: &[f64]) -> String {
    let parts: Vec<String> = x.iter().map(|v| format!("{v}")).collect();
    format!("({})", parts.join(", "))
}

#[derive(Default)]
struct Offenders {
    count: usize,
    first: Option<(usize, f64)>,
}

impl Offenders {
    fn add(&mut self, i: usize, v: f64) {
        self.count += 1;
        self.first.get_or_insert((i, v));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(values: Vec<f64>, missing: Missing) -> Result<(f64, usize)> {
        check_density("rho", &mut Values::F64(values), missing, &|i| format!("index {i}"))
    }

    #[test]
    fn refusals_name_variable_count_place_and_remedy() {
        let text = check(vec![1.0, f64::NAN, f64::NAN], Missing::Error).unwrap_err().to_string();
        assert!(text.contains("'rho'") && text.contains("2 of 3") && text.contains("index 1"), "{text}");
        assert!(text.contains("missing: zero"), "{text}");
        let text = check(vec![1.0, -2.0], Missing::Zero).unwrap_err().to_string();
        assert!(text.contains("negative") && text.contains("index 1") && text.contains("-2"), "{text}");
        let text = check(vec![0.0, 0.0], Missing::Error).unwrap_err().to_string();
        assert!(text.contains("all 2 values are zero"), "{text}");
        assert!(check(vec![], Missing::Error).is_err());
        assert!(check(vec![1.0, f64::INFINITY], Missing::Zero).is_err());
        assert!(check(vec![f64::NAN], Missing::Zero).is_err());
    }

    #[test]
    fn missing_values_become_zero_on_request() {
        assert_eq!(check(vec![3.0, f64::NAN], Missing::Zero).unwrap(), (3.0, 1));
    }
}
