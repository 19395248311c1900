//! The gravity of a disc of gas, as a set of rings, and the vertical structure that is consistent with it.
//!
//! A ring of mass m attracts as Phi = -G m/agm(a, b), with a and b the largest and the smallest distance to it (Gauss; the same as
//! the complete elliptic integral). Columns of a width below the scale height are layered in rings; columns that are far away count
//! as two rings at the height of their root mean square, s, to first order in s^2. Density and potential are found in turns until they
//! agree; what a ring does at a place is worked out once.

use super::law::Law;
use super::rows::{Rows, even_values};
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

/// -Phi/(G m) of a ring at the distances whose squares are `a` and `b`: 1/agm.
fn ring(a: f64, b: f64) -> f64 {
    let (mut a, mut b) = (a.sqrt(), b.sqrt());
    while (a - b).abs() > 1e-9 * a {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    2.0 / (a + b)
}

/// Height of the middle of a layer.
fn middle(layer: usize, height: f64) -> f64 {
    (layer as f64 + 0.5) * LAYER * height
}

/// The first of the four layers about a height in scale heights, their weights, and how far it is beyond the last one, from where on a
/// potential goes straight.
fn between_layers(height: f64) -> (usize, [f64; 4], f64) {
    let place = height.abs() / LAYER;
    let base = (place as usize).saturating_sub(1).min(LAYERS - 3);
    (base, even_values((place - base as f64).min(3.0)), (place - LAYERS as f64).max(0.0))
}

/// A row's value at a height that is [`between_layers`]: beyond the last layer it goes on as in it.
fn at_height(row: &[f64; LAYERS + 1], (base, weights, beyond): (usize, [f64; 4], f64)) -> f64 {
    (0..4).map(|k| weights[k] * row[base + k]).sum::<f64>() + beyond * (row[LAYERS] - row[LAYERS - 1])
}

impl Column {
    /// -Phi/(G m) of the two rings of a layer, above the plane and below it.
    fn pair(&self, radius: f64, z: f64, height: f64) -> f64 {
        let (out, across) = ((self.radius + radius).powi(2), (self.radius - radius).powi(2));
        let one = |dz: f64| ring(out + dz * dz, across + dz * dz);
        0.5 * (one(z - height) + one(z + height))
    }

    /// Whether it counts layer by layer at a row.
    fn is_near(&self, radius: f64, reach: f64) -> bool {
        (self.radius - radius).abs() <= NEAR * reach.max(self.height)
    }

    /// Spreads the mass over the layers as exp(-rise/c^2).
    fn layer(&mut self, exponent: impl Fn(f64) -> f64) {
        let z = |k: usize| middle(k, self.height);
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
        let places = rows.places().to_vec();
        let heights: Vec<f64> = places.iter().map(|&r| law.scale_height(well, r, scale)).collect::<Result<_>>()?;
        let n = places.len();
        let mut own = Self { rows, heights, plane: vec![0.0; n], rise: vec![[0.0; LAYERS + 1]; n] };
        let mut columns: Vec<Column> = own.columns(law, scale);
        let attractions: Vec<Attractions> =
            places.par_iter().zip(&own.heights).map(|(&r, &h)| Attractions::new(&columns, r, h)).collect();
        for _ in 0..TURNS {
            columns.par_iter_mut().for_each(|column| {
                let (radius, speed) = (column.radius, law.sound_speed(well, column.radius).powi(2));
                column.layer(|z| (well.rise(law.off_center(radius), z) + own.rise(radius, z)) / speed);
            });
            let found: Vec<[f64; LAYERS + 1]> = attractions
                .par_iter()
                .map(|row| row.potential(&columns).map(|potential| -well.constant * potential))
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
        let (first, weights, height) = self.about(radius);
        let between = between_layers(z / height);
        (0..4).map(|j| weights[j] * at_height(&self.rise[first + j], between)).sum()
    }

    /// The same at every height, for many of them at one radius.
    pub fn rises(&self, radius: f64) -> impl Fn(f64) -> f64 {
        let (first, weights, height) = self.about(radius);
        let row: [f64; LAYERS + 1] = sph::array(|k| (0..4).map(|j| weights[j] * self.rise[first + j][k]).sum());
        move |z| at_height(&row, between_layers(z / height))
    }

    /// The first of the four rows about a radius, their weights, and the scale height there.
    fn about(&self, radius: f64) -> (usize, [f64; 4], f64) {
        let (first, weights) = self.rows.weights(radius);
        (first, weights, (0..4).map(|j| weights[j] * self.heights[first + j]).sum())
    }

    /// dPhi/dR in the middle plane.
    pub fn pull(&self, radius: f64) -> f64 {
        self.rows.slope(&self.plane, radius)
    }
}

/// What the columns do at one height of a row: -Phi/G by what changes from turn to turn.
struct Attraction {
    /// Of far columns in the plane.
    rings: f64,
    /// Of far columns by the square of their spread; nothing of near ones. A correction to `rings` of a sixteenth at most.
    spreads: Vec<f32>,
    /// Of near columns by the part of their mass in each layer.
    layers: Vec<[f64; LAYERS]>,
}

/// The columns' attraction at all heights of a row.
struct Attractions {
    /// Columns that count layer by layer.
    near: Vec<usize>,
    at: Vec<Attraction>,
}

impl Attractions {
    fn new(columns: &[Column], radius: f64, height: f64) -> Self {
        let is_near = |column: &Column| column.is_near(radius, height);
        let near: Vec<usize> = (0..columns.len()).filter(|&j| is_near(&columns[j])).collect();
        let at = |k: usize| {
            let z = k as f64 * LAYER * height;
            let mut rings = 0.0;
            let mut of_spread = |column: &Column| {
                if is_near(column) {
                    return 0.0;
                }
                let ring = column.pair(radius, z, 0.0);
                rings += column.mass * ring;
                (column.mass * (column.pair(radius, z, column.height) - ring) / column.height.powi(2)) as f32
            };
            let spreads = columns.iter().map(&mut of_spread).collect();
            let of_layers = |j: &usize| {
                let column = &columns[*j];
                sph::array(|k| column.mass * column.pair(radius, z, middle(k, column.height)))
            };
            Attraction { layers: near.iter().map(of_layers).collect(), rings, spreads }
        };
        let at = (0..=LAYERS).map(at).collect();
        Self { near, at }
    }

    /// -Phi/G at the heights.
    fn potential(&self, columns: &[Column]) -> [f64; LAYERS + 1] {
        sph::array(|k| {
            let Attraction { rings, spreads, layers } = &self.at[k];
            let spread: f64 = spreads.iter().zip(columns).map(|(f, c)| f64::from(*f) * c.spread * c.spread).sum();
            let of_near = |(j, layers): (&usize, &[f64; LAYERS])| -> f64 {
                layers.iter().zip(&columns[*j].parts).map(|(f, part)| f * part).sum()
            };
            rings + spread + self.near.iter().zip(layers).map(of_near).sum::<f64>()
        })
    }
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
        for (radius, z) in [(0.0_f64, 0.0), (0.5, 0.0), (0.98, 0.05), (1.3, 0.4), (20.0, 3.0)] {
            let found = ring((1.0 + radius).powi(2) + z * z, (1.0 - radius).powi(2) + z * z);
            assert!((found / of_parts(radius, z) - 1.0).abs() < 1e-9, "{radius} {z}: {found}");
        }
    }

    /// Ring by ring, as it is written down in the module's head, with other spreads than those for which the table was made.
    #[test]
    fn a_row_feels_every_ring_of_all_columns() {
        let mut columns: Vec<Column> = (0..40)
            .map(|j| {
                let radius = 1.0 + 0.1 * f64::from(j);
                Column { radius, height: 0.08 * radius, mass: 1.0 / radius, parts: [0.0; LAYERS], spread: 0.0 }
            })
            .collect();
        for (radius, height) in [(1.0, 0.08), (2.65, 0.2), (4.9, 0.4)] {
            let row = Attractions::new(&columns, radius, height);
            for column in &mut columns {
                let scale = 1.2 * column.height;
                column.layer(|z| 0.5 * (z / scale).powi(2));
            }
            assert!((5..35).contains(&row.near.len()), "{}", row.near.len());
            for (k, found) in row.potential(&columns).iter().enumerate() {
                let z = k as f64 * LAYER * height;
                let of_layer = |c: &Column, k: usize| c.mass * c.parts[k] * c.pair(radius, z, middle(k, c.height));
                let expected: f64 = columns.iter().map(|c| (0..LAYERS).map(|k| of_layer(c, k)).sum::<f64>()).sum();
                // Two rings in place of layers are 1.5e-4 off for the first of these rows, and to first order in their spread 1.8e-4.
                assert!((found / expected - 1.0).abs() < 2.5e-4, "{radius} {k}: {found} {expected}");
            }
        }
    }
}
