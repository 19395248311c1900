//! The bytes that a file begins with.

pub const NAME: &str = "gadget-binary";

/// Bytes of the header record.
pub const HEADER_BYTES: u32 = 256;
/// The same of GADGET-4 with six types of particles, as it is built by default.
pub const HEADER_BYTES_OF_4: u32 = 192;
/// Bytes of a name record.
pub const NAME_BYTES: u32 = 8;
