//! PLY files (Stanford's polygon format): of them the points and faces; text and binary of either byte order.
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
//! Quirks: other elements and properties are passed over. Polygons become fans of triangles; strips of triangles (`tristrips`)
//! end with -1, and turn every other triangle. There are no units.

#[cfg(feature = "ply")]
mod read;
#[cfg(feature = "ply")]
mod schema;

use crate::registry::{Capabilities, Columns, FormatSpec, Match, ReadFn};

/// Name of the format in messages.
const NAME: &str = "ply";

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: NAME,
    summary: "PLY surfaces, text and binary",
    extensions: &["ply"],
    feature: "ply",
    reference: "https://gamma.cs.unc.edu/POWERPLANT/papers/ply.pdf",
    capabilities: Capabilities {
        read_field: true,
        read_particles: false,
        write_particles: false,
        requires: &[],
        geometries: &["surface"],
        dimensions: &[3],
        equal_masses: false,
        columns: Columns::Any,
        cubic_box: false,
    },
    sniff,
    read: READ,
    write: None,
};

#[cfg(feature = "ply")]
const READ: Option<ReadFn> = Some(read::read);
#[cfg(not(feature = "ply"))]
const READ: Option<ReadFn> = None;

fn sniff(head: &[u8]) -> Match {
    let first = head.split(|b| *b == b'\n').next().unwrap_or_default();
    if first == b"ply" || first == b"ply\r" { Match::Certain } else { Match::No }
}
