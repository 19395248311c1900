//! GADGET-2/3/4 HDF5 initial conditions and snapshots; those of GIZMO, AREPO and SWIFT are read as well.
//!
//! | dataset         | type        | from                                                             |
//! |-----------------|-------------|------------------------------------------------------------------|
//! | Coordinates     | f8 (N, 3)   | required                                                         |
//! | Velocities      | f4 (N, 3)   | zeros where absent                                               |
//! | Masses          | f4          | required; MassTable stays zero, since it would override them     |
//! | SmoothingLength | f4          | if known: the kernel's support radius, a first guess to the code |
//! | InternalEnergy  | f4          | required for gas; per mass (Flag_Entropy_ICs is 0)               |
//! | ParticleIDs     | u8          | 1 ... N where absent; GADGET-4 keeps 31 bits of them by default  |
//! | Density         | f4          | for viewers                                                      |
//!
//! GADGET-4 reads one BoxSize only, so other than cubic boxes are refused. Its template configuration turns on
//! `INITIAL_CONDITIONS_CONTAIN_ENTROPY`: turn it off. See [`crate::common::snapshot`] for the rest.

use crate::registry::{Capabilities, FixedCorner, FormatSpec, Match, ReadFn, Streaming, WriteFn};

#[cfg(feature = "gadget")]
mod doubts;
#[cfg(feature = "gadget")]
mod laid_out;
#[cfg(feature = "gadget")]
mod read;
#[cfg(feature = "gadget")]
mod schema;
#[cfg(feature = "gadget")]
mod write;

#[cfg(feature = "gadget")]
const CODE: (Option<ReadFn>, Option<WriteFn>) = (Some(read::read), Some(write::write));
#[cfg(not(feature = "gadget"))]
const CODE: (Option<ReadFn>, Option<WriteFn>) = (None, None);

#[cfg(feature = "gadget")]
const STREAM: Option<Streaming> =
    Some(Streaming { write: write::write_piece, names: crate::registry::FileNames::Numbered, in_blocks: true });
#[cfg(not(feature = "gadget"))]
const STREAM: Option<Streaming> = None;

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: "gadget",
    summary: "GADGET-2/3/4 HDF5 files; reads GIZMO, AREPO and SWIFT as well",
    extensions: &["h5", "hdf5", "arepo", "gizmo"],
    feature: "gadget",
    reference: "https://wwwmpa.mpa-garching.mpg.de/gadget4/",
    capabilities: Capabilities {
        read_particles: true,
        write_particles: true,
        requires: &[crate::particle_names::INTERNAL_ENERGY],
        dimensions: &[1, 2, 3],
        halved_box: true,
        corner: FixedCorner::Periodic,
        ..Capabilities::NONE
    },
    sniff,
    read: CODE.0,
    write: CODE.1,
    stream: STREAM,
};

/// An HDF5 file that names particle types; the same magic bytes begin many others.
fn sniff(head: &[u8]) -> Match {
    let container = crate::registry::sniff_hdf5(head);
    let has = |name: &[u8]| crate::registry::contains(head, name);
    let particles = has(b"PartType") || has(b"NumPart_Total");
    if container == Match::Container && particles { Match::Certain } else { container }
}
