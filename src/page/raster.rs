//! Sums over particles at the pixels of an image: f(x) = sum_j f_j W(|x - r_j|, H_j), in a plane or along the line of sight.

use super::portrait::Portrait;
use sph::kernel::{KernelName, evaluate, with_kernel};
use sph::parallel;

/// What of the particles a picture shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Depth {
    /// All, in 2-D.
    Flat,
    /// The plane in which this coordinate has this value.
    Slice(usize, f64),
    /// All along this axis.
    Along(usize),
}

/// A rectangle of the picture's plane, and its pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct View {
    /// Which coordinates go right and up.
    pub axes: [usize; 2],
    pub lo: [f64; 2],
    pub hi: [f64; 2],
    pub pixels: [usize; 2],
    pub depth: Depth,
}

/// Longest and shortest edge of a picture in pixels. Narrower bodies are not shown to scale.
const LONGEST: usize = 300;
const SHORTEST: usize = 60;
/// What is left free around a body, as a share of it.
const MARGIN: f64 = 0.03;

impl View {
    /// Of all particles.
    pub fn new(portrait: &Portrait, axes: [usize; 2], depth: Depth) -> Self {
        let (mut lo, mut hi) = ([0.0; 2], [0.0; 2]);
        for (i, &k) in axes.iter().enumerate() {
            let margin = if portrait.periodic[k] { 0.0 } else { MARGIN * (portrait.hi[k] - portrait.lo[k]) };
            (lo[i], hi[i]) = (portrait.lo[k] - margin, portrait.hi[k] + margin);
        }
        let longest = (hi[0] - lo[0]).max(hi[1] - lo[1]);
        for i in 0..2 {
            // All in one line.
            if !(hi[i] - lo[i] > 1e-6 * longest) {
                let half = 0.05 * if longest > 0.0 { longest } else { 1.0 };
                (lo[i], hi[i]) = (lo[i] - half, hi[i] + half);
            }
        }
        let pixels = [0, 1].map(|i| {
            let share = if longest > 0.0 { (hi[i] - lo[i]) / longest } else { 1.0 };
            ((LONGEST as f64 * share).round() as usize).clamp(SHORTEST, LONGEST)
        });
        Self { axes, lo, hi, pixels, depth }
    }

    /// The same rectangle with pixels about as large as `edge` of its own.
    pub fn coarse(&self, edge: usize) -> Self {
        Self { pixels: self.pixels.map(|n| n.div_ceil(edge).max(1)), ..*self }
    }

    pub fn pixel(&self) -> [f64; 2] {
        sph::array(|i| (self.hi[i] - self.lo[i]) / self.pixels[i] as f64)
    }
}

/// Points of a kernel's table.
const TABLE: usize = 512;

/// The kernel at q = r/H in `d` dimensions at unit support; along a line of sight, its integral.
fn table(kernel: KernelName, d: usize, is_column: bool) -> Vec<f64> {
    let shape = |q: f64| {
        with_kernel!(kernel, k => match d {
            1 => evaluate::<_, 1>(k, q).0,
            2 => evaluate::<_, 2>(k, q).0,
            _ => evaluate::<_, 3>(k, q).0,
        })
    };
    let column = |b: f64| {
        let end = (1.0 - b * b).max(0.0).sqrt();
        let steps = 64;
        // The midpoint rule, for a function that ends smoothly.
        (0..steps).map(|i| shape((b * b + (end * (i as f64 + 0.5) / steps as f64).powi(2)).sqrt())).sum::<f64>()
            * 2.0
            * end
            / steps as f64
    };
    let point = |i: usize| i as f64 / (TABLE - 1) as f64;
    (0..TABLE).map(|i| kernel.sigma(d) * if is_column { column(point(i)) } else { shape(point(i)) }).collect()
}

/// Bands of rows that threads take.
const BANDS: usize = 16;
/// Smallest support in pixels: what is finer is spread over a pixel.
const FINEST: f64 = 1.2;

/// Sums of `values` over the particles, times the kernel, for each pixel, row by row from the bottom.
pub(super) fn sums<const C: usize>(
    portrait: &Portrait,
    view: &View,
    values: impl Fn(usize) -> [f64; C] + Sync,
) -> Vec<[f64; C]> {
    let d = portrait.dimension;
    let is_column = matches!(view.depth, Depth::Along(_));
    let table = table(portrait.kernel, d, is_column);
    // A column of a 3-D kernel is one of two dimensions.
    let power = if is_column { d as i32 - 1 } else { d as i32 };
    let pixel = view.pixel();
    let finest = FINEST * pixel[0].max(pixel[1]);
    let [columns, rows] = view.pixels;
    let height = rows.div_ceil(BANDS);
    let band = |band: usize| {
        let (first, last) = ((band * height).min(rows), ((band + 1) * height).min(rows));
        let mut out = vec![[0.0; C]; (last - first) * columns];
        for i in 0..portrait.count() {
            let reach = portrait.detail.support[i].max(finest);
            let away = match view.depth {
                Depth::Slice(axis, at) => distance_along(portrait, axis, portrait.positions[i][axis], at),
                _ => 0.0,
            };
            if !(away < reach) {
                continue;
            }
            let value = values(i);
            let norm = reach.powi(power).recip();
            for x in images(portrait, view, 0, portrait.positions[i], reach) {
                for y in images(portrait, view, 1, portrait.positions[i], reach) {
                    let range = |center: f64, lo: f64, edge: f64, most: usize| {
                        let from = ((center - reach - lo) / edge - 0.5).ceil().max(0.0) as usize;
                        let to = ((center + reach - lo) / edge + 0.5).floor().clamp(0.0, most as f64) as usize;
                        (from, to)
                    };
                    let (x_from, x_to) = range(x, view.lo[0], pixel[0], columns);
                    let (y_from, y_to) = range(y, view.lo[1], pixel[1], rows);
                    for row in y_from.max(first)..y_to.min(last) {
                        let dy = view.lo[1] + (row as f64 + 0.5) * pixel[1] - y;
                        for column in x_from..x_to {
                            let dx = view.lo[0] + (column as f64 + 0.5) * pixel[0] - x;
                            let q = ((dx / reach).powi(2) + (dy / reach).powi(2) + (away / reach).powi(2)).sqrt();
                            if q >= 1.0 {
                                continue;
                            }
                            let place = q * (TABLE - 1) as f64;
                            let (k, t) = (place as usize, place.fract());
                            let w = norm * (table[k] + t * (table[(k + 1).min(TABLE - 1)] - table[k]));
                            let out = &mut out[(row - first) * columns + column];
                            (0..C).for_each(|c| out[c] += w * value[c]);
                        }
                    }
                }
            }
        }
        out
    };
    parallel::tasks(BANDS, band).concat()
}

/// Distance along an axis, around the box where it is periodic.
fn distance_along(portrait: &Portrait, k: usize, a: f64, b: f64) -> f64 {
    let away = (a - b).abs();
    let edge = portrait.hi[k] - portrait.lo[k];
    if portrait.periodic[k] { away.min((edge - away).abs()) } else { away }
}

/// Where a particle and its periodic images lie that reach into the view along its axis `i`.
fn images(portrait: &Portrait, view: &View, i: usize, x: [f64; 3], reach: f64) -> impl Iterator<Item = f64> {
    let k = view.axes[i];
    let edge = if portrait.periodic[k] { portrait.hi[k] - portrait.lo[k] } else { 0.0 };
    let (lo, hi) = (view.lo[i] - reach, view.hi[i] + reach);
    let shifts: &[f64] = if edge > 0.0 { &[-1.0, 0.0, 1.0] } else { &[0.0] };
    shifts.iter().map(move |s| x[k] + s * edge).filter(move |v| (lo..=hi).contains(v))
}
