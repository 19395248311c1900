//! GADGET-style HDF5 snapshots: GADGET-2/3/4, GIZMO, AREPO, and SWIFT's initial conditions for reading.
//!
//! Layout: [`crate::common::snapshot`]; datasets: [`schema`]. `SmoothingLength` is the radius at which the kernel
//! vanishes (GADGET's convention). GADGET-4 wants a box with one edge, IDs below 2^31 unless built with
//! IDS_64BIT, and takes missing datasets for zero, so that all of them are written.

#[cfg(feature = "gadget")]
mod read;
#[cfg(feature = "gadget")]
mod schema;

use crate::registry::{Capabilities, FormatSpec, Match};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: "gadget",
    summary: "GADGET-4, GIZMO and AREPO HDF5 snapshots; reads SWIFT's too",
    extensions: &["h5", "hdf5"],
    feature: "gadget",
    reference: "https://wwwmpa.mpa-garching.mpg.de/gadget4/",
    capabilities: Capabilities {
        read_field: false,
        read_particles: true,
        write_particles: true,
        geometries: &["cloud"],
        dimensions: &[1, 2, 3],
    },
    sniff,
    #[cfg(feature = "gadget")]
    read: Some(read::read),
    #[cfg(not(feature = "gadget"))]
    read: None,
    #[cfg(feature = "gadget")]
    write: Some(|path, file, options| crate::common::snapshot::write(&schema::FLAVOR, path, file, options)),
    #[cfg(not(feature = "gadget"))]
    write: None,
};

/// Any HDF5 file; NetCDF-4 files are told apart by their extension.
fn sniff(head: &[u8]) -> Match {
    if head.starts_with(b"\x89HDF\r\n\x1a\n") { Match::Container } else { Match::No }
}
