//! The `collisionless` section of a scene, and the bodies whose gravity its own feels.

use super::{DomainInput, Input, Quantity};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Particles that feel gravity alone, as dark matter and stars do: a type of their own, without pressure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CollisionlessInput {
    /// Particle type in files of GADGET's kind, 1 to 5: 1 is dark matter, 4 are stars.
    #[schemars(range(min = 1, max = 5), example = 4)]
    #[serde(rename = "type")]
    pub part_type: u8,
    /// How velocities are drawn.
    pub velocities: VelocityName,
}

/// Random velocities, alike in all directions, that hold a spherical body against its gravity and that of `gravity_of`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum VelocityName {
    /// From the distribution function f(E) that makes the density in the potential (Eddington 1916).
    #[default]
    Eddington,
    /// Gaussian ones with the dispersion of Jeans's equation, which is 0 at the body's edge; none is above the escape speed.
    Jeans,
    /// None are drawn: particles have the velocities of `fields` and `motion`, or are at rest.
    None,
}

impl Default for CollisionlessInput {
    fn default() -> Self {
        Self { part_type: 1, velocities: VelocityName::default() }
    }
}

/// A body that attracts from about the same center: an input, or a point mass.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AttractorInput {
    pub input: Input,
    #[serde(skip_serializing_if = "DomainInput::is_empty")]
    pub domain: DomainInput,
    /// Mass of a point, instead of an input.
    #[schemars(extend("x-unit" = "mass"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point_mass: Option<Quantity>,
    /// Of a point mass: the distance at which its softened attraction becomes that of a point; 0 by default.
    #[schemars(extend("x-unit" = "length"), example = &"0.1 kpc")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub softening_radius: Option<Quantity>,
    /// What holds it in turn, where its density follows from that (`hydrostatic`).
    #[schemars(example = serde_json::json!([{"point_mass": "1 Msun", "softening_radius": "0.1 Rsun"}]))]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gravity_of: Vec<AttractorInput>,
}
