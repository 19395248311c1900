//! The integral of a function of one variable, and its inverse: where a given fraction of the mass lies.

use crate::field::quadrature::integrate;

/// Points of the rule on a segment.
const ORDER: usize = 8;
/// Segments before refinement, so that narrow features are met.
const FIRST_SEGMENTS: usize = 256;
const MOST_SEGMENTS: usize = 1 << 16;
/// Refinement ends where halving a segment changes its integral by less than this fraction of the whole.
const TOLERANCE: f64 = 1e-14;
/// Halvings of a segment; a discontinuity is located to 2^-40 of a first segment.
const MOST_HALVINGS: u32 = 40;
const MOST_NEWTON_STEPS: usize = 60;

/// The running integral of `f >= 0` over an interval.
pub(super) struct Cumulative<'a> {
    f: Box<dyn Fn(f64) -> f64 + Sync + 'a>,
    /// Edges of the segments, and the integral up to each.
    edges: Vec<f64>,
    sums: Vec<f64>,
}

impl<'a> Cumulative<'a> {
    /// Integrates `f` from `lo` to `hi`.
    pub fn new(f: impl Fn(f64) -> f64 + Sync + 'a, lo: f64, hi: f64) -> Self {
        Self::over(Box::new(f), lo, hi)
    }

    fn over(f: Box<dyn Fn(f64) -> f64 + Sync + 'a>, lo: f64, hi: f64) -> Self {
        let edge = |i: usize| if i == FIRST_SEGMENTS { hi } else { lo + (hi - lo) * i as f64 / FIRST_SEGMENTS as f64 };
        let rough: f64 = (0..FIRST_SEGMENTS).map(|i| integrate(ORDER, edge(i), edge(i + 1), &f)).sum();
        let mut this = Self { f, edges: vec![lo], sums: vec![0.0] };
        for i in 0..FIRST_SEGMENTS {
            let whole = integrate(ORDER, edge(i), edge(i + 1), &*this.f);
            this.append(edge(i), edge(i + 1), whole, TOLERANCE * rough, MOST_HALVINGS);
        }
        this
    }

    fn append(&mut self, a: f64, b: f64, whole: f64, tolerance: f64, halvings: u32) {
        let middle = 0.5 * (a + b);
        let (left, right) = (integrate(ORDER, a, middle, &*self.f), integrate(ORDER, middle, b, &*self.f));
        if (left + right - whole).abs() <= tolerance || halvings == 0 || self.edges.len() >= MOST_SEGMENTS {
            let before = self.total();
            self.edges.push(b);
            self.sums.push(before + left + right);
            return;
        }
        self.append(a, middle, left, tolerance, halvings - 1);
        self.append(middle, b, right, tolerance, halvings - 1);
    }

    /// The integral over the whole interval.
    pub fn total(&self) -> f64 {
        self.sums[self.sums.len() - 1]
    }

    /// The integral from the lower end to `x`.
    pub fn at(&self, x: f64) -> f64 {
        let i = self.edges.partition_point(|&e| e <= x).clamp(1, self.edges.len() - 1) - 1;
        self.sums[i] + integrate(ORDER, self.edges[i], x.min(self.edges[i + 1]), &*self.f)
    }

    /// Where the integral is `fraction` of the whole: Newton's method, bracketed.
    pub fn inverse(&self, fraction: f64) -> f64 {
        let below = fraction.clamp(0.0, 1.0) * self.total();
        let i = self.sums.partition_point(|&s| s <= below).clamp(1, self.edges.len() - 1) - 1;
        let (start, end) = (self.edges[i], self.edges[i + 1]);
        let (mut a, mut b) = (start, end);
        let share = (below - self.sums[i]) / (self.sums[i + 1] - self.sums[i]);
        let mut x = if share.is_finite() { a + share.clamp(0.0, 1.0) * (b - a) } else { a };
        for _ in 0..MOST_NEWTON_STEPS {
            let miss = below - self.sums[i] - integrate(ORDER, start, x, &*self.f);
            if miss > 0.0 {
                a = x
            } else {
                b = x
            }
            let newton = x + miss / (self.f)(x);
            let next = if newton > a && newton < b { newton } else { 0.5 * (a + b) };
            let step = (next - x).abs();
            x = next;
            if step <= 4.0 * f64::EPSILON * (end - start) || b - a <= f64::EPSILON * x.abs() {
                break;
            }
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exponential_is_inverted() {
        let c = Cumulative::new(|x: f64| (-5.0 * x).exp(), 0.0, 1.0);
        for i in 0..=100 {
            let m = f64::from(i) / 100.0;
            let exact = -(1.0 - m * (1.0 - (-5.0_f64).exp())).ln() / 5.0;
            assert!((c.inverse(m) - exact).abs() < 1e-12, "{m}: {} instead of {exact}", c.inverse(m));
        }
    }

    #[test]
    fn discontinuities_and_gaps_are_crossed() {
        let c = Cumulative::new(
            |x: f64| {
                if x < 0.3 {
                    1.0
                } else if x < 0.7 {
                    0.0
                } else {
                    3.0
                }
            },
            0.0,
            1.0,
        );
        assert!((c.total() - 1.2).abs() < 1e-10);
        assert!((c.inverse(0.125) - 0.15).abs() < 1e-10);
        assert!((c.inverse(0.625) - 0.85).abs() < 1e-10);
        let edge = c.inverse(0.25 + 1e-6);
        assert!((0.7..0.701).contains(&edge) || edge < 0.3 + 1e-9, "{edge}");
    }
}
