//! The files of a comparison.

use super::comparison::Comparison;
use super::table::csv;
#[cfg(feature = "plots")]
use super::{figures, page};
use crate::error::{Error, Result};
use sph_formats::FormatError;
use std::path::Path;

/// The files of a comparison; the last two are figures of the page for the most particles, to show elsewhere: the
/// first one, and the density of the last method.
#[cfg(feature = "plots")]
pub const FILES: [&str; 5] =
    ["compare.csv", "compare.json", "report.html", "error-against-time.svg", "density-profile.svg"];

/// The files of a comparison.
#[cfg(not(feature = "plots"))]
pub const FILES: [&str; 2] = ["compare.csv", "compare.json"];

/// Whether the files could be written; makes the folder. Asked before a long comparison.
///
/// # Errors
/// [`FormatError::Io`].
pub fn probe(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| FormatError::io(folder, "create the folder", e))?;
    FILES.iter().try_for_each(|name| Ok(sph_formats::output::probe(&folder.join(name))?))
}

/// Writes the files, each whole or not at all.
///
/// # Errors
/// [`FormatError::Io`], or a plot that cannot be drawn.
pub fn write(comparison: &Comparison, folder: &Path) -> Result<()> {
    let texts = [csv(comparison), json(comparison)?].into_iter().chain(drawings(comparison)?);
    for (name, text) in FILES.iter().zip(texts) {
        sph_formats::output::atomically(&folder.join(name), |path| {
            std::fs::write(path, text).map_err(|e| FormatError::io(path, "write", e))
        })?;
    }
    Ok(())
}

/// The page and the figures to show elsewhere.
#[cfg(feature = "plots")]
fn drawings(comparison: &Comparison) -> Result<Vec<String>> {
    let most = comparison.counts().last().copied().unwrap_or(0);
    let figure = figures::error_against_time(comparison, most).file();
    let last = comparison.runs.iter().rfind(|r| r.particles == most);
    let profile = last.and_then(figures::profile).map_or_else(String::new, |figure| figure.file());
    Ok(vec![page::page(comparison)?, figure, profile])
}

#[cfg(not(feature = "plots"))]
fn drawings(_: &Comparison) -> Result<Vec<String>> {
    Ok(Vec::new())
}

/// As JSON.
///
/// # Errors
/// A figure that JSON cannot hold.
pub fn json(comparison: &Comparison) -> Result<String> {
    serde_json::to_string_pretty(comparison)
        .map(|text| text + "\n")
        .map_err(|e| Error::Numeric { stage: "report", problem: e.to_string() })
}
