//! Sections that the pages of runs and of files share.

use super::figure::Figure;
use super::portrait::Portrait;
use super::{maps, profile, statistics};
use crate::error::Result;

fn figures(all: impl IntoIterator<Item = String>) -> String {
    let all: String = all.into_iter().collect();
    if all.is_empty() { all } else { format!("<div class=\"figures\">\n{all}</div>\n") }
}

/// Maps of density, error, motion and materials.
///
/// # Errors
/// A picture that cannot be encoded.
pub fn pictures(portrait: &Portrait) -> Result<String> {
    if portrait.dimension == 1 {
        return Ok("<p>In one dimension the profile shows all that a map would.</p>\n".into());
    }
    Ok(figures(maps::all(portrait)?))
}

/// Density against target, and the error, over the radius or along an axis.
pub fn profiles(portrait: &Portrait) -> String {
    figures(profile::figures(portrait).iter().map(Figure::html))
}

/// Error, force noise and distances.
pub fn histograms(portrait: &Portrait) -> String {
    figures(statistics::figures(portrait).iter().map(Figure::html))
}

/// The density in a slice, or as it is in 2-D; none in 1-D.
///
/// # Errors
/// A picture that cannot be encoded.
pub fn density_map(portrait: &Portrait, title: &str) -> Result<Option<String>> {
    maps::density(portrait, title)
}

/// The error in the same place, with colors up to `range` per cent.
///
/// # Errors
/// A picture that cannot be encoded.
pub fn error_map(portrait: &Portrait, title: &str, range: f64) -> Result<Option<String>> {
    maps::error(portrait, title, range)
}

/// Density against target.
pub fn density_profile(portrait: &Portrait) -> Option<Figure> {
    profile::figures(portrait).into_iter().next()
}
