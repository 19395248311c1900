//! Rectilinear grids: piecewise linear or constant in cells, multilinear, or limited cubic.
//!
//! The cubic interpolant is the tensor product of Catmull-Rom splines, clamped to the range of the 2^D values
//! around the point, hence never negative and free of new extrema.

use super::check::magnitude;
use super::grid_axis::{AxisTable, AxisWeights};
use super::grid_shape::Shape;
use super::quadrature::{Sum, rule};
use super::sampled::{Outside, Sampler};
use super::{Interpolation, MassEstimate};
use sph::domain::{Axis, Domain, Region};
use sph::parallel;
use sph_formats::Values;
use std::sync::Arc;

pub(crate) struct Grid<const D: usize> {
    pub(crate) axes: [AxisTable; D],
    pub(crate) interpolation: Interpolation,
    /// Of all cells of one variable's values, or of none.
    pub(super) shapes: Vec<Shape<D>>,
}

impl<const D: usize> Grid<D> {
    pub(crate) fn new(axes: [AxisTable; D], interpolation: Interpolation) -> Self {
        Self { axes, interpolation, shapes: Vec::new() }
    }

    /// The box of all axes.
    pub(crate) fn domain(&self) -> crate::Result<Domain<D>> {
        let kinds = std::array::from_fn(|k| if self.axes[k].is_periodic() { Axis::Periodic } else { Axis::OPEN });
        Ok(Domain::new(sph::array(|k| self.axes[k].lo), sph::array(|k| self.axes[k].hi), kinds, Region::Box)?)
    }

    /// `x` brought into the axes; none where it is outside and `outside` says so.
    pub(super) fn admit(&self, x: &[f64; D], outside: Outside) -> Option<[f64; D]> {
        let mut inside = *x;
        for k in 0..D {
            inside[k] = self.axes[k].admit(x[k], outside == Outside::Clamp)?;
        }
        Some(inside)
    }

    /// Combines the values around `x`, which lies within the axes.
    pub(crate) fn combine(&self, values: &Values, stride: usize, x: &[f64; D], out: &mut [f64]) {
        if self.interpolation == Interpolation::PiecewiseLinear {
            return self.reconstruct(values, stride, x, out);
        }
        if let Some(corners) = self.corners(x) {
            return corners.blend(values, stride, out);
        }
        let stencil = self.stencil(x);
        stencil.blend(values, stride, out);
        if self.interpolation == Interpolation::Cubic {
            stencil.limit(values, stride, out);
        }
    }

    /// The cell around `x`, or the corners of the interval if it is one between values along all axes; `None` where that is not all.
    fn corners(&self, x: &[f64; D]) -> Option<Corners<D>> {
        let is_constant = match self.interpolation {
            Interpolation::Constant => true,
            Interpolation::Linear => false,
            Interpolation::Cubic | Interpolation::PiecewiseLinear => return None,
        };
        let mut corners = Corners { first: 0, steps: [0; D], fractions: [0.0; D], is_constant };
        let mut step = 1;
        for (k, axis) in self.axes.iter().enumerate() {
            let (i, fraction) = if is_constant { (axis.cell(x[k])?, 0.0) } else { axis.between(x[k])? };
            corners.first += i * step;
            (corners.steps[k], corners.fractions[k]) = (step, fraction);
            step *= axis.len();
        }
        Some(corners)
    }

    fn stencil(&self, x: &[f64; D]) -> Stencil {
        let mut stencil = Stencil { axes: [AxisWeights::single(0); 3], steps: [0; 3] };
        let mut step = 1;
        for (k, axis) in self.axes.iter().enumerate() {
            stencil.axes[k] = axis.weights(x[k], self.interpolation);
            stencil.steps[k] = step;
            step *= axis.len();
        }
        stencil
    }

    /// `sum_ijk w_i w_j w_k v_ijk`, compensated, in a fixed order for any number of threads.
    pub(crate) fn tensor_integral(&self, values: &Values, weights: &[Vec<f64>; D]) -> MassEstimate {
        let unit = magnitude(values);
        let row = weights[0].len();
        let rows = values.len() / row.max(1);
        let partial: Vec<f64> = parallel::map(rows, |j| {
            let mut weight = 1.0;
            let mut rest = j;
            for w in &weights[1..] {
                weight *= w[rest % w.len()];
                rest /= w.len();
            }
            let sum: Sum = (0..row).map(|i| weights[0][i] * (values.get(j * row + i) / unit)).collect();
            weight * sum.value()
        });
        let sum: Sum = partial.iter().copied().collect();
        let size: Sum = partial.iter().map(|v| v.abs()).collect();
        MassEstimate { value: sum.value() * unit, error: 16.0 * f64::EPSILON * size.value() * unit }
    }

    /// The integral over a domain of a linear or constant interpolant of all values, or of those whose numbers `is_own` is true of.
    pub(super) fn integral_of_own(
        &self,
        values: &Values,
        domain: &Domain<D>,
        is_own: Option<&(dyn Fn(usize) -> bool + Sync)>,
    ) -> MassEstimate {
        let weights = std::array::from_fn(|k| {
            self.axes[k].integral_weights(domain.lo[k], domain.hi[k], self.interpolation, 1, &|_| 1.0)
        });
        let own = is_own.map(|is_own| {
            let value = |i: usize| if is_own(i) { values.get(i) } else { 0.0 };
            Values::F64((0..values.len()).map(value).collect())
        });
        let whole = self.tensor_integral(own.as_ref().unwrap_or(values), &weights);
        if self.interpolation != Interpolation::PiecewiseLinear {
            return whole;
        }
        let cut = self.cut_integral(values, magnitude(values), domain, is_own.unwrap_or(&|_| true));
        MassEstimate { value: whole.value + cut.value, error: whole.error + cut.error }
    }

    /// What clamping takes from or adds to the cubic in each cell, by two of Gauss's rules; the rest has a
    /// closed form. Clamping is rare, so that a huge grid gets by with midpoints.
    fn clamped_integral(&self, values: &Values) -> MassEstimate {
        let unit = magnitude(values);
        let weights = std::array::from_fn(|k| {
            let axis = &self.axes[k];
            axis.integral_weights(axis.lo, axis.hi, Interpolation::Cubic, 2, &|_| 1.0)
        });
        let smooth = self.tensor_integral(values, &weights);
        let breaks: [Vec<f64>; D] = std::array::from_fn(|k| self.axes[k].intervals());
        let counts: [usize; D] = sph::array(|k| breaks[k].len() - 1);
        let cells: usize = counts.iter().product();
        let orders: &[usize] = match cells {
            0..=0x1_0000 => &[5, 6],
            0x1_0001..=0x80_0000 => &[1, 2],
            _ => &[1],
        };
        const CHUNK: usize = 4096;
        let partial: Vec<[f64; 2]> = parallel::pieces(cells, CHUNK, |chunk| {
            let (mut sum, mut error) = (Sum::default(), Sum::default());
            for cell in chunk {
                let (lo, hi) = cell_bounds(&breaks, &counts, cell);
                let (mut coarse, mut fine) = (0.0, 0.0);
                for &order in orders {
                    (coarse, fine) = (fine, self.clamping(values, order, &lo, &hi) / unit);
                }
                sum.add(fine);
                error.add((fine - coarse).abs());
            }
            [sum.value(), error.value()]
        });
        let sum: Sum = partial.iter().map(|p| p[0]).collect();
        let error: Sum = partial.iter().map(|p| p[1]).collect();
        MassEstimate { value: smooth.value + sum.value() * unit, error: smooth.error + error.value() * unit }
    }

    /// Integral of the clamped less the unclamped cubic over a cell.
    fn clamping(&self, values: &Values, order: usize, lo: &[f64; D], hi: &[f64; D]) -> f64 {
        let rule = rule(order);
        let volume: f64 = (0..D).map(|k| hi[k] - lo[k]).product();
        let mut sum = 0.0;
        for point in 0..order.pow(D as u32) {
            let mut rest = point;
            let mut weight = volume;
            let x = sph::array(|k| {
                let (t, w) = rule[rest % order];
                rest /= order;
                weight *= w;
                lo[k] + t * (hi[k] - lo[k])
            });
            let stencil = self.stencil(&x);
            let mut raw = [0.0];
            stencil.blend(values, 1, &mut raw);
            let mut clamped = raw;
            stencil.limit(values, 1, &mut clamped);
            sum += weight * (clamped[0] - raw[0]);
        }
        sum
    }

    fn fills(&self, domain: &Domain<D>) -> bool {
        (0..D).all(|k| {
            let a = &self.axes[k];
            let slack = 1e-9 * (a.hi - a.lo);
            (domain.lo[k] - a.lo).abs() <= slack && (domain.hi[k] - a.hi).abs() <= slack
        })
    }
}

fn cell_bounds<const D: usize>(breaks: &[Vec<f64>; D], counts: &[usize; D], mut cell: usize) -> ([f64; D], [f64; D]) {
    let (mut lo, mut hi) = ([0.0; D], [0.0; D]);
    for k in 0..D {
        let i = cell % counts[k];
        cell /= counts[k];
        (lo[k], hi[k]) = (breaks[k][i], breaks[k][i + 1]);
    }
    (lo, hi)
}

/// The two values along each axis between which a point lies.
struct Corners<const D: usize> {
    /// Place in memory of the first of them, and from there to the other along each axis.
    first: usize,
    steps: [usize; D],
    fractions: [f64; D],
    /// Whether the first is all.
    is_constant: bool,
}

impl<const D: usize> Corners<D> {
    fn blend(&self, values: &Values, stride: usize, out: &mut [f64]) {
        for (c, v) in out.iter_mut().enumerate() {
            // The kind of number is settled once, not per value.
            *v = match values {
                Values::F32(all) => self.mean(|i| f64::from(all[i * stride + c])),
                Values::F64(all) => self.mean(|i| all[i * stride + c]),
                Values::I64(all) => self.mean(|i| all[i * stride + c] as f64),
            };
        }
    }

    #[inline]
    fn mean(&self, value: impl Fn(usize) -> f64) -> f64 {
        if self.is_constant {
            return value(self.first);
        }
        let mut at = [0.0; 8];
        for (corner, at) in at.iter_mut().enumerate().take(1 << D) {
            *at = value(self.first + (0..D).map(|k| (corner >> k & 1) * self.steps[k]).sum::<usize>());
        }
        for (k, t) in self.fractions.iter().enumerate() {
            for j in 0..1 << (D - 1 - k) {
                at[j] = (1.0 - t) * at[2 * j] + t * at[2 * j + 1];
            }
        }
        at[0]
    }
}

/// Values around a point and their weights; axes that a grid does not have count one value.
struct Stencil {
    axes: [AxisWeights; 3],
    /// Distance in memory between neighbors along each axis.
    steps: [usize; 3],
}

impl Stencil {
    fn blend(&self, values: &Values, stride: usize, out: &mut [f64]) {
        for (c, v) in out.iter_mut().enumerate() {
            // The kind of number is settled once, not per value.
            *v = match values {
                Values::F32(all) => self.sum(|i| f64::from(all[i * stride + c])),
                Values::F64(all) => self.sum(|i| all[i * stride + c]),
                Values::I64(all) => self.sum(|i| all[i * stride + c] as f64),
            };
        }
    }

    #[inline]
    fn sum(&self, value: impl Fn(usize) -> f64) -> f64 {
        let [x, y, z] = &self.axes;
        let mut total = 0.0;
        for k in 0..z.count {
            for j in 0..y.count {
                let base = z.index[k] * self.steps[2] + y.index[j] * self.steps[1];
                let mut row = 0.0;
                for i in 0..x.count {
                    row += x.weight[i] * value(base + x.index[i] * self.steps[0]);
                }
                total += z.weight[k] * y.weight[j] * row;
            }
        }
        total
    }

    /// Clamps to the range of the values at the corners of the interval around the point.
    fn limit(&self, values: &Values, stride: usize, out: &mut [f64]) {
        for (c, v) in out.iter_mut().enumerate() {
            let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
            for corner in 0..8_usize {
                let index: usize = self
                    .axes
                    .iter()
                    .zip(self.steps)
                    .enumerate()
                    .map(|(k, (a, step))| a.index[a.core[corner >> k & 1]] * step)
                    .sum();
                let value = values.get(index * stride + c);
                lo = lo.min(value);
                hi = hi.max(value);
            }
            *v = v.clamp(lo, hi);
        }
    }
}

impl<const D: usize> Sampler<D> for Grid<D> {
    fn sample(&self, values: &Values, stride: usize, x: &[f64; D], outside: Outside, out: &mut [f64]) -> bool {
        let Some(inside) = self.admit(x, outside) else { return false };
        self.combine(values, stride, &inside, out);
        true
    }

    fn integral(&self, values: &Values, domain: &Domain<D>) -> Option<MassEstimate> {
        if !matches!(domain.region, Region::Box) {
            return None;
        }
        if self.interpolation == Interpolation::Cubic {
            return self.fills(domain).then(|| self.clamped_integral(values));
        }
        Some(self.integral_of_own(values, domain, None))
    }

    /// Those of a cell hold throughout it: kinds and counts stay whole, shares of the mass stay shares and add up, and what particles in the cell have of
    /// momentum and energy is what it has.
    fn of_carried(&self) -> Option<Arc<dyn Sampler<D>>> {
        (self.interpolation == Interpolation::PiecewiseLinear)
            .then(|| Arc::new(Self::new(self.axes.clone(), Interpolation::Constant)) as Arc<dyn Sampler<D>>)
    }

    fn integral_of_box(&self, values: &Values, of: [&[f64; D]; 2], is_own: &dyn Fn(usize) -> bool) -> Option<f64> {
        self.integral_of_values(values, of, is_own)
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::super::{Period, ScalarField};
    use super::*;
    use crate::field::sampled::SampledDensity;

    fn uneven(n: usize) -> Vec<f64> {
        (0..n).map(|i| (i as f64).powf(1.3)).collect()
    }

    fn node_grid<const D: usize>(interpolation: Interpolation, n: [usize; D]) -> Grid<D> {
        Grid::new(n.map(|n| AxisTable::nodes("x", uneven(n), None, false).unwrap()), interpolation)
    }

    fn tabulate<const D: usize>(n: [usize; D], f: impl Fn([f64; D]) -> f64) -> Values {
        let total: usize = n.iter().product();
        Values::F64(
            (0..total)
                .map(|mut i| {
                    f(sph::array(|k| {
                        let x = uneven(n[k])[i % n[k]];
                        i /= n[k];
                        x
                    }))
                })
                .collect(),
        )
    }

    fn linear_fields_are_exact<const D: usize>(n: [usize; D]) {
        let f = |x: [f64; D]| 1.0 + (0..D).map(|k| (k as f64 + 0.5) * x[k]).sum::<f64>();
        for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
            let field = SampledDensity { sampler: Arc::new(node_grid(interpolation, n)), values: tabulate(n, f) };
            let mut random = Random::new(7);
            let domain = field.sampler.domain().unwrap();
            for _ in 0..500 {
                let x = sph::array(|k| domain.lo[k] + random.unit() * (domain.hi[k] - domain.lo[k]));
                assert!((field.value(&x) - f(x)).abs() < 1e-12 * f(x), "{x:?}");
            }
            // A linear field's mean is its value in the middle.
            let middle: [f64; D] = sph::array(|k| 0.5 * (domain.lo[k] + domain.hi[k]));
            let expected = f(middle) * domain.volume();
            let mass = field.integral(&domain).unwrap();
            assert!((mass.value - expected).abs() <= mass.error, "{mass:?} {expected}");
            assert_eq!(field.value(&domain.hi.map(|h| h + 0.1)), 0.0);
            assert!((field.value(&domain.hi) - f(domain.hi)).abs() < 1e-12 * f(domain.hi));
        }
    }

    #[test]
    fn linear_fields_are_exact_in_every_dimension() {
        linear_fields_are_exact([9]);
        linear_fields_are_exact([5, 7]);
        linear_fields_are_exact([4, 3, 5]);
    }

    #[test]
    fn cubic_is_closer_than_linear_and_never_negative() {
        let n = [30];
        let f = |x: [f64; 1]| (-0.02 * (x[0] - 30.0).powi(2)).exp();
        let error = |interpolation| {
            let field = SampledDensity { sampler: Arc::new(node_grid(interpolation, n)), values: tabulate(n, f) };
            (0..8000)
                .map(|i| [0.01 * f64::from(i)])
                .map(|x| {
                    assert!(field.value(&x) >= 0.0);
                    (field.value(&x) - f(x)).powi(2)
                })
                .sum::<f64>()
        };
        assert!(error(Interpolation::Cubic) < 0.3 * error(Interpolation::Linear));
        let spike = SampledDensity {
            sampler: Arc::new(node_grid(Interpolation::Cubic, [5, 5])),
            values: Values::F64((0..25).map(|i| if i == 12 { 1.0 } else { 0.0 }).collect()),
        };
        for i in 0..1000 {
            let x = [0.006 * f64::from(i), 0.006 * f64::from((i * 37) % 1000)];
            assert!((0.0..=1.0).contains(&spike.value(&x)));
        }
        let domain = spike.sampler.domain().unwrap();
        let mass = spike.integral(&domain).unwrap();
        assert!(mass.value > 0.0 && mass.error < 0.05 * mass.value, "{mass:?}");
    }

    #[test]
    fn parts_of_a_box_and_extreme_values_have_exact_masses() {
        for unit in [1.0, 1e300, 1e-300] {
            let n = [4, 3];
            let field = SampledDensity {
                sampler: Arc::new(node_grid(Interpolation::Linear, n)),
                values: tabulate(n, |x| unit * (1.0 + x[0] * x[1])),
            };
            let domain = Domain::new([0.25, 0.5], [2.0, 9.0], [Axis::OPEN; 2], Region::Box).unwrap();
            let (a, b) = ([0.25, 0.5], [2.0, uneven(3)[2]]);
            let moment = |k: usize| 0.5 * (b[k] * b[k] - a[k] * a[k]);
            let expected = (b[0] - a[0]) * (b[1] - a[1]) + moment(0) * moment(1);
            let mass = field.integral(&domain).unwrap();
            assert!((mass.value / unit / expected - 1.0).abs() < 1e-14, "{mass:?}");
        }
    }

    #[test]
    fn single_precision_cells_repeat() {
        let axis = || AxisTable::cells("x", vec![0.0, 1.0, 2.0], vec![0.5, 1.5], Some(Period::Auto)).unwrap();
        let grid = Grid::new([axis(), axis()], Interpolation::Constant);
        let field = SampledDensity { sampler: Arc::new(grid), values: Values::F32(vec![1.0, 2.0, 3.0, 4.0]) };
        assert_eq!(field.value(&[0.2, 0.2]), 1.0);
        assert_eq!(field.value(&[3.2, 0.2]), 2.0);
        assert_eq!(field.value(&[-0.2, 5.5]), 4.0);
        let domain = field.sampler.domain().unwrap();
        assert_eq!(domain.axes, [Axis::Periodic; 2]);
        assert_eq!(field.integral(&domain).unwrap().value, 10.0);
    }
}
