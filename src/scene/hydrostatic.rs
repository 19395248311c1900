//! The `hydrostatic` gas of an input's profile: at rest in the gravity of others and its own.

use super::{Quantity, Term};
use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sph_formats::UnitDimension;

/// Gas at rest in the gravity of what is about its center (`gravity_of`, or `bodies` with the same position) and its own. Its temperature
/// determines its density: give `sound_speed`, or `n`, or both.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HydrostaticInput {
    /// Mass of the gas within the outer radius.
    #[schemars(extend("x-unit" = "mass"))]
    pub mass: Quantity,
    /// Radius at which the gas ends.
    #[schemars(extend("x-unit" = "length"))]
    pub outer_radius: Quantity,
    /// Isothermal sound speed sqrt(P/rho): a number, or an expression in r. With `n` it is the value in the center.
    #[schemars(example = &"sqrt(kB*6e7*K/(0.6*mH))")]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sound_speed: Option<Term>,
    /// Polytropic index of P = K rho^(1 + 1/n), from 0 to 100. Without a sound speed the density falls to 0 at the outer radius.
    #[schemars(example = 1.5)]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub n: Option<f64>,
    /// Whether the disc is self-gravitating.
    #[serde(default = "yes")]
    pub self_gravity: bool,
}

/// Of larger indices a gas is isothermal.
const LARGEST_INDEX: f64 = 100.0;

fn yes() -> bool {
    true
}

impl HydrostaticInput {
    pub(crate) fn quantities(&self) -> Vec<(&'static str, &Quantity, UnitDimension)> {
        vec![("mass", &self.mass, UnitDimension::MASS), ("outer_radius", &self.outer_radius, UnitDimension::LENGTH)]
    }

    pub(super) fn validate(&self) -> Result<()> {
        let key = |name: &str| format!("input.profile.hydrostatic.{name}");
        match (&self.sound_speed, self.n) {
            (None, None) => {
                let problem = "is missing: the temperature of the gas, or `n` of a polytropic one, is what determines its density";
                Err(Error::scene(key("sound_speed"), problem))
            }
            (_, Some(n)) if !(0.0..=LARGEST_INDEX).contains(&n) => {
                let problem =
                    format!("is {n}, expected 0 to {LARGEST_INDEX}; with `sound_speed` alone the gas is isothermal");
                Err(Error::scene(key("n"), problem))
            }
            _ => Ok(()),
        }
    }
}
