//! The `core` of a scene's input: the inner part of a star as a point mass with a softened potential.

use super::Quantity;
use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sph_formats::UnitDimension;

/// A point mass in the center of a radial profile, and the gas about it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CoreInput {
    /// Radius beyond which the softened attraction equals that of a point, and within which the gas is replaced: 2 hsoft in Phantom, 2.8
    /// Plummer-equivalent lengths in GADGET and AREPO, 3 in SWIFT.
    #[schemars(extend("x-unit" = "length"), example = &"5 Rsun")]
    pub radius: Quantity,
    /// Profile of the gas within the radius.
    #[serde(default, skip_serializing_if = "CoreGas::is_cubic")]
    pub gas: CoreGas,
    /// Mass of the point. For a cubic core it is determined if it is left out; for the other laws it follows from hydrostatic equilibrium; with
    /// `keep` it has to be stated.
    #[schemars(extend("x-unit" = "mass"), example = &"0.4 Msun")]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<Quantity>,
    /// Polytropic index of a lane-emden core; 3 by default.
    #[schemars(example = 3.0)]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub n: Option<f64>,
    /// Softening kernel of the point mass; by default that of the target code or, without one, a cubic spline.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub softening: Option<SofteningName>,
    /// Particle type of the point in GADGET-style files, 1 to 5; 1 (dark matter) by default.
    #[schemars(range(min = 1, max = 5), example = 1)]
    #[serde(default, rename = "type", skip_serializing_if = "Option::is_none")]
    pub part_type: Option<u8>,
}

/// Gas about a point mass. Each but the last is hydrostatic with the softened point, and has the model's pressure, density and
/// enclosed mass at the radius.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CoreGas {
    /// rho = a r^3 + b r^2 + d with the model's density gradient at the radius, as in Phantom.
    #[default]
    Cubic,
    /// P/rho^gamma as at the radius, with thermal.gamma.
    ConstantEntropy,
    /// The solution of the modified Lane-Emden equation with the model's density gradient at the radius (Ohlmann et al. 2017).
    LaneEmden,
    /// As in the input, for a model from which the core has been removed already, or a star around a black hole.
    Keep,
}

impl CoreGas {
    fn is_cubic(&self) -> bool {
        *self == Self::Cubic
    }
}

/// The function by which a point mass is softened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SofteningName {
    /// M4, as in Phantom, GADGET, GIZMO and AREPO.
    CubicSpline,
    /// Wendland's C2 function, as in SWIFT.
    WendlandC2,
}

impl CoreInput {
    /// `is_of_gas` is whether the input is a radial profile of gas as far as the scene tells, in so many dimensions.
    pub(super) fn validate(&self, is_of_gas: bool, dimension: Option<usize>) -> Result<()> {
        self.radius.check_positive("input.core.radius", UnitDimension::LENGTH)?;
        let refused = |key: &str, problem: &str| Err(Error::scene(format!("input.core{key}"), problem));
        if let Some(mass) = &self.mass {
            mass.check_positive("input.core.mass", UnitDimension::MASS)?;
        }
        match (self.gas, &self.mass) {
            (CoreGas::ConstantEntropy | CoreGas::LaneEmden, Some(_)) => {
                return refused(
                    ".mass",
                    "follows from hydrostatics with this gas; leave it out, or choose the gas cubic",
                );
            }
            (CoreGas::Keep, None) => return refused(".mass", "is missing, which gas that is kept leaves open"),
            _ => {}
        }
        match self.n {
            Some(_) if self.gas != CoreGas::LaneEmden => {
                return refused(".n", "is of the gas lane-emden; leave it out");
            }
            Some(n) if !(n > 0.0 && n < 5.0) => {
                return refused(".n", &format!("is {n}, expected a polytropic index above 0 and below 5"));
            }
            _ => {}
        }
        if let Some(t) = self.part_type.filter(|t| !(1..=5).contains(t)) {
            return refused(".type", &format!("is {t}, expected 1 to 5; 0 is gas"));
        }
        if !is_of_gas {
            return refused("", "is of a radial profile of gas; leave it out beside an expression or a planet");
        }
        match dimension {
            Some(d) if d < 3 => refused("", &format!("is of a star in 3 dimensions, but input.dimension is {d}")),
            _ => Ok(()),
        }
    }
}
