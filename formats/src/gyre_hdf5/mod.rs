//! GYRE's stellar models in HDF5: GSM and POLY.
//!
//! GSM (versions 0.00, 1.00, 1.10, 1.20), from the center to the surface, all in cgs units and at the same points:
//!
//! | object | content |
//! |---|---|
//! | root attributes | n, M_star, R_star, L_star, and version from 1.00 on |
//! | `r`, `rho`, `T`, `P` (`p` in 0.00), `L_r` | profiles |
//! | `M_r`, or in 0.00 `w` = M_r / (M_star - M_r) | enclosed mass |
//! | `Gamma_1`, `nabla`, `nabla_ad`, `delta`, `N2`, `kap` or `kappa`, `eps` or `epsilon`, `Omega_rot` | carried where they are there |
//!
//! POLY (a polytrope of one index):
//!
//! | object | content |
//! |---|---|
//! | root attributes | n, n_poly, n_r (number of regions, which must be 1) |
//! | `z`, `theta`, `dtheta` | solution of the Lane-Emden equation: z = r / r_n |
//!
//! A polytrope has no dimensions, so it is read in code units: lengths in r_n, densities in the central one, and G = 1, which
//! makes the mass -4 pi z^2 theta' and the pressure 4 pi / (n_poly + 1) theta^(n_poly + 1) (Kippenhahn, Weigert & Weiss
//! 2012, Stellar Structure and Evolution, equations 19.5 to 19.10). `input.length_unit` and `input.density_unit` of a
//! scene give it a size. Quirk: a repeated radius is a jump.

use crate::registry::{Capabilities, FormatSpec, HDF5_SIGNATURE, Match, ReadFn, contains};

#[cfg(feature = "gyre-hdf5")]
mod read;
mod schema;

#[cfg(feature = "gyre-hdf5")]
const READ: Option<ReadFn> = Some(read::read);
#[cfg(not(feature = "gyre-hdf5"))]
const READ: Option<ReadFn> = None;

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: schema::NAME,
    summary: "GYRE stellar models in HDF5: GSM, and polytropes (POLY)",
    extensions: &["gsm", "h5"],
    feature: "gyre-hdf5",
    reference: "https://gyre.readthedocs.io/en/stable/ref-guide/stellar-models.html",
    capabilities: Capabilities::of_fields(&["radial"], &[1, 2, 3]),
    sniff,
    read: READ,
    write: None,
    stream: None,
};

/// Names that such files have and no others.
fn sniff(head: &[u8]) -> Match {
    let has = |what: &[u8]| contains(head, what);
    match head.starts_with(HDF5_SIGNATURE) {
        true if has(b"theta") && has(b"n_poly") || has(b"M_star") && has(b"R_star") => Match::Certain,
        true => Match::Container,
        false => Match::No,
    }
}
