//! The meaning of columns x, y, z beside a radius: the mass fractions X, Y, Z of a star, or coordinates.

use super::sheet::Sheet;
use crate::common::text::Text;
use crate::error::Result;

/// Digits that tables keep at least: how far fractions may miss their sum, relative to 1.
const FRACTION_SLACK: f64 = 1e-2;
/// How far a radius may be from the distance of its point, relative to the largest.
const RADIUS_SLACK: f64 = 1e-3;

/// What stands beside a radius.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Beside {
    /// Nothing, a lone x, or mass fractions: the radius is the only coordinate.
    Fractions,
    /// Coordinates, of which the radius is a function.
    Coordinates,
}

/// Judges the columns `axes` (x, y, z) by the numbers in them.
///
/// # Errors
/// [`crate::FormatError::Input`] where they may be either.
pub fn beside_radius(text: &Text, sheet: &Sheet, radius: usize, axes: &[Option<usize>]) -> Result<Beside> {
    // A lone x is a fraction of hydrogen or a scaled radius.
    if axes.get(1).copied().flatten().is_none() {
        return Ok(Beside::Fractions);
    }
    let column = |i: usize| sheet.columns.get(i).map(|c| c.values.as_slice());
    let others: Vec<&[f64]> = axes.iter().flatten().filter_map(|i| column(*i)).collect();
    let radii = column(radius).unwrap_or_default();
    if are_distances(radii, &others) {
        return Ok(Beside::Coordinates);
    }
    if are_fractions(&others, others.len() == axes.len()) && is_monotonic(radii) {
        return Ok(Beside::Fractions);
    }
    let name = |i: usize| sheet.columns.get(i).map_or("", |c| c.heading.name.as_str());
    let names: Vec<&str> = axes.iter().flatten().map(|i| name(*i)).collect();
    let problem = format!(
        "there are '{}' and {}, which may be a profile with mass fractions or points in space; rename the radius, or \
         those others, so that one kind of coordinate is left",
        name(radius),
        names.join(", ")
    );
    Err(text.error("coordinates", problem))
}

fn are_distances(radii: &[f64], coordinates: &[&[f64]]) -> bool {
    let square = |row: usize| coordinates.iter().filter_map(|c| c.get(row)).map(|x| x * x).sum::<f64>();
    let largest = radii.iter().copied().fold(0.0, f64::max);
    largest > 0.0 && (0..radii.len()).zip(radii).all(|(i, r)| (square(i).sqrt() - r).abs() <= RADIUS_SLACK * largest)
}

/// Whether numbers are fractions of a whole, of which `all` parts are there.
fn are_fractions(parts: &[&[f64]], all: bool) -> bool {
    let rows = parts.first().map_or(0, |p| p.len());
    (0..rows).all(|i| {
        let row = || parts.iter().filter_map(|p| p.get(i)).copied();
        let sum: f64 = row().sum();
        row().all(|x| (0.0..=1.0 + FRACTION_SLACK).contains(&x))
            && sum <= 1.0 + FRACTION_SLACK
            && (!all || sum >= 1.0 - FRACTION_SLACK)
    })
}

fn is_monotonic(radii: &[f64]) -> bool {
    radii.windows(2).all(|w| w[0] <= w[1]) || radii.windows(2).all(|w| w[0] >= w[1])
}
