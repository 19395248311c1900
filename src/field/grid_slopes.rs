//! Piecewise linear reconstruction from the cell averages of a grid: a slope along each axis of a cell, and mixed derivatives, which conserve the
//! cell's mass.
//!
//! A cell beside a jump has van Leer's slope (1974, J. Comput. Phys. 14, 361): the harmonic mean of those to the two neighbors, 0 where these differ in
//! sign. In an even field it is hence even there, and the jump stays in the face. Where the bends of a cell and of its neighbors have one sign, the field
//! is smooth, also at an extremum (after Colella & Sekora 2008, J. Comput. Phys. 227, 7069). Parabolas go on across faces with the mean of the two slopes,
//! exponentials with their harmonic mean, of which a b w / (v c) is 1 and at an extremum 0, with the slopes a and b, the bend c = b - a, the value v and
//! the width w: that is the share of the latter. At an open end the slope one cell farther in stands for the one that is missing.
//!
//! Without the mixed second derivatives faces of a smooth field would jump beside their middles. They are those of the cells across edges, and no
//! larger than either slope, so that even cells stay even. Where all neighbors have the sign of the cell, all changes are reduced until its corners
//! have at least half of what its neighbors along the axes make of it together: a density stays positive.

use super::grid::Grid;
use super::grid_axis::AxisTable;
use super::grid_shape::{Shape, pair};
use super::quadrature::Sum;
use super::{Interpolation, MassEstimate};
use sph::domain::Domain;
use sph::parallel;
use sph_formats::Values;

impl<const D: usize> Grid<D> {
    /// Where the cell around an admitted `x` is along each axis.
    pub(super) fn cell_around(&self, x: &[f64; D]) -> [usize; D] {
        sph::array(|k| self.axes[k].cell(x[k]).unwrap_or(0))
    }

    /// The number of a cell's value.
    pub(super) fn number_of(&self, at: &[usize; D]) -> usize {
        (0..D).rev().fold(0, |number, k| number * self.axes[k].len() + at[k])
    }

    /// Values at an admitted `x`.
    pub(super) fn reconstruct(&self, values: &Values, stride: usize, x: &[f64; D], out: &mut [f64]) {
        let at = self.cell_around(x);
        let number = self.number_of(&at);
        let place: [f64; D] = sph::array(|k| self.axes[k].place_in(at[k], x[k]));
        for (c, v) in out.iter_mut().enumerate() {
            let value = |i: usize| values.get(i * stride + c);
            *v = value(number) + self.shape(&at, number, value).at(&place);
        }
    }

    /// With the shapes of all cells of `values`, unless there are too many. Such a grid is one of these values alone.
    pub(super) fn keeping_shapes(mut self, values: &Values) -> Self {
        if self.interpolation == Interpolation::PiecewiseLinear && values.len() <= MOST_KEPT {
            let of_cell = |number: usize| {
                let mut rest = number;
                let at = sph::array(|k| {
                    let along = rest % self.axes[k].len();
                    rest /= self.axes[k].len();
                    along
                });
                self.made_shape(&at, number, |i| values.get(i))
            };
            self.shapes = parallel::map(values.len(), of_cell);
        }
        self
    }

    /// How a cell's values change within it.
    #[inline]
    pub(super) fn shape(&self, at: &[usize; D], number: usize, value: impl Fn(usize) -> f64) -> Shape<D> {
        self.shapes.get(number).copied().unwrap_or_else(|| self.made_shape(at, number, value))
    }

    #[inline]
    fn made_shape(&self, at: &[usize; D], number: usize, value: impl Fn(usize) -> f64) -> Shape<D> {
        let own = value(number);
        let sign = if own < 0.0 { -1.0 } else { 1.0 };
        let size = own.abs();
        let (mut shape, mut step) = (Shape::EVEN, 1);
        // From the cell to those that stand for its neighbors in mixed derivatives, and the distance of these.
        let (mut lower, mut upper, mut distances) = ([0; D], [0; D], [0.0; D]);
        // The share of the cell's value that is left at the lowest of its corners, by its neighbors.
        let (mut least, mut keeps_sign) = (1.0, true);
        for k in 0..D {
            let line = Line::around(&self.axes[k], at[k]);
            let base = number - at[k] * step;
            let values = sph::array(|i| if line.has[i] { value(base + line.cells[i] * step) } else { 0.0 });
            let Change { change, beside, lowest } = line.change(&values, sign);
            shape.changes[k] = change;
            keeps_sign &= beside >= 0.0;
            least *= if size > 0.0 { (lowest / size).clamp(0.0, 1.0) } else { 1.0 };
            let [below, above] = line.ends();
            lower[k] = (below * step).wrapping_sub(at[k] * step);
            upper[k] = (above * step).wrapping_sub(at[k] * step);
            distances[k] = line.distance();
            step *= self.axes[k].len();
        }
        for k in 0..D {
            for l in k + 1..D {
                let most = shape.changes[k].abs().min(shape.changes[l].abs());
                let distance = distances[k] * distances[l];
                if most > 0.0 && distance > 0.0 {
                    let of = |a: usize, b: usize| value(number.wrapping_add(a).wrapping_add(b));
                    let change = (of(upper[k], upper[l]) - of(lower[k], upper[l]))
                        - (of(upper[k], lower[l]) - of(lower[k], lower[l]));
                    shape.mixed[pair(k, l)] = (change / distance).clamp(-most, most);
                }
            }
        }
        if keeps_sign {
            shape.end_at(size, 0.5 * size * least, sign);
        }
        shape
    }

    /// What slopes add to the integral over a domain of the cells that it cuts, of those whose numbers `is_own` is true of.
    pub(super) fn cut_integral(
        &self,
        values: &Values,
        unit: f64,
        domain: &Domain<D>,
        is_own: &(dyn Fn(usize) -> bool + Sync),
    ) -> MassEstimate {
        let shares: [Vec<[f64; 2]>; D] = std::array::from_fn(|k| self.axes[k].shares(domain.lo[k], domain.hi[k]));
        let (mut sum, mut size) = (Sum::default(), Sum::default());
        let is_cut = |k: usize, i: usize| shares[k][i][1] != 0.0;
        for axis in 0..D {
            for cut in (0..shares[axis].len()).filter(|&i| is_cut(axis, i)) {
                let others = values.len() / self.axes[axis].len();
                let of_cell = |mut i: usize| {
                    let at: [usize; D] = std::array::from_fn(|k| {
                        if k == axis {
                            return cut;
                        }
                        let along = i % self.axes[k].len();
                        i /= self.axes[k].len();
                        along
                    });
                    let number = self.number_of(&at);
                    let of_axes: [[f64; 2]; D] = std::array::from_fn(|k| shares[k][at[k]]);
                    let is_counted = (0..axis).any(|k| is_cut(k, at[k]));
                    if is_counted || of_axes.iter().any(|share| share[0] == 0.0) || !is_own(number) {
                        return 0.0;
                    }
                    self.shape(&at, number, |i| values.get(i)).over(&of_axes) / unit
                };
                for part in parallel::map(others, of_cell) {
                    sum.add(part);
                    size.add(part.abs());
                }
            }
        }
        MassEstimate { value: sum.value() * unit, error: 16.0 * f64::EPSILON * size.value() * unit }
    }
}

/// Cells whose shapes are kept, at most: of 48 bytes each in 3-D.
const MOST_KEPT: usize = 1 << 23;

/// A cell in the middle of the two below and the two above it along an axis, of which some may not be there.
struct Line {
    cells: [usize; 5],
    has: [bool; 5],
    widths: [f64; 5],
}

/// How a cell changes along one axis.
struct Change {
    /// Over half of it.
    change: f64,
    /// The lowest value of its neighbors.
    beside: f64,
    /// The same, or the lowest that a field which goes on as it changes here has in it.
    lowest: f64,
}

impl Line {
    #[inline]
    fn around(axis: &AxisTable, cell: usize) -> Self {
        let count = axis.len();
        // A single cell is beside its own images, which say nothing of slopes.
        let (is_alone, is_periodic) = (count == 1, axis.is_periodic());
        let has = sph::array(|i| i == 2 || !is_alone && (is_periodic || (2..count + 2).contains(&(cell + i))));
        let cells = sph::array(|i| match cell + i {
            _ if !has[i] => cell,
            below if below < 2 => below + count - 2,
            above if above >= count + 2 => above - count - 2,
            within => within - 2,
        });
        Self { cells, has, widths: sph::array(|i| if has[i] { axis.width(cells[i]) } else { 0.0 }) }
    }

    /// The cells below and above, or the cell itself in the place of one beyond an open end.
    #[inline]
    fn ends(&self) -> [usize; 2] {
        [self.cells[1], self.cells[3]]
    }

    /// Between the middles of these, in half cells.
    #[inline]
    fn distance(&self) -> f64 {
        let half = |i: usize| if self.has[i] { 0.5 * (self.widths[i] + self.widths[2]) } else { 0.0 };
        (half(1) + half(3)) / (0.5 * self.widths[2])
    }

    /// Between the middles of a cell and the next one.
    #[inline]
    fn slope(&self, values: &[f64; 5], from: usize) -> f64 {
        (values[from + 1] - values[from]) / (0.5 * (self.widths[from] + self.widths[from + 1]))
    }

    /// With the cells' values; `sign` times these are compared.
    #[inline]
    fn change(&self, values: &[f64; 5], sign: f64) -> Change {
        let [_, below, own, above, _] = *values;
        let among = |i: usize| if self.has[i] { sign * values[i] } else { f64::INFINITY };
        let beside = among(1).min(among(3));
        let even = Change { change: 0.0, beside, lowest: beside };
        let going_on = |change: f64| Change { change, beside, lowest: beside.min(sign * own - change.abs()) };
        let width = self.widths[2];
        let slope = |from: usize| self.slope(values, from);
        match self.has {
            [_, true, _, true, _] => {}
            [true, true, ..] => return going_on(0.5 * width * harmonic(slope(1), slope(0))),
            [.., true, true] => return going_on(0.5 * width * harmonic(slope(2), slope(3))),
            _ => return even,
        }
        let (a, b) = (slope(1), slope(2));
        if a == 0.0 && b == 0.0 {
            return even;
        }
        let own_bend = b - a;
        let is_alike = |bend: &f64| bend * own_bend > 0.0;
        let left = self.has[0].then(|| a - slope(0)).filter(is_alike);
        let right = self.has[4].then(|| slope(3) - b).filter(is_alike);
        let Some((left, right)) = left.zip(right) else {
            let room = (below - own).abs().min((above - own).abs());
            return Change { change: (0.5 * width * harmonic(a, b)).clamp(-room, room), ..even };
        };
        let mean = 0.5 * (a + b);
        // Not a number where there is nothing, which has no slope in the end.
        let share = ((a / own) * (b / own_bend) * width).clamp(0.0, 1.0);
        let slope = if share > 0.0 { mean + share * (harmonic(a, b) - mean) } else { mean };
        let between = if a * b > 0.0 { 2.0 * a.abs().min(b.abs()) } else { 0.0 };
        let most = own_bend.abs().min(left.abs()).min(right.abs()).max(between);
        going_on(0.5 * width * slope.clamp(-most, most))
    }
}

/// Harmonic mean of slopes; 0 where they differ in sign.
#[inline]
fn harmonic(a: f64, b: f64) -> f64 {
    if a > 0.0 && b > 0.0 || a < 0.0 && b < 0.0 { 2.0 * a * (b / (a + b)) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::sampled::{Outside, SampledDensity, Sampler};
    use super::super::testing::Random;
    use super::super::{Interpolation, Period, ScalarField};
    use super::*;
    use sph::domain::{Axis, Region};
    use std::sync::Arc;

    fn edges(n: usize) -> Vec<f64> {
        (0..=n).map(|i| i as f64 + 0.3 * (i % 2) as f64).collect()
    }

    fn grid<const D: usize>(n: [usize; D], period: Option<Period>) -> Grid<D> {
        let table = |n: usize| {
            let centers = edges(n).windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
            AxisTable::cells("x", edges(n), centers, period).unwrap()
        };
        Grid::new(n.map(table), Interpolation::PiecewiseLinear)
    }

    fn middles<const D: usize>(n: [usize; D], mut i: usize) -> [f64; D] {
        std::array::from_fn(|k| {
            let at = i % n[k];
            i /= n[k];
            0.5 * (edges(n[k])[at] + edges(n[k])[at + 1])
        })
    }

    fn random_place<const D: usize>(grid: &Grid<D>, random: &mut Random) -> [f64; D] {
        std::array::from_fn(|k| grid.axes[k].lo + random.unit() * (grid.axes[k].hi - grid.axes[k].lo))
    }

    fn lines_are_met<const D: usize>(n: [usize; D]) {
        let line = |x: &[f64; D]| 20.0 + (0..D).map(|k| (k as f64 - 0.5) * x[k]).sum::<f64>();
        let grid = grid(n, None);
        let values = Values::F64((0..n.iter().product()).map(|i| line(&middles(n, i))).collect());
        let mut random = Random::new(3);
        for _ in 0..200 {
            let x = random_place(&grid, &mut random);
            let mut out = [0.0];
            assert!(grid.sample(&values, 1, &x, Outside::Reject, &mut out));
            assert!((out[0] - line(&x)).abs() < 1e-12 * line(&x), "{D}-D at {x:?}: {} for {}", out[0], line(&x));
        }
    }

    #[test]
    fn a_linear_field_is_met_up_to_open_ends() {
        lines_are_met([7]);
        lines_are_met([6, 5]);
        lines_are_met([5, 6, 7]);
    }

    /// Each cell keeps its mass, and no place in it is at 0 or below.
    fn rough_fields_are_kept<const D: usize>(n: [usize; D], period: Option<Period>, decades: f64) {
        let grid = grid(n, period);
        let mut random = Random::new(11);
        let count = n.iter().product();
        let values = Values::F64((0..count).map(|_| 10_f64.powf(decades * random.unit())).collect());
        let (mut out, points) = ([0.0], 4_usize);
        for cell in 0..count {
            let middle = middles(n, cell);
            let at = grid.cell_around(&middle);
            assert_eq!(grid.number_of(&at), cell);
            let mut mean = 0.0;
            for p in 0..points.pow(D as u32) {
                let x: [f64; D] = std::array::from_fn(|k| {
                    let share = (p / points.pow(k as u32) % points) as f64 / (points - 1) as f64 - 0.5;
                    // Just within the faces.
                    middle[k] + 0.999_999 * share * grid.axes[k].width(at[k])
                });
                grid.sample(&values, 1, &x, Outside::Reject, &mut out);
                assert!(out[0] > 0.0, "{D}-D: {} at {x:?}", out[0]);
                mean += out[0] / points.pow(D as u32) as f64;
            }
            assert!((mean / values.get(cell) - 1.0).abs() < 1e-12, "{D}-D cell {cell}: {mean}");
        }
    }

    #[test]
    fn cells_keep_their_mass_and_densities_stay_positive() {
        for (period, decades) in [(None, 1.0), (Some(Period::Auto), 1.0), (None, 30.0)] {
            rough_fields_are_kept([9], period, decades);
            rough_fields_are_kept([6, 7], period, decades);
            rough_fields_are_kept([5, 4, 6], period, decades);
        }
    }

    #[test]
    fn shapes_that_are_kept_give_the_same_bits() {
        let n = [5, 4, 6];
        let mut random = Random::new(17);
        let values = Values::F64((0..120).map(|_| 10_f64.powf(2.0 * random.unit())).collect());
        let (made, kept) = (grid(n, None), grid(n, None).keeping_shapes(&values));
        assert_eq!((made.shapes.len(), kept.shapes.len()), (0, 120));
        for _ in 0..500 {
            let x = random_place(&made, &mut random);
            let [a, b] = [&made, &kept].map(|grid| {
                let mut out = [0.0];
                assert!(grid.sample(&values, 1, &x, Outside::Reject, &mut out));
                out[0]
            });
            assert_eq!(a, b, "{x:?}");
        }
    }

    #[test]
    fn jumps_and_vacuum_stay_in_their_faces() {
        let body = |x: &[f64; 2]| if x[0] + 0.2 * x[1] < 4.5 { 10.0 } else { 1.0 };
        let n = [9, 8];
        for outside in [1.0, 0.0] {
            let grid = grid(n, None);
            let cells: Vec<f64> = (0..72).map(|i| if body(&middles(n, i)) > 5.0 { 10.0 } else { outside }).collect();
            let values = Values::F64(cells);
            let mut random = Random::new(5);
            for _ in 0..500 {
                let x = random_place(&grid, &mut random);
                let mut out = [0.0];
                grid.sample(&values, 1, &x, Outside::Reject, &mut out);
                assert_eq!(out[0], values.get(grid.number_of(&grid.cell_around(&x))));
            }
        }
    }

    /// Means of sin + 2 over `n` cells.
    fn waves(n: usize, interpolation: Interpolation) -> (Grid<1>, Values) {
        let edges: Vec<f64> = (0..=n).map(|i| i as f64 / n as f64).collect();
        let centers = edges.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect::<Vec<_>>();
        let mean = |w: &[f64]| 2.0 + ((6.0 * w[0]).cos() - (6.0 * w[1]).cos()) / (6.0 * (w[1] - w[0]));
        let values = Values::F64(edges.windows(2).map(mean).collect());
        (Grid::new([AxisTable::cells("x", edges, centers, None).unwrap()], interpolation), values)
    }

    /// A bilinear field has mixed derivatives too, up to open ends.
    #[test]
    fn mixed_derivatives_are_met() {
        let n = [6, 7];
        let field = |x: &[f64; 2]| 4.0 + 2.0 * x[0] + 3.0 * x[1] + 0.1 * x[0] * x[1];
        let grid = grid(n, None);
        let values = Values::F64((0..42).map(|i| field(&middles(n, i))).collect());
        let mut random = Random::new(9);
        for _ in 0..300 {
            let x = random_place(&grid, &mut random);
            let mut out = [0.0];
            grid.sample(&values, 1, &x, Outside::Reject, &mut out);
            assert!((out[0] / field(&x) - 1.0).abs() < 1e-12, "{x:?}: {} for {}", out[0], field(&x));
        }
    }

    /// Exponentials, which stars and clouds are nearly, go on across faces.
    #[test]
    fn exponentials_go_on() {
        for ratio in [1.1, 1.5, 3.0] {
            let edges: Vec<f64> = (0..=9).map(|i| i as f64).collect();
            let centers = edges.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect::<Vec<_>>();
            let values = Values::F64((0..9).map(|i| f64::powi(ratio, i)).collect());
            let table = AxisTable::cells("x", edges, centers, None).unwrap();
            let field = Grid::new([table], Interpolation::PiecewiseLinear);
            let at = |x: f64| {
                let mut out = [0.0];
                field.sample(&values, 1, &[x], Outside::Reject, &mut out);
                out[0]
            };
            for face in 3..7 {
                let [before, after] = [-1e-12, 1e-12].map(|d| at(face as f64 + d));
                assert!((before / after - 1.0).abs() < 1e-9, "{ratio}: {before} {after}");
            }
        }
    }

    /// A smooth density: errors fall with the square of the width, jumps at faces, of extrema too, with its cube.
    #[test]
    fn smooth_fields_are_met_to_second_order() {
        let at = |of: &(Grid<1>, Values), x: f64| {
            let mut out = [0.0];
            of.0.sample(&of.1, 1, &[x], Outside::Reject, &mut out);
            out[0]
        };
        let error = |n: usize, interpolation: Interpolation| {
            let of = waves(n, interpolation);
            let at = |i: usize| (at(&of, (i as f64 + 0.5) / 1000.0) - 2.0 - (0.006 * (i as f64 + 0.5)).sin()).abs();
            (0..1000).map(at).sum::<f64>() / 1000.0
        };
        let [coarse, fine] = [20, 80].map(|n| error(n, Interpolation::PiecewiseLinear));
        assert!(fine < coarse / 12.0, "{coarse} {fine}");
        assert!(coarse < 0.2 * error(20, Interpolation::Constant), "{coarse}");
        let jump = |n: usize| {
            let of = waves(n, Interpolation::PiecewiseLinear);
            let at = |i: usize| (at(&of, (i as f64 - 1e-9) / n as f64) - at(&of, (i as f64 + 1e-9) / n as f64)).abs();
            (3..n - 2).map(at).fold(0.0, f64::max)
        };
        let [coarse, fine] = [20, 80].map(jump);
        assert!(fine < coarse / 30.0, "{coarse} {fine}");
    }

    /// A maximum between two cells, a spike of one, steps and an edge to vacuum: the first alone is smooth.
    #[test]
    fn smooth_extrema_are_told_from_spikes_and_steps() {
        let has_slope = |values: &[f64], cell: usize| {
            let grid = grid([values.len()], None);
            grid.shape(&[cell], cell, |i| values[i]).changes[0] != 0.0
        };
        assert!(has_slope(&[0.7, 0.9, 1.0, 1.0, 0.9, 0.7], 2));
        assert!(has_slope(&[0.7, 0.9, 1.0, 0.98, 0.8, 0.5], 2));
        for (values, cell) in [
            ([1.0, 1.0, 9.0, 1.0, 1.0, 1.0], 2),
            ([1.0, 1.0, 9.0, 9.0, 1.0, 1.0], 2),
            ([1.0, 1.0, 1.0, 9.0, 9.0, 9.0], 3),
            ([0.0, 0.0, 0.0, 2.0, 2.0, 2.0], 3),
            ([3.0, 1.0, 3.0, 1.0, 3.0, 1.0], 2),
        ] {
            assert!(!has_slope(&values, cell), "{values:?}");
        }
    }

    /// Against sums of samples, in a domain that cuts cells, across a period too, and as one box where that does not cross the period.
    fn cut_domains_are_integrated<const D: usize>(n: [usize; D], parts: usize, period: Option<Period>) {
        let grid = grid(n, period);
        let mut random = Random::new(2);
        let values = Values::F64((0..n.iter().product()).map(|_| 1.0 + 3.0 * random.unit()).collect());
        let axis = if period.is_some() { Axis::Periodic } else { Axis::OPEN };
        let (lo, hi) = match period {
            Some(_) => (grid.axes.each_ref().map(|a| a.lo + 0.7), grid.axes.each_ref().map(|a| a.hi + 0.7)),
            None => (grid.axes.each_ref().map(|a| a.lo + 0.7), grid.axes.each_ref().map(|a| a.hi - 1.6)),
        };
        let domain = Domain::new(lo, hi, [axis; D], Region::Box).unwrap();
        let exact = grid.integral(&values, &domain).unwrap();
        let mut sum = 0.0;
        for mut i in 0..parts.pow(D as u32) {
            let (mut x, mut out) = ([0.0; D], [0.0]);
            for k in 0..D {
                x[k] = lo[k] + (hi[k] - lo[k]) * ((i % parts) as f64 + 0.5) / parts as f64;
                i /= parts;
            }
            grid.sample(&values, 1, &x, Outside::Reject, &mut out);
            sum += out[0];
        }
        let volume: f64 = (0..D).map(|k| hi[k] - lo[k]).product();
        let sampled = sum * volume / parts.pow(D as u32) as f64;
        assert!((exact.value / sampled - 1.0).abs() < 2.0 / parts as f64, "{D}-D: {} {sampled}", exact.value);
        let boxes = grid.integral_of_box(&values, [&lo, &hi], &|_| true);
        assert_eq!(boxes.is_some(), period.is_none());
        assert!(boxes.is_none_or(|b| (b / exact.value - 1.0).abs() < 1e-12), "{boxes:?} {exact:?}");
    }

    #[test]
    fn domains_that_cut_cells_have_what_lies_in_them() {
        for period in [None, Some(Period::Auto)] {
            cut_domains_are_integrated([8], 4000, period);
            cut_domains_are_integrated([7, 6], 400, period);
            cut_domains_are_integrated([5, 6, 7], 80, period);
        }
    }

    /// A velocity changes its sign within a cell, or in one of 0; a density of 0 has no slope.
    #[test]
    fn signs_are_kept_where_all_have_one() {
        let change = |values: [f64; 5]| grid([5], None).shape(&[2], 2, |i| values[i]).changes[0];
        assert!(change([-2.0, -1.0, 0.0, 1.0, 2.0]) > 0.0);
        assert!(change([-3.0, -1.0, 0.5, 2.0, 3.0]) > 0.5);
        assert_eq!(change([4.0, 1.0, 0.0, 0.5, 3.0]), 0.0);
        assert!(change([9.0, 4.0, 0.1, 3.0, 9.0]).abs() <= 0.1);
    }

    #[test]
    fn numbers_of_any_size_are_kept() {
        for values in [[1e300, 1e302, 1e304, 1e306], [1e-320, 1e-310, 1e-300, 1e-290], [0.0, 0.0, 1e308, 1e308]] {
            let field = SampledDensity { sampler: Arc::new(grid([4], None)), values: Values::F64(values.to_vec()) };
            for i in 0..100 {
                let value = field.value(&[4.0 * i as f64 / 99.0]);
                assert!(value.is_finite() && value >= 0.0, "{values:?}: {value}");
            }
        }
    }
}
