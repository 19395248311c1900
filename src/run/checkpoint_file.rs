//! Checkpoint files: a magic number, the version of the layout, a checksum, and the state.

use super::fingerprint::Hash;
use crate::error::{Error, Result};
use sph_formats::FormatError;
use std::io::Read;
use std::path::Path;

/// Version of the layout; another program version is refused by the scene's own line.
const LAYOUT: u32 = 8;
/// Mark, layout and checksum.
const HEADER: usize = 20;

/// What is said of bytes that are no state of this program's.
pub(super) fn unreadable(error: &postcard::Error) -> String {
    format!("its content cannot be read ({error}); start without it")
}

/// Writes what `payload` appends behind `mark`; the checksum of it.
///
/// # Errors
/// A payload that cannot be made, or a file that cannot be written.
pub(super) fn write(
    path: &Path,
    mark: &[u8; 8],
    payload: impl FnOnce(Vec<u8>) -> std::result::Result<Vec<u8>, String>,
) -> Result<u64> {
    let bad = |problem: String| Error::Checkpoint { path: path.into(), problem: format!("cannot be made: {problem}") };
    let mut bytes = payload(vec![0; HEADER]).map_err(bad)?;
    let checksum = Hash::of(&bytes[HEADER..]);
    bytes[..8].copy_from_slice(mark);
    bytes[8..12].copy_from_slice(&LAYOUT.to_le_bytes());
    bytes[12..HEADER].copy_from_slice(&checksum.to_le_bytes());
    sph_formats::output::atomically(path, |temporary| {
        std::fs::write(temporary, &bytes).map_err(|e| FormatError::io(path, "write the checkpoint", e))
    })?;
    Ok(checksum)
}

/// The whole file if it begins with one of `marks`, else its beginning: what is none may be of any size.
///
/// # Errors
/// A file that cannot be read.
pub(super) fn read(path: &Path, marks: &[&[u8; 8]]) -> std::io::Result<Vec<u8>> {
    let mut file = std::fs::File::open(path)?;
    let mut bytes = Vec::new();
    file.by_ref().take(HEADER as u64).read_to_end(&mut bytes)?;
    if marks.iter().any(|mark| bytes.starts_with(*mark)) {
        file.read_to_end(&mut bytes)?;
    }
    Ok(bytes)
}

/// What follows the header of a file with this `mark`, up to so many bytes: enough to see what the file belongs to, and not whether it is whole.
pub(super) fn beginning(path: &Path, mark: &[u8; 8], most: u64) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    std::fs::File::open(path).ok()?.take(HEADER as u64 + most).read_to_end(&mut bytes).ok()?;
    let is_one = bytes.starts_with(mark) && number(&bytes, 8, 4) == Some(LAYOUT.into());
    bytes.get(HEADER..).filter(|_| is_one).map(<[u8]>::to_vec)
}

/// What follows the header, if that is as it should be.
pub(super) fn payload<'b>(bytes: &'b [u8], mark: &[u8; 8]) -> std::result::Result<&'b [u8], String> {
    if !bytes.starts_with(mark) {
        return Err("is no checkpoint of sph-prep; name the file that --checkpoint wrote".into());
    }
    let (Some(layout), Some(checksum), Some(payload)) = (number(bytes, 8, 4), checksum_of(bytes), bytes.get(HEADER..))
    else {
        return Err("is cut off; start without it".into());
    };
    if layout != u64::from(LAYOUT) {
        return Err(format!("has layout {layout}, expected {LAYOUT}: another version wrote it; start without it"));
    }
    if checksum != Hash::of(payload) {
        return Err("is cut off or damaged (its checksum does not hold); start without it".into());
    }
    Ok(payload)
}

/// What the header says.
pub(super) fn checksum_of(bytes: &[u8]) -> Option<u64> {
    number(bytes, 12, 8)
}

/// The little-endian number in `width` bytes from `at`.
fn number(bytes: &[u8], at: usize, width: usize) -> Option<u64> {
    Some(bytes.get(at..at + width)?.iter().rev().fold(0, |n, &b| n << 8 | u64::from(b)))
}
