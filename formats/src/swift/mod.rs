//! SWIFT initial conditions (HDF5), accepted as they are by GADGET-4, GIZMO and AREPO too.
//!
//! Layout: [`crate::common::snapshot`]; datasets: [`schema`]. What SWIFT demands was read in its `single_io.c` and
//! `hydro_io.h` (2026.04): singular dataset names, coordinates in [0, BoxSize) unless periodic, u > 0, and
//! h = eta (m/rho)^(1/d) with eta = `SPH:resolution_eta` = 1.2348, whose kernel ends at 1.825742 h in 3-D.

#[cfg(feature = "swift")]
mod schema;

use crate::registry::{Capabilities, FormatSpec, Match};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: "swift",
    summary: "SWIFT HDF5 initial conditions, accepted by GADGET-4, GIZMO and AREPO too",
    extensions: &["hdf5"],
    feature: "swift",
    reference: "https://swift.strw.leidenuniv.nl/docs/InitialConditions/index.html",
    capabilities: Capabilities {
        read_field: false,
        read_particles: false,
        write_particles: true,
        geometries: &[],
        dimensions: &[1, 2, 3],
    },
    sniff,
    read: None,
    #[cfg(feature = "swift")]
    write: Some(|path, file, options| crate::common::snapshot::write(&schema::FLAVOR, path, file, options)),
    #[cfg(not(feature = "swift"))]
    write: None,
};

/// Reading is the GADGET format's, which takes both layouts.
fn sniff(_head: &[u8]) -> Match {
    Match::No
}
