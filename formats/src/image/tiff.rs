//! TIFF, through the `tiff` crate.

use super::picture::{Picture, error};
use super::schema::NAME;
use crate::error::{FormatError, Result};
use crate::limits::Budget;
use crate::model::Values;
use std::io::{BufRead, Seek};
use std::path::Path;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;
use tiff::{ColorType, TiffError};

/// The `PlanarConfiguration` of interleaved channels.
const INTERLEAVED: u16 = 1;
/// The `Orientation` of pictures whose first row is on top and whose first column is left.
const UPRIGHT: u16 = 1;
/// Bytes of a sample at most, as stored and as read.
const SAMPLE_BYTES: u64 = 16;

pub fn decode(path: &Path, file: impl BufRead + Seek, budget: &Budget, notes: &mut Vec<String>) -> Result<Picture> {
    let fault = |e: TiffError| match e {
        TiffError::UnsupportedError(e) => unsupported(path, e.to_string()),
        TiffError::IoError(e) if e.kind() != std::io::ErrorKind::UnexpectedEof => FormatError::io(path, "read", e),
        e => error(path, format!("cannot be decoded: {e}; the file is damaged or incomplete")),
    };
    let cap = usize::try_from(budget.left()).unwrap_or(usize::MAX);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = cap;
    limits.intermediate_buffer_size = cap;
    let mut decoder = Decoder::new(file).map_err(fault)?.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(fault)?;
    let color = decoder.colortype().map_err(fault)?;
    let (channels, alpha) = match color {
        ColorType::Gray(_) => (1, false),
        ColorType::GrayA(_) => (2, true),
        ColorType::RGB(_) => (3, false),
        ColorType::RGBA(_) => (4, true),
        other => return Err(unsupported(path, format!("colors of type {other:?}; save it in gray or RGB"))),
    };
    let mut tag = |tag: Tag, usual: u16| decoder.find_tag_unsigned(tag).map(|found| found.unwrap_or(usual));
    if channels > 1 && tag(Tag::PlanarConfiguration, INTERLEAVED).map_err(fault)? != INTERLEAVED {
        return Err(unsupported(path, "channels in separate planes; save them interleaved".into()));
    }
    let orientation = tag(Tag::Orientation, UPRIGHT).map_err(fault)?;
    if orientation != UPRIGHT {
        return Err(unsupported(path, format!("orientation {orientation}; save it upright")));
    }
    let samples = u64::from(width).saturating_mul(u64::from(height)).saturating_mul(channels as u64);
    budget.take(path, NAME, "image", samples.saturating_mul(SAMPLE_BYTES))?;
    let decoded = decoder.read_image().map_err(fault)?;
    if decoder.more_images() {
        notes.push("the file has several images; the first was read".into());
    }
    let depth = color.bit_depth();
    let (values, white) = numbers(path, decoded, depth)?;
    Ok(Picture { width: width as usize, height: height as usize, channels, alpha, values, white })
}

fn unsupported(path: &Path, what: String) -> FormatError {
    FormatError::Unsupported { path: path.into(), format: NAME, what }
}

/// The samples, and the number that is white: 1 where they are densities themselves.
fn numbers(path: &Path, decoded: DecodingResult, depth: u8) -> Result<(Values, f64)> {
    fn f64s<T: Copy>(v: &[T], f: impl Fn(T) -> f64) -> Values {
        Values::F64(v.iter().map(|&x| f(x)).collect())
    }
    let white = f64::from(2.0_f32.powi(i32::from(depth.min(16))) - 1.0);
    Ok(match decoded {
        DecodingResult::U8(v) if depth == 8 => (Values::F32(v.into_iter().map(f32::from).collect()), white),
        DecodingResult::U8(_) => return Err(unsupported(path, format!("{depth} bits; save it with 8 or 16"))),
        DecodingResult::U16(v) => (Values::F32(v.into_iter().map(f32::from).collect()), white),
        DecodingResult::F16(v) => (Values::F32(v.into_iter().map(f32::from).collect()), 1.0),
        DecodingResult::F32(v) => (Values::F32(v), 1.0),
        DecodingResult::F64(v) => (Values::F64(v), 1.0),
        DecodingResult::U32(v) => (f64s(&v, f64::from), 1.0),
        DecodingResult::U64(v) => (f64s(&v, |x| x as f64), 1.0),
        DecodingResult::I8(v) => (f64s(&v, f64::from), 1.0),
        DecodingResult::I16(v) => (f64s(&v, f64::from), 1.0),
        DecodingResult::I32(v) => (f64s(&v, f64::from), 1.0),
        DecodingResult::I64(v) => (f64s(&v, |x| x as f64), 1.0),
    })
}
