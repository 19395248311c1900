//! Real roots of polynomials of low degree.

use crate::roots::bisect;

/// The real roots of sum c_i t^i in ascending order: where it changes its sign between the roots of its derivative, by
/// bisection. Double roots, at which it does not change, may be missing.
pub(crate) fn roots(coefficients: &[f64]) -> Vec<f64> {
    let mut c = coefficients;
    let scale = c.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    while let [rest @ .., last] = c {
        if last.abs() > NOTHING * scale {
            break;
        }
        c = rest;
    }
    match c {
        [] | [_] => Vec::new(),
        [a, b] => vec![-a / b],
        [a, b, c] => {
            let square = b * b - 4.0 * a * c;
            if !(square > 0.0) {
                return Vec::new();
            }
            // Without the difference of two numbers that are nearly equal.
            let q = -0.5 * (b + b.signum() * square.sqrt());
            let mut both = if q == 0.0 { vec![0.0, -b / c] } else { vec![q / c, a / q] };
            both.sort_by(f64::total_cmp);
            both
        }
        _ => between(c),
    }
}

/// A leading coefficient this small beside the largest is none.
const NOTHING: f64 = 1e-14;

fn between(c: &[f64]) -> Vec<f64> {
    let value = |t: f64| c.iter().rev().fold(0.0, |v, a| v * t + a);
    let derivative: Vec<f64> = c.iter().enumerate().skip(1).map(|(i, a)| i as f64 * a).collect();
    let lead = c.last().copied().unwrap_or(1.0);
    // Cauchy's bound.
    let bound = 1.0 + c.iter().fold(0.0_f64, |m, a| m.max((a / lead).abs()));
    let mut ends = vec![-bound];
    ends.extend(roots(&derivative).into_iter().filter(|t| t.abs() < bound));
    ends.push(bound);
    let mut found = Vec::new();
    for pair in ends.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let rises = value(b) > 0.0;
        if (value(a) > 0.0) == rises {
            continue;
        }
        let [a, b] = bisect(|x| (value(x) > 0.0) != rises, [a, b], 100);
        found.push(0.5 * (a + b));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_of_factors_have_their_roots() {
        let times = |p: &[f64], root: f64| -> Vec<f64> {
            let at = |i: usize| p.get(i).copied().unwrap_or(0.0);
            (0..=p.len()).map(|i| if i == 0 { 0.0 } else { at(i - 1) } - root * at(i)).collect()
        };
        for expected in [vec![-2.0, -0.5, 0.25, 3.0], vec![1.0, 1.5, 7.0], vec![-4.0, 4.0], vec![0.5]] {
            let p = expected.iter().fold(vec![3.0], |p, r| times(&p, *r));
            let found = roots(&p);
            assert_eq!(found.len(), expected.len(), "{expected:?} {found:?}");
            assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-9), "{expected:?} {found:?}");
        }
        assert!(roots(&[1.0, 0.0, 1.0]).is_empty() && roots(&[2.0]).is_empty() && roots(&[1.0, 0.0, 0.0]).is_empty());
    }
}
