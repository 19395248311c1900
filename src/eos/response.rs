//! A pressure with its derivatives.

/// A pressure and how it changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    pub pressure: f64,
    /// dP/drho at constant u.
    pub by_density: f64,
    /// dP/du at constant rho.
    pub by_energy: f64,
}
