//! The bytes that a file begins with.

pub const NAME: &str = "image";

/// First bytes of PNG files.
pub const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
/// First bytes of TIFF and BigTIFF files in both byte orders.
pub const TIFF: [&[u8]; 4] = [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"];
