//! From pixels to a grid.

use super::{PNG, SPEC, png, tiff};
use crate::error::{FormatError, Result};
use crate::limits::Budget;
use crate::model::{Coordinates, Geometry, GridAxis, Location, RawField, Values, Variable};
use crate::registry::{FieldRequest, FileContent};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Weights of red, green and blue in the luminance (Rec. ITU-R BT.709-6, item 3.2).
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];
/// The only variable.
const DENSITY: &str = "density";

/// A decoded image, rows from the top.
pub struct Picture {
    pub width: usize,
    pub height: usize,
    /// Interleaved: gray or three colors, and alpha behind them.
    pub channels: usize,
    pub alpha: bool,
    pub values: Values,
    /// What is divided by.
    pub white: f64,
}

pub fn error(path: &Path, problem: impl Into<String>) -> FormatError {
    FormatError::input(path, SPEC.name, "image", problem)
}

/// Reads the first image of a file.
///
/// # Errors
/// [`FormatError::Input`] where it is damaged, [`FormatError::Unsupported`] for kinds of pixels that are no density,
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
        format: SPEC.name,
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

impl Picture {
    /// Row by row from the bottom.
    fn densities(&self, path: &Path) -> Result<Values> {
        let expected = self.width.checked_mul(self.height).and_then(|n| n.checked_mul(self.channels));
        if expected != Some(self.values.len()) {
            let (w, h) = (self.width, self.height);
            return Err(error(path, format!("has {} numbers for {w} x {h} pixels", self.values.len())));
        }
        let opaque = (self.channels.saturating_sub(1)..self.values.len()).step_by(self.channels.max(1));
        if self.alpha && opaque.into_iter().any(|i| self.values.get(i) != self.white) {
            return Err(FormatError::Unsupported {
                path: path.into(),
                format: SPEC.name,
                what: "an image that is transparent in places; flatten it onto black or white first".into(),
            });
        }
        let colors = self.channels - usize::from(self.alpha);
        let density = |pixel: usize| {
            let first = pixel * self.channels;
            let value = match colors {
                1 => self.values.get(first),
                _ => LUMINANCE.iter().enumerate().map(|(c, weight)| weight * self.values.get(first + c)).sum(),
            };
            value / self.white
        };
        let upward = (0..self.height).rev().flat_map(|row| (0..self.width).map(move |x| row * self.width + x));
        Ok(match self.values {
            Values::F32(_) => Values::F32(upward.map(|p| density(p) as f32).collect()),
            _ => Values::F64(upward.map(density).collect()),
        })
    }
}
