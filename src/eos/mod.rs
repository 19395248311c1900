//! Equations of state: pressure, energy, sound speed, temperature and adiabats of one material, in cgs.
//!
//! | equation | pressure | energy |
//! |---|---|---|
//! | ideal gas | (gamma - 1) rho u | u; kB T / ((gamma - 1) mu mH) |
//! | isothermal | c^2 rho | of the compression |
//! | polytrope | K rho^gamma | of the compression |
//! | Murnaghan (Cole 1948) | (K_0/n) ((rho/rho_0)^n - 1), none below rho_0 | of the compression |
//! | [`Tillotson`] (1962) | of solids that may melt and vaporize | u; cold curve and C_V T |
//! | [`Table`] | bilinear in the logarithms of density and temperature | the same |
//!
//! The middle three are barotropic: their pressure knows no temperature, and their energy is what the compression has put in.

mod barotropic;
mod equation;
mod error;
mod material;
mod response;
mod search;
mod table;
mod tillotson;

pub use barotropic::Barotropic;
pub use equation::EquationOfState;
pub use error::{EosError, Warmth};
pub use material::Material;
pub use response::Response;
pub use table::Table;
pub use tillotson::Tillotson;

#[cfg(test)]
mod tests;
