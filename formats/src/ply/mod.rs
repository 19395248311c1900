//! PLY files (Stanford's polygon format), text and binary of either byte order. Only points and faces are read.
//!
//! ```text
//! ply
//! format ascii 1.0                                (or binary_little_endian, binary_big_endian)
//! comment anything
//! element vertex 8                                then one row for each, in this order
//! property float x                                (char uchar short ushort int uint float double, or int8 ... float64)
//! property float y
//! property float z
//! element face 6
//! property list uchar int vertex_indices          (or vertex_index)
//! end_header
//! ```
//!
//! Quirks: other elements and properties are passed over. Polygons become triangles; strips of triangles (`tristrips`)
//! end with -1, and turn every other triangle. There are no units.

#[cfg(feature = "ply")]
mod header;
#[cfg(feature = "ply")]
mod read;
mod schema;

use crate::registry::{Capabilities, FormatSpec, Match, ReadFn};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: schema::NAME,
    summary: "PLY surfaces, text and binary",
    extensions: &["ply"],
    feature: "ply",
    reference: "https://gamma.cs.unc.edu/POWERPLANT/papers/ply.pdf",
    capabilities: Capabilities::of_fields(&["surface"], &[3]),
    sniff,
    read: READ,
    write: None,
    stream: None,
};

#[cfg(feature = "ply")]
const READ: Option<ReadFn> = Some(read::read);
#[cfg(not(feature = "ply"))]
const READ: Option<ReadFn> = None;

fn sniff(head: &[u8]) -> Match {
    if schema::is_ply(head) { Match::Certain } else { Match::No }
}
