//! The name of the format and the names in its files.

pub const NAME: &str = "amrex";

/// How the first line of a `Header` begins.
pub const VERSIONS: [&str; 2] = ["HyperCLaw-V", "NavierStokes-V"];

/// Names of the density, in the order of trust.
#[cfg(feature = "amrex")]
pub const DENSITY_NAMES: [&str; 3] = ["density", "rho", "gasDensity"];
/// In the folders of WarpX, whose `rho` is a density of charge.
#[cfg(feature = "amrex")]
pub const WARPX: &str = "WarpXHeader";
