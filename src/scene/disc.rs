//! The `disc` of an input's profile: gas that rotates around the central bodies of its scene.

use super::{Quantity, Term};
use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sph_formats::UnitDimension;

/// Gas in a flat disc about the z axis, in equilibrium along z and along R with the gravity of point masses, halos and bulges about its
/// center (`bodies` with the same position, or `gravity_of`) and with its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiscInput {
    /// Mass of the gas.
    #[schemars(extend("x-unit" = "mass"))]
    pub mass: Quantity,
    /// Inner radius of the disc; 0 for a disc without a hole.
    #[schemars(extend("x-unit" = "length"))]
    pub inner_radius: Quantity,
    /// Outer radius of the disc.
    #[schemars(extend("x-unit" = "length"))]
    pub outer_radius: Quantity,
    /// Surface density as an expression in R, in any unit: its scale follows from the mass.
    #[schemars(example = &"exp(-R/3)")]
    #[serde(default = "one_over_radius")]
    pub surface_density: Term,
    /// H/R of the gas without its own gravity, a number or an expression in R: the sound speed over the circular speed.
    #[schemars(example = 0.05)]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aspect_ratio: Option<Term>,
    /// Isothermal sound speed in place of the aspect ratio: a number, or an expression in R.
    #[schemars(example = &"10 km/s")]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sound_speed: Option<Term>,
    /// Width over which the surface density falls at both edges, in local scale heights: as exp(-x^2/2), to three of these widths. With a width
    /// below one, rings are unstable (Rayleigh); 0 is a sharp edge.
    #[schemars(range(min = 0.0), example = 1.25)]
    #[serde(default = "edge_width")]
    pub edge_width: f64,
    /// Whether the disc is self-gravitating.
    #[serde(default = "yes")]
    pub self_gravity: bool,
}

fn one_over_radius() -> Term {
    Term::Text("1/R".into())
}

fn edge_width() -> f64 {
    1.25
}

fn yes() -> bool {
    true
}

impl DiscInput {
    pub(crate) fn quantities(&self) -> Vec<(&'static str, &Quantity, UnitDimension)> {
        let length = UnitDimension::LENGTH;
        vec![
            ("mass", &self.mass, UnitDimension::MASS),
            ("inner_radius", &self.inner_radius, length),
            ("outer_radius", &self.outer_radius, length),
        ]
    }

    /// What sets the temperature: key, statement, and whether it is a speed.
    ///
    /// # Errors
    /// Neither or both of the two that can.
    pub(crate) fn temperature(&self) -> Result<(&'static str, &Term, bool)> {
        match (&self.aspect_ratio, &self.sound_speed) {
            (Some(ratio), None) => Ok(("aspect_ratio", ratio, false)),
            (None, Some(speed)) => Ok(("sound_speed", speed, true)),
            (found, _) => {
                let both = if found.is_some() { "both" } else { "none" };
                let problem = format!("has {both} of aspect_ratio and sound_speed; give one");
                Err(Error::scene("input.profile.disc", problem))
            }
        }
    }

    pub(super) fn validate(&self) -> Result<()> {
        self.temperature()?;
        match self.edge_width >= 0.0 && self.edge_width.is_finite() {
            true => Ok(()),
            false => {
                let problem = format!("is {}, expected a number of scale heights from 0", self.edge_width);
                Err(Error::scene("input.profile.disc.edge_width", problem))
            }
        }
    }
}
