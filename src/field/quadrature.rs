//! Gauss-Legendre rules and compensated sums.

use std::sync::LazyLock;

/// Highest order kept ready.
const MAX_ORDER: usize = 16;

static RULES: LazyLock<Vec<Vec<(f64, f64)>>> = LazyLock::new(|| (0..=MAX_ORDER).map(gauss_legendre).collect());

/// Nodes in (0, 1) and weights (sum 1) of the Gauss-Legendre rule of `order` points, exact for polynomials of
/// degree `2 order - 1`.
pub(crate) fn rule(order: usize) -> &'static [(f64, f64)] {
    &RULES[order.clamp(1, MAX_ORDER)]
}

/// Roots of the Legendre polynomial by Newton's method from the Chebyshev-like guess.
fn gauss_legendre(order: usize) -> Vec<(f64, f64)> {
    let n = order as f64;
    let mut rule: Vec<(f64, f64)> = (0..order)
        .map(|i| {
            let mut z = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (mut p, mut previous) = (1.0, 0.0);
                for j in 0..order {
                    let j = j as f64;
                    (p, previous) = (((2.0 * j + 1.0) * z * p - j * previous) / (j + 1.0), p);
                }
                slope = n * (z * p - previous) / (z * z - 1.0);
                let step = p / slope;
                z -= step;
                if step.abs() < 1e-16 {
                    break;
                }
            }
            (0.5 * (1.0 - z), 1.0 / ((1.0 - z * z) * slope * slope))
        })
        .collect();
    // Symmetric to the last bit, and the sum of the weights as near 1 as rounding allows.
    for i in 0..order / 2 {
        let weight = 0.5 * (rule[i].1 + rule[order - 1 - i].1);
        rule[i].1 = weight;
        rule[order - 1 - i] = (1.0 - rule[i].0, weight);
    }
    let sum: f64 = rule.iter().map(|p| p.1).sum();
    rule.iter_mut().for_each(|p| p.1 /= sum);
    rule
}

/// Integral of `f` over `[a, b]` by the rule of `order` points.
pub(crate) fn integrate(order: usize, a: f64, b: f64, f: &dyn Fn(f64) -> f64) -> f64 {
    let sum: f64 = rule(order).iter().map(|&(t, w)| w * f(a + t * (b - a))).sum();
    sum * (b - a)
}

/// Neumaier's sum: the rounding of n terms stays that of a few.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sum {
    total: f64,
    carry: f64,
}

impl Sum {
    pub(crate) fn add(&mut self, x: f64) {
        let t = self.total + x;
        self.carry += if self.total.abs() >= x.abs() { (self.total - t) + x } else { (x - t) + self.total };
        self.total = t;
    }

    pub(crate) fn value(self) -> f64 {
        self.total + self.carry
    }
}

impl FromIterator<f64> for Sum {
    fn from_iter<I: IntoIterator<Item = f64>>(terms: I) -> Self {
        let mut sum = Self::default();
        terms.into_iter().for_each(|x| sum.add(x));
        sum
    }
}

/// The power of two at or below `|x|`: dividing by it is exact and brings the largest value to [1, 2).
pub(crate) fn binade(x: f64) -> f64 {
    let x = x.abs();
    if x >= f64::MIN_POSITIVE && x.is_finite() {
        f64::from_bits(x.to_bits() & 0x7ff0_0000_0000_0000)
    } else {
        f64::MIN_POSITIVE
    }
}

/// Digits of `i` in a base, mirrored at the point: coordinates of Halton's points (1960), from 1 on.
pub(crate) fn radical_inverse(mut i: usize, base: usize) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0 / base as f64);
    while i > 0 {
        value += digit * (i % base) as f64;
        i /= base;
        digit /= base as f64;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_integrate_polynomials_of_their_degree() {
        for order in 1..=MAX_ORDER {
            for degree in 0..2 * order {
                let value = integrate(order, 0.0, 1.0, &|x| x.powi(degree as i32));
                assert!((value * (degree as f64 + 1.0) - 1.0).abs() < 1e-13, "{order} {degree}: {value}");
            }
        }
    }

    #[test]
    fn compensated_sums_keep_small_terms() {
        let sum: Sum = [1.0, 1e100, 1.0, -1e100].into_iter().collect();
        assert_eq!(sum.value(), 2.0);
    }

    #[test]
    fn binades_are_powers_of_two() {
        assert_eq!(binade(5.0), 4.0);
        assert_eq!(binade(-1.0), 1.0);
        assert_eq!(binade(0.0), f64::MIN_POSITIVE);
        let x = 1.2345e300;
        assert_eq!(x / binade(x) * binade(x), x);
    }
}
