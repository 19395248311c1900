//! A small writer of NetCDF classic files, for fields that this project creates itself.
//!
//! Files are CDF-2 (64-bit offset); CDF-5 (64-bit data) where a dimension or a variable is too large for
//! that, or has integers of 64 bits.
//! There is no record dimension. All numbers are big-endian; names, attribute values and variables are padded
//! with zeros to four bytes.
//!
//! | part       | content                                                                              |
//! |------------|--------------------------------------------------------------------------------------|
//! | magic      | `CDF` and the version byte, 2 or 5                                                   |
//! | numrecs    | 0                                                                                    |
//! | dimensions | tag 10, count, then (name, length)                                                   |
//! | attributes | tag 12, count, then (name, type, count, values)                                      |
//! | variables  | tag 11, count, then (name, rank, dimension ids, attributes, type, bytes, offset)     |
//! | data       | variables in order, C order (last dimension fastest)                                 |
//!
//! Counts, lengths, ids and byte sizes are 4 bytes in CDF-2 and 8 bytes in CDF-5; offsets are 8 bytes in both.
//! An empty list is a zero tag and a zero count.
//!
//! Reference: <https://docs.unidata.ucar.edu/netcdf-c/current/file_format_specifications.html>

use crate::error::{FormatError, Result};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

const FORMAT: &str = "netcdf";
const TAG_DIMENSION: u32 = 10;
const TAG_VARIABLE: u32 = 11;
const TAG_ATTRIBUTE: u32 = 12;
const TYPE_CHAR: u32 = 2;
const TYPE_DOUBLE: u32 = 6;
const TYPE_INT64: u32 = 10;
/// A CDF-2 variable may take this many bytes at most (2^32 - 4).
const CDF2_VARIABLE_BYTES: u64 = 0xffff_fffc;
/// A CDF-2 dimension may be this long at most.
const CDF2_DIMENSION: u64 = 0x7fff_ffff;

/// Value of an attribute.
#[derive(Debug, Clone, PartialEq)]
pub enum Attribute {
    Text(String),
    Numbers(Vec<f64>),
}

impl From<&str> for Attribute {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<f64> for Attribute {
    fn from(number: f64) -> Self {
        Self::Numbers(vec![number])
    }
}

/// Numbers of a variable, borrowed until [`ClassicFile::write`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Data<'a> {
    I8(&'a [i8]),
    I32(&'a [i32]),
    /// In CDF-5 only, which such a file becomes.
    I64(&'a [i64]),
    F32(&'a [f32]),
    F64(&'a [f64]),
}

impl Data<'_> {
    fn len(&self) -> usize {
        match self {
            Self::I8(v) => v.len(),
            Self::I32(v) => v.len(),
            Self::I64(v) => v.len(),
            Self::F32(v) => v.len(),
            Self::F64(v) => v.len(),
        }
    }

    /// NetCDF type number and bytes per value.
    fn kind(&self) -> (u32, u64) {
        match self {
            Self::I8(_) => (1, 1),
            Self::I32(_) => (4, 4),
            Self::I64(_) => (TYPE_INT64, 8),
            Self::F32(_) => (5, 4),
            Self::F64(_) => (TYPE_DOUBLE, 8),
        }
    }

    fn bytes(&self) -> u64 {
        (self.len() as u64 * self.kind().1).next_multiple_of(4)
    }

    fn write(&self, out: &mut impl Write) -> std::io::Result<()> {
        match self {
            Self::I8(v) => v.iter().try_for_each(|x| out.write_all(&x.to_be_bytes()))?,
            Self::I32(v) => v.iter().try_for_each(|x| out.write_all(&x.to_be_bytes()))?,
            Self::I64(v) => v.iter().try_for_each(|x| out.write_all(&x.to_be_bytes()))?,
            Self::F32(v) => v.iter().try_for_each(|x| out.write_all(&x.to_be_bytes()))?,
            Self::F64(v) => v.iter().try_for_each(|x| out.write_all(&x.to_be_bytes()))?,
        }
        let padding = self.bytes() - self.len() as u64 * self.kind().1;
        out.write_all(&[0; 3][..padding as usize])
    }
}

/// Handle of a dimension of a [`ClassicFile`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DimensionId(usize);

#[derive(Debug, Clone)]
struct VariableEntry<'a> {
    name: String,
    dimensions: Vec<DimensionId>,
    attributes: Vec<(String, Attribute)>,
    data: Data<'a>,
}

/// A file in the making: add dimensions, variables and attributes, then [`ClassicFile::write`].
///
/// ```
/// use sph_formats::common::netcdf_classic::{ClassicFile, Data};
/// let (r, rho) = ([0.0, 0.5, 1.0], [1.0, 0.4, 0.0]);
/// let mut file = ClassicFile::new();
/// file.attribute("title", "a ball of gas");
/// let radius = file.dimension("r", r.len());
/// file.variable("r", &[radius], Data::F64(&r), &[("units", "cm".into())]);
/// file.variable("density", &[radius], Data::F64(&rho), &[("units", "g cm-3".into())]);
/// # let folder = tempfile::tempdir().unwrap();
/// # let path = folder.path().join("star.nc");
/// file.write(&path)?;
/// # Ok::<(), sph_formats::FormatError>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct ClassicFile<'a> {
    dimensions: Vec<(String, u64)>,
    attributes: Vec<(String, Attribute)>,
    variables: Vec<VariableEntry<'a>>,
}

impl<'a> ClassicFile<'a> {
    pub fn new() -> Self {
        Self::default()
    }

    pub fn dimension(&mut self, name: &str, length: usize) -> DimensionId {
        self.dimensions.push((name.to_owned(), length as u64));
        DimensionId(self.dimensions.len() - 1)
    }

    /// Adds a global attribute.
    pub fn attribute(&mut self, name: &str, value: impl Into<Attribute>) {
        self.attributes.push((name.to_owned(), value.into()));
    }

    /// Adds a variable; `data` is in C order, the last of `dimensions` runs fastest.
    pub fn variable(
        &mut self,
        name: &str,
        dimensions: &[DimensionId],
        data: Data<'a>,
        attributes: &[(&str, Attribute)],
    ) {
        self.variables.push(VariableEntry {
            name: name.to_owned(),
            dimensions: dimensions.to_vec(),
            attributes: attributes.iter().map(|(k, v)| ((*k).to_owned(), v.clone())).collect(),
            data,
        });
    }

    /// Writes everything to `path`, replacing an older file.
    ///
    /// # Errors
    /// [`FormatError::Output`] where names repeat or are empty, a dimension is empty, or a variable's data does
    /// not fit its dimensions; [`FormatError::Io`].
    pub fn write(&self, path: &Path) -> Result<()> {
        self.check().map_err(|problem| FormatError::Output { path: path.into(), format: FORMAT, problem })?;
        let file = File::create(path).map_err(|e| FormatError::io(path, "create", e))?;
        let mut out = BufWriter::with_capacity(1 << 18, file);
        let written = out
            .write_all(&self.header())
            .and_then(|()| self.variables.iter().try_for_each(|v| v.data.write(&mut out)))
            .and_then(|()| out.flush());
        written.map_err(|e| FormatError::io(path, "write", e))
    }

    fn check(&self) -> std::result::Result<(), String> {
        check_names("dimension", self.dimensions.iter().map(|d| &d.0))?;
        check_names("variable", self.variables.iter().map(|v| &v.name))?;
        check_names("attribute", self.attributes.iter().map(|a| &a.0))?;
        if let Some((name, _)) = self.dimensions.iter().find(|d| d.1 == 0) {
            return Err(format!("dimension '{name}' has length 0, expected at least 1"));
        }
        for v in &self.variables {
            check_names("attribute", v.attributes.iter().map(|a| &a.0))?;
            let mut expected = 1u64;
            for d in &v.dimensions {
                let length = self.dimensions.get(d.0).map_or(0, |d| d.1);
                expected = expected.saturating_mul(length);
            }
            if expected != v.data.len() as u64 {
                return Err(format!(
                    "variable '{}' has {} values, its dimensions say {expected}",
                    v.name,
                    v.data.len()
                ));
            }
        }
        Ok(())
    }

    fn header(&self) -> Vec<u8> {
        let wide = self.dimensions.iter().any(|d| d.1 > CDF2_DIMENSION)
            || self.variables.iter().any(|v| v.data.bytes() > CDF2_VARIABLE_BYTES || v.data.kind().0 == TYPE_INT64);
        self.header_of(wide)
    }

    fn header_of(&self, wide: bool) -> Vec<u8> {
        // The header's length does not depend on the offsets in it: measure it first.
        let length = self.encode(wide, 0).len() as u64;
        self.encode(wide, length)
    }

    fn encode(&self, wide: bool, data_start: u64) -> Vec<u8> {
        let mut out = Encoder { bytes: Vec::new(), wide };
        out.bytes.extend_from_slice(if wide { b"CDF\x05" } else { b"CDF\x02" });
        out.count(0);
        out.list(TAG_DIMENSION, self.dimensions.len());
        for (name, length) in &self.dimensions {
            out.text(name);
            out.count(*length);
        }
        out.attributes(&self.attributes);
        out.list(TAG_VARIABLE, self.variables.len());
        let mut offset = data_start;
        for v in &self.variables {
            out.text(&v.name);
            out.count(v.dimensions.len() as u64);
            v.dimensions.iter().for_each(|d| out.count(d.0 as u64));
            out.attributes(&v.attributes);
            out.word(v.data.kind().0);
            out.count(v.data.bytes());
            out.bytes.extend_from_slice(&offset.to_be_bytes());
            offset += v.data.bytes();
        }
        out.bytes
    }
}

fn check_names<'n>(kind: &str, names: impl Iterator<Item = &'n String>) -> std::result::Result<(), String> {
    let mut seen = std::collections::BTreeSet::new();
    for name in names {
        if name.is_empty() || name.contains('/') || name.chars().any(char::is_control) {
            return Err(format!(
                "{kind} name '{}' is not allowed in NetCDF; expected printable characters other than '/'",
                name.escape_debug()
            ));
        }
        if !seen.insert(name) {
            return Err(format!("{kind} name '{name}' is used twice"));
        }
    }
    Ok(())
}

struct Encoder {
    bytes: Vec<u8>,
    wide: bool,
}

impl Encoder {
    fn word(&mut self, value: u32) {
        self.bytes.extend_from_slice(&value.to_be_bytes());
    }

    /// A count or size: 4 bytes in CDF-2, 8 in CDF-5.
    fn count(&mut self, value: u64) {
        if self.wide {
            self.bytes.extend_from_slice(&value.to_be_bytes());
        } else {
            self.word(value as u32);
        }
    }

    fn list(&mut self, tag: u32, count: usize) {
        self.word(if count == 0 { 0 } else { tag });
        self.count(count as u64);
    }

    fn text(&mut self, text: &str) {
        self.count(text.len() as u64);
        self.bytes.extend_from_slice(text.as_bytes());
        self.pad();
    }

    fn pad(&mut self) {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
    }

    fn attributes(&mut self, attributes: &[(String, Attribute)]) {
        self.list(TAG_ATTRIBUTE, attributes.len());
        for (name, value) in attributes {
            self.text(name);
            match value {
                Attribute::Text(text) => {
                    self.word(TYPE_CHAR);
                    self.text(text);
                }
                Attribute::Numbers(numbers) => {
                    self.word(TYPE_DOUBLE);
                    self.count(numbers.len() as u64);
                    for x in numbers {
                        self.bytes.extend_from_slice(&x.to_be_bytes());
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smallest_file_has_the_bytes_of_the_specification() {
        let values = [1i8, -2, 3];
        let mut file = ClassicFile::new();
        let x = file.dimension("x", 3);
        file.variable("v", &[x], Data::I8(&values), &[]);
        let mut expected = b"CDF\x02\0\0\0\0\0\0\0\x0a\0\0\0\x01\0\0\0\x01x\0\0\0\0\0\0\x03".to_vec();
        expected.extend_from_slice(&[0; 8]);
        expected.extend_from_slice(b"\0\0\0\x0b\0\0\0\x01\0\0\0\x01v\0\0\0\0\0\0\x01\0\0\0\0");
        expected.extend_from_slice(&[0; 8]);
        expected.extend_from_slice(b"\0\0\0\x01\0\0\0\x04\0\0\0\0\0\0\0\x54");
        assert_eq!(expected.len(), 0x54);
        expected.extend_from_slice(&[1, 254, 3, 0]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.nc");
        file.write(&path).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), expected);
    }

    #[test]
    fn wide_headers_use_eight_byte_counts() {
        let mut file = ClassicFile::new();
        file.dimension("x", 1 << 33);
        let header = file.header();
        assert_eq!(&header[..4], b"CDF\x05");
        assert_eq!(&header[36..44], &(1u64 << 33).to_be_bytes());
    }

    #[test]
    fn wrong_lengths_and_repeated_names_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.nc");
        let mut file = ClassicFile::new();
        let x = file.dimension("x", 3);
        file.variable("v", &[x], Data::F64(&[1.0]), &[]);
        let text = file.write(&path).unwrap_err().to_string();
        assert!(text.contains("variable 'v' has 1 values, its dimensions say 3"), "{text}");
        let mut file = ClassicFile::new();
        file.dimension("x", 3);
        file.dimension("x", 4);
        assert!(file.write(&path).unwrap_err().to_string().contains("'x' is used twice"));
        assert!(!path.exists());
    }
}
