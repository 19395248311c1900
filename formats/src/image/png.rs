//! PNG, through the `png` crate.

use super::picture::{Picture, error};
use super::schema::NAME;
use crate::error::{FormatError, Result};
use crate::limits::Budget;
use crate::model::Values;
use png::{BitDepth, ColorType, Decoder, DecodingError, Limits, Transformations};
use std::io::{BufRead, Seek};
use std::path::Path;

pub fn decode(path: &Path, file: impl BufRead + Seek, budget: &Budget) -> Result<Picture> {
    let fault = |e: DecodingError| match e {
        DecodingError::IoError(e) if e.kind() != std::io::ErrorKind::UnexpectedEof => FormatError::io(path, "read", e),
        DecodingError::LimitsExceeded => FormatError::Limit {
            path: path.into(),
            format: NAME,
            location: "image".into(),
            declared: "more memory".into(),
            allowed: format!("the {} bytes that are left to a file of its size", budget.left()),
        },
        e => error(path, format!("cannot be decoded: {e}; the file is damaged or incomplete")),
    };
    let bytes = usize::try_from(budget.left()).unwrap_or(usize::MAX);
    let mut decoder = Decoder::new_with_limits(file, Limits { bytes });
    // Palettes become colors, and fewer bits than 8 become 8.
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(fault)?;
    let (color, depth) = reader.output_color_type();
    let channels = color.samples();
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    let width_of_sample = if depth == BitDepth::Sixteen { 2 } else { 1 };
    // Beside the bytes themselves, their numbers as f32.
    let samples = (width as u64).saturating_mul(height as u64).saturating_mul(channels as u64);
    budget.take(path, NAME, "image", samples.saturating_mul(4 + width_of_sample))?;
    let size = reader.output_buffer_size().ok_or_else(|| error(path, "is too large for this machine"))?;
    let mut bytes = vec![0; size];
    let frame = reader.next_frame(&mut bytes).map_err(fault)?;
    // Checksums and the end of the file come behind the picture.
    reader.finish().map_err(fault)?;
    bytes.truncate(frame.buffer_size());
    let (values, white) = if depth == BitDepth::Sixteen {
        (bytes.as_chunks().0.iter().map(|b| f32::from(u16::from_be_bytes(*b))).collect(), f64::from(u16::MAX))
    } else {
        (bytes.iter().map(|b| f32::from(*b)).collect(), f64::from(u8::MAX))
    };
    let alpha = matches!(color, ColorType::GrayscaleAlpha | ColorType::Rgba);
    Ok(Picture { width, height, channels, alpha, values: Values::F32(values), white })
}
