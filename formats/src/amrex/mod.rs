//! AMReX and BoxLib plotfiles (Castro, MAESTROeX, Nyx, Quokka, PeleC and others): folders.
//!
//! | file | content |
//! |---|---|
//! | `Header` | version (`HyperCLaw-V1.1`), names of variables, dimensions, time, finest level, ends of the box, ratios of refinement, the box of each level in cells, coordinates, and the path of each level's data |
//! | `Level_<l>/Cell_H` | boxes of the patches of a level, and where each one's values are |
//! | `Level_<l>/Cell_D_<n>` | for each patch a line of text (`FAB`: kind of numbers, box, number of variables), then values by variable, z, y, x |
//! | `job_info` | name of the code, and boundaries |
//!
//! Cells that a finer level covers hold averages of it and are left out. Numbers are of 4 or 8 bytes in either order. Patches may
//! have ghost cells. Read are Cartesian grids in one to three dimensions. The numbers are in cgs units where `job_info` names
//! Castro or MAESTROeX, which have no others; other codes do not say it. Axes whose boundaries are both `interior` there repeat.
//!
//! The folder is opened by its name or by that of its `Header`.

#[cfg(feature = "amrex")]
mod fab;
#[cfg(feature = "amrex")]
mod header;
#[cfg(feature = "amrex")]
mod job;
#[cfg(feature = "amrex")]
mod leaves;
#[cfg(feature = "amrex")]
mod level;
#[cfg(feature = "amrex")]
mod read;
#[cfg(feature = "amrex")]
mod scan;
mod schema;

use crate::registry::{Capabilities, FormatSpec, Match, ReadFn};
use schema::{NAME, VERSIONS};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: NAME,
    summary: "AMReX and BoxLib plotfiles (folders), refined or not",
    extensions: &["plt"],
    feature: "amrex",
    reference: "https://amrex-codes.github.io/amrex/docs_html/IO.html",
    capabilities: Capabilities::of_fields(&["refined grid"], &[1, 2, 3]),
    sniff,
    read: READ,
    write: None,
    stream: None,
};

#[cfg(feature = "amrex")]
const READ: Option<ReadFn> = Some(read::read);
#[cfg(not(feature = "amrex"))]
const READ: Option<ReadFn> = None;

fn sniff(head: &[u8]) -> Match {
    if VERSIONS.iter().any(|version| head.starts_with(version.as_bytes())) { Match::Certain } else { Match::No }
}
