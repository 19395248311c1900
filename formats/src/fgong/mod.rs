//! FGONG stellar models, for comparing stars and their oscillations; MESA, ASTEC, CESAM and others write them.
//!
//! | line | content |
//! |---|---|
//! | 1 to 4 | text |
//! | 5 | points N, global numbers, variables, version |
//! | then | global numbers, five on a line: M, R, L (cgs), Z and X at first, ..., age (13th), effective temperature (14th), G (15th) |
//! | then | for each point its variables, five on a line |
//!
//! | variable | what | versions |
//! |---|---|---|
//! | 1, 2 | r; ln(m / M) | all |
//! | 3 to 5 | T, P, rho | all |
//! | 6 to 14 | X, L, kappa, epsilon, Gamma_1, nabla_ad, delta, c_p, 1 / mu_e | all |
//! | 17 | Z; R - r before 210 | 210, 250, 300 |
//! | 21 to 25 | He3, C12, C13, N14, O16 | from 200 on |
//! | 29 to 36 | H2, He4, Li7, Be7, N15, O17, O18, Ne20 | 300 |
//!
//! All variables belong to the same radii (nothing is staggered), from the surface to the center; the other order is read
//! as well. Numbers are 16 characters wide (`1p5e16.9`), or 27 where 1000 is added to the version (`1p,5(x,e26.18e3)`), so that
//! negative ones may touch those before them. A variable that is 0 everywhere is one that the code does not have. The rest
//! (derivatives, rates, depths) means nothing on particles and is not read. A repeated radius is a jump.

#[cfg(feature = "fgong")]
mod read;
mod schema;

use crate::registry::{Capabilities, FormatSpec, Match, ReadFn};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: schema::NAME,
    summary: "FGONG stellar models (text)",
    extensions: &["fgong", "gong"],
    feature: "fgong",
    reference: "https://www.astro.up.pt/corot/ntools/docs/CoRoT_ESTA_Files.pdf",
    capabilities: Capabilities::of_fields(&["radial"], &[1, 2, 3]),
    sniff,
    read: READ,
    write: None,
    stream: None,
};

#[cfg(feature = "fgong")]
const READ: Option<ReadFn> = Some(read::read);
#[cfg(not(feature = "fgong"))]
const READ: Option<ReadFn> = None;

fn sniff(head: &[u8]) -> Match {
    if schema::is_model(&String::from_utf8_lossy(head)) { Match::Certain } else { Match::No }
}
