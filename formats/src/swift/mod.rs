//! SWIFT HDF5 initial conditions. Written only: the `gadget` reader reads them, and SWIFT's snapshots.
//!
//! | dataset         | type        | from                                                             |
//! |-----------------|-------------|------------------------------------------------------------------|
//! | Coordinates     | f8 (N, 3)   | required; within the box, periodic or not                        |
//! | Velocities      | f4 (N, 3)   | zeros where absent                                               |
//! | Masses          | f4          | required                                                         |
//! | SmoothingLength | f4          | 1.2348 (m/rho)^(1/D): not the kernel's support radius, but from it where there is no Density |
//! | InternalEnergy  | f4          | required for gas; per mass                                       |
//! | ParticleIDs     | u8          | 1 ... N where absent                                             |
//! | Density         | f4          | for viewers; SWIFT ignores it                                    |
//! | MaterialIDs     | i4          | needed by the planetary schemes only                             |
//!
//! BoxSize has three elements where the box is not cubic. See [`crate::common::snapshot`] for the rest.
//! Dataset names after SWIFT commit 8a8f0d794 (`src/hydro/SPHENIX/hydro_io.h`, `src/single_io.c`).

use crate::registry::{Capabilities, FixedCorner, FormatSpec, Streaming};

#[cfg(feature = "swift")]
mod schema;
#[cfg(feature = "swift")]
mod write;

#[cfg(feature = "swift")]
const WRITE: Option<crate::registry::WriteFn> = Some(write::write);
#[cfg(not(feature = "swift"))]
const WRITE: Option<crate::registry::WriteFn> = None;

#[cfg(feature = "swift")]
const STREAM: Option<Streaming> =
    Some(Streaming { write: write::write_piece, names: crate::registry::FileNames::One, in_blocks: true });
#[cfg(not(feature = "swift"))]
const STREAM: Option<Streaming> = None;

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: "swift",
    summary: "SWIFT HDF5 initial conditions",
    extensions: &["hdf5"],
    feature: "swift",
    reference: "https://swift.strw.leidenuniv.nl/docs/InitialConditions/index.html",
    capabilities: Capabilities {
        write_particles: true,
        requires: &[crate::particle_names::INTERNAL_ENERGY],
        dimensions: &[1, 2, 3],
        corner: FixedCorner::Everywhere,
        magnetic: crate::magnetic::MagneticUnit::Current(1.0),
        ..Capabilities::NONE
    },
    sniff: crate::registry::sniff_hdf5,
    read: None,
    write: WRITE,
    stream: STREAM,
};
