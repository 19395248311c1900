//! SPH-EXA HDF5 files: the H5Part layout that `sphexa --init FILE` starts from, and its own outputs.
//!
//! Everything is in the group `/Step#0` (its outputs: the last `/Step#n`).
//!
//! | dataset             | type   | from                                                                          |
//! |---------------------|--------|-------------------------------------------------------------------------------|
//! | x, y, z             | f8     | required; within the box                                                      |
//! | vx, vy, vz          | f4     | zeros where absent                                                            |
//! | x_m1, y_m1, z_m1    | f4     | the last step's displacement: velocity times `minDt_m1`                       |
//! | h                   | f4     | half the kernel's support radius                                              |
//! | m                   | f4     | required                                                                      |
//! | temp                | f8     | u mui (gamma - 1) / R of the internal energy u per mass, which is required    |
//! | u                   | f8     | the same u, for the code's propagators that evolve it; read in preference      |
//! | alpha, du_m1        | f4     | columns of this name, else the code's floor of the viscosity, 0.05, and zeros |
//! | rho                 | f4     | if known; ignored by the code                                                 |
//! | id                  | u8     | 1 ... N where absent                                                          |
//!
//! | attribute            | type    | content                                                                     |
//! |----------------------|---------|-----------------------------------------------------------------------------|
//! | box                  | 6 f8    | xmin, xmax, ymin, ymax, zmin, zmax                                           |
//! | boundaryType         | 3 i1    | 0 open, 1 periodic                                                          |
//! | iteration, numParticlesGlobal | u8 | 1, N                                                                     |
//! | time, minDt, minDt_m1 | f8     | the time steps are a tenth of the Courant condition                       |
//! | gravConstant         | f8      | Newton's constant in the file's units; 0 where an axis is periodic          |
//! | eps                  | f8      | half the smallest spacing, where there is gravity and the density is known  |
//! | ng0, ngmax           | u4      | neighbors aimed at and half as many more, where the sums are of its kernel  |
//! | gamma, muiConst      | f8, f4  | the gas's index (5/3 by default) and 10: with them temp means the u above     |
//!
//! Each dataset has an attribute `unit exponents` of length, mass, time and temperature. All attributes are arrays. Quirks: three dimensions and gas only; nothing states units, so they and the header's other
//! facts are texts in the group `/SphPrep`, without which numbers are read as pure ones. A box whose corner is not at the
//! origin is shifted there when read, with a note. f4 columns are f8 in double precision.
//!
//! Layout after SPH-EXA's `main/src/init/file_init.hpp`, `main/src/io/ifile_io_hdf5.cpp`, `sph/particles_data.hpp`.

use crate::registry::{Capabilities, FormatSpec, Match, ReadFn, WriteFn, contains};

#[cfg(feature = "sph-exa")]
mod read;
#[cfg(feature = "sph-exa")]
mod schema;
#[cfg(feature = "sph-exa")]
mod write;

#[cfg(feature = "sph-exa")]
const CODE: (Option<ReadFn>, Option<WriteFn>) = (Some(read::read), Some(write::write));
#[cfg(not(feature = "sph-exa"))]
const CODE: (Option<ReadFn>, Option<WriteFn>) = (None, None);

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: "sph-exa",
    summary: "SPH-EXA HDF5 files (H5Part steps)",
    extensions: &["sphexa"],
    feature: "sph-exa",
    reference: "https://github.com/sphexa-org/sphexa",
    capabilities: Capabilities {
        read_particles: true,
        write_particles: true,
        requires: &[crate::particle_names::INTERNAL_ENERGY],
        dimensions: &[3],
        gas_alone: true,
        ..Capabilities::NONE
    },
    sniff,
    read: CODE.0,
    write: CODE.1,
    stream: None,
};

/// Files that the HDF5 library wrote name a step at their start; ours do not.
fn sniff(head: &[u8]) -> Match {
    let container = crate::registry::sniff_hdf5(head);
    let step = contains(head, b"Step#");
    if container == Match::Container && step { Match::Certain } else { container }
}
