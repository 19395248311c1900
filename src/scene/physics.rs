//! Keys of a scene for motion, energies and materials.

use super::Quantity;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Velocities added to those that the particles carry.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Motion {
    /// Velocity of all particles.
    #[schemars(extend("x-unit" = "velocity"))]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bulk: Vec<Quantity>,
    /// Angular velocity about the domain's center: three components, or one in 2-D.
    #[schemars(extend("x-unit" = "angular velocity"))]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rotation: Vec<Quantity>,
}

/// Source of the internal energy, if the input does not carry it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Thermal {
    /// Adiabatic index, used to turn a carried pressure into u = P/((gamma - 1) rho).
    pub gamma: f64,
    /// Specific internal energy of all particles.
    #[schemars(extend("x-unit" = "specific energy"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub internal_energy: Option<Quantity>,
}

impl Default for Thermal {
    fn default() -> Self {
        Self { gamma: 5.0 / 3.0, internal_energy: None }
    }
}

/// A shell of one material, as SWIFT's planetary schemes number them (`MaterialIDs`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialLayer {
    /// Material number.
    #[schemars(example = 400)]
    pub id: i32,
    /// Outer radius. The last layer has none.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<Quantity>,
}
