//! GYRE stellar models in its text format, which MESA writes as "GYRE format" (`*.mesa`, `*.GYRE`).
//!
//! Line 1: `N M R L [version]` in g, cm, erg/s; then N lines from the center to the surface, all in cgs units, all
//! at the same points (not staggered):
//!
//! | columns | version 100, 101 | 120 | 19 | none (0.01) |
//! |---|---|---|---|---|
//! | 1 | k | k | k | k |
//! | 2, 3 | r, M_r | r, M_r | r, M_r / (M - M_r) | r, M_r / (M - M_r) |
//! | 4 to 7 | L_r, P, T, rho | L_r, P, T, rho | L_r, P, T, rho | L_r, P, T, rho |
//! | 8, 9 | nabla, N^2 | nabla, N^2 | nabla, N^2 | nabla, N^2 |
//! | 10 to 12 | Gamma_1, nabla_ad, delta | same | same | thermodynamic, not read |
//! | 13 to 18 | kappa, its two partials, epsilon, its two partials | same | same | 14 to 19 |
//! | 19 | Omega | eps_grav | Omega | |
//! | 20 | | Omega | | |
//!
//! Quirks: a repeated radius is a jump. The center may be missing: nothing is added then. Of the partial
//! derivatives none is read: they mean nothing on particles.

#[cfg(feature = "gyre")]
mod read;
mod schema;

use crate::registry::{Capabilities, FormatSpec, Match, ReadFn};
use schema::{NAME, column_count, header_version};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: NAME,
    summary: "GYRE stellar models (MESA text format)",
    extensions: &["mesa", "gyre"],
    feature: "gyre",
    reference: "https://gyre.readthedocs.io/en/stable/ref-guide/stellar-models.html",
    capabilities: Capabilities::of_fields(&["radial"], &[1, 2, 3]),
    sniff,
    read: READ,
    write: None,
    stream: None,
};

#[cfg(feature = "gyre")]
const READ: Option<ReadFn> = Some(read::read);
#[cfg(not(feature = "gyre"))]
const READ: Option<ReadFn> = None;

fn sniff(head: &[u8]) -> Match {
    let text = String::from_utf8_lossy(head);
    let mut lines = text.lines();
    let (Some(first), Some(second)) = (lines.next(), lines.next()) else { return Match::No };
    let Some(columns) = header_version(first).and_then(column_count) else { return Match::No };
    let mut fields = second.split_whitespace();
    if fields.next() == Some("1") && fields.count() + 1 == columns { Match::Certain } else { Match::No }
}
