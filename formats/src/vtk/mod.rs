//! VTK files for ParaView and friends.
//!
//! Reading: XML (`.vti`, `.vtr`, `.vts`, `.vtu`, `.vtp`; ASCII, inline and appended, base64 and raw; zlib, LZ4, LZMA) and legacy
//! (ASCII and binary). Axes of one node are dropped; curvilinear grids become hexahedra or quadrilaterals; vertex-only
//! files are point clouds, or particles where there are masses.
//!
//! Particles in pieces that a `.pvtu` or `.pvtp` lists are read and written together.
//!
//! Writing: `.vtu` and `.vtp` (XML, zlib blocks in appended base64, 64-bit headers, which VTK, ParaView, pyvista and, for
//! `.vtu`, meshio read) and legacy `.vtk` (version 4.2, binary, big-endian). Every particle is a vertex cell, without
//! which ParaView draws nothing. `SupportRadius` is the radius at which the placement's kernel vanishes.

#[cfg(feature = "vtk")]
mod dataset;
#[cfg(feature = "vtk")]
mod decode;
#[cfg(feature = "vtk")]
mod element;
#[cfg(feature = "vtk")]
mod ghosts;
#[cfg(feature = "vtk")]
mod legacy;
#[cfg(feature = "vtk")]
mod particles;
#[cfg(feature = "vtk")]
mod pieces;
#[cfg(feature = "vtk")]
mod read;
mod schema;
#[cfg(feature = "vtk")]
mod write;
#[cfg(feature = "vtk")]
mod xml;

use crate::registry::{Capabilities, FormatSpec, Match, Streaming};

#[cfg(feature = "vtk")]
const STREAM: Option<Streaming> = Some(Streaming {
    write: pieces::write_piece,
    names: crate::registry::FileNames::Listed {
        extensions: &[("pvtu", "vtu"), ("pvtp", "vtp")],
        index: pieces::write_index,
    },
    in_blocks: false,
});
#[cfg(not(feature = "vtk"))]
const STREAM: Option<Streaming> = None;

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: schema::NAME,
    summary: "VTK XML and legacy files, for ParaView",
    extensions: &["vtu", "vtp", "vtk", "vti", "vtr", "vts", "pvtu", "pvtp"],
    feature: "vtk",
    reference: "https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html",
    capabilities: Capabilities {
        read_field: true,
        read_particles: true,
        write_particles: true,
        geometries: &["grid", "mesh", "cloud"],
        dimensions: &[1, 2, 3],
        ..Capabilities::NONE
    },
    sniff,
    #[cfg(feature = "vtk")]
    read: Some(read::read),
    #[cfg(not(feature = "vtk"))]
    read: None,
    #[cfg(feature = "vtk")]
    write: Some(write::write),
    #[cfg(not(feature = "vtk"))]
    write: None,
    stream: STREAM,
};

fn sniff(head: &[u8]) -> Match {
    let text = String::from_utf8_lossy(head);
    let legacy = text.to_ascii_lowercase().starts_with("# vtk datafile");
    if legacy || text.contains("<VTKFile") { Match::Certain } else { Match::No }
}
