//! Piecewise monotone curves through nodes, with discontinuities.
//!
//! Slopes are those of Fritsch and Butland (1984, doi 10.1137/0905021, the weighted harmonic mean of Brodlie),
//! which keep the sufficient condition of Fritsch and Carlson (1980, doi 10.1137/0717021): a cubic Hermite
//! segment is monotone where both end slopes lie within [0, 3] secants. A curve that is positive and spans more
//! than [`LOG_SPAN`] is interpolated in its logarithm.

use super::intervals::Intervals;

/// Ratio of the largest to the smallest positive value above which the logarithm is interpolated.
pub(crate) const LOG_SPAN: f64 = 1e2;

/// Slopes at the `n + 1` nodes of `n` intervals (`widths` > 0) with the given secants.
pub(crate) fn monotone_slopes(widths: &[f64], secants: &[f64]) -> Vec<f64> {
    let n = widths.len();
    match n {
        0 => return vec![0.0],
        1 => return vec![secants[0]; 2],
        _ => {}
    }
    let mut slopes = Vec::with_capacity(n + 1);
    slopes.push(end_slope(widths[0], widths[1], secants[0], secants[1]));
    for i in 1..n {
        slopes.push(inner_slope(widths[i - 1], widths[i], secants[i - 1], secants[i]));
    }
    slopes.push(end_slope(widths[n - 1], widths[n - 2], secants[n - 1], secants[n - 2]));
    slopes
}

fn inner_slope(h0: f64, h1: f64, s0: f64, s1: f64) -> f64 {
    if s0 == 0.0 || s1 == 0.0 || (s0 > 0.0) != (s1 > 0.0) {
        return 0.0;
    }
    let (w0, w1) = (2.0 * h1 + h0, h1 + 2.0 * h0);
    (w0 + w1) / (w0 / s0 + w1 / s1)
}

/// One-sided three-point slope, limited to keep the first interval monotone.
fn end_slope(h0: f64, h1: f64, s0: f64, s1: f64) -> f64 {
    let d = ((2.0 * h0 + h1) * s0 - h0 * s1) / (h0 + h1);
    if d == 0.0 || s0 == 0.0 || (d > 0.0) != (s0 > 0.0) {
        0.0
    } else if (s0 > 0.0) != (s1 > 0.0) && d.abs() > 3.0 * s0.abs() {
        3.0 * s0
    } else {
        d
    }
}

/// Interpolant of one interval, as a function of `t` in [0, 1].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shape {
    Constant(f64),
    /// Cubic Hermite; `m0`, `m1` are slopes times the interval's width.
    Cubic {
        y0: f64,
        y1: f64,
        m0: f64,
        m1: f64,
    },
    /// `y0 exp(cubic)`; the cubic runs from 0 to `ln(y1 / y0)`.
    Log {
        y0: f64,
        y1: f64,
        rise: f64,
        m0: f64,
        m1: f64,
    },
}

impl Shape {
    pub(crate) fn evaluate(&self, t: f64) -> f64 {
        match *self {
            Self::Constant(y) => y,
            Self::Cubic { y0, y1, m0, m1 } => {
                if t >= 1.0 {
                    return y1;
                }
                (y0 + hermite(y1 - y0, m0, m1, t)).clamp(y0.min(y1), y0.max(y1))
            }
            Self::Log { y0, y1, rise, m0, m1 } => {
                if t >= 1.0 {
                    return y1;
                }
                (y0 * hermite(rise, m0, m1, t).exp()).clamp(y0.min(y1), y0.max(y1))
            }
        }
    }
}

impl Shape {
    /// The same over [t, 1] as a shape of its own.
    pub(crate) fn rest(&self, t: f64) -> Self {
        let width = 1.0 - t;
        match *self {
            Self::Constant(y) => Self::Constant(y),
            Self::Cubic { y0, y1, m0, m1 } => {
                Self::Cubic { y0: self.evaluate(t), y1, m0: width * hermite_slope(y1 - y0, m0, m1, t), m1: width * m1 }
            }
            Self::Log { y1, rise, m0, m1, .. } => {
                let y0 = self.evaluate(t);
                Self::Log { y0, y1, rise: (y1 / y0).ln(), m0: width * hermite_slope(rise, m0, m1, t), m1: width * m1 }
            }
        }
    }
}

/// Hermite cubic from (0, 0) to (1, `rise`).
fn hermite(rise: f64, m0: f64, m1: f64, t: f64) -> f64 {
    let u = 1.0 - t;
    rise * t * t * (3.0 - 2.0 * t) + m0 * t * u * u - m1 * t * t * u
}

/// Its derivative.
fn hermite_slope(rise: f64, m0: f64, m1: f64, t: f64) -> f64 {
    let u = 1.0 - t;
    6.0 * rise * t * u + m0 * u * (1.0 - 3.0 * t) + m1 * t * (3.0 * t - 2.0)
}

/// A function of one variable, constant beyond its ends.
#[derive(Debug, Clone)]
pub(crate) struct Curve {
    /// Left ends of the segments, ascending.
    starts: Intervals,
    end: f64,
    shapes: Vec<Shape>,
}

impl Curve {
    /// Through `(x, y)` with `x` ascending; equal neighbors in `x` are a discontinuity, at which the curve takes
    /// the right-hand value. Needs one node at least.
    pub(crate) fn through(x: &[f64], y: &[f64]) -> Self {
        let mut starts = Vec::new();
        let mut shapes = Vec::new();
        let mut first = 0;
        for i in 1..=x.len() {
            if i == x.len() || x[i] == x[i - 1] {
                starts.extend_from_slice(&x[first..i - 1]);
                shapes.extend(piece(&x[first..i], &y[first..i]));
                first = i;
            }
        }
        if shapes.is_empty() {
            starts.push(x[0]);
            shapes.push(Shape::Constant(y[x.len() - 1]));
        }
        Self { starts: Intervals::new(starts), end: x[x.len() - 1], shapes }
    }

    pub(crate) fn segments(&self) -> impl Iterator<Item = (f64, f64, Shape)> + '_ {
        (0..self.shapes.len()).map(|i| (self.starts[i], self.end_of(i), self.shapes[i]))
    }

    fn end_of(&self, i: usize) -> f64 {
        self.starts.get(i + 1).copied().unwrap_or(self.end)
    }

    pub(crate) fn evaluate(&self, x: f64) -> f64 {
        let i = self.starts.find(x);
        let start = self.starts[i];
        let width = self.end_of(i) - start;
        let t = if width > 0.0 { ((x - start) / width).clamp(0.0, 1.0) } else { 0.0 };
        self.shapes[i].evaluate(t)
    }
}

/// Shapes between nodes without a discontinuity. Runs of positive values that span decades go by their logarithm;
/// what touches a value that is not positive is interpolated as it is.
fn piece(x: &[f64], y: &[f64]) -> Vec<Shape> {
    let widths: Vec<f64> = x.windows(2).map(|w| w[1] - w[0]).collect();
    let secants: Vec<f64> = (0..widths.len()).map(|i| (y[i + 1] - y[i]) / widths[i]).collect();
    let slopes = monotone_slopes(&widths, &secants);
    let mut shapes: Vec<Shape> = (0..widths.len())
        .map(|i| Shape::Cubic { y0: y[i], y1: y[i + 1], m0: slopes[i] * widths[i], m1: slopes[i + 1] * widths[i] })
        .collect();
    let mut first = 0;
    while first < y.len() {
        let length = y[first..].iter().take_while(|&&v| v > 0.0).count();
        if length >= 2 && spans_decades(&y[first..first + length]) {
            let run = first..first + length - 1;
            let rises: Vec<f64> = run.clone().map(|i| y[i + 1].ln() - y[i].ln()).collect();
            let secants: Vec<f64> = run.clone().zip(&rises).map(|(i, r)| r / widths[i]).collect();
            let slopes = monotone_slopes(&widths[run.clone()], &secants);
            for (k, i) in run.enumerate() {
                shapes[i] = Shape::Log {
                    y0: y[i],
                    y1: y[i + 1],
                    rise: rises[k],
                    m0: slopes[k] * widths[i],
                    m1: slopes[k + 1] * widths[i],
                };
            }
        }
        first += length + 1;
    }
    shapes
}

fn spans_decades(y: &[f64]) -> bool {
    let (lo, hi) = y.iter().fold((f64::INFINITY, 0.0_f64), |(lo, hi), &v| (lo.min(v), hi.max(v)));
    hi / LOG_SPAN > lo
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::*;

    #[test]
    fn discontinuities_keep_both_sides() {
        let curve = Curve::through(&[0.0, 1.0, 1.0, 2.0], &[5.0, 4.0, 10.0, 9.0]);
        assert_eq!(curve.evaluate(0.0), 5.0);
        assert_eq!(curve.evaluate(1.0), 10.0);
        assert!(curve.evaluate(1.0 - 1e-12) < 4.0 + 1e-9);
        assert_eq!(curve.evaluate(2.0), 9.0);
        assert_eq!(curve.evaluate(3.0), 9.0);
        assert_eq!(curve.evaluate(-1.0), 5.0);
    }

    #[test]
    fn a_parabola_is_followed_to_third_order() {
        let error = |n: usize| {
            let x: Vec<f64> = (0..=n).map(|i| 1.0 + i as f64 / n as f64).collect();
            let y: Vec<f64> = x.iter().map(|x| x.exp()).collect();
            let curve = Curve::through(&x, &y);
            (0..1000).map(|i| 1.0 + i as f64 / 1000.0).map(|x| (curve.evaluate(x) - x.exp()).abs()).fold(0.0, f64::max)
        };
        assert!(error(20) < 2e-4 && error(40) < error(20) / 3.5, "{} {}", error(20), error(40));
    }

    #[test]
    fn one_node_and_only_repeated_nodes_are_constants() {
        assert_eq!(Curve::through(&[2.0], &[3.0]).evaluate(7.0), 3.0);
        assert_eq!(Curve::through(&[2.0, 2.0], &[3.0, 4.0]).evaluate(2.0), 4.0);
    }

    #[test]
    fn curves_meet_their_nodes_and_stay_between_them() {
        let mut random = Random::new(3);
        for _ in 0..256 {
            let (mut x, mut y) = (vec![0.0], vec![1.0]);
            for _ in 0..random.whole(2, 30) {
                x.push(x[x.len() - 1] + random.between(1e-6, 1.0));
                y.push(if random.unit() < 0.5 { 0.0 } else { 10f64.powf(random.between(-8.0, 8.0)) });
            }
            let curve = Curve::through(&x, &y);
            for i in 0..x.len() {
                assert_eq!(curve.evaluate(x[i]), y[i], "{x:?}, {y:?}");
            }
            for i in 0..x.len() - 1 {
                let (a, b) = (y[i], y[i + 1]);
                let mut previous = a;
                for k in 1..=16 {
                    let v = curve.evaluate(x[i] + (x[i + 1] - x[i]) * f64::from(k) / 16.0);
                    let slack = 1e-12 * a.max(b);
                    assert!(v >= a.min(b) && v <= a.max(b), "{x:?}, {y:?}: {v} in interval {i}");
                    let onward = if b >= a { v >= previous - slack } else { v <= previous + slack };
                    assert!(onward, "{x:?}, {y:?}: {v} after {previous} in interval {i}");
                    previous = v;
                }
            }
        }
    }
}
