//! The gravity of a disc of gas: rings of it, and the vertical structure that goes with them.
//!
//! A ring of mass m attracts as Phi = -G m/agm(a, b), with a and b the largest and the smallest distance to it (Gauss; the same as
//! the complete elliptic integral). Columns of a width below the scale height are layered in rings; columns that are far away count
//! as two rings at the height of their root mean square. Density and potential are found in turns until they agree.

use super::law::Law;
use super::rows::{Rows, lagrange};
use super::well::Well;
use crate::error::{Error, Result};
use crate::field::quadrature::integrate;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Layers of a column above the middle plane, each a part of the scale height.
const LAYERS: usize = 24;
const LAYER: f64 = 0.25;
/// Columns nearer than so many scale heights count layer by layer.
const NEAR: f64 = 4.0;
/// Turns, and the change of the potential in units of c^2 at which they end.
const TURNS: usize = 200;
const ENOUGH: f64 = 1e-6;

/// Potential of the gas itself, by columns.
pub(super) struct Own {
    rows: Rows,
    /// Scale heights of the rows, in which heights count.
    heights: Vec<f64>,
    /// Potential in the middle plane.
    plane: Vec<f64>,
    /// Phi(R, z) - Phi(R, 0) row by row, at heights of 0, 1, 2, ... layers.
    rise: Vec<[f64; LAYERS + 1]>,
}

/// A column of gas between two rows.
struct Column {
    radius: f64,
    height: f64,
    mass: f64,
    /// Parts of the mass by layer, above the plane; their sum is 1.
    parts: [f64; LAYERS],
    /// Root mean square of z.
    spread: f64,
}

/// -Phi/(G m) of a ring at the distances `a` and `b`: 1/agm(a, b).
fn ring(mut a: f64, mut b: f64) -> f64 {
    while (a - b).abs() > 1e-9 * a {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    2.0 / (a + b)
}

impl Column {
    /// -Phi/G of the two rings of a layer, each of half of `mass`.
    fn pair(&self, radius: f64, z: f64, height: f64, mass: f64) -> f64 {
        let (out, across) = (self.radius + radius, self.radius - radius);
        let one = |dz: f64| ring(out.hypot(dz), across.hypot(dz));
        0.5 * mass * (one(z - height) + one(z + height))
    }

    /// -Phi/G at a place.
    fn potential(&self, radius: f64, z: f64, reach: f64) -> f64 {
        if (self.radius - radius).abs() > NEAR * reach.max(self.height) {
            return self.pair(radius, z, self.spread, self.mass);
        }
        let layer = |k: usize| (k as f64 + 0.5) * LAYER * self.height;
        (0..LAYERS).map(|k| self.pair(radius, z, layer(k), self.mass * self.parts[k])).sum()
    }

    /// Spreads the mass over the layers as exp(-rise/c^2).
    fn layer(&mut self, exponent: impl Fn(f64) -> f64) {
        let z = |k: usize| (k as f64 + 0.5) * LAYER * self.height;
        let weights: [f64; LAYERS] = sph::array(|k| (-exponent(z(k))).exp());
        let sum: f64 = weights.iter().sum();
        self.parts = weights.map(|w| w / sum);
        self.spread = (0..LAYERS).map(|k| self.parts[k] * z(k).powi(2)).sum::<f64>().sqrt();
    }
}

impl Own {
    /// Of the surface density that `law` has, times `scale`, in equilibrium along z with itself and with `well`.
    ///
    /// # Errors
    /// A disc that is too heavy for its temperature: density and potential do not come to agree.
    pub fn new(law: &Law, well: &Well, rows: Rows, scale: f64) -> Result<Self> {
        let places = rows.places();
        let heights: Vec<f64> = places.iter().map(|&r| law.scale_height(well, r, scale)).collect::<Result<_>>()?;
        let n = places.len();
        let mut own = Self { rows, heights, plane: vec![0.0; n], rise: vec![[0.0; LAYERS + 1]; n] };
        let mut columns: Vec<Column> = own.columns(law, scale);
        for _ in 0..TURNS {
            columns.par_iter_mut().for_each(|column| {
                let (radius, speed) = (column.radius, law.sound_speed(well, column.radius).powi(2));
                column.layer(|z| (well.rise(radius, z) + own.rise(radius, z)) / speed);
            });
            let found: Vec<[f64; LAYERS + 1]> = own
                .rows
                .places()
                .par_iter()
                .zip(&own.heights)
                .map(|(&r, &h)| potential(&columns, r, h, well))
                .collect();
            let mut change = 0.0f64;
            for (i, values) in found.iter().enumerate() {
                let speed = law.sound_speed(well, own.rows.places()[i]).powi(2);
                own.plane[i] = values[0];
                for (k, value) in values.iter().enumerate() {
                    let rise = value - values[0];
                    // What is far above the plane holds next to nothing.
                    if k <= LAYERS / 2 {
                        change = change.max((rise - own.rise[i][k]).abs() / speed);
                    }
                    own.rise[i][k] = rise;
                }
            }
            if change < ENOUGH {
                return Ok(own);
            }
        }
        Err(Error::scene(
            "input.profile.disc",
            "is too heavy for its temperature: gravity of its own and vertical structure do not come to agree; take less mass, or a higher aspect_ratio or sound_speed",
        ))
    }

    fn columns(&self, law: &Law, scale: f64) -> Vec<Column> {
        let between = self.rows.places().windows(2).zip(self.heights.windows(2));
        between
            .map(|(r, h)| {
                let surface = |r: f64| TAU * r * law.surface_density(r);
                let mass = scale * integrate(4, r[0], r[1], &surface);
                let (radius, height) = (0.5 * (r[0] + r[1]), 0.5 * (h[0] + h[1]));
                Column { radius, height, mass, parts: [1.0 / LAYERS as f64; LAYERS], spread: height }
            })
            .collect()
    }

    /// Phi(R, z) - Phi(R, 0).
    pub fn rise(&self, radius: f64, z: f64) -> f64 {
        let (first, weights, _) = self.rows.weights(radius);
        let height: f64 = (0..4).map(|j| weights[j] * self.heights[first + j]).sum();
        let place = (z / height).abs() / LAYER;
        let base = (place as usize).saturating_sub(1).min(LAYERS - 3);
        let along = lagrange(&[0.0, 1.0, 2.0, 3.0], (place - base as f64).min(3.0));
        let of_row = |row: &[f64; LAYERS + 1]| {
            // Straight on beyond the last layer.
            let beyond = (place - LAYERS as f64).max(0.0) * (row[LAYERS] - row[LAYERS - 1]);
            (0..4).map(|k| along.0[k] * row[base + k]).sum::<f64>() + beyond
        };
        (0..4).map(|j| weights[j] * of_row(&self.rise[first + j])).sum()
    }

    /// dPhi/dR in the middle plane.
    pub fn pull(&self, radius: f64) -> f64 {
        let (first, _, slopes) = self.rows.weights(radius);
        (0..4).map(|j| slopes[j] * self.plane[first + j]).sum()
    }
}

/// Potential of all columns at the heights of a row.
fn potential(columns: &[Column], radius: f64, height: f64, well: &Well) -> [f64; LAYERS + 1] {
    sph::array(|k| {
        let z = k as f64 * LAYER * height;
        -well.constant * columns.iter().map(|column| column.potential(radius, z, height)).sum::<f64>()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_attracts_as_its_parts_do() {
        let parts = 20_000;
        let of_parts = |radius: f64, z: f64| {
            let one = |i: i32| {
                let angle = TAU * f64::from(i) / f64::from(parts);
                1.0 / ((angle.cos() - radius).powi(2) + angle.sin().powi(2) + z * z).sqrt()
            };
            (0..parts).map(one).sum::<f64>() / f64::from(parts)
        };
        for (radius, z) in [(0.0, 0.0), (0.5, 0.0), (0.98, 0.05), (1.3, 0.4), (20.0, 3.0)] {
            let found = ring(f64::hypot(1.0 + radius, z), f64::hypot(1.0 - radius, z));
            assert!((found / of_parts(radius, z) - 1.0).abs() < 1e-9, "{radius} {z}: {found}");
        }
    }
}
