//! Writes NetCDF classic files (CDF-2, 64-bit offsets), which every NetCDF library reads.
//!
//! Layout: magic `CDF\x02`, record count, then the lists of dimensions, global attributes and variables, each
//! tagged and counted, then the data of the variables one after the other; all big-endian, padded to 4 bytes.
//! Specification: <https://docs.unidata.ucar.edu/netcdf-c/current/file_format_specifications.html>

use crate::error::{FormatError, Result};
use std::io::{BufWriter, Write};
use std::path::Path;

const DIMENSION: u32 = 0x0a;
const VARIABLE: u32 = 0x0b;
const ATTRIBUTE: u32 = 0x0c;
/// Largest size of a variable that CDF-2 can state.
const MAX_VARIABLE: u64 = u32::MAX as u64 - 3;

/// Values of a variable.
#[derive(Debug, Clone)]
pub enum Data {
    F32(Vec<f32>),
    F64(Vec<f64>),
    I32(Vec<i32>),
}

impl Data {
    fn type_code(&self) -> u32 {
        match self {
            Self::I32(_) => 4,
            Self::F32(_) => 5,
            Self::F64(_) => 6,
        }
    }

    fn len(&self) -> usize {
        match self {
            Self::I32(v) => v.len(),
            Self::F32(v) => v.len(),
            Self::F64(v) => v.len(),
        }
    }

    fn bytes(&self) -> u64 {
        self.len() as u64 * if matches!(self, Self::F64(_)) { 8 } else { 4 }
    }

    fn write(&self, out: &mut impl Write) -> std::io::Result<()> {
        match self {
            Self::I32(v) => v.iter().try_for_each(|x| out.write_all(&x.to_be_bytes())),
            Self::F32(v) => v.iter().try_for_each(|x| out.write_all(&x.to_be_bytes())),
            Self::F64(v) => v.iter().try_for_each(|x| out.write_all(&x.to_be_bytes())),
        }
    }
}

/// A variable over some of the file's dimensions, the last running fastest.
#[derive(Debug, Clone)]
pub struct NetcdfVariable {
    pub name: String,
    /// Indices into the file's dimensions.
    pub dimensions: Vec<usize>,
    /// Text attributes such as `units`.
    pub attributes: Vec<(String, String)>,
    /// Numeric attributes such as `_FillValue`, of the variable's own type.
    pub numbers: Vec<(String, Data)>,
    pub data: Data,
}

/// A whole file.
#[derive(Debug, Clone, Default)]
pub struct NetcdfFile {
    pub dimensions: Vec<(String, usize)>,
    pub attributes: Vec<(String, String)>,
    pub variables: Vec<NetcdfVariable>,
}

impl NetcdfFile {
    /// Writes the file.
    ///
    /// # Errors
    /// [`FormatError::Output`] for a variable that does not fit its dimensions or is larger than 4 GiB;
    /// [`FormatError::Io`].
    pub fn write(&self, path: &Path) -> Result<()> {
        for v in &self.variables {
            let wanted: Option<usize> =
                v.dimensions.iter().try_fold(1, |n, &d| Some(n * self.dimensions.get(d).map(|d| d.1)?));
            let problem = if wanted != Some(v.data.len()) {
                format!("variable '{}' has {} values, which its dimensions do not allow", v.name, v.data.len())
            } else if v.data.bytes() > MAX_VARIABLE {
                format!("variable '{}' has {} bytes, more than CDF-2 can state", v.name, v.data.bytes())
            } else {
                continue;
            };
            return Err(FormatError::Output { path: path.into(), format: "netcdf", problem });
        }
        self.write_bytes(path).map_err(|e| FormatError::io(path, "write", e))
    }

    fn write_bytes(&self, path: &Path) -> std::io::Result<()> {
        // Offsets have a fixed width, so a header with zeros tells the length of the real one.
        let length = self.header(&vec![0; self.variables.len()]).len() as u64;
        let mut begins = Vec::with_capacity(self.variables.len());
        let mut at = length;
        for v in &self.variables {
            begins.push(at);
            at += v.data.bytes().next_multiple_of(4);
        }
        let mut out = BufWriter::new(std::fs::File::create(path)?);
        out.write_all(&self.header(&begins))?;
        for v in &self.variables {
            v.data.write(&mut out)?;
        }
        out.into_inner().map_err(std::io::IntoInnerError::into_error)?.sync_all()
    }

    fn header(&self, begins: &[u64]) -> Vec<u8> {
        let mut h = b"CDF\x02".to_vec();
        number(&mut h, 0);
        list(&mut h, DIMENSION, self.dimensions.len());
        for (name, length) in &self.dimensions {
            text(&mut h, name);
            number(&mut h, *length as u32);
        }
        attributes(&mut h, &self.attributes, &[]);
        list(&mut h, VARIABLE, self.variables.len());
        for (v, begin) in self.variables.iter().zip(begins) {
            text(&mut h, &v.name);
            number(&mut h, v.dimensions.len() as u32);
            v.dimensions.iter().for_each(|&d| number(&mut h, d as u32));
            attributes(&mut h, &v.attributes, &v.numbers);
            number(&mut h, v.data.type_code());
            number(&mut h, v.data.bytes().next_multiple_of(4) as u32);
            h.extend_from_slice(&begin.to_be_bytes());
        }
        h
    }
}

fn number(h: &mut Vec<u8>, value: u32) {
    h.extend_from_slice(&value.to_be_bytes());
}

/// An empty list has tag 0.
fn list(h: &mut Vec<u8>, tag: u32, count: usize) {
    number(h, if count == 0 { 0 } else { tag });
    number(h, count as u32);
}

fn text(h: &mut Vec<u8>, value: &str) {
    number(h, value.len() as u32);
    h.extend_from_slice(value.as_bytes());
    pad(h);
}

fn pad(h: &mut Vec<u8>) {
    h.resize(h.len().next_multiple_of(4), 0);
}

fn attributes(h: &mut Vec<u8>, texts: &[(String, String)], numbers: &[(String, Data)]) {
    list(h, ATTRIBUTE, texts.len() + numbers.len());
    for (name, value) in texts {
        text(h, name);
        number(h, 2);
        text(h, value);
    }
    for (name, value) in numbers {
        text(h, name);
        number(h, value.type_code());
        number(h, value.len() as u32);
        // Writing to memory cannot fail.
        let _ = value.write(h);
        pad(h);
    }
}
