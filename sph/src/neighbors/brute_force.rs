//! Neighbors found by checking every pair and image in f64; used as the reference in tests.

use crate::domain::Domain;

/// Calls `visit(displacement, j)` for every particle or image `j` within `radius` of `x`, itself included.
pub fn for_each_within<const D: usize>(
    domain: &Domain<D>,
    positions: &[Vec<f64>; D],
    x: &[f64; D],
    radius: f64,
    mut visit: impl FnMut([f64; D], usize),
) {
    let images: [_; D] = std::array::from_fn(|k| domain.axis_images(k, x[k] - radius, x[k] + radius));
    let combinations: usize = images.iter().map(Vec::len).product();
    for j in 0..positions[0].len() {
        for mut combination in 0..combinations {
            let d: [f64; D] = crate::array(|k| {
                let image = images[k][combination % images[k].len()];
                combination /= images[k].len();
                image.apply(positions[k][j]) - x[k]
            });
            if d.iter().map(|v| v * v).sum::<f64>() < radius * radius {
                visit(d, j);
            }
        }
    }
}
