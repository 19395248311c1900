//! The smooth factor on the thermal state with which pressure balances gravity on average, and similar smooth functions.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use sph::geometry::distance;
use sph::{parallel, reduce};

use crate::target::{Positions, at};

/// A factor by its coefficients: one, or those of uniform cubic B-splines over the d-th root of the enclosed mass, up to where
/// it was fitted; beyond it is what it is there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Factor {
    coefficients: Vec<f64>,
    pub last: f64,
}

impl Factor {
    /// No change.
    pub fn one() -> Self {
        Self { coefficients: Vec::new(), last: 1.0 }
    }

    /// What it is where intervals meet.
    fn values(&self) -> Vec<f64> {
        match self.coefficients.as_slice() {
            [single] => vec![*single],
            many => many.windows(3).map(|c| (c[0] + 4.0 * c[1] + c[2]) / 6.0).collect(),
        }
    }

    /// Difference from 1, on average over the radius: near a surface of few particles it may be large.
    pub fn bias(&self) -> f64 {
        let values = self.values();
        values.iter().map(|v| (v - 1.0).abs()).sum::<f64>() / values.len().max(1) as f64
    }
}

impl std::fmt::Display for Factor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let values = self.values();
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(0.0, f64::max);
        match values.len() {
            0 => write!(f, "1"),
            1 => write!(f, "{most:.4}"),
            _ => write!(f, "{least:.4} to {most:.4} (a smooth function of the enclosed mass)"),
        }
    }
}

/// Functions of which a factor is made, at particles.
pub(super) struct Basis<'a> {
    /// Share of the mass nearer to the center; one function that is 1 everywhere where there is none.
    fraction: Option<&'a [f64]>,
    /// The share up to which it is fitted.
    last: f64,
    dimension: usize,
}

/// Intervals of the splines.
const INTERVALS: usize = 6;
/// Weight of the coefficients' second differences against the mean square of the relative force.
const STIFFNESS: f64 = 1.0;
/// Weight of the coefficients' first differences: where hardly a particle is, near the center, the factor stays what it is beside.
const STEADINESS: f64 = 0.03;
/// Gravity below this share of the largest counts no more than it.
const LEAST_GRAVITY: f64 = 0.1;

impl<'a> Basis<'a> {
    pub fn new<const D: usize>(fraction: Option<&'a [f64]>, last: f64) -> Self {
        Self { fraction, last, dimension: D }
    }

    /// The functions that are to be fitted over `set`.
    pub fn over<const D: usize>(fraction: Option<&'a [f64]>, set: Option<&[bool]>) -> Self {
        let counts = |i: usize| set.is_none_or(|s| s[i]);
        let share = |f: &[f64]| reduce::max(f.len(), |i| if counts(i) { f[i] } else { 0.0 });
        Self::new::<D>(fraction, fraction.map(share).filter(|last| *last > 0.0).unwrap_or(1.0))
    }

    pub fn len(&self) -> usize {
        if self.fraction.is_some() { INTERVALS + 3 } else { 1 }
    }

    /// The `k`-th function at particle `i`.
    pub fn value(&self, k: usize, i: usize) -> f64 {
        let Some(fraction) = self.fraction else { return 1.0 };
        let share = (fraction[i] / self.last).min(1.0);
        let radius = if self.dimension == 3 { share.cbrt() } else { share.powf(1.0 / self.dimension as f64) };
        let t = radius * INTERVALS as f64;
        // Distance from the spline's middle, in intervals.
        let s = (t - (k as f64 - 1.0)).abs();
        if s < 1.0 { (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0 } else { (2.0 - s).max(0.0).powi(3) / 6.0 }
    }

    /// `factor` at particle `i`.
    pub fn sum(&self, factor: &Factor, i: usize) -> f64 {
        if factor.coefficients.is_empty() {
            return 1.0;
        }
        factor.coefficients.iter().enumerate().map(|(k, c)| c * self.value(k, i)).sum()
    }

    /// The factor with which `forces`, those of the single functions, cancel gravity best over `set`. `None` where they do
    /// not determine it.
    pub fn fitted<const D: usize>(
        &self,
        forces: &[Vec<[f64; D]>],
        gravity: &[[f64; D]],
        set: Option<&[bool]>,
    ) -> Option<Factor> {
        let n = gravity.len();
        let square = |g: &[f64; D]| g.iter().map(|v| v * v).sum::<f64>();
        let least = LEAST_GRAVITY.powi(2) * reduce::max(n, |i| square(&gravity[i]));
        let weight = parallel::map(n, |i| match set.is_none_or(|s| s[i]) {
            true => 1.0 / square(&gravity[i]).max(least),
            false => 0.0,
        });
        let wanted = parallel::map(n, |i| gravity[i].map(|g| -g));
        self.nearest(forces, &wanted, &weight)
    }

    /// The factor with which `functions`, one for each of the basis, add up to what is wanted with the least sum of weighted
    /// squares. `None` where they do not determine it.
    pub fn nearest<const D: usize>(
        &self,
        functions: &[Vec<[f64; D]>],
        wanted: &[[f64; D]],
        weight: &[f64],
    ) -> Option<Factor> {
        let (n, len) = (wanted.len(), functions.len());
        let over = |a: &[[f64; D]], b: &[[f64; D]]| {
            reduce::sum(n, |i| weight[i] * (0..D).map(|k| a[i][k] * b[i][k]).sum::<f64>())
        };
        let mut matrix =
            DMatrix::from_fn(len, len, |a, b| if a <= b { over(&functions[a], &functions[b]) } else { 0.0 });
        matrix.fill_lower_triangle_with_upper_triangle();
        let count = parallel::count(n, |i| weight[i] > 0.0) as f64;
        for (penalty, difference) in [(STIFFNESS, &[1.0, -2.0, 1.0][..]), (STEADINESS, &[1.0, -1.0])] {
            for row in 0..(len + 1).saturating_sub(difference.len()) {
                for (a, x) in difference.iter().enumerate() {
                    for (b, y) in difference.iter().enumerate() {
                        matrix[(row + a, row + b)] += penalty * count * x * y;
                    }
                }
            }
        }
        let right = DVector::from_fn(len, |a, _| over(&functions[a], wanted));
        let found = matrix.cholesky()?.solve(&right);
        found
            .iter()
            .all(|c| c.is_finite())
            .then(|| Factor { coefficients: found.iter().copied().collect(), last: self.last })
    }
}

/// For each particle the share of all that is nearer to `center`, and half of itself.
pub(super) fn enclosed_fractions<const D: usize>(positions: &Positions<D>, center: &[f64; D]) -> Vec<f64> {
    let n = positions[0].len();
    let radius = parallel::map(n, |i| distance(&at(positions, i), center));
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| radius[a].total_cmp(&radius[b]).then(a.cmp(&b)));
    let mut fraction = vec![0.0; n];
    order.iter().enumerate().for_each(|(rank, &i)| fraction[i] = (rank as f64 + 0.5) / n as f64);
    fraction
}
