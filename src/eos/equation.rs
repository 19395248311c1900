//! The equation of state of a material: which one it is, and its functions.

use super::barotropic::Barotropic;
use super::error::{EosError, positive};
use super::response::Response;
use super::table::Table;
use super::tillotson::Tillotson;
use std::sync::Arc;

/// k_B / m_H of CODATA 2022 in cgs.
const GAS_CONSTANT_OF_HYDROGEN: f64 = 1.380_649e-16 / 1.673_532_838e-24;

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
