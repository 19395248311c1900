//! Reductions whose result does not depend on the number of threads: fixed chunks, combined in order.

use rayon::prelude::*;

const CHUNK: usize = 4096;

/// Sum of `f(i)` for `i` in `0..n`, compensated (Neumaier) within and across chunks.
pub fn sum(n: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
    let partial: Vec<Compensated> = (0..n.div_ceil(CHUNK))
        .into_par_iter()
        .map(|c| {
            let mut total = Compensated::default();
            (c * CHUNK..((c + 1) * CHUNK).min(n)).for_each(|i| total.add(f(i)));
            total
        })
        .collect();
    let mut total = Compensated::default();
    for part in partial {
        total.add(part.sum);
        total.add(part.correction);
    }
    total.value()
}

/// Largest of `f(i)`, or negative infinity for `n` = 0. NaN is passed over.
pub fn max(n: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
    (0..n).into_par_iter().map(&f).reduce(|| f64::NEG_INFINITY, f64::max)
}

/// Running sum that carries its rounding error along.
#[derive(Debug, Clone, Copy, Default)]
pub struct Compensated {
    sum: f64,
    correction: f64,
}

impl Compensated {
    pub fn add(&mut self, x: f64) {
        let total = self.sum + x;
        self.correction += if self.sum.abs() >= x.abs() { (self.sum - total) + x } else { (x - total) + self.sum };
        self.sum = total;
    }

    pub fn value(self) -> f64 {
        self.sum + self.correction
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_keep_small_terms_beside_large_ones() {
        let terms = [1e16, 1.0, -1e16, 1.0];
        assert_eq!(sum(terms.len(), |i| terms[i]), 2.0);
        assert_eq!(sum(1_000_000, |_| 0.1), 100_000.0);
    }
}
