//! VTK legacy and XML files, for ParaView

use crate::registry::{Capabilities, FormatSpec, Match};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: "vtk",
    summary: "VTK legacy and XML files, for ParaView",
    extensions: &["vtu", "vtp", "vti", "vtr", "vts", "vtk"],
    feature: "vtk",
    reference: "https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html",
    capabilities: Capabilities {
        read_field: true,
        read_particles: true,
        write_particles: true,
        geometries: &[],
        dimensions: &[1, 2, 3],
    },
    sniff,
    read: None,
    write: None,
};

fn sniff(_head: &[u8]) -> Match {
    Match::No
}
