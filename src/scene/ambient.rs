//! The `ambient` section of a scene: a medium that fills the rest of the box about bodies.

use super::{FieldsInput, Term};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A medium in the box of the scene's `domain`, out of which bodies cut their shape.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AmbientInput {
    /// Its density: a number, or an expression in x, y, z and r (distance from the box's center), constants and units.
    #[schemars(example = 0.01)]
    pub density: Term,
    /// Pressure, temperature, velocity and other columns of the medium, as expressions.
    #[schemars(example = serde_json::json!({"pressure": 1, "velocity": [2, 0, 0]}))]
    #[serde(default, skip_serializing_if = "FieldsInput::is_empty")]
    pub fields: FieldsInput,
    /// Whether its particles have the mass or the spacing of those of the bodies.
    #[serde(default, rename = "match", skip_serializing_if = "MatchName::is_default")]
    pub matching: MatchName,
}

/// What is the same on both sides of a body's surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MatchName {
    /// The mass of particles: spacings differ as the cube root of the densities.
    #[default]
    Mass,
    /// The spacing, in all of the medium that of the bodies at their surfaces: masses follow its density.
    Spacing,
}

impl MatchName {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}
