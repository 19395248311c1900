//! What begins a file.

pub const NAME: &str = "gadget-binary";

/// Bytes of the header record.
pub const HEADER_BYTES: u32 = 256;
/// Bytes of a name record.
pub const NAME_BYTES: u32 = 8;
