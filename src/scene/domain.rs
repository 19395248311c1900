//! The `domain` section of a scene.

use super::Quantity;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where particles may be. By default all of the input; expressions need a box or a ball.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DomainInput {
    /// Lower and upper corner.
    #[schemars(extend("x-unit" = "length"), example = serde_json::json!([[0, 0, 0], [1, 1, 1]]))]
    #[serde(rename = "box", skip_serializing_if = "Option::is_none")]
    pub bounds: Option<[Vec<Quantity>; 2]>,
    #[schemars(example = serde_json::json!({"radius": 1}))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ball: Option<BallInput>,
    #[schemars(example = serde_json::json!({"radius": 1, "length": 2}))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cylinder: Option<CylinderInput>,
    /// One for all axes, or one each; the surface of a ball or hull takes the first, that of a cylinder the first across
    /// its axis. By default open.
    #[schemars(schema_with = "super::schema::one_or_many::<BoundaryName>", example = &"periodic")]
    #[serde(skip_serializing_if = "Vec::is_empty", deserialize_with = "super::yaml::one_or_many")]
    pub boundary: Vec<BoundaryName>,
}

/// A ball, disc or interval, or a shell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BallInput {
    /// The origin by default.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(default)]
    pub center: Vec<Quantity>,
    /// Half the length of an interval in 1-D.
    #[schemars(extend("x-unit" = "length"))]
    pub radius: Quantity,
    /// What is within is left free: 0 by default.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(default)]
    pub inner_radius: Quantity,
}

/// A cylinder or a tube, in three dimensions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderInput {
    /// The middle of its axis; the origin by default.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(default)]
    pub center: Vec<Quantity>,
    /// Along which it stands.
    #[serde(default)]
    pub axis: AxisName,
    /// Across its axis.
    #[schemars(extend("x-unit" = "length"))]
    pub radius: Quantity,
    /// That of the hole in a tube; 0 by default.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(default)]
    pub inner_radius: Quantity,
    /// Along its axis.
    #[schemars(extend("x-unit" = "length"))]
    pub length: Quantity,
}

/// A coordinate axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AxisName {
    X,
    Y,
    #[default]
    Z,
}

/// What lies beyond a face or a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BoundaryName {
    /// The opposite face.
    Periodic,
    /// A mirror image of the matter within.
    Reflecting,
    /// Vacuum.
    Open,
}
