//! Pressures that depend on the density alone. Their energy is that of the compression, du = P/rho^2 drho.

use super::error::{EosError, positive};
use super::response::Response;

/// P(rho).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Barotropic {
    /// P = c^2 rho; u counts from 1 g/cm^3.
    Isothermal { sound_speed: f64 },
    /// P = K rho^gamma, gamma > 1; u = K rho^(gamma-1) / (gamma - 1).
    Polytrope { constant: f64, gamma: f64 },
    /// P = (K_0/n) ((rho/rho_0)^n - 1) with the bulk modulus K_0 at rho_0 (Murnaghan 1944, PNAS 30, 244); with n = 7 that of
    /// water by Cole (1948). Below rho_0 there is no pressure: it parts rather than pull.
    Murnaghan { density: f64, bulk_modulus: f64, exponent: f64 },
}

impl Barotropic {
    /// # Errors
    /// A constant that is none.
    pub fn checked(self) -> Result<Self, EosError> {
        let more_than_one = |name, value: f64| match value.is_finite() && value > 1.0 {
            true => Ok(()),
            false => Err(EosError::Constant { name, value, expected: "more than 1" }),
        };
        match self {
            Self::Isothermal { sound_speed } => {
                positive("sound_speed", sound_speed)?;
            }
            Self::Polytrope { constant, gamma } => {
                positive("constant", constant)?;
                more_than_one("gamma", gamma)?;
            }
            Self::Murnaghan { density, bulk_modulus, exponent } => {
                positive("density", density)?;
                positive("bulk_modulus", bulk_modulus)?;
                more_than_one("exponent", exponent)?;
            }
        }
        Ok(self)
    }

    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Isothermal { .. } => "an isothermal gas",
            Self::Polytrope { .. } => "a polytrope",
            Self::Murnaghan { .. } => "a Murnaghan material",
        }
    }

    pub(super) fn response(&self, density: f64) -> Response {
        let (pressure, by_density) = match *self {
            Self::Isothermal { sound_speed } => (sound_speed * sound_speed * density, sound_speed * sound_speed),
            Self::Polytrope { constant, gamma } => {
                let slope = constant * density.powf(gamma - 1.0);
                (slope * density, gamma * slope)
            }
            Self::Murnaghan { density: usual, .. } if density <= usual => (0.0, 0.0),
            Self::Murnaghan { density: usual, bulk_modulus, exponent } => {
                let power = (density / usual).powf(exponent);
                (bulk_modulus / exponent * (power - 1.0), bulk_modulus * power / density)
            }
        };
        Response { pressure, by_density, by_energy: 0.0 }
    }

    pub(super) fn energy(&self, density: f64) -> f64 {
        match *self {
            Self::Isothermal { sound_speed } => sound_speed * sound_speed * density.ln(),
            Self::Polytrope { constant, gamma } => constant * density.powf(gamma - 1.0) / (gamma - 1.0),
            Self::Murnaghan { density: usual, .. } if density <= usual => 0.0,
            Self::Murnaghan { density: usual, bulk_modulus, exponent } => {
                let x = density / usual;
                let of_power = (x.powf(exponent - 1.0) - 1.0) / (exponent - 1.0);
                bulk_modulus / (exponent * usual) * (of_power + 1.0 / x - 1.0)
            }
        }
    }

    pub(super) fn usual_density(&self) -> f64 {
        match *self {
            Self::Murnaghan { density, .. } => density,
            Self::Isothermal { .. } | Self::Polytrope { .. } => 1.0,
        }
    }
}
