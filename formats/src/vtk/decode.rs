//! Arrays of XML files: ASCII, base64 and raw data, with zlib, LZ4 and LZMA blocks.

use super::dataset::DataArray;
use super::element::{Attributes, Element};
use super::schema::NAME;
use crate::error::{FormatError, Result};
use crate::limits::Budget;
use crate::model::Values;
use base64::Engine;
use std::io::Read;
use std::path::Path;

/// More components than this are not one quantity; tensors have 9.
const MAX_COMPONENTS: usize = 4096;

/// Whether an attribute of the file has the second of its two values; the first stands where there is none.
fn one_of(path: &Path, file: &Attributes, key: &str, values: [&str; 2]) -> Result<bool> {
    match file.get(key) {
        None => Ok(false),
        Some(value) if values.contains(&value.as_str()) => Ok(value == values[1]),
        Some(value) => {
            let problem = format!("is '{value}', expected {} or {}", values[0], values[1]);
            Err(FormatError::input(path, NAME, format!("attribute {key} of VTKFile"), problem))
        }
    }
}

/// How the file encodes its arrays.
pub(super) struct Decoder<'a> {
    path: &'a Path,
    wide_header: bool,
    big_endian: bool,
    compressor: Option<String>,
    /// Appended data behind the underscore, and whether it is raw.
    appended: &'a [u8],
    raw: bool,
    pub file_bytes: usize,
    budget: Budget,
}

impl<'a> Decoder<'a> {
    pub fn new(path: &'a Path, file: &Attributes, tail: &'a [u8], file_bytes: usize) -> Result<Self> {
        let head_end = tail.iter().position(|&b| b == b'>').map_or(tail.len(), |i| i + 1);
        let raw = String::from_utf8_lossy(&tail[..head_end]).contains("raw");
        let start = tail[head_end..].iter().position(|&b| b == b'_').map_or(tail.len(), |i| head_end + i + 1);
        Ok(Self {
            path,
            wide_header: one_of(path, file, "header_type", ["UInt32", "UInt64"])?,
            big_endian: one_of(path, file, "byte_order", ["LittleEndian", "BigEndian"])?,
            compressor: file.get("compressor").cloned(),
            appended: &tail[start..],
            raw,
            file_bytes,
            budget: Budget::new(file_bytes as u64),
        })
    }

    pub fn array(&self, element: &Element) -> Result<DataArray> {
        let attribute = |key: &str| element.attributes.get(key).map_or("", String::as_str);
        let name = attribute("Name").to_owned();
        let broken = |problem: String| FormatError::input(self.path, NAME, format!("array '{name}'"), problem);
        let components = match attribute("NumberOfComponents") {
            // VTK leaves it out for scalars.
            "" => 1,
            text => text.trim().parse().ok().filter(|n| (1..=MAX_COMPONENTS).contains(n)).ok_or_else(|| {
                broken(format!("has NumberOfComponents '{text}', expected a number from 1 to {MAX_COMPONENTS}"))
            })?,
        };
        let kind = attribute("type");
        let values = match attribute("format") {
            "ascii" => ascii(kind, &element.text).map_err(broken)?,
            "binary" => {
                let text: Vec<u8> = element.text.bytes().filter(|b| !b.is_ascii_whitespace()).collect();
                numbers(kind, &self.base64(&text).map_err(broken)?, self.big_endian).map_err(broken)?
            }
            "appended" => {
                let offset: usize = attribute("offset").parse().map_err(|_| broken("has no valid offset".into()))?;
                let data = self.appended.get(offset..).ok_or_else(|| {
                    broken(format!("starts at {offset}, behind the end of the appended data; the file is cut off"))
                })?;
                let bytes = if self.raw { self.raw(data) } else { self.base64(data) }.map_err(broken)?;
                numbers(kind, &bytes, self.big_endian).map_err(broken)?
            }
            other => return Err(broken(format!("has format '{other}', expected ascii, binary or appended"))),
        };
        if values.len() % components != 0 {
            return Err(broken(format!("has {} values, which are not whole rows of {components}", values.len())));
        }
        Ok(DataArray { name, components, values })
    }

    fn word(&self) -> usize {
        if self.wide_header { 8 } else { 4 }
    }

    /// Header words at the start of `bytes`.
    fn words(&self, bytes: &[u8], count: usize) -> std::result::Result<Vec<usize>, String> {
        let size = self.word();
        let head = bytes.get(..count * size).ok_or("is cut off in its header")?;
        head.chunks_exact(size)
            .map(|chunk| {
                let mut wide = [0_u8; 8];
                if self.big_endian {
                    wide[8 - size..].copy_from_slice(chunk);
                    usize::try_from(u64::from_be_bytes(wide))
                } else {
                    wide[..size].copy_from_slice(chunk);
                    usize::try_from(u64::from_le_bytes(wide))
                }
                .map_err(|_| "declares an absurd size".to_owned())
            })
            .collect()
    }

    /// Raw appended data: header words, then bytes.
    fn raw(&self, data: &[u8]) -> std::result::Result<Vec<u8>, String> {
        if self.compressor.is_none() {
            let length = self.words(data, 1)?[0];
            let bytes = data.get(self.word()..).and_then(|d| d.get(..length)).ok_or("is cut off")?;
            return Ok(bytes.to_vec());
        }
        let (header, sizes) = self.block_header(&|count| self.words(data, count))?;
        let start = (3 + sizes.len()) * self.word();
        self.decompress(&header, &sizes, data.get(start..).ok_or("is cut off")?)
    }

    /// Base64: header and data are one stream uncompressed, two streams compressed.
    fn base64(&self, text: &[u8]) -> std::result::Result<Vec<u8>, String> {
        let characters = |bytes: usize| bytes.div_ceil(3) * 4;
        let decode = |from: usize, bytes: usize| -> std::result::Result<Vec<u8>, String> {
            let end = from.checked_add(characters(bytes)).ok_or("declares an absurd size")?;
            let part = text.get(from..end).ok_or("is cut off")?;
            base64::engine::general_purpose::STANDARD.decode(part).map_err(|e| format!("is not valid base64: {e}"))
        };
        let word = self.word();
        if self.compressor.is_none() {
            let length = self.words(&decode(0, word)?, 1)?[0];
            if length > self.file_bytes {
                return Err(format!("declares {length} bytes, more than the file has"));
            }
            let all = decode(0, word + length)?;
            return all.get(word..word + length).map(<[u8]>::to_vec).ok_or_else(|| "is cut off".into());
        }
        let (header, sizes) = self.block_header(&|count| self.words(&decode(0, count * word)?, count))?;
        let start = characters((3 + sizes.len()) * word);
        self.decompress(&header, &sizes, &decode(start, sizes.iter().sum())?)
    }

    /// Number of blocks, block size and last size; then the compressed sizes.
    fn block_header(
        &self,
        words: &dyn Fn(usize) -> std::result::Result<Vec<usize>, String>,
    ) -> std::result::Result<([usize; 3], Vec<usize>), String> {
        let first = words(1)?[0];
        if first == 0 {
            return Ok(([0; 3], Vec::new()));
        }
        let limit = usize::try_from(self.budget.left()).unwrap_or(usize::MAX);
        let head = words(3)?;
        if first > self.file_bytes || head[1].saturating_mul(first) > limit {
            return Err(format!("declares {first} blocks of {} bytes, more than the file can hold", head[1]));
        }
        let all = words(3 + first)?;
        let sizes = all[3..].to_vec();
        if sizes.iter().try_fold(0_usize, |n, &s| n.checked_add(s)).is_none_or(|n| n > self.file_bytes) {
            return Err("declares blocks larger than the file".into());
        }
        Ok(([head[0], head[1], head[2]], sizes))
    }

    fn decompress(&self, header: &[usize; 3], sizes: &[usize], data: &[u8]) -> std::result::Result<Vec<u8>, String> {
        let compressor = self.compressor.as_deref().unwrap_or("");
        let mut out = Vec::new();
        let mut at = 0;
        for (b, &size) in sizes.iter().enumerate() {
            let last = b + 1 == sizes.len() && header[2] > 0;
            let expected = if last { header[2] } else { header[1] };
            let bytes = (expected as u64).saturating_mul(2);
            self.budget.take(self.path, NAME, "compressed data", bytes).map_err(|e| e.to_string())?;
            let packed = data.get(at..at + size).ok_or("is cut off")?;
            at += size;
            let before = out.len();
            let result = match compressor {
                "vtkZLibDataCompressor" => flate2::read::ZlibDecoder::new(packed)
                    .take(expected as u64 + 1)
                    .read_to_end(&mut out)
                    .map(drop)
                    .map_err(|e| e.to_string()),
                "vtkLZ4DataCompressor" => lz4_flex::block::decompress(packed, expected)
                    .map(|block| out.extend_from_slice(&block))
                    .map_err(|e| e.to_string()),
                "vtkLZMADataCompressor" => lzma(packed, expected, &mut out),
                other => Err(format!("compressor '{other}' is not known")),
            };
            result.map_err(|e| format!("block {b} cannot be decompressed: {e}"))?;
            if out.len() - before != expected {
                return Err(format!("block {b} has {} bytes, expected {expected}", out.len() - before));
            }
        }
        Ok(out)
    }
}

/// Decompresses into a buffer that refuses to grow beyond what is expected.
fn lzma(packed: &[u8], expected: usize, out: &mut Vec<u8>) -> std::result::Result<(), String> {
    struct Capped<'a> {
        out: &'a mut Vec<u8>,
        left: usize,
    }
    impl std::io::Write for Capped<'_> {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            if bytes.len() > self.left {
                return Err(std::io::Error::other("more data than declared"));
            }
            self.left -= bytes.len();
            self.out.extend_from_slice(bytes);
            Ok(bytes.len())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let mut input = packed;
    lzma_rs::xz_decompress(&mut input, &mut Capped { out, left: expected }).map_err(|e| format!("{e:?}"))
}

fn ascii(kind: &str, text: &str) -> std::result::Result<Values, String> {
    // Text is read as f64 whatever its type, but a type that is none is a sign of damage.
    numbers(kind, &[], false)?;
    let numbers = text
        .split_whitespace()
        .map(|t| t.parse::<f64>().map_err(|_| format!("has '{t}' where a number is expected")))
        .collect::<std::result::Result<Vec<_>, _>>()?;
    Ok(if kind == "Float32" { Values::F32(numbers.iter().map(|&v| v as f32).collect()) } else { Values::F64(numbers) })
}

/// Numbers of a VTK type from bytes. Whole numbers become f64: they index or count.
pub(super) fn numbers(kind: &str, bytes: &[u8], big_endian: bool) -> std::result::Result<Values, String> {
    macro_rules! all {
        ($t:ty, $wrap:expr) => {{
            let size = std::mem::size_of::<$t>();
            if bytes.len() % size != 0 {
                return Err(format!("has {} bytes, which are not whole numbers of type {kind}", bytes.len()));
            }
            let one = |chunk: &[u8]| {
                let mut raw = [0_u8; std::mem::size_of::<$t>()];
                raw.copy_from_slice(chunk);
                if big_endian { <$t>::from_be_bytes(raw) } else { <$t>::from_le_bytes(raw) }
            };
            $wrap(bytes.chunks_exact(size).map(one))
        }};
    }
    Ok(match kind {
        "Float32" | "float" => all!(f32, |i| Values::F32(Iterator::collect(i))),
        "Float64" | "double" => all!(f64, |i| Values::F64(Iterator::collect(i))),
        "Int8" | "char" => all!(i8, |i| Values::F64(Iterator::map(i, f64::from).collect())),
        "UInt8" | "unsigned_char" | "bit" => all!(u8, |i| Values::F64(Iterator::map(i, f64::from).collect())),
        "Int16" | "short" => all!(i16, |i| Values::F64(Iterator::map(i, f64::from).collect())),
        "UInt16" | "unsigned_short" => all!(u16, |i| Values::F64(Iterator::map(i, f64::from).collect())),
        "Int32" | "int" => all!(i32, |i| Values::F64(Iterator::map(i, f64::from).collect())),
        "UInt32" | "unsigned_int" => all!(u32, |i| Values::F64(Iterator::map(i, f64::from).collect())),
        "Int64" | "long" | "vtktypeint64" => all!(i64, |i| long(Iterator::collect(i))),
        "UInt64" | "unsigned_long" => {
            let all: Vec<u64> = all!(u64, Iterator::collect);
            let signed: Option<Vec<i64>> = all.iter().map(|v| i64::try_from(*v).ok()).collect();
            signed.map_or_else(|| Values::F64(all.iter().map(|v| *v as f64).collect()), long)
        }
        other => return Err(format!("has type '{other}', which is not known")),
    })
}

/// Whole numbers as such where an f64 would not hold them all, beyond 2^53, as numbers of particles may be.
fn long(all: Vec<i64>) -> Values {
    match all.iter().any(|v| v.unsigned_abs() > 1 << 53) {
        true => Values::I64(all),
        false => Values::F64(all.into_iter().map(|v| v as f64).collect()),
    }
}
