//! A decoded image, from either decoder, and the densities that its colors represent.

use super::schema::NAME;
use crate::error::{FormatError, Result};
use crate::model::Values;
use std::path::Path;

/// Weights of red, green and blue in the luminance (Rec. ITU-R BT.709-6, item 3.2).
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];
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

impl Picture {
    /// Row by row from the bottom.
    pub fn densities(&self, path: &Path) -> Result<Values> {
        let expected = self.width.checked_mul(self.height).and_then(|n| n.checked_mul(self.channels));
        if expected != Some(self.values.len()) {
            let (w, h) = (self.width, self.height);
            return Err(error(path, format!("has {} numbers for {w} x {h} pixels", self.values.len())));
        }
        let opaque = (self.channels.saturating_sub(1)..self.values.len()).step_by(self.channels.max(1));
        if self.alpha && opaque.into_iter().any(|i| self.values.get(i) != self.white) {
            return Err(FormatError::Unsupported {
                path: path.into(),
                format: NAME,
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

pub fn error(path: &Path, problem: impl Into<String>) -> FormatError {
    FormatError::input(path, NAME, "image", problem)
}
