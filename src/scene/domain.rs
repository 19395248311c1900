//! The `domain` section of a scene.

use super::Quantity;
use serde::{Deserialize, Serialize};

/// Where particles may be. By default all of the input; expressions need a box or a ball.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DomainInput {
    /// Lower and upper corner.
    #[serde(rename = "box", skip_serializing_if = "Option::is_none")]
    pub bounds: Option<[Vec<Quantity>; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ball: Option<BallInput>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cylinder: Option<CylinderInput>,
    /// One for all axes, or one each; the surface of a ball or hull takes the first, that of a cylinder the first across
    /// its axis. By default open.
    #[serde(skip_serializing_if = "Vec::is_empty", deserialize_with = "super::yaml::one_or_many")]
    pub boundary: Vec<BoundaryName>,
}

/// A ball, disc or interval, or a shell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BallInput {
    /// The origin by default.
    #[serde(default)]
    pub center: Vec<Quantity>,
    pub radius: Quantity,
    #[serde(default)]
    pub inner_radius: Quantity,
}

/// A cylinder or a tube, in three dimensions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CylinderInput {
    /// The middle of its axis; the origin by default.
    #[serde(default)]
    pub center: Vec<Quantity>,
    #[serde(default)]
    pub axis: AxisName,
    pub radius: Quantity,
    #[serde(default)]
    pub inner_radius: Quantity,
    pub length: Quantity,
}

/// A coordinate axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AxisName {
    X,
    Y,
    #[default]
    Z,
}

/// What lies beyond a face or a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BoundaryName {
    /// The opposite face.
    Periodic,
    /// A mirror image of the matter within.
    Reflecting,
    /// Vacuum.
    Open,
}
