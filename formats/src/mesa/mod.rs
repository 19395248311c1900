//! MESA `profile*.data` files: one model of a star, zone by zone.
//!
//! | line | content |
//! |---|---|
//! | 1 | numbers of the header's entries: 1 2 3 ... |
//! | 2 | their names: `model_number`, `num_zones`, `star_mass`, ... |
//! | 3 | their values; texts in double quotes |
//! | 4 | blank |
//! | 5 | numbers of the columns: 1 2 3 ... |
//! | 6 | their names; which there are is the user's choice (`profile_columns.list`) |
//! | 7 ... | one line per zone, from the surface to the center |
//!
//! Quirks:
//! * Staggering: radius, mass, velocity and luminosity belong to the outer face of a zone; density, temperature,
//!   pressure and energy to its inside. So the faces become the radial nodes, and the density is a cell value: its
//!   sum over the shells is the star's mass to rounding, which taking both at the same radius misses by 1 %.
//! * Radius and mass are in solar units whose size MESA changed: newer headers state `msun` and `rsun`. Without
//!   them, the pair of constants is taken with which density and mass agree.
//! * `log` columns are decadic; exponents may lack their letter (`1.234-101`).
//! * `history.data` looks alike but holds one model per line.

#[cfg(feature = "mesa")]
mod faces;
#[cfg(feature = "mesa")]
mod quantities;
#[cfg(feature = "mesa")]
mod read;
mod schema;
#[cfg(feature = "mesa")]
mod sheet;

use crate::registry::{Capabilities, FormatSpec, Match, ReadFn};
use schema::{HEADER_NAMES, NAME, is_numbering};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: NAME,
    summary: "MESA profile*.data stellar models",
    extensions: &["data"],
    feature: "mesa",
    reference: "https://docs.mesastar.org/en/latest/using_mesa/output.html",
    capabilities: Capabilities::of_fields(&["radial"], &[1, 2, 3]),
    sniff,
    read: READ,
    write: None,
    stream: None,
};

#[cfg(feature = "mesa")]
const READ: Option<ReadFn> = Some(read::read);
#[cfg(not(feature = "mesa"))]
const READ: Option<ReadFn> = None;

fn sniff(head: &[u8]) -> Match {
    let text = String::from_utf8_lossy(head);
    let mut lines = text.lines();
    match (lines.next(), lines.next()) {
        (Some(first), Some(second)) if is_numbering(first) => {
            let known = second.split_whitespace().any(|name| HEADER_NAMES.contains(&name));
            if known { Match::Certain } else { Match::No }
        }
        _ => Match::No,
    }
}
