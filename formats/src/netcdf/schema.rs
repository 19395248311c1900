//! The name of the format and the names in its files.

pub const NAME: &str = "netcdf";

/// Names of the density, in the order of trust.
#[cfg(feature = "netcdf")]
pub const DENSITY_NAMES: &[&str] = &["density", "rho", "dens", "mass_density"];
