//! GADGET-2/3/4, GIZMO and AREPO HDF5 snapshots

use crate::registry::{Capabilities, FormatSpec, Match};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: "gadget",
    summary: "GADGET-2/3/4, GIZMO and AREPO HDF5 snapshots",
    extensions: &["hdf5"],
    feature: "gadget",
    reference: "https://wwwmpa.mpa-garching.mpg.de/gadget4/",
    capabilities: Capabilities {
        read_field: false,
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
