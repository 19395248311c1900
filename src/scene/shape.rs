//! Shapes from which a domain is built.

use super::Quantity;
use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sph_formats::UnitDimension;
use std::path::PathBuf;

/// A primitive, or what others make together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ShapeInput {
    /// Lower and upper corner; in 2-D a rectangle, in 1-D an interval.
    #[schemars(example = serde_json::json!({"box": [[0, 0, 0], [1, 1, 1]]}))]
    #[schemars(extend("x-aliases" = ["rectangle", "interval"]))]
    #[serde(alias = "rectangle", alias = "interval")]
    Box([Vec<Quantity>; 2]),
    /// A ball, disc or interval, or a shell.
    #[schemars(extend("x-aliases" = ["sphere", "circle"]))]
    #[serde(alias = "sphere", alias = "circle")]
    Ball(BallInput),
    /// A cylinder or a tube, in three dimensions.
    Cylinder(CylinderInput),
    /// A tube about a circle, in three dimensions.
    Torus(TorusInput),
    /// An ellipsoid or ellipse with axes along the coordinates.
    #[schemars(extend("x-aliases" = ["ellipse"]))]
    #[serde(alias = "ellipse")]
    Ellipsoid(EllipsoidInput),
    /// The half-space on one side of a plane or line.
    #[schemars(extend("x-aliases" = ["half-plane"]))]
    #[serde(alias = "half-plane")]
    HalfSpace(HalfSpaceInput),
    /// The interior of a surface from a file.
    Surface(SurfaceInput),
    /// The union of all shapes of a list.
    #[schemars(example = serde_json::json!({"union": [{"ball": {"center": [0, 0, 0], "radius": 1}}, {"box": [[0, 0, 0], [1, 1, 1]]}]}))]
    Union(Vec<ShapeInput>),
    /// The intersection of all shapes of a list.
    #[schemars(example = serde_json::json!({"intersection": [{"ball": {"center": [0, 0, 0], "radius": 1}}, {"box": [[0, 0, 0], [1, 1, 1]]}]}))]
    Intersection(Vec<ShapeInput>),
    /// The first shape without the others.
    #[schemars(example = serde_json::json!({"difference": [{"ball": {"center": [0, 0, 0], "radius": 1}}, {"box": [[0, 0, 0], [1, 1, 1]]}]}))]
    Difference(Vec<ShapeInput>),
    /// A shape turned about a point.
    #[schemars(example = serde_json::json!({"rotate": {"by": [0, 0, 30], "shape": {"box": [[0, 0, 0], [1, 1, 1]]}}}))]
    Rotate(RotateInput),
}

/// A ball, disc or interval, or a shell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BallInput {
    /// The origin by default.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(default)]
    pub center: Vec<Quantity>,
    /// Radius; in 1-D half the length of an interval.
    #[schemars(extend("x-unit" = "length"))]
    pub radius: Quantity,
    /// Radius of the inner surface of a shell, 0 by default; no particles are placed within it.
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
    /// Direction of the axis.
    #[serde(default)]
    pub axis: AxisName,
    /// Radius across the axis.
    #[schemars(extend("x-unit" = "length"))]
    pub radius: Quantity,
    /// Radius of the hole in a tube; 0 by default.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(default)]
    pub inner_radius: Quantity,
    /// Length along the axis.
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

/// A tube about a circle, in three dimensions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TorusInput {
    /// The origin by default.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub center: Vec<Quantity>,
    /// Direction of the axis through the hole.
    #[serde(default)]
    pub axis: AxisName,
    /// Radius of the circle.
    #[schemars(extend("x-unit" = "length"))]
    pub radius: Quantity,
    /// Radius of the tube around the circle.
    #[schemars(extend("x-unit" = "length"))]
    pub tube_radius: Quantity,
}

/// An ellipsoid or ellipse with axes along the coordinates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EllipsoidInput {
    /// The origin by default.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub center: Vec<Quantity>,
    /// Half-axes, one for each coordinate.
    #[schemars(extend("x-unit" = "length"))]
    #[schemars(example = serde_json::json!([1, 1, 0.5]))]
    pub radii: Vec<Quantity>,
}

/// The half-space on one side of a plane or line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HalfSpaceInput {
    /// A point of the plane; the origin by default.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub point: Vec<Quantity>,
    /// Normal of the plane that points out of the half-space, of any length.
    #[schemars(example = serde_json::json!([0, 0, 1]))]
    pub normal: Vec<f64>,
}

/// The interior of a surface from a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfaceInput {
    /// Path, from the scene's folder: STL, OBJ or PLY.
    #[schemars(example = &"tank.stl")]
    pub file: PathBuf,
    /// Name of the format, if it cannot be recognized from the file.
    #[schemars(example = &"stl")]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub format: Option<String>,
    /// Unit of length of the file; by default that of the scene's plain numbers.
    #[schemars(example = &"mm")]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length_unit: Option<String>,
    /// Factor on the coordinates, or one for each axis.
    #[schemars(schema_with = "super::schema::one_or_many::<f64>", example = 0.01)]
    #[serde(default, skip_serializing_if = "Vec::is_empty", deserialize_with = "super::yaml::one_or_many_numbers")]
    pub scale: Vec<f64>,
    /// Rotation about the axes x, y and z, in this order, in degrees; in 2-D one number.
    #[schemars(schema_with = "super::schema::one_or_many::<f64>", example = serde_json::json!([0, 0, 30]))]
    #[serde(default, skip_serializing_if = "Vec::is_empty", deserialize_with = "super::yaml::one_or_many_numbers")]
    pub rotate: Vec<f64>,
}

/// A shape turned about a point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotateInput {
    /// Rotation about the axes x, y and z, in this order, in degrees; in 2-D one number.
    #[schemars(schema_with = "super::schema::one_or_many::<f64>", example = serde_json::json!([0, 0, 30]))]
    #[serde(deserialize_with = "super::yaml::one_or_many_numbers")]
    pub by: Vec<f64>,
    /// The origin by default.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub about: Vec<Quantity>,
    /// The shape that is turned.
    #[schemars(example = serde_json::json!({"box": [[0, 0, 0], [1, 1, 1]]}))]
    pub shape: Box<ShapeInput>,
}

/// How deep shapes are nested, at most.
const DEEPEST: usize = 32;
/// How many there are, at most: each is looked at for each particle.
const MOST: usize = 200;

impl ShapeInput {
    /// Shapes that are part of this one.
    fn parts(&self) -> &[Self] {
        match self {
            Self::Union(parts) | Self::Intersection(parts) | Self::Difference(parts) => parts,
            Self::Rotate(rotate) => std::slice::from_ref(&rotate.shape),
            _ => &[],
        }
    }

    /// How many coordinates it has, where it says that.
    pub fn dimension(&self) -> Option<usize> {
        match self {
            Self::Box(corners) => Some(corners[0].len()),
            Self::Ball(ball) => Some(ball.center.len()).filter(|n| *n > 0),
            Self::Cylinder(_) | Self::Torus(_) => Some(3),
            Self::Ellipsoid(ellipsoid) => Some(ellipsoid.radii.len()),
            Self::HalfSpace(half) => Some(half.normal.len()),
            Self::Surface(_) => None,
            _ => self.parts().iter().find_map(Self::dimension),
        }
    }

    /// The files of surfaces in it.
    pub fn files_mut(&mut self) -> Vec<&mut PathBuf> {
        match self {
            Self::Surface(surface) => vec![&mut surface.file],
            Self::Union(parts) | Self::Intersection(parts) | Self::Difference(parts) => {
                parts.iter_mut().flat_map(Self::files_mut).collect()
            }
            Self::Rotate(rotate) => rotate.shape.files_mut(),
            _ => Vec::new(),
        }
    }

    /// Keys, values and dimensions of what has one.
    pub(super) fn quantities<'a>(&'a self, key: &str, into: &mut Vec<(String, &'a Quantity, UnitDimension)>) {
        let key = format!("{key}.{}", self.name());
        let mut add = |name: &str, all: &'a [Quantity]| {
            into.extend(all.iter().map(|q| (format!("{key}.{name}"), q, UnitDimension::LENGTH)));
        };
        match self {
            Self::Box(corners) => corners.iter().for_each(|c| add("corner", c)),
            Self::Ball(b) => {
                add("center", &b.center);
                add("radius", std::slice::from_ref(&b.radius));
                add("inner_radius", std::slice::from_ref(&b.inner_radius));
            }
            Self::Cylinder(c) => {
                add("center", &c.center);
                add("radius", std::slice::from_ref(&c.radius));
                add("inner_radius", std::slice::from_ref(&c.inner_radius));
                add("length", std::slice::from_ref(&c.length));
            }
            Self::Torus(t) => {
                add("center", &t.center);
                add("radius", std::slice::from_ref(&t.radius));
                add("tube_radius", std::slice::from_ref(&t.tube_radius));
            }
            Self::Ellipsoid(e) => {
                add("center", &e.center);
                add("radii", &e.radii);
            }
            Self::HalfSpace(h) => add("point", &h.point),
            Self::Rotate(r) => add("about", &r.about),
            Self::Surface(_) | Self::Union(_) | Self::Intersection(_) | Self::Difference(_) => {}
        }
        self.parts().iter().for_each(|part| part.quantities(&key, into));
    }

    /// The key under which it stands.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Box(_) => "box",
            Self::Ball(_) => "ball",
            Self::Cylinder(_) => "cylinder",
            Self::Torus(_) => "torus",
            Self::Ellipsoid(_) => "ellipsoid",
            Self::HalfSpace(_) => "half-space",
            Self::Surface(_) => "surface",
            Self::Union(_) => "union",
            Self::Intersection(_) => "intersection",
            Self::Difference(_) => "difference",
            Self::Rotate(_) => "rotate",
        }
    }

    /// Checks what can be checked without units.
    pub(super) fn validate(&self, key: &str) -> Result<()> {
        let mut number = 0;
        self.check(key, 0, &mut number)
    }

    fn check(&self, key: &str, depth: usize, number: &mut usize) -> Result<()> {
        let key = format!("{key}.{}", self.name());
        *number += 1;
        if depth > DEEPEST || *number > MOST {
            let problem = format!("has more than {MOST} shapes, or more than {DEEPEST} within each other");
            return Err(Error::scene("domain", problem));
        }
        match self {
            Self::Union(parts) | Self::Intersection(parts) if parts.is_empty() => {
                return Err(Error::scene(key, "has no shapes"));
            }
            Self::Difference(parts) if parts.len() < 2 => {
                return Err(Error::scene(key, "has fewer than two shapes; expected one, and what is taken from it"));
            }
            Self::HalfSpace(h) if !(h.normal.iter().all(|c| c.is_finite()) && h.normal.iter().any(|c| *c != 0.0)) => {
                let problem = format!("is {:?}, expected a direction out of the half-space", h.normal);
                return Err(Error::scene(format!("{key}.normal"), problem));
            }
            Self::Surface(s) => super::input::validate_orientation(&key, &s.scale, &s.rotate)?,
            Self::Rotate(r) => super::input::validate_orientation(&key, &[], &r.by)?,
            _ => {}
        }
        self.parts().iter().try_for_each(|part| part.check(&key, depth + 1, number))
    }
}
