//! The name of the format and the names in its files.

pub const NAME: &str = "grid-hdf5";

/// Names of the density, in the order of trust.
#[cfg(feature = "grid-hdf5")]
pub const DENSITY_NAMES: [&str; 3] = ["rho", "dens", "density"];
