//! NumPy files: particles as an `.npz` archive of named arrays, densities as `.npy` arrays.
//!
//! | file | content | read as |
//! |---|---|---|
//! | `.npz` | `Coordinates` (N, D) or `x`, `y`, `z`, with `Masses` or `mass`, and any arrays of N rows | particles |
//! | `.npz` | arrays of one shape in 1 to 3 dimensions | grid |
//! | `.npz` | the same with arrays `x`, `y`, `z` of positions, or of edges (one more) | grid on these axes |
//! | `.npz` | the same with arrays `r`, `theta`, `phi`, or `R`, `phi`, `z`, or `R`, `z`, `phi`, without those of a single cell | grid on these axes, radial profile for `r` alone |
//! | `.npz` | with those, arrays of one more index of 2 or 3, the last | vectors |
//! | `.npy` | one array in 1 to 3 dimensions | grid of its density |
//!
//! Grids: the first index is x; without axes of their own, the values are averages of equal cells that fill the box of the scene, else that from 0
//! to 1; axes of length 1 are dropped. Particles are written with positions in f8 and the rest in f4 (or f8), and with a text array `header`
//! for units, box, kernel and provenance. Numbers of 16 bits to 64 bits in both byte orders and both index orders are
//! read; structured arrays and pickled objects are refused.

use crate::registry::{Capabilities, FormatSpec, Match, ReadFn, WriteFn};

#[cfg(feature = "numpy")]
mod grid;
#[cfg(feature = "numpy")]
mod npy;
#[cfg(feature = "numpy")]
mod read;
mod schema;
#[cfg(feature = "numpy")]
mod write;

#[cfg(feature = "numpy")]
const CODE: (Option<ReadFn>, Option<WriteFn>) = (Some(read::read), Some(write::write));
#[cfg(not(feature = "numpy"))]
const CODE: (Option<ReadFn>, Option<WriteFn>) = (None, None);

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: schema::NAME,
    summary: "NumPy archives of particles (.npz), arrays of densities (.npy)",
    extensions: &["npz", "npy"],
    feature: "numpy",
    reference: "https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html",
    capabilities: Capabilities {
        read_field: true,
        read_particles: true,
        write_particles: true,
        geometries: &["grid"],
        dimensions: &[1, 2, 3],
        ..Capabilities::NONE
    },
    sniff,
    read: CODE.0,
    write: CODE.1,
    stream: None,
};

fn sniff(head: &[u8]) -> Match {
    if head.starts_with(schema::MAGIC) {
        Match::Certain
    } else if head.starts_with(b"PK\x03\x04") || head.starts_with(b"PK\x05\x06") {
        Match::Container
    } else {
        Match::No
    }
}
