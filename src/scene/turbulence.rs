//! The `turbulence` section of a scene.

use super::Quantity;
use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sph_formats::UnitDimension;

/// Random velocities with a given spectrum, added to those of the fields; they are periodic over the domain's box.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TurbulenceInput {
    /// Root mean square of the velocity, weighted by mass; the gas as a whole is at rest.
    #[schemars(extend("x-unit" = "velocity"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rms_velocity: Option<Quantity>,
    /// The same in units of the sound speed, whose root mean square over the mass counts.
    #[schemars(example = 1.0)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mach: Option<f64>,
    /// Exponent p of E(k) ~ k^-p: 5/3 by default, 2 for a gas dominated by shocks.
    pub slope: f64,
    /// Smallest and largest wave number, in waves across the box.
    pub wavenumbers: [f64; 2],
    /// Share of the energy in compressive motion; 0 by default, for a field without divergence. In 1-D all motion is compressive.
    #[schemars(range(min = 0.0, max = 1.0), example = 0.3)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compressive: Option<f64>,
    /// Seed of the random numbers; by default that of the scene.
    #[schemars(example = 1)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
}

impl Default for TurbulenceInput {
    fn default() -> Self {
        Self {
            rms_velocity: None,
            mach: None,
            slope: 5.0 / 3.0,
            wavenumbers: [1.0, 8.0],
            compressive: None,
            seed: None,
        }
    }
}

/// More waves across the box than this are as many as the particles can tell apart in large runs.
const MOST_WAVES: f64 = 64.0;

impl TurbulenceInput {
    pub(super) fn validate(&self) -> Result<()> {
        match (&self.rms_velocity, self.mach) {
            (Some(v), None) => v.check_positive("turbulence.rms_velocity", UnitDimension::VELOCITY)?,
            (None, Some(mach)) if mach.is_finite() && mach > 0.0 => {}
            (None, Some(mach)) => {
                return Err(Error::scene("turbulence.mach", format!("is {mach}, expected a positive number")));
            }
            _ => {
                let problem = "has both rms_velocity and mach, or neither; give one of the two";
                return Err(Error::scene("turbulence", problem));
            }
        }
        if !self.slope.is_finite() {
            return Err(Error::scene("turbulence.slope", format!("is {}, expected a number", self.slope)));
        }
        let [least, most] = self.wavenumbers;
        if !(least > 0.0 && least <= most && (1.0..=MOST_WAVES).contains(&most)) {
            let problem = format!("are {least} to {most}, expected two that ascend, up to {MOST_WAVES}");
            return Err(Error::scene("turbulence.wavenumbers", problem));
        }
        if let Some(share) = self.compressive.filter(|c| !(0.0..=1.0).contains(c)) {
            return Err(Error::scene("turbulence.compressive", format!("is {share}, expected 0 to 1")));
        }
        Ok(())
    }
}
