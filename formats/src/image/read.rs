//! From pixels to a grid.

use super::picture::error;
use super::schema::{NAME, PNG};
use super::{png, tiff};
use crate::error::{FormatError, Result};
use crate::limits::Budget;
use crate::model::{Coordinates, Geometry, GridAxis, Location, RawField, Variable};
use crate::registry::{FieldRequest, FileContent};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// The only variable.
const DENSITY: &str = "density";

/// Reads the first image of a file.
///
/// # Errors
/// [`FormatError::Input`] where it is damaged, [`FormatError::Unsupported`] for pixels that are not densities,
/// [`FormatError::Limit`], [`FormatError::Io`].
pub fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let file = File::open(path).map_err(|e| FormatError::io(path, "open", e))?;
    let length = file.metadata().map_err(|e| FormatError::io(path, "open", e))?.len();
    let mut file = BufReader::new(file);
    let is_png = file.fill_buf().map_err(|e| FormatError::io(path, "read", e))?.starts_with(PNG);
    let budget = Budget::new(length);
    let mut notes = vec!["the image is 1 wide, its top row has the largest y; black is vacuum".to_owned()];
    let picture =
        if is_png { png::decode(path, file, &budget)? } else { tiff::decode(path, file, &budget, &mut notes)? };
    if let Some(name) = request.density.as_ref().filter(|n| *n != DENSITY) {
        return Err(error(path, format!("has no variable '{name}'; its pixels are '{DENSITY}'")));
    }
    if picture.channels > 2 {
        notes.push("the colors were turned into their luminance".into());
    }
    let values = picture.densities(path)?;
    let (w, h) = (picture.width, picture.height);
    let axes: Vec<GridAxis> =
        [("x", w), ("y", h)].into_iter().filter(|(_, n)| *n > 1).map(|(name, n)| axis(name, n, w.max(1))).collect();
    if axes.is_empty() {
        return Err(error(path, format!("has {w} x {h} pixels, expected more than one")));
    }
    Ok(FileContent::Field(RawField {
        path: path.into(),
        format: NAME,
        geometry: Geometry::Grid { coordinates: Coordinates::Cartesian, axes },
        variables: vec![Variable {
            name: DENSITY.into(),
            description: None,
            unit: None,
            location: Location::Node,
            components: 1,
            values,
        }],
        density: Some(DENSITY.into()),
        metadata: vec![("pixels".into(), format!("{w} x {h}"))],
        notes,
    }))
}

/// `n` cells of the width of a pixel, `across` of which are 1 wide.
fn axis(name: &str, n: usize, across: usize) -> GridAxis {
    let at = |i: f64| i / across as f64;
    GridAxis {
        name: name.into(),
        nodes: (0..n).map(|i| at(i as f64 + 0.5)).collect(),
        unit: None,
        bounds: Some((0..=n).map(|i| at(i as f64)).collect()),
    }
}
