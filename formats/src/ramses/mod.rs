//! RAMSES outputs: folders `output_00001`.
//!
//! | file | content |
//! |---|---|
//! | `info_00001.txt` | numbers of files and dimensions, levels, size of the box, time, units in cgs |
//! | `hydro_file_descriptor.txt` | names of the hydro variables, in either of two styles |
//! | `amr_00001.out00001` and on | one for each process: the octs that it owns, and copies of those around them and at boundaries |
//! | `hydro_00001.out00001` and on | values of the cells of the same octs |
//!
//! Both kinds are Fortran records, in either byte order, of numbers of 4 or 8 bytes. An oct of level l has 2^d cells of 2^-l coarse
//! cells; cells that hold an oct of the next level are averages of it and are left out, as are copies. Positions count in coarse
//! cells, of which there are more at the ends of an axis that has boundaries: the box is that of the octs of level 1.
//!
//! Read are one to three dimensions. Without a descriptor the variables are density, velocities, pressure and scalars, as hydro
//! runs have them; from 11 variables on they may be those of magnetic runs, of which only what both share gets a name. `B_x_left`
//! and `B_x_right`, of the faces of a cell, become their mean, `magnetic_field_x`. Numbers are in the units that the info file
//! states, and without units where all of these are 1. An axis without boundaries is periodic. Particles, gravity and radiation
//! are not read.
//!
//! The folder is opened by its name or by that of its info file.

#[cfg(feature = "ramses")]
mod amr;
#[cfg(feature = "ramses")]
mod blocks;
#[cfg(feature = "ramses")]
mod descriptor;
#[cfg(feature = "ramses")]
mod hydro;
#[cfg(feature = "ramses")]
mod info;
#[cfg(feature = "ramses")]
mod numbers;
#[cfg(feature = "ramses")]
mod octs;
#[cfg(feature = "ramses")]
mod read;
mod schema;

use crate::registry::{Capabilities, FormatSpec, Match, ReadFn};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: schema::NAME,
    summary: "RAMSES outputs (folders), refined or not",
    extensions: &["ramses"],
    feature: "ramses",
    reference: "https://ramses-organisation.readthedocs.io/en/latest/",
    capabilities: Capabilities::of_fields(&["refined grid"], &[1, 2, 3]),
    sniff,
    read: READ,
    write: None,
    stream: None,
};

#[cfg(feature = "ramses")]
const READ: Option<ReadFn> = Some(read::read);
#[cfg(not(feature = "ramses"))]
const READ: Option<ReadFn> = None;

fn sniff(head: &[u8]) -> Match {
    if schema::is_info(&String::from_utf8_lossy(head)) { Match::Certain } else { Match::No }
}
