//! The `balance` section of a scene.

use super::{Conversion, Quantity};
use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sph_formats::UnitDimension;

/// The balance of pressure and gravity, which follows the polish.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BalanceInput {
    /// Number of evaluations of the force; by default at most 600, fewer for more than 30 000 particles; it ends when the net force is a
    /// thousandth of gravity.
    #[schemars(schema_with = "super::schema::optional_count", example = 200)]
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "super::count::optional_count")]
    pub evaluations: Option<usize>,
    /// The gravity that the pressure balances: by default the input's own if it is a radial profile, otherwise an external field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gravity: Option<GravityName>,
    /// Gravitational constant in the input's numbers, if these have no units.
    pub constant: f64,
    /// Equation of state for the pressure, if the input carries neither pressure nor internal energy; overrides what it carries.
    #[schemars(example = serde_json::json!({"polytrope": {"constant": 1.0, "gamma": 1.5}}))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub equation_of_state: Option<EquationOfState>,
}

impl Default for BalanceInput {
    fn default() -> Self {
        Self { evaluations: None, gravity: None, constant: 1.0, equation_of_state: None }
    }
}

/// What the pressure force is to cancel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum GravityName {
    /// The gravity of the enclosed mass of a radial profile.
    Own,
    /// An external field: grad P / rho of the target.
    Field,
    /// None: the pressure is made uniform.
    None,
}

/// Pressure as a function of density, or of the weight above.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum EquationOfState {
    /// P = constant rho^gamma, all in the scene's units.
    Polytrope {
        /// K of P = K rho^gamma.
        #[schemars(example = 1.0)]
        constant: f64,
        /// 1 + 1/n of a polytrope of index n.
        #[schemars(example = 1.5)]
        gamma: f64,
    },
    /// P = sound_speed^2 rho.
    Isothermal {
        /// Sound speed of the gas, uniform.
        #[schemars(extend("x-unit" = "velocity"))]
        sound_speed: Quantity,
    },
    /// That of a self-gravitating body at rest.
    AtRest,
}

impl EquationOfState {
    /// K and gamma of P = K rho^gamma in the units of `conversion.to`; `None` where it is no such law.
    ///
    /// # Errors
    /// A sound speed that is none.
    pub(crate) fn power_law(&self, conversion: &Conversion) -> Result<Option<(f64, f64)>> {
        Ok(match self {
            Self::Polytrope { constant, gamma } => {
                let [pressure, density] =
                    [UnitDimension::PRESSURE, UnitDimension::mass_density(3)].map(|d| conversion.factor(d));
                Some((constant * pressure / density.powf(*gamma), *gamma))
            }
            Self::Isothermal { sound_speed } => {
                let key = "balance.equation_of_state.sound_speed";
                let speed = sound_speed.value(key, UnitDimension::VELOCITY, conversion)?;
                Some((speed * speed, 1.0))
            }
            Self::AtRest => None,
        })
    }
}

impl BalanceInput {
    pub(super) fn validate(&self) -> Result<()> {
        let (constant, gamma) = match &self.equation_of_state {
            Some(EquationOfState::Polytrope { constant, gamma }) => (*constant, *gamma),
            Some(EquationOfState::Isothermal { sound_speed }) => (sound_speed.number(), 1.0),
            Some(EquationOfState::AtRest) | None => (1.0, 1.0),
        };
        for (key, value) in [
            ("balance.constant", self.constant),
            ("balance.equation_of_state", constant),
            ("balance.equation_of_state.gamma", gamma),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::scene(key, format!("is {value}, expected a positive number")));
            }
        }
        Ok(())
    }
}
