//! SWIFT HDF5 initial conditions

use crate::registry::{Capabilities, FormatSpec, Match};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: "swift",
    summary: "SWIFT HDF5 initial conditions",
    extensions: &["hdf5"],
    feature: "swift",
    reference: "https://swift.strw.leidenuniv.nl/docs/InitialConditions/index.html",
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
