//! Pages and images: self-contained HTML, with figures as inline SVG, readable on a phone, in print, and in light and dark mode.
//!
//! Knows particles and figures; what a run says of itself comes from [`mod@crate::run`], what a comparison says from
//! [`crate::compare`].

mod axis;
mod color;
mod figure;
mod html;
mod image;
mod map;
mod maps;
mod of_file;
mod picture;
mod portrait;
mod profile;
mod raster;
mod sections;
mod statistics;

pub use axis::Axis;
pub use color::CURVES;
pub use figure::{Band, Curve, Figure, Mark};
pub use html::{Page, escape, list, table};
pub use of_file::page_of_file;
pub use picture::picture;
pub use portrait::{Portrait, Seen, Side};
pub use sections::{density_map, density_profile, error_map, histograms, pictures, profiles};

use crate::error::Result;
use sph_formats::FormatError;
use std::path::Path;

/// Writes a page or a picture, whole or not at all.
///
/// # Errors
/// [`FormatError::Io`].
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    Ok(sph_formats::output::atomically(path, |temporary| {
        std::fs::write(temporary, bytes).map_err(|e| FormatError::io(path, "write", e))
    })?)
}
