//! Models of the White Dwarf Evolution Code (WDEC), in the files that it calls `evolved`.
//!
//! | line | content |
//! |---|---|
//! | 1 | model number and what the run says of it |
//! | 2 | `N = core + envelope`, the numbers of points, then masses of layers and parameters of the composition |
//! | then | 20 arrays of N numbers each, four on a line of 22 characters each (`1p,4e22.15`), every array on a new line |
//!
//! | array | what |
//! |---|---|
//! | 1 to 6 | r, m(r), L(r), T, rho, P |
//! | 7, 8 | energy generation, c_v |
//! | 9, 10 | chi_rho, chi_T |
//! | 11 to 14 | partial derivatives of energy generation and opacity, not read |
//! | 15, 16 | nabla, nabla_ad |
//! | 17, 18, 19 | mass fraction of helium, opacity, Ledoux term |
//! | 20 | not read |
//!
//! All in cgs units, at the same points (nothing is staggered), from the center to the surface; the order of the arrays is that
//! in which the code writes them (`eprep_subroutines.f90`) and GYRE reads them. Quirks: the center itself is missing, nothing
//! is added there; an array that is 0 everywhere is left out. The other profiles that the code writes (`corsico.dat` and others)
//! have no radii or densities.

#[cfg(feature = "wdec")]
mod read;
mod schema;

use crate::registry::{Capabilities, FormatSpec, Match, ReadFn};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: schema::NAME,
    summary: "WDEC white dwarf models (evolved)",
    extensions: &["wdec"],
    feature: "wdec",
    reference: "https://github.com/kim554/wdec",
    capabilities: Capabilities::of_fields(&["radial"], &[1, 2, 3]),
    sniff,
    read: READ,
    write: None,
    stream: None,
};

#[cfg(feature = "wdec")]
const READ: Option<ReadFn> = Some(read::read);
#[cfg(not(feature = "wdec"))]
const READ: Option<ReadFn> = None;

fn sniff(head: &[u8]) -> Match {
    if schema::is_model(&String::from_utf8_lossy(head)) { Match::Certain } else { Match::No }
}
