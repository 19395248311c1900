//! The name of the format and the names in its files.

pub const NAME: &str = "numpy";

/// First bytes of an array.
pub const MAGIC: &[u8; 6] = b"\x93NUMPY";

/// Name of the array that holds the header's facts.
#[cfg(feature = "numpy")]
pub const HEADER: &str = "header";
