//! Images as density maps in the plane: PNG and TIFF.
//!
//! | what | read as |
//! |---|---|
//! | pixel | average over a square cell; the picture is 1 wide, and so high that its pixels are square |
//! | rows | the top one has the largest y |
//! | 1 to 16 bits | density from 0 (black, vacuum) to 1 (white), so that the depth of the file changes nothing |
//! | 32 bits, 64 bits and floats (TIFF) | density as it is; NaN is missing |
//! | colors | luminance 0.2126 R + 0.7152 G + 0.0722 B (Rec. ITU-R BT.709-6, item 3.2) of the stored numbers |
//! | alpha | refused unless all is opaque |
//!
//! Quirks: numbers are taken as stored, without gamma or color profile, since a density map is data and no photograph;
//! an image of one row or column is one-dimensional; of several images in a TIFF file the first is read, and of an
//! animated PNG the still one; in TIFF, deflate, LZW and PackBits are read.

use crate::registry::{Capabilities, FormatSpec, Match, ReadFn};
use schema::{NAME, PNG, TIFF};

#[cfg(feature = "image")]
mod picture;
#[cfg(feature = "image")]
mod png;
#[cfg(feature = "image")]
mod read;
mod schema;
#[cfg(feature = "image")]
mod tiff;

#[cfg(feature = "image")]
const READ: Option<ReadFn> = Some(read::read);
#[cfg(not(feature = "image"))]
const READ: Option<ReadFn> = None;

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: NAME,
    summary: "PNG and TIFF images as density maps in 2-D",
    extensions: &["png", "tif", "tiff"],
    feature: "image",
    reference: "https://www.w3.org/TR/png-3/",
    capabilities: Capabilities::of_fields(&["grid"], &[1, 2]),
    sniff,
    read: READ,
    write: None,
    stream: None,
};

fn sniff(head: &[u8]) -> Match {
    let known = head.starts_with(PNG) || TIFF.iter().any(|magic| head.starts_with(magic));
    if known { Match::Certain } else { Match::No }
}
