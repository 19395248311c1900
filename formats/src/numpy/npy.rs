//! One array in NumPy's own layout: magic, version, a Python dictionary as text, then the bare values.

use super::schema::{MAGIC, NAME};
use crate::error::{FormatError, Result};
use crate::limits::MAX_VARIABLE_BYTES;
use crate::model::Values;
use std::io::Read;
use std::path::Path;

/// Longest header that is read; NumPy itself stops at 10000 characters.
const MAX_HEADER: usize = 1 << 16;
/// Bytes decoded at a time.
const CHUNK: usize = 1 << 16;

/// An array as stored.
#[derive(Debug)]
pub struct Array {
    pub shape: Vec<usize>,
    /// The first index runs fastest.
    pub fortran: bool,
    pub content: Content,
}

#[derive(Debug)]
pub enum Content {
    Numbers(Values),
    /// One text (`S` of no dimension).
    Text(String),
}

/// Where an array is, for messages.
pub struct Place<'a> {
    pub path: &'a Path,
    pub name: &'a str,
}

impl Place<'_> {
    pub fn error(&self, problem: impl Into<String>) -> FormatError {
        FormatError::input(self.path, NAME, format!("array '{}'", self.name), problem)
    }

    fn io(&self, e: std::io::Error) -> FormatError {
        match e.kind() {
            std::io::ErrorKind::UnexpectedEof => self.error("the file ends within it; it is truncated"),
            std::io::ErrorKind::InvalidData | std::io::ErrorKind::InvalidInput | std::io::ErrorKind::Other => {
                self.error(format!("its archive is damaged: {e}"))
            }
            _ => FormatError::io(self.path, "read", e),
        }
    }
}

/// Reads an array from `source`, which holds `length` bytes at most.
///
/// # Errors
/// [`FormatError::Input`], [`FormatError::Unsupported`], [`FormatError::Limit`], [`FormatError::Io`].
pub fn read(place: &Place<'_>, source: &mut impl Read, length: u64) -> Result<Array> {
    let text = read_header(place, source)?;
    let descr = field(&text, "descr").ok_or_else(|| place.error("its header names no 'descr'"))?;
    let fortran = match field(&text, "fortran_order") {
        Some("True") => true,
        Some("False") => false,
        other => return Err(place.error(format!("fortran_order is {other:?}, expected True or False"))),
    };
    let shape =
        field(&text, "shape").and_then(shape).ok_or_else(|| place.error("its header has no shape in numbers"))?;
    let kind = kind(descr).ok_or_else(|| FormatError::Unsupported {
        path: place.path.into(),
        format: NAME,
        what: format!("array '{}' of type {descr}; save plain numbers of 16 to 64 bits", place.name),
    })?;
    let count = shape.iter().try_fold(1_u64, |n, &d| n.checked_mul(d as u64)).unwrap_or(u64::MAX);
    let bytes = count.saturating_mul(kind.width as u64);
    if bytes > length.min(MAX_VARIABLE_BYTES) {
        return Err(FormatError::Limit {
            path: place.path.into(),
            format: NAME,
            location: format!("array '{}'", place.name),
            declared: format!("{bytes} bytes"),
            allowed: format!("the {length} that the file has for it"),
        });
    }
    if kind.letter == 'S' && shape.is_empty() {
        let mut text = vec![0; kind.width];
        source.read_exact(&mut text).map_err(|e| place.io(e))?;
        let text = String::from_utf8_lossy(&text).trim_end_matches('\0').to_owned();
        return Ok(Array { shape, fortran, content: Content::Text(text) });
    }
    let count = usize::try_from(count).map_err(|_| place.error("it is too long for this machine"))?;
    let values = numbers(place, source, kind, count)?;
    Ok(Array { shape, fortran, content: Content::Numbers(values) })
}

fn read_header(place: &Place<'_>, source: &mut impl Read) -> Result<String> {
    let mut start = [0; 8];
    source.read_exact(&mut start).map_err(|e| place.io(e))?;
    let [.., major, _] = start;
    if !start.starts_with(MAGIC) || !(1..=3).contains(&major) {
        return Err(place.error("does not begin as a NumPy array of version 1 to 3"));
    }
    let mut bytes = [0; 4];
    let width = if major == 1 { 2 } else { 4 };
    if let Some(b) = bytes.get_mut(..width) {
        source.read_exact(b).map_err(|e| place.io(e))?;
    }
    let length = u32::from_le_bytes(bytes) as usize;
    if length > MAX_HEADER {
        return Err(place.error(format!("its header has {length} bytes, expected at most {MAX_HEADER}")));
    }
    let mut text = vec![0; length];
    source.read_exact(&mut text).map_err(|e| place.io(e))?;
    String::from_utf8(text).map_err(|_| place.error("its header is not text"))
}

/// The value of a key in the header's dictionary, without quotes.
fn field<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let rest = [format!("'{key}'"), format!("\"{key}\"")].iter().find_map(|k| text.split_once(k.as_str()))?.1;
    let value = rest.trim_start().strip_prefix(':')?.trim_start();
    let end = match value.chars().next()? {
        '(' => value.find(')')? + 1,
        quote @ ('\'' | '"') => return value.get(1..)?.split(quote).next(),
        '[' => value.find(']')? + 1,
        _ => value.find([',', '}'])?,
    };
    value.get(..end).map(str::trim)
}

fn shape(text: &str) -> Option<Vec<usize>> {
    let inner = text.strip_prefix('(')?.strip_suffix(')')?;
    inner.split(',').map(str::trim).filter(|d| !d.is_empty()).map(|d| d.trim_end_matches('L').parse().ok()).collect()
}

#[derive(Clone, Copy)]
struct Kind {
    big_endian: bool,
    letter: char,
    width: usize,
}

fn kind(descr: &str) -> Option<Kind> {
    let order = descr.chars().next()?;
    let letter = descr.chars().nth(1)?;
    let width = descr.get(2..)?.parse().ok()?;
    let known = matches!((letter, width), ('f', 2 | 4 | 8) | ('i' | 'u', 1 | 2 | 4 | 8) | ('b', 1))
        || letter == 'S' && width <= MAX_HEADER * 256;
    (known && matches!(order, '<' | '>' | '|' | '=')).then_some(Kind { big_endian: order == '>', letter, width })
}

fn numbers(place: &Place<'_>, source: &mut impl Read, kind: Kind, count: usize) -> Result<Values> {
    let bad = || place.error("an integer is larger than 2^63 - 1");
    Ok(match (kind.letter, kind.width) {
        ('f', 2) => Values::F32(decode(place, source, kind, count, |b| Some(half(u16::from_le_bytes(b))))?),
        ('f', 4) => Values::F32(decode(place, source, kind, count, |b| Some(f32::from_le_bytes(b)))?),
        ('f', 8) => Values::F64(decode(place, source, kind, count, |b| Some(f64::from_le_bytes(b)))?),
        ('i', 1) => Values::I64(decode(place, source, kind, count, |b| Some(i8::from_le_bytes(b).into()))?),
        ('i', 2) => Values::I64(decode(place, source, kind, count, |b| Some(i16::from_le_bytes(b).into()))?),
        ('i', 4) => Values::I64(decode(place, source, kind, count, |b| Some(i32::from_le_bytes(b).into()))?),
        ('i', 8) => Values::I64(decode(place, source, kind, count, |b| Some(i64::from_le_bytes(b)))?),
        ('u' | 'b', 1) => Values::I64(decode(place, source, kind, count, |b| Some(u8::from_le_bytes(b).into()))?),
        ('u', 2) => Values::I64(decode(place, source, kind, count, |b| Some(u16::from_le_bytes(b).into()))?),
        ('u', 4) => Values::I64(decode(place, source, kind, count, |b| Some(u32::from_le_bytes(b).into()))?),
        ('u', 8) => Values::I64(decode(place, source, kind, count, |b| i64::try_from(u64::from_le_bytes(b)).ok())?),
        _ => return Err(bad()),
    })
}

fn decode<T, const W: usize>(
    place: &Place<'_>,
    source: &mut impl Read,
    kind: Kind,
    count: usize,
    value: impl Fn([u8; W]) -> Option<T>,
) -> Result<Vec<T>> {
    // Grown as data comes: an archive's own statement of the length may be wrong.
    let mut values = Vec::new();
    let mut buffer = vec![0; CHUNK];
    while values.len() < count {
        let (chunk, _) = buffer.split_at_mut(CHUNK.min((count - values.len()) * W));
        source.read_exact(chunk).map_err(|e| place.io(e))?;
        for word in chunk.as_chunks_mut::<W>().0 {
            if kind.big_endian {
                word.reverse();
            }
            values.push(value(*word).ok_or_else(|| place.error("an integer is larger than 2^63 - 1"))?);
        }
    }
    Ok(values)
}

/// IEEE 754 half precision.
fn half(bits: u16) -> f32 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f32::from(bits & 0x3ff));
    sign * match exponent {
        0 => fraction * 2.0_f32.powi(-24),
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        e => (1.0 + fraction / 1024.0) * 2.0_f32.powi(e - 15),
    }
}

/// Magic, version and dictionary, padded so that the data begins at a multiple of 64 bytes.
pub fn header(descr: &str, shape: &[usize]) -> Vec<u8> {
    let dims: String = shape.iter().map(|d| format!("{d},")).collect();
    let dict = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({dims}), }}");
    let total = (10 + dict.len() + 1).next_multiple_of(64);
    let mut bytes = Vec::with_capacity(total);
    bytes.extend(MAGIC);
    bytes.extend([1, 0]);
    bytes.extend(((total - 10) as u16).to_le_bytes());
    bytes.extend(dict.as_bytes());
    bytes.resize(total - 1, b' ');
    bytes.push(b'\n');
    bytes
}

/// From the order in which the first index of `shape` runs fastest to the one in which the last does.
pub(super) fn transposed(values: &Values, shape: &[usize]) -> Values {
    fn reorder<T: Copy>(v: &[T], shape: &[usize]) -> Vec<T> {
        let source = |mut flat: usize| {
            // Digits of the target index, the last fastest; strides of the source, the first fastest.
            let mut index = 0;
            let mut stride: usize = shape.iter().product();
            for &n in shape.iter().rev() {
                stride /= n.max(1);
                index += flat % n.max(1) * stride;
                flat /= n.max(1);
            }
            index
        };
        (0..v.len()).filter_map(|flat| v.get(source(flat)).copied()).collect()
    }
    match values {
        Values::F32(v) => Values::F32(reorder(v, shape)),
        Values::F64(v) => Values::F64(reorder(v, shape)),
        Values::I64(v) => Values::I64(reorder(v, shape)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_ieee() {
        for (bits, value) in [(0x3c00, 1.0), (0xc000, -2.0), (0x7bff, 65504.0), (0x0001, 5.960_464_5e-8), (0, 0.0)] {
            assert_eq!(half(bits), value);
        }
        assert!(half(0x7e00).is_nan() && half(0xfc00) == f32::NEG_INFINITY);
    }

    #[test]
    fn headers_are_read_in_pythons_ways_of_writing() {
        let text = "{'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }";
        assert_eq!((field(text, "descr"), field(text, "shape").and_then(shape)), (Some("<f8"), Some(vec![3, 4])));
        assert_eq!(field("{\"shape\": (5,), \"descr\": [('x', '<f8')]}", "descr"), Some("[('x', '<f8')]"));
        assert_eq!((shape("()"), shape("(7L,)"), shape("(x,)")), (Some(vec![]), Some(vec![7]), None));
        assert!(header("<f4", &[3, 2]).len().is_multiple_of(64));
    }
}
