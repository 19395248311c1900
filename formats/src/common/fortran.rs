//! Fortran records as gfortran writes them, where long records are split into parts. A record length is used only after the file is known to be
//! that long.

use crate::error::{FormatError, Result};
use std::fs::File;
use std::io::{BufReader, Read, Seek, Write};
use std::path::Path;

/// Most bytes of one part of a record (gfortran's default).
const PART: u64 = 2_147_483_639;

/// Records of a file being read.
pub struct Records<'a> {
    path: &'a Path,
    format: &'static str,
    file: BufReader<File>,
    length: u64,
    at: u64,
    pub big_endian: bool,
}

impl<'a> Records<'a> {
    /// Opens a file of `format` whose first record is short, by which the order of its bytes is known.
    pub fn open(path: &'a Path, format: &'static str) -> Result<Self> {
        let file = File::open(path).map_err(|e| FormatError::io(path, "open", e))?;
        let length = file.metadata().map_err(|e| FormatError::io(path, "open", e))?.len();
        let mut records = Self { path, format, file: BufReader::new(file), length, at: 0, big_endian: false };
        let first = records.marker("the first record")?;
        records.big_endian = !(0..=0xffff).contains(&first);
        records.file.rewind().map_err(|e| FormatError::io(path, "read", e))?;
        records.at = 0;
        Ok(records)
    }

    pub fn error(&self, location: &str, problem: impl Into<String>) -> FormatError {
        FormatError::input(self.path, self.format, format!("{location}, before byte {}", self.at), problem)
    }

    /// The next record, of any length up to `most` bytes.
    pub fn record(&mut self, location: &str, most: u64) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.parts(location, most, |records, length| {
            let start = bytes.len();
            bytes.resize(start + length, 0);
            let (_, part) = bytes.split_at_mut(start);
            records.file.read_exact(part).map_err(|e| FormatError::io(records.path, "read", e))
        })?;
        Ok(bytes)
    }

    /// The next record, which has to have `bytes` bytes.
    pub fn exactly(&mut self, location: &str, bytes: u64) -> Result<Vec<u8>> {
        let record = self.record(location, bytes)?;
        if record.len() as u64 == bytes {
            return Ok(record);
        }
        Err(self.error(location, format!("its record has {} bytes, expected {bytes}", record.len())))
    }

    /// Passes over a record of at most `bytes` bytes.
    pub fn skip(&mut self, location: &str, bytes: u64) -> Result<()> {
        self.parts(location, bytes, |records, length| {
            // Within what is read ahead where it reaches so far: a file may have millions of short records.
            records.file.seek_relative(length as i64).map_err(|e| FormatError::io(records.path, "read", e))
        })
    }

    /// Walks through the parts of a record; `take` consumes as many bytes as it is told.
    fn parts(&mut self, location: &str, most: u64, mut take: impl FnMut(&mut Self, usize) -> Result<()>) -> Result<()> {
        let mut total = 0u64;
        let mut first = true;
        loop {
            let head = self.marker(location)?;
            let length = u64::from(head.unsigned_abs());
            total = total.saturating_add(length);
            if total > most {
                return Err(self.error(location, format!("its record has {total} bytes or more, expected {most}")));
            }
            let left = self.length.saturating_sub(self.at);
            if length.saturating_add(4) > left {
                return Err(FormatError::Limit {
                    path: self.path.into(),
                    format: self.format,
                    location: format!("{location}, before byte {}", self.at),
                    declared: format!("{length} bytes"),
                    allowed: format!("the {left} that are left of the file"),
                });
            }
            take(self, length as usize)?;
            self.at += length;
            let tail = self.marker(location)?;
            // A negative length behind a part says that another came before it.
            let expected = if first { i64::from(head.unsigned_abs()) } else { -i64::from(head.unsigned_abs()) };
            if i64::from(tail) != expected {
                let problem = format!(
                    "the length behind its record is {tail}, expected {expected}; the file is damaged or not of this format"
                );
                return Err(self.error(location, problem));
            }
            if head >= 0 {
                return Ok(());
            }
            first = false;
        }
    }

    fn marker(&mut self, location: &str) -> Result<i32> {
        if self.length.saturating_sub(self.at) < 4 {
            return Err(self.error(location, "the file ends here; it is truncated or not of this format"));
        }
        let mut bytes = [0; 4];
        self.file.read_exact(&mut bytes).map_err(|e| FormatError::io(self.path, "read", e))?;
        self.at += 4;
        Ok(if self.big_endian { i32::from_be_bytes(bytes) } else { i32::from_le_bytes(bytes) })
    }
}

/// Writes a record of `length` bytes, which `fill` puts out in pieces.
pub fn write<W: Write>(
    out: &mut W,
    length: u64,
    fill: impl FnOnce(&mut Parts<'_, W>) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let mut parts = Parts { out, left: length, part: 0, in_part: 0, first: true, most: PART };
    parts.begin()?;
    fill(&mut parts)?;
    parts.end()
}

/// A record being written.
pub struct Parts<'w, W> {
    out: &'w mut W,
    /// Bytes that no part has taken yet.
    left: u64,
    part: u64,
    in_part: u64,
    first: bool,
    most: u64,
}

impl<W: Write> Parts<'_, W> {
    fn begin(&mut self) -> std::io::Result<()> {
        self.part = self.left.min(self.most);
        self.left -= self.part;
        self.in_part = 0;
        let sign = if self.left > 0 { -1 } else { 1 };
        self.out.write_all(&(sign * self.part as i32).to_le_bytes())
    }

    fn end(&mut self) -> std::io::Result<()> {
        let sign = if self.first { 1 } else { -1 };
        self.first = false;
        self.out.write_all(&(sign * self.part as i32).to_le_bytes())
    }

    pub fn put(&mut self, mut bytes: &[u8]) -> std::io::Result<()> {
        while !bytes.is_empty() {
            if self.in_part == self.part {
                if self.left == 0 {
                    return Err(std::io::Error::other("a record is longer than announced"));
                }
                self.end()?;
                self.begin()?;
            }
            let room = usize::try_from(self.part - self.in_part).unwrap_or(usize::MAX).min(bytes.len());
            let (now, later) = bytes.split_at(room);
            self.out.write_all(now)?;
            self.in_part += room as u64;
            bytes = later;
        }
        Ok(())
    }
}

/// Text with blanks behind it.
pub fn padded<const N: usize>(text: &str) -> [u8; N] {
    let mut bytes = [b' '; N];
    bytes.iter_mut().zip(text.bytes()).for_each(|(to, from)| *to = from);
    bytes
}

/// Writes a record of these bytes.
pub fn record(out: &mut impl Write, bytes: &[u8]) -> std::io::Result<()> {
    write(out, bytes.len() as u64, |parts| parts.put(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_records_are_split_and_joined_as_gfortran_does() {
        let mut out = Vec::new();
        let mut parts = Parts { out: &mut out, left: 11, part: 0, in_part: 0, first: true, most: 4 };
        parts.begin().unwrap();
        parts.put(b"hello").unwrap();
        parts.put(b" world").unwrap();
        parts.end().unwrap();
        let marks = |n: i32| n.to_le_bytes().to_vec();
        let expected = [
            marks(-4),
            b"hell".to_vec(),
            marks(4),
            marks(-4),
            b"o wo".to_vec(),
            marks(-4),
            marks(3),
            b"rld".to_vec(),
            marks(-3),
        ];
        assert_eq!(out, expected.concat());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let first = [marks(2), b"ab".to_vec(), marks(2)].concat();
        std::fs::write(&path, [first, out].concat()).unwrap();
        let mut records = Records::open(&path, "phantom").unwrap();
        assert_eq!(records.record("a", 10).unwrap(), b"ab");
        assert_eq!(records.exactly("b", 11).unwrap(), b"hello world");
        assert!(records.record("c", 1).unwrap_err().to_string().contains("the file ends here"));
        let mut records = Records::open(&path, "phantom").unwrap();
        records.skip("a", 2).unwrap();
        assert!(records.exactly("b", 10).unwrap_err().to_string().contains("11 bytes or more, expected 10"));
    }
}
