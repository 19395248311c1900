//! The `input` section of a scene.

use super::{CoreInput, DiscInput, HydrostaticInput, InterpolationName, ProfileInput, Quantity, Term};
use crate::error::{Error, Result};
use crate::field::Orientation;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The density field.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Input {
    /// A stellar profile, grid, mesh, table, point cloud or particle file.
    #[schemars(example = &"star.nc")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Density as an expression in x, y, z and r (distance from the domain's center), constants and units, instead of a file; or a number with its unit.
    #[schemars(example = &"1 + 0.5*sin(2*pi*x)")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expression: Option<String>,
    /// A body from its physics, instead of a file.
    #[schemars(example = serde_json::json!({"polytrope": {"n": 1.5, "mass": "1 Msun", "radius": "1 Rsun"}}))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile: Option<ProfileInput>,
    /// A point mass with a softened potential in place of the core of a star.
    #[schemars(example = serde_json::json!({"radius": "5 Rsun"}))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub core: Option<CoreInput>,
    /// Name of the format, if it cannot be recognized from the file.
    #[schemars(example = &"mesa")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub format: Option<String>,
    /// Variable that is the mass density; within a surface a number, or an expression in x, y, z and r.
    #[schemars(example = &"rho")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<String>,
    /// Factor on the density: a number, or an expression in x, y, z and r.
    #[schemars(example = &"0.01*(1 + r)")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub factor: Option<Term>,
    /// Variables to carry onto the particles; all by default.
    #[schemars(example = serde_json::json!(["temperature", "velocity"]))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub carry: Option<Vec<String>>,
    /// Value of the time coordinate to read.
    #[schemars(extend("x-unit" = "of the coordinate"), example = 0.5)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interpolation: Option<InterpolationName>,
    pub missing: MissingValues,
    /// Positions of the rows of a radial table; by default the mass that the table states decides.
    #[serde(skip_serializing_if = "StaggeringName::is_auto")]
    pub staggering: StaggeringName,
    /// Whether the values of a grid belong to cells or to nodes, if the file gives no cell bounds; by default a periodic axis is decided by the
    /// position of its nodes, or refused.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centering: Option<CenteringName>,
    /// Dimension in which a radial profile is used (3), and of an expression.
    #[schemars(range(min = 1, max = 3), example = 3)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dimension: Option<usize>,
    /// Unit of length of the input; overrides the file.
    #[schemars(example = &"km")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_unit: Option<String>,
    /// Unit of the density; overrides the file.
    #[schemars(example = &"kg/m^3")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density_unit: Option<String>,
    /// Unit of a magnetic field in an input that does not state it.
    #[schemars(example = &"1e-6 G")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnetic_field_unit: Option<String>,
    /// Factor on the coordinates of a surface, or one for each axis.
    #[schemars(schema_with = "super::schema::one_or_many::<f64>", example = 0.01)]
    #[serde(skip_serializing_if = "Vec::is_empty", deserialize_with = "super::yaml::one_or_many_numbers")]
    pub scale: Vec<f64>,
    /// Rotation of a surface about the axes x, y and z, in this order, in degrees; in 2-D one number.
    #[schemars(schema_with = "super::schema::one_or_many::<f64>", example = serde_json::json!([0, 0, 30]))]
    #[serde(skip_serializing_if = "Vec::is_empty", deserialize_with = "super::yaml::one_or_many_numbers")]
    pub rotate: Vec<f64>,
    pub atmosphere: Atmosphere,
    /// Radius of the planet from whose surface a grid's depth or height counts; a plain number is in the unit of that axis where the scene states no `units`.
    #[schemars(extend("x-unit" = "length"), example = &"6371 km")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub planet_radius: Option<Quantity>,
    /// A particle file from another tool, whose dark matter, stars and other particles except gas are copied to the output unchanged, in the
    /// coordinates of the input.
    #[schemars(example = &"halo.hdf5")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub others: Option<PathBuf>,
    /// Whether the particles of a snapshot stay as they are, and none is placed: a star that was relaxed before, to be put on an orbit. By
    /// default they do in a body of `bodies` that states nothing else of its particles, in a scene that states no number of them.
    #[schemars(example = true)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub keep_particles: Option<bool>,
    /// Particles of a snapshot other than gas: dark matter, stars, sinks.
    #[serde(skip_serializing_if = "OtherTypes::is_default")]
    pub other_types: OtherTypes,
}

impl Input {
    /// Whether the scene itself says that a snapshot's particles stay.
    pub(crate) fn keeps_particles(&self) -> bool {
        self.keep_particles == Some(true)
    }

    /// Whether it is a profile of numbers with units.
    pub(crate) fn has_profile_with_units(&self) -> bool {
        self.profile.as_ref().is_some_and(|profile| profile.has_units(self.dimension.unwrap_or(3)))
    }

    /// The disc that it is, if it is one.
    pub(crate) fn disc(&self) -> Option<&DiscInput> {
        match &self.profile {
            Some(ProfileInput::Disc(disc)) => Some(disc),
            _ => None,
        }
    }

    /// The gas whose density follows from its temperature, if that is what the input is.
    pub(crate) fn hydrostatic(&self) -> Option<&HydrostaticInput> {
        match &self.profile {
            Some(ProfileInput::Hydrostatic(gas)) => Some(gas),
            _ => None,
        }
    }

    /// Whether it is gas that feels others alone.
    pub(crate) fn is_without_own_gravity(&self) -> bool {
        self.hydrostatic().is_some_and(|gas| !gas.self_gravity)
    }

    /// How a surface is scaled and turned, where [`Self::validate_orientation`] has no objection.
    pub(crate) fn orientation(&self) -> Orientation {
        orientation(&self.scale, &self.rotate)
    }

    /// Refuses what says how a file is read where there is none.
    pub(super) fn validate_of_file(&self) -> Result<()> {
        let source = match (&self.file, &self.expression, &self.profile) {
            (None, Some(_), _) => "an expression",
            (None, None, Some(_)) => "a profile",
            _ => return Ok(()),
        };
        let asked = [
            (self.format.is_some(), "format"),
            (self.density.is_some(), "density"),
            (self.time.is_some(), "time"),
            (!self.staggering.is_auto(), "staggering"),
            (self.centering.is_some(), "centering"),
            (self.interpolation.is_some(), "interpolation"),
        ];
        match asked.iter().find(|(is_asked, _)| *is_asked) {
            Some((_, key)) => {
                let problem = format!("says how a `file` is read, but the input is {source}; leave it out");
                Err(Error::scene(format!("input.{key}"), problem))
            }
            None => Ok(()),
        }
    }

    pub(super) fn validate_orientation(&self) -> Result<()> {
        if self.file.is_none() && !(self.scale.is_empty() && self.rotate.is_empty()) {
            let key = if self.scale.is_empty() { "input.rotate" } else { "input.scale" };
            return Err(Error::scene(key, "is of a surface in a `file`; leave it out"));
        }
        validate_orientation("input", &self.scale, &self.rotate)
    }
}

/// One factor for all axes or one each; angles about x, y and z, or about z alone.
pub(crate) fn orientation(scale: &[f64], rotate: &[f64]) -> Orientation {
    let of = |values: &[f64], k: usize| values.get(k).copied();
    Orientation {
        scale: sph::array(|k| if scale.len() == 1 { scale[0] } else { of(scale, k).unwrap_or(1.0) }),
        rotate: match rotate {
            [angle] => [0.0, 0.0, *angle],
            _ => sph::array(|k| of(rotate, k).unwrap_or(0.0)),
        },
    }
}

pub(super) fn validate_orientation(key: &str, scale: &[f64], rotate: &[f64]) -> Result<()> {
    if !(scale.len() <= 3 && scale.iter().all(|s| s.is_finite() && *s != 0.0)) {
        let problem = format!("is {scale:?}, expected a factor that is not 0, or one for each axis");
        return Err(Error::scene(format!("{key}.scale"), problem));
    }
    if !([0, 1, 3].contains(&rotate.len()) && rotate.iter().all(|angle| angle.is_finite())) {
        let problem = format!("is {rotate:?}, expected three angles in degrees about x, y and z, or in 2-D one");
        return Err(Error::scene(format!("{key}.rotate"), problem));
    }
    Ok(())
}

/// Meaning of NaN and masked values of the density.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MissingValues {
    /// They are refused.
    #[default]
    Error,
    /// No matter there.
    Zero,
}

/// Where the rows of a radial table lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum StaggeringName {
    /// Chosen so that each zone has the mass that a column states or, without such a column, by the names of the columns.
    #[default]
    Auto,
    /// At points, to which radius, density and mass belong.
    Nodes,
    /// Radius and mass at the outer faces of zones, the density within.
    OuterFaces,
    /// Radius and mass at the inner faces.
    InnerFaces,
    /// The radius in the middle of zones, the mass at their outer faces.
    Centers,
}

/// What the values of a grid belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CenteringName {
    /// Values belong to cells around the nodes: N of them span N steps.
    Cells,
    /// Values belong to the nodes: N of them span N - 1 steps, and the last of a periodic axis repeats the first.
    Nodes,
}

impl StaggeringName {
    pub(crate) fn is_auto(&self) -> bool {
        *self == Self::Auto
    }
}

/// Particles of a snapshot that are no gas.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OtherTypes {
    /// They are copied to the output unchanged.
    #[default]
    Keep,
    /// They are left out.
    Drop,
}

impl OtherTypes {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// The thin outer layer of a radial profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Atmosphere {
    /// It is cut where N particles no longer resolve it; the report states the mass left out.
    #[default]
    Cut,
    /// It is kept, however few particles it receives.
    Keep,
}
