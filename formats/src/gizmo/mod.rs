//! GIZMO HDF5 initial conditions. Written only: the `gadget` reader reads them, and GIZMO's snapshots.
//!
//! | dataset         | type        | from                                                                    |
//! |-----------------|-------------|-------------------------------------------------------------------------|
//! | Coordinates     | f8 (N, 3)   | required; GIZMO rounds to f4 without `INPUT_POSITIONS_IN_DOUBLE`        |
//! | Velocities      | f4 (N, 3)   | zeros where absent: GIZMO hangs without them                            |
//! | Masses          | f4          | required                                                                |
//! | InternalEnergy  | f4          | required for gas; per mass; at 0 GIZMO hangs; unused if `InitGasTemp` > 0 |
//! | ParticleIDs     | u8          | 1 ... N where absent; 0 is special with `BOX_BND_PARTICLES`             |
//! | SmoothingLength | f4          | if known: the kernel's support radius, read with `INPUT_READ_HSML` only |
//! | Density         | f4          | if known; for viewers                                                   |
//!
//! GIZMO opens most header attributes without asking whether they exist, stops on Flag_DoublePrecision 1 whatever the
//! data, and takes the box from its parameter file (`BOX_LONG_X` and its like make it other than cubic: BoxSize is
//! its first edge, and `/SphPrep` has all of them). See [`crate::common::snapshot`] for the rest. After GIZMO c70c760, `read_ic.c`.

use crate::registry::{Capabilities, FixedCorner, FormatSpec, Streaming, WriteFn};

#[cfg(feature = "gizmo")]
mod schema;
#[cfg(feature = "gizmo")]
mod write;

#[cfg(feature = "gizmo")]
const WRITE: Option<WriteFn> = Some(write::write);
#[cfg(not(feature = "gizmo"))]
const WRITE: Option<WriteFn> = None;

#[cfg(feature = "gizmo")]
const STREAM: Option<Streaming> =
    Some(Streaming { write: write::write_piece, names: crate::registry::FileNames::Numbered, in_blocks: true });
#[cfg(not(feature = "gizmo"))]
const STREAM: Option<Streaming> = None;

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: "gizmo",
    summary: "GIZMO HDF5 initial conditions",
    extensions: &["gizmo", "hdf5", "h5"],
    feature: "gizmo",
    reference: "https://www.tapir.caltech.edu/~phopkins/Site/GIZMO_files/gizmo_documentation.html",
    capabilities: Capabilities {
        write_particles: true,
        requires: &[crate::particle_names::INTERNAL_ENERGY],
        dimensions: &[1, 2, 3],
        corner: FixedCorner::Periodic,
        magnetic: crate::magnetic::MagneticUnit::Gauss,
        ..Capabilities::NONE
    },
    sniff: crate::registry::sniff_hdf5,
    read: None,
    write: WRITE,
    stream: STREAM,
};
