//! Fortran records of a file, in either byte order. A record length is used only after the file is known to be that long.

use super::schema::{HEADER_BYTES, HEADER_BYTES_OF_4, NAME, NAME_BYTES};
use crate::error::{FormatError, Result};
use crate::model::Values;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Values converted at a time.
const CHUNK_BYTES: usize = 1 << 16;

pub struct Records<'a> {
    path: &'a Path,
    file: BufReader<File>,
    length: u64,
    at: u64,
    big_endian: bool,
    /// Whether every record has a name record before it.
    pub named: bool,
}

/// The record that comes next.
pub struct Head {
    /// In format 2.
    pub label: Option<[u8; 4]>,
    /// Length in bytes, modulo 2^32.
    pub marker: u32,
}

/// What a record holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Float,
    Double,
    Word,
    LongWord,
}

impl Kind {
    pub fn width(self) -> u64 {
        match self {
            Self::Float | Self::Word => 4,
            Self::Double | Self::LongWord => 8,
        }
    }
}

impl<'a> Records<'a> {
    pub fn open(path: &'a Path) -> Result<Self> {
        let file = File::open(path).map_err(|e| FormatError::io(path, "open", e))?;
        let length = file.metadata().map_err(|e| FormatError::io(path, "open", e))?.len();
        let mut records = Self { path, file: BufReader::new(file), length, at: 0, big_endian: false, named: false };
        let first: [u8; 4] = records.bytes("the first record")?;
        let little = u32::from_le_bytes(first);
        let begins = |marker: u32| matches!(marker, HEADER_BYTES | HEADER_BYTES_OF_4 | NAME_BYTES);
        records.big_endian = !begins(little);
        let marker = records.word(first);
        if !begins(marker) {
            let problem = format!(
                "its length is {little} bytes, expected {HEADER_BYTES} (format 1), {HEADER_BYTES_OF_4} (that of GADGET-4) or {NAME_BYTES} (format 2) in either byte \
                 order; name another format with --format"
            );
            return Err(records.error("the first record", problem));
        }
        records.named = marker == NAME_BYTES;
        records.seek(0)?;
        Ok(records)
    }

    pub fn error(&self, location: &str, problem: impl Into<String>) -> FormatError {
        FormatError::input(self.path, NAME, format!("{location} at byte {}", self.at), problem)
    }

    pub fn word(&self, bytes: [u8; 4]) -> u32 {
        if self.big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
    }

    pub fn long_word(&self, bytes: [u8; 8]) -> u64 {
        if self.big_endian { u64::from_be_bytes(bytes) } else { u64::from_le_bytes(bytes) }
    }

    /// The head of the next record, `None` at the end of the file.
    pub fn next(&mut self) -> Result<Option<Head>> {
        if self.at == self.length {
            return Ok(None);
        }
        let mut label = None;
        if self.named {
            self.expect_marker("a block's name", NAME_BYTES)?;
            label = Some(self.bytes("a block's name")?);
            let _skip: [u8; 4] = self.bytes("a block's name")?;
            self.expect_marker("a block's name", NAME_BYTES)?;
        }
        let marker = self.bytes("a record's length")?;
        Ok(Some(Head { label, marker: self.word(marker) }))
    }

    /// The data of the header record behind its head, 256 bytes or GADGET-4's 192.
    pub fn header(&mut self, head: &Head) -> Result<Vec<u8>> {
        if !matches!(head.marker, HEADER_BYTES | HEADER_BYTES_OF_4) {
            let problem = format!(
                "it has {} bytes, expected {HEADER_BYTES}, or {HEADER_BYTES_OF_4} of GADGET-4 with six types",
                head.marker
            );
            return Err(self.error("the header", problem));
        }
        let mut bytes = vec![0; head.marker as usize];
        self.read("the header", &mut bytes)?;
        self.expect_marker("the header", head.marker)?;
        Ok(bytes)
    }

    /// Passes over a record that is not understood.
    pub fn skip(&mut self, location: &str, head: &Head) -> Result<()> {
        self.room(location, u64::from(head.marker))?;
        self.seek(self.at + u64::from(head.marker))?;
        self.expect_marker(location, head.marker)
    }

    /// `count` numbers behind a record's head.
    pub fn numbers(&mut self, location: &str, head: &Head, kind: Kind, count: u64) -> Result<Values> {
        let bytes = count.saturating_mul(kind.width());
        self.room(location, bytes)?;
        let count = usize::try_from(count).map_err(|_| self.error(location, "it is too long for this machine"))?;
        let values = match kind {
            Kind::Float => Values::F32(self.fill(location, count, |s, b| Ok(f32::from_bits(s.word(b))))?),
            Kind::Double => Values::F64(self.fill(location, count, |s, b| Ok(f64::from_bits(s.long_word(b))))?),
            Kind::Word => Values::I64(self.fill(location, count, |s, b| Ok(i64::from(s.word(b))))?),
            Kind::LongWord => Values::I64(self.fill(location, count, |s, b| {
                i64::try_from(s.long_word(b)).map_err(|_| {
                    s.error(location, format!("it has the number {}, expected at most 2^63 - 1", s.long_word(b)))
                })
            })?),
        };
        self.expect_marker(location, head.marker)?;
        Ok(values)
    }

    fn fill<T, const W: usize>(
        &mut self,
        location: &str,
        count: usize,
        decode: impl Fn(&Self, [u8; W]) -> Result<T>,
    ) -> Result<Vec<T>> {
        let mut values = Vec::with_capacity(count);
        let mut buffer = vec![0; CHUNK_BYTES];
        while values.len() < count {
            let wanted = CHUNK_BYTES.min((count - values.len()) * W);
            let (chunk, _) = buffer.split_at_mut(wanted);
            self.read(location, chunk)?;
            let (words, _) = chunk.as_chunks::<W>();
            for &word in words {
                values.push(decode(self, word)?);
            }
        }
        Ok(values)
    }

    fn bytes<const N: usize>(&mut self, location: &str) -> Result<[u8; N]> {
        let mut bytes = [0; N];
        self.read(location, &mut bytes)?;
        Ok(bytes)
    }

    fn read(&mut self, location: &str, out: &mut [u8]) -> Result<()> {
        self.room(location, out.len() as u64)?;
        self.file.read_exact(out).map_err(|e| FormatError::io(self.path, "read", e))?;
        self.at += out.len() as u64;
        Ok(())
    }

    fn seek(&mut self, to: u64) -> Result<()> {
        self.file.seek(SeekFrom::Start(to)).map_err(|e| FormatError::io(self.path, "read", e))?;
        self.at = to;
        Ok(())
    }

    fn room(&self, location: &str, bytes: u64) -> Result<()> {
        let left = self.length.saturating_sub(self.at);
        if bytes <= left {
            return Ok(());
        }
        Err(FormatError::Limit {
            path: self.path.into(),
            format: NAME,
            location: format!("{location} at byte {}", self.at),
            declared: format!("{bytes} bytes"),
            allowed: format!("the {left} that are left of the file"),
        })
    }

    fn expect_marker(&mut self, location: &str, expected: u32) -> Result<()> {
        let bytes = self.bytes(location)?;
        let found = self.word(bytes);
        if found == expected {
            return Ok(());
        }
        let problem = format!(
            "the length around its record is {found}, expected {expected}; the file is damaged or not written as Fortran records of this format"
        );
        Err(self.error(location, problem))
    }
}
