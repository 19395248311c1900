//! A small image of the density of particles, without axes.

use super::axis::Axis;
use super::color::sequential;
use super::image::Image;
use super::map::Scale;
use super::maps::{density_shades, first_view};
use super::portrait::Portrait;
use super::profile::binned;
use crate::error::Result;

/// Height over width of the picture of a profile.
const SHAPE: (usize, usize) = (300, 180);

/// The density as a PNG file: a slice through the middle of a body in 3-D, all of it in 2-D, its profile in 1-D. What the colors
/// mean is in the file as text.
///
/// # Errors
/// A picture that cannot be encoded.
pub fn picture(portrait: &Portrait) -> Result<Vec<u8>> {
    let Some(view) = first_view(portrait) else { return profile(portrait) };
    let (values, scale) = density_shades(portrait, &view);
    let image = scale.image(view.pixels, &values);
    let Scale::Sequential(axis, (lo, hi)) = scale else { return image.png(&[]) };
    let value = |v: f64| if axis.logarithmic { 10f64.powf(v) } else { v };
    let kind = if axis.logarithmic { "logarithmic" } else { "linear" };
    let meaning = format!("{}, {kind}, from {:e} (dark) to {:e} (light)", axis.label, value(lo), value(hi));
    let extent =
        |i: usize| format!("{} from {:e} to {:e}", portrait.length_label(["x", "y"][i]), view.lo[i], view.hi[i]);
    image.png(&[("Title", meaning), ("Description", format!("{}; {}", extent(0), extent(1)))])
}

/// Columns as high as the density.
fn profile(portrait: &Portrait) -> Result<Vec<u8>> {
    let bins = binned(portrait, SHAPE.0 / 2);
    let factor = portrait.labels.density_factor;
    let densities: Vec<f64> = bins.iter().map(|b| b.density.mean * factor).collect();
    let axis = Axis::for_values(portrait.density_label(), densities.iter().copied());
    let (lo, hi) = axis.ends(densities.iter().filter_map(|v| axis.place(*v)));
    let lo = if axis.logarithmic { lo } else { lo.min(0.0) };
    let (first, last) = (portrait.lo[0], portrait.hi[0].max(portrait.lo[0] + f64::MIN_POSITIVE));
    let mut values = vec![f64::NAN; SHAPE.0 * SHAPE.1];
    for column in 0..SHAPE.0 {
        let x = first + (column as f64 + 0.5) / SHAPE.0 as f64 * (last - first);
        let Some((_, rho)) = bins.iter().zip(&densities).find(|(b, _)| x <= b.to) else { continue };
        let share = axis.place(*rho).map_or(0.0, |v| (v - lo) / (hi - lo));
        let top = (share * SHAPE.1 as f64) as usize;
        (0..top.min(SHAPE.1)).for_each(|row| values[row * SHAPE.0 + column] = share);
    }
    let meaning = format!("{} against {}", axis.label, portrait.length_label("x"));
    Image::shaded(SHAPE, &values, sequential).png(&[("Title", meaning)])
}
