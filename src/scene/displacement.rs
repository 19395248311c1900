//! The `displacement` section of a scene.

use super::{Quantity, Term};
use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sph_formats::UnitDimension;
use std::path::PathBuf;

/// Moves the particles once they are arranged: x = q + psi(q), by a random field psi of a spectrum or by a stated one (Zel'dovich
/// 1970). The box is periodic along all axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DisplacementInput {
    /// psi by its components, as expressions of x, y, z and r before the move; in place of a spectrum.
    #[schemars(example = serde_json::json!(["-0.01*sin(2*pi*x)", 0, 0]))]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub field: Vec<Term>,
    /// Exponent n of the power spectrum P(k) ~ k^n of the density contrast -div psi.
    #[schemars(example = -2.0)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slope: Option<f64>,
    /// The power spectrum P(k) as pairs of k and P, or as a file with two such columns, in the scene's units; in place of a power law.
    #[schemars(example = serde_json::json!([[6.3, 1e-4], [63, 1e-6]]))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spectrum: Option<SpectrumInput>,
    /// P at the wave number 1 of a power law, in the scene's units; in place of `rms`.
    #[schemars(range(min = 0.0), example = 1e-4)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub amplitude: Option<f64>,
    /// Root mean square of |psi| over the box, to which the field is scaled; without it a spectrum has its own amplitude.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rms: Option<Quantity>,
    /// Smallest and largest wave number, in waves across the longest edge of the box.
    pub wavenumbers: [f64; 2],
    /// Velocities over displacements, which are added to those of the scene: f H of a growing mode. Without it there are none.
    #[schemars(extend("x-unit" = "angular velocity"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity_factor: Option<Quantity>,
    /// Seed of the random numbers; by default that of the scene.
    #[schemars(example = 1)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
}

/// A spectrum by points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected pairs [k, P], or the name of a file with two columns")]
pub enum SpectrumInput {
    Points(Vec<[f64; 2]>),
    File(PathBuf),
}

impl Default for DisplacementInput {
    fn default() -> Self {
        Self {
            field: Vec::new(),
            slope: None,
            spectrum: None,
            amplitude: None,
            rms: None,
            wavenumbers: [1.0, 16.0],
            velocity_factor: None,
            seed: None,
        }
    }
}

/// As many waves across the box as there may be: half a million in 3-D, each of which moves each particle.
const MOST_WAVES: f64 = 64.0;
const KEY: &str = "displacement";

impl DisplacementInput {
    /// Files that it names.
    pub(super) fn file_mut(&mut self) -> Option<&mut PathBuf> {
        if let Some(SpectrumInput::File(path)) = &mut self.spectrum { Some(path) } else { None }
    }

    pub(super) fn validate(&self) -> Result<()> {
        let stated = [!self.field.is_empty(), self.slope.is_some(), self.spectrum.is_some()];
        match stated.into_iter().filter(|s| *s).count() {
            1 => {}
            n => {
                let problem = format!("has {n} of `field`, `slope` and `spectrum`; expected exactly one");
                return Err(Error::scene(KEY, problem));
            }
        }
        if let Some(factor) = &self.velocity_factor {
            factor.check("displacement.velocity_factor", UnitDimension::RATE)?;
        }
        if let Some(rms) = &self.rms {
            rms.check_positive("displacement.rms", UnitDimension::LENGTH)?;
        }
        if !self.field.is_empty() {
            let others = [
                ("displacement.rms", self.rms.is_some()),
                ("displacement.amplitude", self.amplitude.is_some()),
                ("displacement.seed", self.seed.is_some()),
            ];
            return others.iter().find(|o| o.1).map_or(Ok(()), |(key, _)| {
                Err(Error::scene(*key, "is of a random field, but `field` states one; leave it out"))
            });
        }
        if let Some(slope) = self.slope.filter(|s| !s.is_finite()) {
            return Err(Error::scene("displacement.slope", format!("is {slope}, expected a number")));
        }
        match (self.slope, self.amplitude, &self.rms) {
            (Some(_), Some(p), None) if p.is_finite() && p > 0.0 => {}
            (Some(_), Some(p), None) => {
                return Err(Error::scene("displacement.amplitude", format!("is {p}, expected a positive number")));
            }
            (Some(_), None, Some(_)) | (None, None, _) => {}
            (Some(_), _, _) => {
                return Err(Error::scene(
                    KEY,
                    "has not one of rms and amplitude beside its slope; give one of the two",
                ));
            }
            (None, Some(_), _) => {
                return Err(Error::scene(
                    "displacement.amplitude",
                    "is of a power law; give `rms` to scale a spectrum",
                ));
            }
        }
        if let Some(SpectrumInput::Points(points)) = &self.spectrum {
            check_points(points).map_err(|problem| Error::scene("displacement.spectrum", problem))?;
        }
        let [least, most] = self.wavenumbers;
        if !(least > 0.0 && least <= most && (1.0..=MOST_WAVES).contains(&most)) {
            let problem = format!("are {least} to {most}, expected two that ascend, up to {MOST_WAVES}");
            return Err(Error::scene("displacement.wavenumbers", problem));
        }
        Ok(())
    }
}

/// Whether these are points of a spectrum: two of them at least, wave numbers that ascend, no negative power.
pub(crate) fn check_points(points: &[[f64; 2]]) -> std::result::Result<(), String> {
    if points.len() < 2 {
        return Err(format!("has {} points, expected two at least", points.len()));
    }
    for (i, [k, power]) in points.iter().enumerate() {
        if !(k.is_finite() && *k > 0.0 && power.is_finite() && *power >= 0.0) {
            return Err(format!("has k = {k}, P = {power} at point {i}, expected a positive k and no negative P"));
        }
        if i > 0 && points[i - 1][0] >= *k {
            return Err(format!(
                "has k = {k} at point {i} after {}, expected wave numbers that ascend",
                points[i - 1][0]
            ));
        }
    }
    Ok(())
}
