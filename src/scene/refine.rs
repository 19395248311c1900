//! The `refine` section of a scene: a sphere with another resolution, which may move.

use super::Quantity;
use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sph_formats::UnitDimension;

/// Particles in the place of one, at most, and as a share at least.
const MOST: f64 = 1e6;
/// What it is where nothing is said: half the spacing in 3-D.
const FACTOR: f64 = 8.0;

/// A sphere (a disc in 2-D, an interval in 1-D) in which particles are finer or coarser. Particles of a snapshot that lie far from it stay as they are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RefineInput {
    /// Center of the sphere at the time 0; the origin by default.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub center: Vec<Quantity>,
    /// Radius of the sphere, within which `factor` applies.
    #[schemars(extend("x-unit" = "length"))]
    pub radius: Quantity,
    /// Width of the layer beyond the radius in which masses change; a quarter of the radius by default.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shell: Option<Quantity>,
    /// Number of particles that replace one: 8 halves the spacing in 3-D, 1/8 doubles it.
    #[schemars(range(min = 1e-6, max = 1e6), example = 8.0)]
    #[serde(default = "factor")]
    pub factor: f64,
    /// Velocity of the center.
    #[schemars(extend("x-unit" = "velocity"))]
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub velocity: Vec<Quantity>,
    /// Time at which the sphere is at center + velocity * time; by default that of the snapshot, otherwise 0.
    #[schemars(extend("x-unit" = "time"))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<Quantity>,
    /// Mass of a particle far from the sphere, for a snapshot; by default that of its heaviest (of its lightest, where the factor is below 1).
    #[schemars(extend("x-unit" = "mass"))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub particle_mass: Option<Quantity>,
}

fn factor() -> f64 {
    FACTOR
}

impl RefineInput {
    /// Keys, values and dimensions of what has one.
    pub(super) fn quantities(&self) -> Vec<(String, &Quantity, UnitDimension)> {
        let vectors =
            [("center", &self.center, UnitDimension::LENGTH), ("velocity", &self.velocity, UnitDimension::VELOCITY)];
        let components = vectors.into_iter().flat_map(|(name, values, dimension)| {
            values.iter().enumerate().map(move |(i, q)| (format!("refine.{name}[{i}]"), q, dimension))
        });
        let single = [
            ("refine.radius", Some(&self.radius), UnitDimension::LENGTH),
            ("refine.shell", self.shell.as_ref(), UnitDimension::LENGTH),
            ("refine.time", self.time.as_ref(), UnitDimension::TIME),
            ("refine.particle_mass", self.particle_mass.as_ref(), UnitDimension::MASS),
        ];
        components.chain(single.into_iter().filter_map(|(key, q, d)| Some((key.to_owned(), q?, d)))).collect()
    }

    pub(super) fn validate(&self) -> Result<()> {
        self.radius.check_positive("refine.radius", UnitDimension::LENGTH)?;
        self.shell.as_ref().map_or(Ok(()), |q| q.check_positive("refine.shell", UnitDimension::LENGTH))?;
        self.particle_mass
            .as_ref()
            .map_or(Ok(()), |q| q.check_positive("refine.particle_mass", UnitDimension::MASS))?;
        match (1.0 / MOST..=MOST).contains(&self.factor) {
            true => Ok(()),
            false => {
                let problem = format!(
                    "is {}, expected particles in the place of one, from {} to {MOST}",
                    self.factor,
                    1.0 / MOST
                );
                Err(Error::scene("refine.factor", problem))
            }
        }
    }
}
