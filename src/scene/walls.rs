//! The `walls` section of a scene: particles of solid walls around the fluid.

use super::{Quantity, ShapeInput};
use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sph_formats::UnitDimension;

/// Particles in layers outside of what holds the fluid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct WallsInput {
    /// Number of layers.
    #[schemars(range(min = 1, max = 64))]
    pub layers: usize,
    /// Spacing of the wall particles; by default the mean spacing of the fluid.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing: Option<Quantity>,
    /// Region that the walls enclose; by default the domain of the fluid.
    #[schemars(example = serde_json::json!({"box": [[0, 0, 0], [1, 1, 1]]}))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub around: Option<ShapeInput>,
    /// Region without walls, for example above an open tank.
    #[schemars(example = serde_json::json!({"box": [[0, 0, 0], [1, 1, 1]]}))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub without: Option<ShapeInput>,
    /// Particle type in files of GADGET's kind, 1 to 5; 5 (boundary) by default.
    #[schemars(range(min = 1, max = 5))]
    #[serde(rename = "type")]
    pub part_type: u8,
}

impl Default for WallsInput {
    fn default() -> Self {
        Self { layers: 3, spacing: None, around: None, without: None, part_type: 5 }
    }
}

/// Most layers.
const MOST: usize = 64;

impl WallsInput {
    pub(super) fn validate(&self) -> Result<()> {
        if !(1..=MOST).contains(&self.layers) {
            return Err(Error::scene("walls.layers", format!("is {}, expected 1 to {MOST}", self.layers)));
        }
        if !(1..=5).contains(&self.part_type) {
            return Err(Error::scene("walls.type", format!("is {}, expected 1 to 5; 0 is gas", self.part_type)));
        }
        if let Some(spacing) = &self.spacing {
            spacing.check_positive("walls.spacing", UnitDimension::LENGTH)?;
        }
        self.around.as_ref().map_or(Ok(()), |shape| shape.validate("walls.around"))?;
        self.without.as_ref().map_or(Ok(()), |shape| shape.validate("walls.without"))
    }
}
