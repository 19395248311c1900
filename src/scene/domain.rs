//! The `domain` section of a scene.

use super::{BallInput, CylinderInput, EllipsoidInput, Quantity, RotateInput, ShapeInput, SurfaceInput, TorusInput};
use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Region in which particles are placed. By default all of the input; expressions need one of its keys.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DomainInput {
    /// Lower and upper corner.
    #[schemars(extend("x-unit" = "length"), example = serde_json::json!([[0, 0, 0], [1, 1, 1]]))]
    #[schemars(extend("x-aliases" = ["rectangle", "interval"]))]
    #[serde(rename = "box", alias = "rectangle", alias = "interval", skip_serializing_if = "Option::is_none")]
    pub bounds: Option<[Vec<Quantity>; 2]>,
    #[schemars(example = serde_json::json!({"radius": 1}))]
    #[schemars(extend("x-aliases" = ["sphere", "circle"]))]
    #[serde(alias = "sphere", alias = "circle", skip_serializing_if = "Option::is_none")]
    pub ball: Option<BallInput>,
    #[schemars(example = serde_json::json!({"radius": 1, "length": 2}))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cylinder: Option<CylinderInput>,
    #[schemars(example = serde_json::json!({"radius": 1, "tube_radius": 0.3}))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torus: Option<TorusInput>,
    #[schemars(example = serde_json::json!({"radii": [1, 1, 0.5]}))]
    #[schemars(extend("x-aliases" = ["ellipse"]))]
    #[serde(alias = "ellipse", skip_serializing_if = "Option::is_none")]
    pub ellipsoid: Option<EllipsoidInput>,
    /// The interior of a surface from a file.
    #[schemars(example = serde_json::json!({"file": "tank.stl"}))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceInput>,
    /// A shape turned about a point.
    #[schemars(example = serde_json::json!({"by": [0, 0, 30], "shape": {"box": [[0, 0, 0], [1, 1, 1]]}}))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotate: Option<RotateInput>,
    /// The union of all shapes of a list.
    #[schemars(example = serde_json::json!([{"ball": {"center": [0, 0, 0], "radius": 1}}, {"box": [[0, 0, 0], [1, 1, 1]]}]))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub union: Option<Vec<ShapeInput>>,
    /// The intersection of all shapes of a list.
    #[schemars(example = serde_json::json!([{"ball": {"center": [0, 0, 0], "radius": 1}}, {"box": [[0, 0, 0], [1, 1, 1]]}]))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intersection: Option<Vec<ShapeInput>>,
    /// The first shape without the others.
    #[schemars(example = serde_json::json!([{"ball": {"center": [0, 0, 0], "radius": 1}}, {"box": [[0, 0, 0], [1, 1, 1]]}]))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub difference: Option<Vec<ShapeInput>>,
    /// One for all axes, or one each; the surface of a ball or hull takes the first, that of a cylinder the first across
    /// its axis. By default open.
    #[schemars(schema_with = "super::schema::one_or_many::<BoundaryName>", example = &"periodic")]
    #[serde(skip_serializing_if = "Vec::is_empty", deserialize_with = "super::yaml::one_or_many")]
    pub boundary: Vec<BoundaryName>,
}

impl DomainInput {
    /// The shape, where the domain is neither a box nor a ball nor a cylinder.
    pub fn shape(&self) -> Option<ShapeInput> {
        let some = |parts: &Option<Vec<ShapeInput>>, make: fn(Vec<ShapeInput>) -> ShapeInput| parts.clone().map(make);
        some(&self.union, ShapeInput::Union)
            .or_else(|| some(&self.intersection, ShapeInput::Intersection))
            .or_else(|| some(&self.difference, ShapeInput::Difference))
            .or_else(|| self.torus.clone().map(ShapeInput::Torus))
            .or_else(|| self.ellipsoid.clone().map(ShapeInput::Ellipsoid))
            .or_else(|| self.surface.clone().map(ShapeInput::Surface))
            .or_else(|| self.rotate.clone().map(ShapeInput::Rotate))
    }

    /// The files of surfaces in it.
    pub(super) fn files_mut(&mut self) -> Vec<&mut PathBuf> {
        let lists = [&mut self.union, &mut self.intersection, &mut self.difference];
        let mut files: Vec<&mut PathBuf> =
            lists.into_iter().flatten().flatten().flat_map(ShapeInput::files_mut).collect();
        files.extend(self.surface.as_mut().map(|s| &mut s.file));
        files.extend(self.rotate.as_mut().into_iter().flat_map(|r| r.shape.files_mut()));
        files
    }

    /// How many of the keys that say where particles may be are there.
    pub(super) fn extents(&self) -> usize {
        let given = [
            self.bounds.is_some(),
            self.ball.is_some(),
            self.cylinder.is_some(),
            self.torus.is_some(),
            self.ellipsoid.is_some(),
            self.surface.is_some(),
            self.rotate.is_some(),
            self.union.is_some(),
            self.intersection.is_some(),
            self.difference.is_some(),
        ];
        given.into_iter().filter(|given| *given).count()
    }

    /// Whether nothing is stated.
    pub(crate) fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// What is said of the faces along an axis: of all at once, or one by one.
    pub(crate) fn boundary_along(&self, axis: usize) -> Option<BoundaryName> {
        match self.boundary.as_slice() {
            [one] => Some(*one),
            many => many.get(axis).copied(),
        }
    }

    /// Whether it says where particles may be, beside what the boundaries do.
    pub fn has_extent(&self) -> bool {
        self.extents() > 0
    }

    pub(super) fn validate(&self) -> Result<()> {
        if self.extents() > 1 {
            let problem = "names more than one of `box`, `ball`, `cylinder` and other shapes; give one, or combine them in `union`, \
                           `intersection` or `difference`";
            return Err(Error::scene("domain", problem));
        }
        self.shape().map_or(Ok(()), |shape| shape.validate("domain"))
    }
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
