//! Phantom's own binary dumps: tagged Fortran records, from which `phantom` starts a run.
//!
//! | record                                     | content                                                                     |
//! |--------------------------------------------|-----------------------------------------------------------------------------|
//! | capture pattern                            | i4 60769, real 60878, i4 60878, i4 version, i4 690706: tells byte order and width |
//! | identity                                   | 100 characters; `F` full or `S` small dump, `T` tagged                      |
//! | 8 header blocks                            | of i4, i1, i2, i4, i8, real, f4, f8: number of items; 16-character tags; values |
//! | number of array lengths                    | 2 per MPI block: particles, sinks                                           |
//! | one per array length                       | i8 length, 8 i4: arrays of each of the 8 types                              |
//! | per array                                  | a 16-character tag, and the values                                          |
//!
//! | array      | type     | from                                                                              |
//! |------------|----------|-----------------------------------------------------------------------------------|
//! | itype      | i1       | written where there is more than gas: 1 gas, 3 boundary, 4 star, 5 dark matter, 6 bulge, 7 dust |
//! | x, y, z    | f8       | required                                                                          |
//! | vx, vy, vz | f8       | zeros where absent                                                                |
//! | u          | f8       | required for gas, per mass                                                        |
//! | h          | f4 (f8)  | 1.2 (m/rho)^(1/3), else from the support radius: Phantom's density is m (1.2/h)^3 |
//! | iorig      | i8       | ids, 1 ... N where absent                                                         |
//! | others     | f4 (f8)  | columns of one component whose name has at most 16 ASCII characters                |
//!
//! The masses are in the header, one per type (`massoftype`): unequal ones are refused. Phantom's gravity has no constant,
//! so the time unit is chosen to make G = 1 and velocities and energies are converted to it; where all units are 1, numbers
//! are taken for pure ones and stay. In open boxes, of matter that may attract itself, the header then has the units that Phantom would take itself (au,
//! solar masses), and `pure_numbers`, which the reader goes by. A box is periodic along all axes or none. Reading: h becomes Density (by the
//! header's `hfact`) and SupportRadius (2 h); particles of h <= 0, which Phantom has accreted, are left out with
//! a note. f4 are f8 in double precision.
//!
//! Bx, By and Bz are in the fourth block of arrays, as Phantom has them; the reader finds them in the first, too.
//!
//! Particles with a column SofteningRadius or AccretionRadius are sinks, in arrays of their own: x, y, z, m, h (the accretion
//! radius), hsoft (half of the softening radius, from which on the attraction is that of a point), vx, vy and vz, all f8. Read, they
//! are of the first type of 1, 5, 4, 3, 2 that no other particles have.
//!
//! The gas of a disc about one point mass whose temperature is a power of the distance from it (the header says that it is a disc) is Phantom's
//! `ieos = 6`: gamma = 1, RK2 = 3/2 K, qfacdisc = q and isink, the number of the star, in the header.
//!
//! Layout after Phantom's `src/main/readwrite_dumps_fortran.f90`, `readwrite_dumps_common.f90` and `utils_dumpfiles.f90`.
//! Records of 2 GiB and more are split as gfortran does it: a negative length says that more follows or came before.

use crate::particle_names as names;
use crate::registry::{Capabilities, Columns, FormatSpec, Match, Origin, ReadFn, WriteFn};
use schema::{CAPTURE, NAME};

#[cfg(feature = "phantom")]
mod layout;
mod locally_isothermal;
#[cfg(feature = "phantom")]
mod read;
mod schema;
#[cfg(feature = "phantom")]
mod sinks;
#[cfg(feature = "phantom")]
mod write;

pub use locally_isothermal::LocallyIsothermal;
pub use schema::units;

#[cfg(feature = "phantom")]
const CODE: (Option<ReadFn>, Option<WriteFn>) = (Some(read::read), Some(write::write));
#[cfg(not(feature = "phantom"))]
const CODE: (Option<ReadFn>, Option<WriteFn>) = (None, None);

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: NAME,
    summary: "Phantom dumps (tagged Fortran records)",
    extensions: &["phantom", "tmp"],
    feature: "phantom",
    reference: "https://phantomsph.readthedocs.io/en/latest/user-guide/dumpfile.html",
    capabilities: Capabilities {
        read_particles: true,
        write_particles: true,
        requires: &[crate::particle_names::INTERNAL_ENERGY],
        dimensions: &[3],
        equal_masses: true,
        alike_axes: true,
        columns: Columns::Scalars { longest_name: 16, vectors: &[names::VELOCITIES, names::MAGNETIC_FIELD] },
        origin: Origin::CenterOfMass,
        ..Capabilities::NONE
    },
    sniff,
    read: CODE.0,
    write: CODE.1,
    stream: None,
};

/// The length of the first record and the integer in it, in either byte order.
fn sniff(head: &[u8]) -> Match {
    let word = |at: usize| head.get(at..)?.first_chunk::<4>().copied();
    let is = |read: fn([u8; 4]) -> i32| {
        word(0).map(read).is_some_and(|n| n == 24 || n == 20) && word(4).map(read) == Some(CAPTURE)
    };
    if is(i32::from_le_bytes) || is(i32::from_be_bytes) { Match::Certain } else { Match::No }
}
