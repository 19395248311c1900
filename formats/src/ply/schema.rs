//! The bytes by which a PLY file is recognized.

pub const NAME: &str = "ply";

/// Whether bytes begin with the first line of a PLY file.
pub fn is_ply(head: &[u8]) -> bool {
    let first = head.split(|b| *b == b'\n').next().unwrap_or_default();
    first == b"ply" || first == b"ply\r"
}
