//! STL files: triangles without anything else, as text and in binary.
//!
//! Binary, little-endian:
//!
//! | bytes | what |
//! |---|---|
//! | 80 | header, of no meaning |
//! | 4 | number N of triangles, u32 |
//! | N times 50 | normal, three corners (12 f32), 2 bytes of attributes |
//!
//! Text: `solid NAME`, then per triangle `facet normal X Y Z`, `outer loop`, three lines `vertex X Y Z`, `endloop`, `endfacet`, and
//! `endsolid` in the end; a file may have several solids.
//!
//! Quirks: normals are often zero or wrong and are not read; corners go counterclockwise as seen from outside. Headers of binary
//! files may begin with `solid`: what counts is whether the length is that of the number of triangles. There are no units.

#[cfg(feature = "stl")]
mod read;
mod schema;

use crate::registry::{Capabilities, FormatSpec, Match, ReadFn};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: schema::NAME,
    summary: "STL triangle surfaces, text and binary",
    extensions: &["stl"],
    feature: "stl",
    reference: "https://www.fabbers.com/tech/STL_Format",
    capabilities: Capabilities::of_fields(&["surface"], &[3]),
    sniff,
    read: READ,
    write: None,
    stream: None,
};

#[cfg(feature = "stl")]
const READ: Option<ReadFn> = Some(read::read);
#[cfg(not(feature = "stl"))]
const READ: Option<ReadFn> = None;

fn sniff(head: &[u8]) -> Match {
    if schema::is_text(head) {
        Match::Certain
    } else if schema::has_records(head) {
        Match::Container
    } else {
        Match::No
    }
}
