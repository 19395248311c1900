//! Wavefront OBJ files. Only their faces are read or, if there are none, lines in a plane of constant z as a curve in 2-D.
//!
//! | line | what |
//! |---|---|
//! | `v X Y Z [W]` | point |
//! | `f A B C ...` | polygon of point numbers, from 1, or counted back from -1; `A/T/N` with what is behind the slash left out |
//! | `l A B ...` | chain of segments |
//! | `vt vn vp o g s mtllib usemtl` | not read |
//!
//! A backslash at the end of a line continues it. Polygons become triangles. Curved surfaces (`curv`, `surf` and the
//! like) are left out with a note. There are no units.

#[cfg(feature = "obj")]
mod read;
mod schema;

use crate::registry::{Capabilities, FormatSpec, Match, ReadFn};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: schema::NAME,
    summary: "Wavefront OBJ surfaces; lines in a plane as curves in 2-D",
    extensions: &["obj"],
    feature: "obj",
    reference: "https://www.loc.gov/preservation/digital/formats/fdd/fdd000507.shtml",
    capabilities: Capabilities::of_fields(&["surface"], &[2, 3]),
    sniff,
    read: READ,
    write: None,
    stream: None,
};

#[cfg(feature = "obj")]
const READ: Option<ReadFn> = Some(read::read);
#[cfg(not(feature = "obj"))]
const READ: Option<ReadFn> = None;

fn sniff(head: &[u8]) -> Match {
    if schema::is_obj(&String::from_utf8_lossy(head)) { Match::Certain } else { Match::No }
}
