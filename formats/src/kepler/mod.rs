//! KEPLER: stellar models and supernova progenitors as text, as published by Heger and others (`s15_presn` and similar files), and as Phantom
//! writes them for KEPLER.
//!
//! | part | content |
//! |---|---|
//! | first lines | `VERSION ...`; facts behind `#` |
//! | names | `grid`, `cell outer total mass`, `cell outer radius`, `cell outer velocity`, `cell density`, ..., then isotopes; two blanks or more between them, or `[03 cell outer total mass]` |
//! | units | a line `# unit g cm ...`, or none: cgs in either case, entropies in k_B per baryon |
//! | cells | `12:` or `12`, then a value for each name; words (`stability`, `NETWORK`) are left out |
//! | last lines | `wind: ...` and such, left out |
//!
//! Quirks:
//! * Staggering: what is called `outer` (mass, radius, velocity) belongs to the outer face of a cell, everything else to its
//!   inside. So the faces become the radial nodes and densities cell values, whose sum over the shells is the mass.
//! * `---` or `-` stands for a value that there is none of: a mass fraction of 0 where a cell's network does not have the
//!   isotope.
//! * A model may begin above a collapsed core: where the innermost cell (`cell mass`) holds less than is enclosed, the radius
//!   within which the rest lies follows from its density.

#[cfg(feature = "kepler")]
mod cells;
#[cfg(feature = "kepler")]
mod read;
mod schema;
#[cfg(feature = "kepler")]
mod sheet;

use crate::registry::{Capabilities, FormatSpec, Match, ReadFn};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: schema::NAME,
    summary: "KEPLER stellar models and supernova progenitors (text)",
    extensions: &["data", "presn"],
    feature: "kepler",
    reference: "https://2sn.org/kepler/doc/index.html",
    capabilities: Capabilities::of_fields(&["radial"], &[1, 2, 3]),
    sniff,
    read: READ,
    write: None,
    stream: None,
};

#[cfg(feature = "kepler")]
const READ: Option<ReadFn> = Some(read::read);
#[cfg(not(feature = "kepler"))]
const READ: Option<ReadFn> = None;

fn sniff(head: &[u8]) -> Match {
    if schema::is_model(&String::from_utf8_lossy(head)) { Match::Certain } else { Match::No }
}
