//! Files of checkpoints: a mark, the version of the layout, a checksum, and what is kept.

use super::fingerprint::Hash;

/// Version of the layout; another program version is refused by the scene's own line.
const LAYOUT: u32 = 6;
/// Mark, layout and checksum.
pub(super) const HEADER: usize = 20;

/// What is said of bytes that are no state of this program's.
pub(super) fn unreadable(error: &postcard::Error) -> String {
    format!("its content cannot be read ({error}); start without it")
}

/// A file's bytes behind `mark`, and their checksum.
pub(super) fn framed(
    mark: &[u8; 8],
    payload: impl FnOnce(Vec<u8>) -> std::result::Result<Vec<u8>, String>,
) -> std::result::Result<(Vec<u8>, u64), String> {
    let mut bytes = payload(vec![0; HEADER])?;
    let checksum = Hash::of(&bytes[HEADER..]);
    bytes[..8].copy_from_slice(mark);
    bytes[8..12].copy_from_slice(&LAYOUT.to_le_bytes());
    bytes[12..HEADER].copy_from_slice(&checksum.to_le_bytes());
    Ok((bytes, checksum))
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
