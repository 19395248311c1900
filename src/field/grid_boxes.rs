//! Integrals of a grid's interpolant over boxes, as sums over the values in them, so that the cells of a target whose density varies strongly
//! from one grid cell to the next have their masses to rounding.

use super::Interpolation;
use super::grid::Grid;
use super::grid_axis::{AxisTable, moment};
use sph_formats::Values;

/// Values along one axis that count in a box, with the lengths for which they do.
#[derive(Default)]
struct Lengths {
    index: [usize; MOST_ALONG],
    length: [f64; MOST_ALONG],
    /// Of cells with slopes in them: the integral of the place in the cell, from -1 to 1, over that length.
    moment: [f64; MOST_ALONG],
    count: usize,
}

/// Values along an axis, at most: of larger boxes a rule of a few points says as much.
const MOST_ALONG: usize = 16;

impl Lengths {
    fn add(&mut self, index: usize, length: f64) -> Option<()> {
        // Neighboring intervals share a value.
        let known = (0..self.count).rev().take(2).find(|&i| self.index[i] == index);
        let place = match known {
            Some(place) => place,
            None if self.count == MOST_ALONG => return None,
            None => {
                self.index[self.count] = index;
                self.count += 1;
                self.count - 1
            }
        };
        self.length[place] += length;
        Some(())
    }

    /// Between `a` and `b`; none where these are beyond the axis, or have too many values between them.
    fn between(axis: &AxisTable, interpolation: Interpolation, [a, b]: [f64; 2]) -> Option<Self> {
        let kinks = axis.kinks(interpolation)?;
        let [first, last] = [*kinks.first()?, *kinks.last()?];
        let slack = ROUNDING * (last - first);
        if !(a < b && a >= first - slack && b <= last + slack) {
            return None;
        }
        let mut lengths = Self::default();
        for pair in kinks[kinks.find(a)..].windows(2).take_while(|pair| pair[0] < b) {
            let (from, to) = (a.max(pair[0]), b.min(pair[1]));
            if !(from < to) {
                continue;
            }
            // One polynomial, of the first degree at most: its middle says what it has.
            let weights = axis.weights(0.5 * (from + to), interpolation);
            for k in 0..weights.count {
                lengths.add(weights.index[k], weights.weight[k] * (to - from))?;
            }
            if interpolation == Interpolation::PiecewiseLinear {
                lengths.moment[lengths.count - 1] = moment([from, to], [pair[0], pair[1]]);
            }
        }
        Some(lengths)
    }
}

/// By how much of an axis a box may end beyond it.
const ROUNDING: f64 = 1e-9;

impl<const D: usize> Grid<D> {
    /// The integral of the interpolant of `values` over a box, of those that `is_own` is true of; none where it is not piecewise linear, or the box
    /// has many values.
    pub(super) fn integral_of_values(
        &self,
        values: &Values,
        [lo, hi]: [&[f64; D]; 2],
        is_own: &dyn Fn(usize) -> bool,
    ) -> Option<f64> {
        let mut along: [Lengths; D] = std::array::from_fn(|_| Lengths::default());
        for k in 0..D {
            along[k] = Lengths::between(&self.axes[k], self.interpolation, [lo[k], hi[k]])?;
        }
        let count: usize = along.iter().map(|lengths| lengths.count).product();
        let has_slopes = self.interpolation == Interpolation::PiecewiseLinear;
        let mut sum = 0.0;
        for mut i in 0..count {
            let (mut weight, mut at, mut shares) = (1.0, [0; D], [[0.0; 2]; D]);
            for (k, lengths) in along.iter().enumerate() {
                let place = i % lengths.count;
                i /= lengths.count;
                at[k] = lengths.index[place];
                shares[k] = [lengths.length[place], lengths.moment[place]];
                weight *= lengths.length[place];
            }
            let number = self.number_of(&at);
            if !is_own(number) {
                continue;
            }
            sum += weight * values.get(number);
            if has_slopes && shares.iter().any(|[_, moment]| *moment != 0.0) {
                sum += self.shape(&at, number, |i| values.get(i)).over(&shares);
            }
        }
        Some(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::super::grid_axis::AxisTable;
    use super::super::quadrature::rule;
    use super::super::sampled::{Outside, Sampler};
    use super::super::testing::Random;
    use super::*;

    /// By Gauss's rule in each of many small parts, along each axis.
    fn sampled<const D: usize>(grid: &Grid<D>, values: &Values, [lo, hi]: [&[f64; D]; 2], parts: usize) -> f64 {
        let points = 2 * parts;
        let place = |k: usize, i: usize| {
            let (u, weight) = rule(2)[i % 2];
            let width = (hi[k] - lo[k]) / parts as f64;
            (lo[k] + (u + (i / 2) as f64) * width, weight * width)
        };
        let value = |i: usize| {
            let at: [(f64, f64); D] = std::array::from_fn(|k| place(k, i / points.pow(k as u32) % points));
            let mut out = [0.0];
            grid.sample(values, 1, &at.map(|a| a.0), Outside::Clamp, &mut out);
            out[0] * at.iter().map(|a| a.1).product::<f64>()
        };
        (0..points.pow(D as u32)).map(value).sum()
    }

    fn check<const D: usize>(n: [usize; D], parts: usize) {
        let mut random = Random::new(5);
        let edges = |n: usize| (0..=n).map(|i| i as f64 + 0.2 * (i % 2) as f64).collect::<Vec<_>>();
        let centers = |n: usize| edges(n).windows(2).map(|w| 0.5 * (w[0] + w[1])).collect::<Vec<_>>();
        let cells = |n: usize| AxisTable::cells("x", edges(n), centers(n), None).unwrap();
        let around = |n: usize| AxisTable::nodes("x", edges(n - 1), Some(super::super::Period::Auto), false).unwrap();
        let nodes = |n: usize| AxisTable::nodes("x", edges(n - 1), None, false).unwrap();
        let values = Values::F64((0..n.iter().product()).map(|_| 10_f64.powf(4.0 * random.unit())).collect());
        type Make<'a> = &'a dyn Fn(usize) -> AxisTable;
        let of: [(Interpolation, Make); 5] = [
            (Interpolation::Constant, &cells),
            (Interpolation::PiecewiseLinear, &cells),
            (Interpolation::Linear, &cells),
            (Interpolation::Linear, &nodes),
            (Interpolation::Linear, &around),
        ];
        for (interpolation, axis) in of {
            let grid = Grid::new(std::array::from_fn(|k| axis(n[k])), interpolation);
            for _ in 0..5 {
                let ends: [[f64; 2]; D] = std::array::from_fn(|k| {
                    let span = grid.axes[k].hi - grid.axes[k].lo;
                    let from = 0.5 * random.unit();
                    [from, from + 0.1 + 0.3 * random.unit()].map(|u| grid.axes[k].lo + u * span)
                });
                let (lo, hi) = (ends.map(|e| e[0]), ends.map(|e| e[1]));
                let exact = grid.integral_of_values(&values, [&lo, &hi], &|_| true).unwrap();
                let near = sampled(&grid, &values, [&lo, &hi], parts);
                let volume: f64 = (0..D).map(|k| hi[k] - lo[k]).product();
                let most = (0..values.len()).map(|i| values.get(i)).fold(0.0, f64::max);
                assert!((exact - near).abs() < 2.0 * D as f64 / parts as f64 * most * volume, "{D}-D: {exact} {near}");
            }
            // All of it, as the integral over the whole has it.
            let whole = grid.integral(&values, &grid.domain().unwrap()).unwrap().value;
            let (lo, hi) = (sph::array(|k| grid.axes[k].lo), sph::array(|k| grid.axes[k].hi));
            let boxes = grid.integral_of_values(&values, [&lo, &hi], &|_| true).unwrap();
            assert!((boxes / whole - 1.0).abs() < 1e-12, "{D}-D {interpolation:?}: {boxes} of {whole}");
            let [even, odd] =
                [0, 1].map(|side| grid.integral_of_values(&values, [&lo, &hi], &|i| i % 2 == side).unwrap());
            assert!(((even + odd) / whole - 1.0).abs() < 1e-12 && even != whole);
            let beyond = hi.map(|v| v + 1.0);
            assert!(grid.integral_of_values(&values, [&lo, &beyond], &|_| true).is_none());
        }
    }

    #[test]
    fn boxes_have_what_the_interpolant_has_in_them() {
        check::<1>([9], 4000);
        check::<2>([9, 6], 200);
        check::<3>([6, 5, 7], 24);
        let grid = Grid::new(
            [AxisTable::cells("x", vec![0.0, 1.0, 2.0], vec![0.5, 1.5], None).unwrap()],
            Interpolation::Cubic,
        );
        assert!(grid.integral_of_values(&Values::F64(vec![1.0, 2.0]), [&[0.0], &[1.0]], &|_| true).is_none());
    }
}
