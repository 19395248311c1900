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
mod material;
mod search;
mod table;
mod tillotson;

pub use barotropic::Barotropic;
pub use material::Material;
pub use search::Warmth;
pub use table::Table;
pub use tillotson::Tillotson;

use std::path::PathBuf;
use std::sync::Arc;

/// k_B / m_H of CODATA 2022 in cgs.
const GAS_CONSTANT_OF_HYDROGEN: f64 = 1.380_649e-16 / 1.673_532_838e-24;

/// What an equation of state cannot answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EosError {
    #[error(
        "{material} at {density:.4e} g/cm^3 has a pressure of {cold:.4e} dyn/cm^2 without any heat; {pressure:.4e} would need less"
    )]
    TooCold { material: String, density: f64, pressure: f64, cold: f64 },
    #[error("{material} reaches no pressure of {pressure:.4e} dyn/cm^2 {warmth}: expected {least:.4e} to {most:.4e}")]
    NoDensity { material: String, pressure: f64, warmth: Warmth, least: f64, most: f64 },
    #[error("{material} has no temperature: its pressure depends on the density alone")]
    NoTemperature { material: String },
    #[error("{name} is {value}, expected {expected}")]
    Constant { name: &'static str, value: f64, expected: &'static str },
    #[error("table '{}': {problem}", path.display())]
    Table { path: PathBuf, problem: String },
}

/// A pressure and how it changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    pub pressure: f64,
    /// dP/drho at constant u.
    pub by_density: f64,
    /// dP/du at constant rho.
    pub by_energy: f64,
}

/// The equation of state of one material. Densities are in g/cm^3, specific energies in erg/g, pressures in dyn/cm^2.
#[derive(Debug, Clone, PartialEq)]
pub enum EquationOfState {
    IdealGas { gamma: f64, mean_molecular_weight: f64 },
    Barotropic(Barotropic),
    Tillotson(Tillotson),
    Table(Arc<Table>),
}

impl EquationOfState {
    /// An ideal gas.
    ///
    /// # Errors
    /// An adiabatic index or a weight that is none.
    pub fn ideal_gas(gamma: f64, mean_molecular_weight: f64) -> Result<Self, EosError> {
        if !(gamma > 1.0 && gamma.is_finite()) {
            return Err(EosError::Constant { name: "gamma", value: gamma, expected: "more than 1" });
        }
        positive("mean_molecular_weight", mean_molecular_weight)?;
        Ok(Self::IdealGas { gamma, mean_molecular_weight })
    }

    /// For messages.
    pub fn name(&self) -> String {
        match self {
            Self::IdealGas { gamma, .. } => format!("an ideal gas of gamma = {gamma:.4}"),
            Self::Barotropic(law) => law.name().into(),
            Self::Tillotson(solid) => format!("Tillotson {}", solid.name),
            Self::Table(table) => format!("table {}", table.name()),
        }
    }

    /// Pressure and its derivatives.
    pub fn response(&self, density: f64, energy: f64) -> Response {
        match self {
            Self::IdealGas { gamma, .. } => Response {
                pressure: (gamma - 1.0) * density * energy,
                by_density: (gamma - 1.0) * energy,
                by_energy: (gamma - 1.0) * density,
            },
            Self::Barotropic(law) => law.response(density),
            Self::Tillotson(solid) => solid.response(density, energy),
            Self::Table(table) => table.response(density, energy),
        }
    }

    /// P(rho, u).
    pub fn pressure(&self, density: f64, energy: f64) -> f64 {
        self.response(density, energy).pressure
    }

    /// sqrt of dP/drho at constant entropy, dP/drho + P/rho^2 dP/du; 0 where that is negative.
    pub fn sound_speed(&self, density: f64, energy: f64) -> f64 {
        let Response { pressure, by_density, by_energy } = self.response(density, energy);
        (by_density + pressure * by_energy / (density * density)).max(0.0).sqrt()
    }

    /// The least energy at a density: that without any heat.
    pub fn cold_energy(&self, density: f64) -> f64 {
        match self {
            Self::IdealGas { .. } => 0.0,
            Self::Barotropic(law) => law.energy(density),
            Self::Tillotson(solid) => solid.cold_energy(density),
            Self::Table(table) => table.least_energy(density),
        }
    }

    /// T(rho, u).
    ///
    /// # Errors
    /// A barotropic material.
    pub fn temperature(&self, density: f64, energy: f64) -> Result<f64, EosError> {
        match self {
            Self::IdealGas { gamma, mean_molecular_weight } => {
                Ok((gamma - 1.0) * mean_molecular_weight * energy / GAS_CONSTANT_OF_HYDROGEN)
            }
            Self::Barotropic(_) => Err(EosError::NoTemperature { material: self.name() }),
            Self::Tillotson(solid) => Ok(((energy - solid.cold_energy(density)) / solid.heat_capacity).max(0.0)),
            Self::Table(table) => Ok(table.temperature(density, energy)),
        }
    }

    /// u(rho, T); of a barotropic material the energy of its compression, whatever the temperature.
    pub fn energy_at(&self, density: f64, temperature: f64) -> f64 {
        match self {
            Self::IdealGas { gamma, mean_molecular_weight } => {
                GAS_CONSTANT_OF_HYDROGEN * temperature / ((gamma - 1.0) * mean_molecular_weight)
            }
            Self::Barotropic(law) => law.energy(density),
            Self::Tillotson(solid) => solid.cold_energy(density) + solid.heat_capacity * temperature,
            Self::Table(table) => table.energy_at(density, temperature),
        }
    }

    pub fn is_barotropic(&self) -> bool {
        matches!(self, Self::Barotropic(_))
    }

    /// A density at which the material is at home: from where others are looked for.
    pub fn usual_density(&self) -> f64 {
        match self {
            Self::IdealGas { .. } => 1.0,
            Self::Barotropic(law) => law.usual_density(),
            Self::Tillotson(solid) => solid.density,
            Self::Table(table) => table.usual_density(),
        }
    }
}

fn positive(name: &'static str, value: f64) -> Result<f64, EosError> {
    match value.is_finite() && value > 0.0 {
        true => Ok(value),
        false => Err(EosError::Constant { name, value, expected: "a positive number" }),
    }
}

#[cfg(test)]
mod tests;
