//! `Cell_D_<n>`: the values of patches.

use super::level::{Level, Patch};
use super::scan::{Cells, Scan};
use super::schema::NAME;
use crate::error::{FormatError, Result};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Longest first line of a patch.
const LINE: u64 = 1024;
/// What a patch's first line begins with.
const MARK: &str = "FAB";

/// Numbers of 4 and of 8 bytes: bits in all, of exponent and mantissa, where sign, exponent and mantissa begin, whether the leading
/// one is implied, and the bias of the exponent.
const SINGLE: [i64; 8] = [32, 8, 23, 0, 1, 9, 0, 127];
const DOUBLE: [i64; 8] = [64, 11, 52, 0, 1, 12, 0, 1023];

/// How the numbers of a patch are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kind {
    pub is_double: bool,
    is_little: bool,
}

/// The values of one patch in its file, not yet read.
#[derive(Debug, Clone)]
pub struct Fab {
    pub kind: Kind,
    /// With ghost cells.
    pub cells: Cells,
    file: PathBuf,
    first_byte: u64,
}

impl Fab {
    /// Finds the values of a patch, and that all of them are there.
    ///
    /// # Errors
    /// A file that cannot be read or ends before its values do, numbers of another kind, and other cells or variables than the
    /// level says.
    pub fn open(files: &mut Files, level: &Level, (number, patch): (usize, &Patch), dimension: usize) -> Result<Self> {
        let what = format!("patch {number} at byte {}", patch.offset);
        let wrong = |problem: String| FormatError::input(&patch.file, NAME, &what, problem);
        let head = files.bytes(&patch.file, patch.offset, LINE)?;
        let Some(end) = head.iter().position(|b| *b == b'\n') else {
            return Err(wrong(format!(
                "has no line that begins with {MARK}; the file is incomplete or the place is wrong"
            )));
        };
        let line = std::str::from_utf8(&head[..end]).ok().and_then(|line| line.strip_prefix(MARK));
        let Some(line) = line else {
            return Err(wrong(format!("does not begin with {MARK}; the place is wrong, or it is an older format")));
        };
        let mut scan = Scan::new(&patch.file, line);
        let kind = kind(&mut scan, &what)?;
        let Some(kind) = kind else {
            let what = format!("numbers that are not IEEE's of 4 or 8 bytes in one of both orders ({})", line.trim());
            return Err(FormatError::Unsupported { path: patch.file.clone(), format: NAME, what });
        };
        let cells = scan.cells(&what, dimension)?;
        let components: usize = scan.number(&what)?;
        let expected = Cells {
            lo: std::array::from_fn(|k| patch.cells.lo[k] - level.ghosts[k]),
            hi: std::array::from_fn(|k| patch.cells.hi[k] + level.ghosts[k]),
        };
        if cells != expected || components != level.components {
            let problem = format!(
                "has {components} variables in cells {:?} to {:?}, expected {} in {:?} to {:?}",
                cells.lo, cells.hi, level.components, expected.lo, expected.hi
            );
            return Err(wrong(problem));
        }
        let first_byte = patch.offset.saturating_add(end as u64 + 1);
        let fab = Self { kind, cells, file: patch.file.clone(), first_byte };
        let needed = fab.bytes_of_one().saturating_mul(components as u64);
        let there = files.length(&patch.file)?.saturating_sub(first_byte);
        if needed > there {
            let problem = format!("has {there} bytes of values, expected {needed}; the file is incomplete");
            return Err(wrong(problem));
        }
        Ok(fab)
    }

    fn bytes_of_one(&self) -> u64 {
        self.cells.count().saturating_mul(if self.kind.is_double { 8 } else { 4 })
    }

    /// All bytes of one variable.
    ///
    /// # Errors
    /// [`FormatError::Io`].
    pub fn read(&self, files: &mut Files, component: usize) -> Result<Vec<u8>> {
        let bytes = self.bytes_of_one();
        files.bytes(&self.file, self.first_byte.saturating_add(bytes.saturating_mul(component as u64)), bytes)
    }

    /// Hands the values of `part`, in cells as the patch counts them, to `take`, x fastest. `bytes` are those of one variable.
    pub fn for_each(&self, bytes: &[u8], part: &Cells, mut take: impl FnMut(f64)) {
        let width = if self.kind.is_double { 8 } else { 4 };
        let [nx, ny, _] = self.cells.sizes().map(|n| n as usize);
        let at = |k: usize, i: i64| (i - self.cells.lo[k]) as usize;
        for z in part.lo[2]..part.hi[2] {
            for y in part.lo[1]..part.hi[1] {
                let row = nx * (at(1, y) + ny * at(2, z));
                let range = width * (row + at(0, part.lo[0]))..width * (row + at(0, part.hi[0]));
                for value in bytes.get(range).unwrap_or_default().chunks_exact(width) {
                    take(self.kind.value(value));
                }
            }
        }
    }
}

impl Kind {
    fn value(self, bytes: &[u8]) -> f64 {
        match (<[u8; 8]>::try_from(bytes), <[u8; 4]>::try_from(bytes)) {
            (Ok(own), _) if self.is_little => f64::from_le_bytes(own),
            (Ok(own), _) => f64::from_be_bytes(own),
            (_, Ok(own)) if self.is_little => f32::from_le_bytes(own).into(),
            (_, Ok(own)) => f32::from_be_bytes(own).into(),
            _ => f64::NAN,
        }
    }
}

/// The kind of numbers by their description; `None` where it is none of those that are read.
fn kind(scan: &mut Scan, what: &str) -> Result<Option<Kind>> {
    let count: usize = scan.number(what)?;
    if count != 8 {
        return Ok(None);
    }
    let mut format = [0_i64; 8];
    for slot in &mut format {
        *slot = scan.number(what)?;
    }
    let width: usize = scan.number(what)?;
    let expected = match format {
        SINGLE => 4,
        DOUBLE => 8,
        _ => return Ok(None),
    };
    if width != expected {
        return Ok(None);
    }
    let order: Vec<usize> = (0..width).map(|_| scan.number(what)).collect::<Result<_>>()?;
    let is_little = order.iter().copied().eq((1..=width).rev());
    let is_big = order.iter().copied().eq(1..=width);
    Ok((is_little || is_big).then_some(Kind { is_double: width == 8, is_little }))
}

/// Data files, of which the last one stays open.
#[derive(Default)]
pub struct Files {
    open: Option<(PathBuf, File, u64)>,
}

impl Files {
    fn file(&mut self, path: &Path) -> Result<&mut (PathBuf, File, u64)> {
        let is_open = self.open.as_ref().is_some_and(|(own, ..)| own == path);
        if !is_open {
            let io = |e| FormatError::io(path, "open", e);
            let file = File::open(path).map_err(io)?;
            let length = file.metadata().map_err(io)?.len();
            self.open = Some((path.into(), file, length));
        }
        self.open.as_mut().ok_or_else(|| FormatError::io(path, "open", std::io::ErrorKind::NotFound.into()))
    }

    /// Bytes of a file.
    ///
    /// # Errors
    /// [`FormatError::Io`].
    pub fn length(&mut self, path: &Path) -> Result<u64> {
        self.file(path).map(|(.., length)| *length)
    }

    /// Up to so many bytes; fewer where the file ends.
    fn bytes(&mut self, path: &Path, first: u64, count: u64) -> Result<Vec<u8>> {
        let (_, file, length) = self.file(path)?;
        let there = length.saturating_sub(first).min(count);
        let mut bytes = Vec::with_capacity(there as usize);
        let io = |e| FormatError::io(path, "read", e);
        file.seek(SeekFrom::Start(first.min(*length))).map_err(io)?;
        file.take(there).read_to_end(&mut bytes).map_err(io)?;
        Ok(bytes)
    }
}
