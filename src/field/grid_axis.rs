//! One axis of a rectilinear grid: finds the interval of a coordinate, and the weights of the values there.
//!
//! Values sit at points: nodes, or the centers of cells between edges. Beyond the first and last center of a
//! cell axis that does not repeat, values continue as constants to the outer edges. A point repeated in
//! position is a discontinuity: the interval of zero width is never entered.

use super::intervals::Intervals;
use super::{Interpolation, Period};
use crate::error::{Error, Result};
use std::sync::OnceLock;

/// Coordinates this fraction of the span beyond the ends count as the ends: they come from rounding.
const SLACK: f64 = 1e-12;

/// Values and weights along one axis; at most four.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct AxisWeights {
    pub(crate) index: [usize; 4],
    pub(crate) weight: [f64; 4],
    pub(crate) count: usize,
    /// Which entries of `index` enclose the coordinate.
    pub(crate) core: [usize; 2],
}

impl AxisWeights {
    pub(crate) fn single(index: usize) -> Self {
        Self { index: [index; 4], weight: [1.0, 0.0, 0.0, 0.0], count: 1, core: [0, 0] }
    }
}

#[derive(Debug, Clone)]
pub(crate) struct AxisTable {
    /// Positions of the values, ascending.
    points: Intervals,
    /// Outer edges of the cells, where values belong to cells.
    edges: Option<Intervals>,
    pub(crate) lo: f64,
    pub(crate) hi: f64,
    /// Points before the pattern repeats: all, or all but a repeated last one.
    cycle: usize,
    period: Option<f64>,
    /// Ends of the lines between values.
    lines: OnceLock<Intervals>,
}

impl AxisTable {
    /// Values at nodes. `repeats` says whether the last plane of values equals the first.
    ///
    /// # Errors
    /// A period that does not fit the nodes.
    pub(crate) fn nodes(name: &str, points: Vec<f64>, period: Option<Period>, repeats: bool) -> Result<Self> {
        let n = points.len();
        let (first, last) = (points[0], points[n - 1]);
        let span = last - first;
        let same = |length: f64| (length - span).abs() <= 1e-6 * span / (n as f64 - 1.0).max(1.0);
        let (cycle, period) = match period {
            None => (n, None),
            Some(Period::Auto) if repeats => (n - 1, Some(span)),
            Some(Period::Auto) => (n, Some(span * n as f64 / (n as f64 - 1.0))),
            Some(Period::Length(length)) if same(length) => (n - 1, Some(span)),
            Some(Period::Length(length)) if length > span && length.is_finite() => (n, Some(length)),
            Some(Period::Length(length)) => {
                return Err(period_error(name, length, first, last));
            }
        };
        let hi = period.map_or(last, |p| first + p);
        Ok(Self { lo: first, hi, points: Intervals::new(points), edges: None, cycle, period, lines: OnceLock::new() })
    }

    /// The same repetition, counted from `lo`.
    pub(crate) fn starting_at(self, lo: f64) -> Self {
        Self { lo, hi: self.period.map_or(self.hi, |period| lo + period), lines: OnceLock::new(), ..self }
    }

    /// Averages over cells between `edges`, placed at `centers`.
    ///
    /// # Errors
    /// A period other than the span of the edges.
    pub(crate) fn cells(name: &str, edges: Vec<f64>, centers: Vec<f64>, period: Option<Period>) -> Result<Self> {
        let (lo, hi) = (edges[0], edges[edges.len() - 1]);
        let period = match period {
            Some(Period::Length(length)) if (length - (hi - lo)).abs() > 1e-6 * (hi - lo) / centers.len() as f64 => {
                return Err(period_error(name, length, lo, hi));
            }
            Some(_) => Some(hi - lo),
            None => None,
        };
        Ok(Self {
            cycle: centers.len(),
            points: Intervals::new(centers),
            edges: Some(Intervals::new(edges)),
            lo,
            hi,
            period,
            lines: OnceLock::new(),
        })
    }

    /// Number of values along this axis.
    #[inline]
    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    /// Positions of the first and the last value.
    pub(crate) fn outermost(&self) -> [f64; 2] {
        [self.points[0], self.points[self.points.len() - 1]]
    }

    #[inline]
    pub(crate) fn is_periodic(&self) -> bool {
        self.period.is_some()
    }

    pub(crate) fn is_cells(&self) -> bool {
        self.edges.is_some()
    }

    /// `x` brought into `[lo, hi]`: wrapped, or clamped where it is off by rounding or where `clamp` says so.
    pub(crate) fn admit(&self, x: f64, clamp: bool) -> Option<f64> {
        if x >= self.lo && x <= self.hi {
            return Some(x);
        }
        if let Some(period) = self.period {
            let wrapped = self.lo + (x - self.lo).rem_euclid(period);
            return wrapped.is_finite().then(|| wrapped.clamp(self.lo, self.hi));
        }
        let slack = SLACK * (self.hi - self.lo);
        let near = x >= self.lo - slack && x <= self.hi + slack;
        (near || clamp && !x.is_nan()).then(|| x.clamp(self.lo, self.hi))
    }

    /// Weights at an admitted `x`; of cells with slopes in them, those of their means.
    pub(crate) fn weights(&self, x: f64, interpolation: Interpolation) -> AxisWeights {
        if matches!(interpolation, Interpolation::Constant | Interpolation::PiecewiseLinear)
            && let Some(cell) = self.cell(x)
        {
            return AxisWeights::single(cell);
        }
        let Some((i, t)) = self.interval(x) else {
            return AxisWeights::single(if x <= self.points[0] { 0 } else { self.points.len() - 1 });
        };
        match interpolation {
            Interpolation::Constant | Interpolation::PiecewiseLinear => {
                AxisWeights::single(self.value_index(if t < 0.5 { i } else { i + 1 }))
            }
            Interpolation::Linear => {
                let (a, b) = (self.value_index(i), self.value_index(i + 1));
                AxisWeights { index: [a, b, b, b], weight: [1.0 - t, t, 0.0, 0.0], count: 2, core: [0, 1] }
            }
            Interpolation::Cubic => self.cubic_weights(i, t),
        }
    }

    /// The cell that `x` lies in, where values belong to cells.
    #[inline]
    pub(crate) fn cell(&self, x: f64) -> Option<usize> {
        Some(self.edges.as_ref()?.find(x).min(self.points.len() - 1))
    }

    /// Length of a cell; 0 where values belong to nodes.
    #[inline]
    pub(crate) fn width(&self, cell: usize) -> f64 {
        self.edges.as_ref().map_or(0.0, |edges| edges[cell + 1] - edges[cell])
    }

    /// Where `x` lies in a cell, from -1 at its lower face to 1 at its upper one.
    #[inline]
    pub(crate) fn place_in(&self, cell: usize, x: f64) -> f64 {
        let Some(edges) = &self.edges else { return 0.0 };
        let (lower, upper) = (edges[cell], edges[cell + 1]);
        ((x - lower) - (upper - x)) / (upper - lower)
    }

    /// For each cell how much of `[a, b]` lies in it, and the integral of [`Self::place_in`] over that: 0 exactly where it lies in there whole.
    pub(crate) fn shares(&self, a: f64, b: f64) -> Vec<[f64; 2]> {
        let images = match self.period {
            Some(period) => {
                let image = |x: f64| ((x - self.lo) / period).floor() as i64;
                image(a)..=image(b)
            }
            None => 0..=0,
        };
        let share = |cell: usize| {
            let Some(edges) = &self.edges else { return [0.0; 2] };
            let (lower, upper) = (edges[cell], edges[cell + 1]);
            let mut share = [0.0; 2];
            for image in images.clone() {
                let shift = self.period.map_or(0.0, |period| period * image as f64);
                let (from, to) = ((a - shift).max(lower), (b - shift).min(upper));
                if to > from {
                    share[0] += to - from;
                    share[1] += moment([from, to], [lower, upper]);
                }
            }
            share
        };
        (0..self.len()).map(share).collect()
    }

    /// The number of the value at or below `x` and the fraction of the way to the next, between the first and the last.
    #[inline]
    pub(crate) fn between(&self, x: f64) -> Option<(usize, f64)> {
        let last = self.points.len() - 1;
        if !(x >= self.points[0] && x < self.points[last]) {
            return None;
        }
        let i = self.points.find(x);
        let (a, b) = (self.points[i], self.points[i + 1]);
        Some((i, (x - a) / (b - a)))
    }

    /// The interval `i .. i + 1` of points (unwrapped numbers) around `x` and the fraction in it; `None` where
    /// values continue as constants.
    fn interval(&self, x: f64) -> Option<(i64, f64)> {
        let n = self.points.len();
        if let Some(period) = self.period {
            // Centers leave half a cell at both ends, in which the interval runs through the boundary.
            if x < self.points[0] {
                return Some((-1, self.fraction(x, -1)));
            }
            if x >= self.points[n - 1] && self.points[n - 1] < self.points[0] + period && self.cycle == n {
                let i = n as i64 - 1;
                return Some((i, self.fraction(x, i)));
            }
        } else if self.edges.is_some() && (x < self.points[0] || x > self.points[n - 1]) || n == 1 {
            return None;
        }
        let i = self.points.find(x).min(n - 2) as i64;
        Some((i, self.fraction(x, i)))
    }

    fn fraction(&self, x: f64, i: i64) -> f64 {
        let (a, b) = (self.position(i), self.position(i + 1));
        if b > a { ((x - a) / (b - a)).clamp(0.0, 1.0) } else { 1.0 }
    }

    /// Position of point `i`, continued through the period or, without one, clamped.
    fn position(&self, i: i64) -> f64 {
        let last = self.points.len() as i64 - 1;
        match self.period {
            Some(period) if i < 0 || i > last => {
                let cycle = self.cycle as i64;
                self.points[i.rem_euclid(cycle) as usize] + period * i.div_euclid(cycle) as f64
            }
            _ => self.points[i.clamp(0, last) as usize],
        }
    }

    fn value_index(&self, i: i64) -> usize {
        if (0..self.points.len() as i64).contains(&i) {
            i as usize
        } else if self.period.is_some() {
            i.rem_euclid(self.cycle as i64) as usize
        } else {
            i.clamp(0, self.points.len() as i64 - 1) as usize
        }
    }

    /// Cubic Hermite weights with the slopes of the parabola through three neighbors (Catmull-Rom where the
    /// spacing is even); one-sided at ends and discontinuities.
    fn cubic_weights(&self, i: i64, t: f64) -> AxisWeights {
        let p: [f64; 4] = sph::array(|k| self.position(i - 1 + k as i64));
        let (before, width, after) = (p[1] - p[0], p[2] - p[1], p[3] - p[2]);
        let u = 1.0 - t;
        let (slope0, slope1) = (t * u * u, -t * t * u);
        let value1 = t * t * (3.0 - 2.0 * t);
        let mut w = [0.0, 1.0 - value1, value1, 0.0];
        if width <= 0.0 {
            w = [0.0, 0.0, 1.0, 0.0];
        } else {
            // Slope at point 1 times the width, as weights of the secants on both sides.
            let left = if before > 0.0 { width / (before + width) } else { 0.0 };
            let right = if after > 0.0 { width / (after + width) } else { 0.0 };
            if before > 0.0 {
                w[1] += slope0 * left * width / before;
                w[0] -= slope0 * left * width / before;
            }
            w[2] += slope0 * (1.0 - left);
            w[1] -= slope0 * (1.0 - left);
            if after > 0.0 {
                w[3] += slope1 * right * width / after;
                w[2] -= slope1 * right * width / after;
            }
            w[2] += slope1 * (1.0 - right);
            w[1] -= slope1 * (1.0 - right);
        }
        AxisWeights { index: sph::array(|k| self.value_index(i - 1 + k as i64)), weight: w, count: 4, core: [1, 2] }
    }

    /// `int w_i(x) measure(x) dx` over `[a, b]` for each value `i`: the integral of the interpolant along this
    /// axis is their scalar product with the values. `order` is that of Gauss's rule between kinks: 1 is exact
    /// for linear interpolation and a measure of 1.
    pub(crate) fn integral_weights(
        &self,
        a: f64,
        b: f64,
        interpolation: Interpolation,
        order: usize,
        measure: &dyn Fn(f64) -> f64,
    ) -> Vec<f64> {
        let mut weights = vec![0.0; self.points.len()];
        let breaks = self.breaks(a, b);
        for pair in breaks.windows(2) {
            let width = pair[1] - pair[0];
            for &(t, w) in super::quadrature::rule(order) {
                let x = pair[0] + t * width;
                let Some(inside) = self.admit(x, false) else {
                    continue;
                };
                let at = self.weights(inside, interpolation);
                for k in 0..at.count {
                    weights[at.index[k]] += w * width * at.weight[k] * measure(x);
                }
            }
        }
        weights
    }

    /// `a`, `b` and all places between them at which the interpolant has a kink or a discontinuity.
    pub(crate) fn breaks(&self, a: f64, b: f64) -> Vec<f64> {
        let mut own: Vec<f64> = self.points.to_vec();
        own.extend(self.points.windows(2).map(|w| 0.5 * (w[0] + w[1])));
        own.extend(self.edges.iter().flat_map(|edges| edges.iter()));
        own.extend([self.lo, self.hi]);
        let mut all = vec![a, b];
        match self.period {
            None => all.extend(own),
            Some(period) => {
                own.push(0.5 * (self.points[self.points.len() - 1] + self.points[0] + period));
                let first = ((a - self.lo) / period).floor() as i64 - 1;
                let last = ((b - self.lo) / period).ceil() as i64;
                for image in first..=last {
                    all.extend(own.iter().map(|x| x + period * image as f64));
                }
            }
        }
        all.retain(|&x| x >= a && x <= b);
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }

    /// Ends and points within `[lo, hi]`: between two of them the interpolant is one polynomial (constant
    /// interpolation aside).
    pub(crate) fn intervals(&self) -> Vec<f64> {
        let mut all = vec![self.lo, self.hi];
        all.extend(self.points.iter().filter(|&&p| p > self.lo && p < self.hi));
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }

    /// Ends of the intervals in each of which the interpolant is a constant, or a line, from end to end of the axis; none where that is not known.
    pub(crate) fn kinks(&self, interpolation: Interpolation) -> Option<&Intervals> {
        let begins = self.edges.as_ref().map_or(self.points[0], |edges| edges[0]);
        match (interpolation, &self.edges) {
            // Counted from another place than the first value.
            _ if begins != self.lo => None,
            (Interpolation::Constant | Interpolation::PiecewiseLinear, Some(edges)) => Some(edges),
            (Interpolation::Linear, _) => Some(self.lines.get_or_init(|| Intervals::new(self.intervals()))),
            _ => None,
        }
    }

    #[cfg(test)]
    pub(crate) fn points(&self) -> &[f64] {
        &self.points
    }

    #[cfg(test)]
    pub(crate) fn span(&self) -> f64 {
        self.hi - self.lo
    }
}

/// The integral over a part of a cell of the place in it, from -1 at its lower face to 1 at its upper one: 0 exactly for all of it.
pub(super) fn moment([from, to]: [f64; 2], [lower, upper]: [f64; 2]) -> f64 {
    (to - from) * ((from - lower) - (upper - to)) / (upper - lower)
}

fn period_error(name: &str, length: f64, lo: f64, hi: f64) -> Error {
    Error::scene(
        "domain",
        format!(
            "axis '{name}' runs from {lo} to {hi}; it cannot repeat with a period of {length}, which must be at least its span"
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use Interpolation::{Constant, Cubic, Linear};

    fn value(axis: &AxisTable, values: &[f64], x: f64, interpolation: Interpolation) -> f64 {
        let w = axis.weights(axis.admit(x, false).unwrap(), interpolation);
        (0..w.count).map(|k| w.weight[k] * values[w.index[k]]).sum()
    }

    #[test]
    fn uneven_nodes_are_exact_on_lines_and_parabolas() {
        let x = vec![-1.0, -0.5, 0.7, 0.8, 3.0];
        let axis = AxisTable::nodes("x", x.clone(), None, false).unwrap();
        let line: Vec<f64> = x.iter().map(|x| 2.0 + 3.0 * x).collect();
        let parabola: Vec<f64> = x.iter().map(|x| x * x).collect();
        for i in 0..=400 {
            let at = -1.0 + f64::from(i) * 0.01;
            assert!((value(&axis, &line, at, Linear) - 2.0 - 3.0 * at).abs() < 1e-13);
            assert!((value(&axis, &line, at, Cubic) - 2.0 - 3.0 * at).abs() < 1e-13);
            if (-0.5..=0.8).contains(&at) {
                assert!((value(&axis, &parabola, at, Cubic) - at * at).abs() < 1e-13, "{at}");
            }
        }
        assert_eq!(axis.admit(3.1, false), None);
        assert_eq!(axis.admit(3.1, true), Some(3.0));
    }

    #[test]
    fn periods_wrap_with_and_without_a_repeated_end() {
        let open = AxisTable::nodes("x", vec![0.0, 1.0, 2.0, 3.0], Some(Period::Auto), false).unwrap();
        assert_eq!(open.hi, 4.0);
        let values = [1.0, 2.0, 3.0, 4.0];
        assert!((value(&open, &values, 3.5, Linear) - 2.5).abs() < 1e-14);
        assert!((value(&open, &values, -0.5, Linear) - 2.5).abs() < 1e-14);
        assert!((value(&open, &values, 8.25, Linear) - 1.25).abs() < 1e-14);
        let closed = AxisTable::nodes("x", vec![0.0, 1.0, 2.0], Some(Period::Auto), true).unwrap();
        assert_eq!(closed.hi, 2.0);
        let values = [5.0, 7.0, 5.0];
        assert!((value(&closed, &values, 2.5, Linear) - 6.0).abs() < 1e-14);
        // Catmull-Rom through the boundary is symmetric here.
        let (a, b) = (value(&closed, &values, 0.25, Cubic), value(&closed, &values, 1.75, Cubic));
        assert!((a - b).abs() < 1e-14);
        assert!(AxisTable::nodes("x", vec![0.0, 1.0], Some(Period::Length(0.5)), false).is_err());
        assert_eq!(AxisTable::nodes("x", vec![0.0, 1.0], Some(Period::Length(1.5)), false).unwrap().hi, 1.5);
    }

    #[test]
    fn cells_are_constant_or_run_through_their_centers() {
        let axis = AxisTable::cells("x", vec![0.0, 1.0, 3.0], vec![0.5, 2.0], None).unwrap();
        let values = [4.0, 7.0];
        assert_eq!(value(&axis, &values, 0.9, Constant), 4.0);
        assert_eq!(value(&axis, &values, 1.0, Constant), 7.0);
        assert_eq!(value(&axis, &values, 3.0, Constant), 7.0);
        assert_eq!(value(&axis, &values, 0.2, Linear), 4.0);
        assert_eq!(value(&axis, &values, 1.25, Linear), 5.5);
        assert_eq!(value(&axis, &values, 2.9, Linear), 7.0);
        let ring = AxisTable::cells("x", vec![0.0, 1.0, 2.0], vec![0.5, 1.5], Some(Period::Auto)).unwrap();
        assert_eq!(value(&ring, &values, 0.0, Linear), 5.5);
        assert_eq!(value(&ring, &values, 2.0, Linear), 5.5);
        let one = AxisTable::cells("x", vec![0.0, 1.0], vec![0.5], None).unwrap();
        assert_eq!(value(&one, &[3.0], 0.7, Linear), 3.0);
        assert_eq!(value(&one, &[3.0], 0.7, Cubic), 3.0);
    }

    #[test]
    fn jumps_keep_both_sides() {
        let axis = AxisTable::nodes("r", vec![0.0, 1.0, 1.0, 2.0], None, false).unwrap();
        let values = [1.0, 1.0, 9.0, 9.0];
        for kind in [Linear, Cubic] {
            assert!((value(&axis, &values, 0.999, kind) - 1.0).abs() < 1e-15);
            assert!((value(&axis, &values, 1.0, kind) - 9.0).abs() < 1e-15);
        }
    }

    #[test]
    fn integral_weights_sum_to_the_length() {
        let axes = [
            AxisTable::nodes("x", vec![-1.0, -0.5, 0.7, 3.0], None, false).unwrap(),
            AxisTable::nodes("x", vec![0.0, 1.0, 2.0, 3.0], Some(Period::Auto), false).unwrap(),
            AxisTable::cells("x", vec![0.0, 1.0, 3.0], vec![0.5, 2.0], Some(Period::Auto)).unwrap(),
        ];
        for axis in &axes {
            for kind in [Constant, Linear] {
                let w = axis.integral_weights(axis.lo, axis.hi, kind, 1, &|_| 1.0);
                assert!((w.iter().sum::<f64>() / axis.span() - 1.0).abs() < 1e-14);
            }
        }
        let w = axes[0].integral_weights(-1.0, 3.0, Linear, 1, &|_| 1.0);
        assert!((w[0] - 0.25).abs() < 1e-15 && (w[1] - 0.85).abs() < 1e-15, "{w:?}");
        // Beyond the ends there is nothing.
        let w = axes[0].integral_weights(-9.0, 9.0, Linear, 1, &|_| 1.0);
        assert!((w.iter().sum::<f64>() - 4.0).abs() < 1e-14);
    }
}
