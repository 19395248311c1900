//! The thermal variable that is given in addition to a pressure, and the errors of equations of state.

use std::fmt;
use std::path::PathBuf;

/// What is known beside a pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Warmth {
    Energy(f64),
    Temperature(f64),
    /// T = temperature (rho/density)^exponent.
    Power {
        temperature: f64,
        density: f64,
        exponent: f64,
    },
}

impl fmt::Display for Warmth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Energy(u) => write!(f, "with {u:.4e} erg/g"),
            Self::Temperature(t) => write!(f, "at {t:.4e} K"),
            Self::Power { temperature, density, exponent } => {
                write!(f, "at {temperature:.4e} K (rho / {density:.4e} g/cm^3)^{exponent}")
            }
        }
    }
}

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

/// # Errors
/// A constant that is none.
pub(super) fn positive(name: &'static str, value: f64) -> Result<f64, EosError> {
    match value.is_finite() && value > 0.0 {
        true => Ok(value),
        false => Err(EosError::Constant { name, value, expected: "a positive number" }),
    }
}
