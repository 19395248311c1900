//! Tables of numbers with named columns: CSV (comma, semicolon, tab) and white-space separated text.
//!
//! | part | accepted |
//! |---|---|
//! | comments | lines from `#`, `!`, `%` or `//`, anywhere |
//! | header | the line above the numbers, or the last comment line with one name per column; names may hold spaces where two or more separate them or the columns have fixed widths; `[ Mass ]` |
//! | units | `density [kg/m^3]`, `radius(m)`, `radius_cm`, or a comment line `# unit ...` |
//! | numbers | as in C and Fortran; columns of text are left out |
//!
//! What the columns make of it:
//! * `r`, `radius` or `rmid`: a radial profile, in either order of rows; two equal radii in a row are a jump. X, Y, Z
//!   beside it are mass fractions where they add up to 1, and coordinates where the radius is their distance from the
//!   origin; anything else is refused as ambiguous;
//! * `outer radius`: a radial profile of cells, whose other columns are averages within (KEPLER's dumps), except
//!   those that are called `outer` as well;
//! * `x` (`y`, `z`) and `mass` or `Masses`: particles;
//! * else `x`, `y`, `z`: a grid where the points fill one in any order, else a cloud of points.
//!
//! Particles are written with names and units in the header, and with `# key: value` comments above it for box, units,
//! kernel and provenance (pandas and numpy want `comment='#'`); types other than gas get a column `ParticleType`.
//!
//! Units are taken as stated. Some real headers are wrong about them: a scene can overrule them.

#[cfg(feature = "table")]
mod fractions;
#[cfg(feature = "table")]
mod layout;
#[cfg(feature = "table")]
mod particles;
#[cfg(feature = "table")]
mod points;
#[cfg(feature = "table")]
mod radial;
#[cfg(feature = "table")]
mod read;
mod schema;
#[cfg(feature = "table")]
mod sheet;

use crate::registry::{Capabilities, FormatSpec, Match, ReadFn, WriteFn};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: schema::NAME,
    summary: "Tables with a header, comma or white-space separated",
    extensions: &["csv", "dat", "txt", "tab", "data", "tsv"],
    feature: "table",
    reference: "https://www.rfc-editor.org/rfc/rfc4180",
    capabilities: Capabilities {
        read_field: true,
        read_particles: true,
        write_particles: true,
        geometries: &["radial", "grid", "cloud"],
        dimensions: &[1, 2, 3],
        ..Capabilities::NONE
    },
    sniff,
    read: READ,
    write: WRITE,
    stream: None,
};

#[cfg(feature = "table")]
const READ: Option<ReadFn> = Some(read::read);
#[cfg(not(feature = "table"))]
const READ: Option<ReadFn> = None;

#[cfg(feature = "table")]
const WRITE: Option<WriteFn> = Some(particles::write);
#[cfg(not(feature = "table"))]
const WRITE: Option<WriteFn> = None;

/// Text with a row of numbers, or with nothing but comments so far. The head may end within a character.
fn sniff(head: &[u8]) -> Match {
    let good = match std::str::from_utf8(head) {
        Ok(text) => text,
        Err(e) if e.error_len().is_none() => {
            head.get(..e.valid_up_to()).and_then(|b| std::str::from_utf8(b).ok()).unwrap_or_default()
        }
        Err(_) => return Match::No,
    };
    if good.contains('\0') {
        return Match::No;
    }
    let lines = || good.lines().filter(|l| !l.trim().is_empty());
    let number = |field: &str| crate::common::text::parse_number(field).is_some();
    let row = |line: &str| line.split([' ', '\t', ',', ';']).find(|f| !f.is_empty()).is_some_and(number);
    let comments = lines().count() > 0 && lines().all(|l| l.trim_start().starts_with(['#', '!', '%']));
    if lines().any(row) || comments { Match::Container } else { Match::No }
}
