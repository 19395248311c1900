//! AREPO HDF5 initial conditions. Written only: the `gadget` reader reads them, and AREPO's snapshots.
//!
//! | dataset        | type        | from                                                                          |
//! |----------------|-------------|-------------------------------------------------------------------------------|
//! | Coordinates    | f8 (N, 3)   | required; generators of the mesh, within the box, periodic or not             |
//! | Velocities     | f4 (N, 3)   | zeros where absent                                                            |
//! | Masses         | f4          | required; masses, not densities: build without `READ_MASS_AS_DENSITY_IN_INPUT` |
//! | InternalEnergy | f4          | required for gas; per mass                                                    |
//! | ParticleIDs    | u8          | 1 ... N where absent; more than 31 bits of them need `LONGIDS`                |
//! | Density        | f4          | if known; for viewers, AREPO divides masses by the volumes of its cells       |
//!
//! Cells have no kernel, so support radii are not written. The header holds cosmological parameters, which AREPO
//! opens even where it does not use them. BoxSize is one number, the first edge
//! of a box other than cubic (`LONG_Y` and `LONG_Z` are the others over it, and `/SphPrep` has all of them).
//! See [`crate::common::snapshot`] for the rest. AREPO itself was not at hand to try the files.

use crate::registry::{Capabilities, FixedCorner, FormatSpec, Streaming, WriteFn};

#[cfg(feature = "arepo")]
mod schema;
#[cfg(feature = "arepo")]
mod write;

#[cfg(feature = "arepo")]
const WRITE: Option<WriteFn> = Some(write::write);
#[cfg(not(feature = "arepo"))]
const WRITE: Option<WriteFn> = None;

#[cfg(feature = "arepo")]
const STREAM: Option<Streaming> =
    Some(Streaming { write: write::write_piece, names: crate::registry::FileNames::Numbered, in_blocks: true });
#[cfg(not(feature = "arepo"))]
const STREAM: Option<Streaming> = None;

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: "arepo",
    summary: "AREPO HDF5 initial conditions",
    extensions: &["arepo", "hdf5", "h5"],
    feature: "arepo",
    reference: "https://arepo-code.org/wp-content/userguide/snapshotformat.html",
    capabilities: Capabilities {
        write_particles: true,
        requires: &[crate::particle_names::INTERNAL_ENERGY],
        dimensions: &[1, 2, 3],
        corner: FixedCorner::Everywhere,
        magnetic: crate::magnetic::MagneticUnit::Gaussian,
        ..Capabilities::NONE
    },
    sniff: crate::registry::sniff_hdf5,
    read: None,
    write: WRITE,
    stream: STREAM,
};
