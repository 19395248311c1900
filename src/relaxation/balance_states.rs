//! The state of a balance between evaluations, which is also kept for an interrupt.

use super::lbfgs::Lbfgs;
use super::newton::MinimalResidual;
use super::pulls::Pulls;
use super::snapshot::{Check, axes, rows};
use super::states::States;
use super::thermal::Factor;
use crate::target::Positions;
use serde::{Deserialize, Serialize};

/// The best state so far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Best<const D: usize> {
    #[serde(with = "axes")]
    pub positions: Positions<D>,
    pub internal_energy: Vec<f64>,
    pub iteration: usize,
    pub error: f64,
    /// The factor on A_i there, and that which gravity asks for.
    pub factors: [Factor; 2],
    /// Whether some particles are close to others: any state in which none are is better.
    pub is_paired: bool,
    /// Error by former gravity of the last state of which gravity was found to see whether it is the best.
    pub looked_at: f64,
}

/// What is held until A_i is taken anew.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Frame {
    /// A_i with the factor, and the factor; or points of the adiabats of materials.
    pub states: States,
    pub factor: Vec<f64>,
    /// Share of the mass nearer to the center of a body that its own gravity holds.
    pub fraction: Option<Vec<f64>>,
    /// What all others attract each with beyond the target's g, where they hold the body.
    pub pulls: Option<Pulls>,
    pub spacing: Vec<f64>,
    /// Unit of each particle's moves: longer where the fluid is cold, so that all respond alike.
    pub unit: Vec<f64>,
    /// Largest P/n, which makes gradients dimensionless.
    pub temperature: f64,
}

impl Frame {
    /// What of it is not of `D` dimensions and as many particles as `check` counts.
    pub fn check<const D: usize>(&self, check: Check, count: usize) -> Check {
        check
            .holds(self.states.is_of(count), "has thermal states of another number of particles")
            .scalars("factors", &self.factor)
            .holds(
                self.pulls.as_ref().is_none_or(|pulls| pulls.is_of(count, D)),
                "has gravity of another number of particles",
            )
            .scalars("spacings", &self.spacing)
            .scalars("units", &self.unit)
    }
}

/// A descent under way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Descent<const D: usize> {
    pub frame: Frame,
    pub memory: Lbfgs<D>,
    pub support: Vec<f64>,
    #[serde(with = "rows")]
    pub gradient: Vec<[f64; D]>,
    /// After how many evaluations gravity was last found.
    pub attracted: usize,
}

/// A step of Newton's method under way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Newton<const D: usize> {
    pub frame: Frame,
    /// Where it begins, with support radii and minus the force there.
    #[serde(with = "axes")]
    pub from: Positions<D>,
    pub support: Vec<f64>,
    #[serde(with = "rows")]
    pub gradient: Vec<[f64; D]>,
    pub solver: MinimalResidual<D>,
    pub products: usize,
}
