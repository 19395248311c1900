//! The keys of a scene for the relaxation stages, checkpoints and the cache.

use crate::error::{Error, Result};
use crate::relaxation::{
    AFC, ALARIC, AfcOptions, AlaricOptions, Bias, DAMPED_RELAXATION, SOLVER, StageName, Weight, WvtOptions,
};
use crate::seeding::Seeding;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Relaxation by weighted Voronoi tessellation (WVT). Sources: Diehl et al. 2015, PASA 32, e048; Arth et al. 2019, arXiv:1907.11250.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct WvtInput {
    /// Number of iterations. The default depends on the seeding and on the polish that follows: 60 without a polish, few before one.
    #[schemars(schema_with = "super::schema::optional_count", example = 60)]
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "super::count::optional_count")]
    pub iterations: Option<usize>,
    /// Weight of a neighbor's push as a function of its distance.
    #[schemars(schema_with = "super::schema::choice::<Weight>")]
    pub weight: Weight,
    /// Treatment of the bias that the kernel's smoothing of the target causes.
    #[schemars(schema_with = "super::schema::choice::<Bias>")]
    pub bias: Bias,
    /// First displacement scale.
    pub step: f64,
    /// Last displacement scale over the first; at most 1.
    pub final_step: f64,
}

impl Default for WvtInput {
    fn default() -> Self {
        let o = WvtOptions::new(3);
        Self { iterations: None, weight: o.weight, bias: o.bias, step: o.step, final_step: o.final_step }
    }
}

/// The method that follows WVT.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Polish {
    /// The density solver.
    Solver,
    /// The damped dynamics of ALARIC ("an ALgorithm for ARbitrary Initial Conditions", its paper's sec. 2).
    Alaric,
    /// The same without velocity stops and splitting: the usual damped relaxation (the ALARIC paper's sec. 1.4.3).
    DampedRelaxation,
    /// Away from the closest neighbor: the naive method with which the ALARIC paper compares (its sec. 5.3).
    Afc,
    /// No further method.
    None,
}

impl Polish {
    /// The stage that does it.
    pub fn stage(self) -> Option<StageName> {
        match self {
            Self::Solver => Some(SOLVER),
            Self::Alaric => Some(ALARIC),
            Self::DampedRelaxation => Some(DAMPED_RELAXATION),
            Self::Afc => Some(AFC),
            Self::None => None,
        }
    }

    /// Whether it takes particles as they are seeded, and not as WVT leaves them.
    pub fn follows_seeding(self) -> bool {
        self == Self::Afc
    }
}

/// How regular the arrangement is to be.
///
/// What isotropic particles start from hardly matters for where they end: in a periodic box of 30 000, with 182 evaluations at quietness
/// 0.72, mass bisection (epsilon 5.9e-7, 0.78 % noise), random points (5.5e-7, 0.76 %), a glass (5.7e-7, 0.76 %) and a
/// low-discrepancy sequence (6.3e-7, 0.81 %) differ by a few percent; quietness 1 trades density for noise (3.9e-6, 0.28 %). A
/// crystal ends at 1e-14 without noise, and where the density follows a sine of 3:1 at 4e-9 with 0.6 % (face-centered; body-centered
/// 8e-9 with 0.9 %, isotropic 1.6e-8 with 1.3 %).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// A lattice: every particle has the same surroundings where the target is uniform; stretched elsewhere; with preferred directions.
    Crystal,
    /// No preferred directions: shells or mass bisection, relaxed. (In the plane, relaxed particles come to form grains of the
    /// hexagonal lattice by themselves.)
    Isotropic,
}

impl Order {
    /// Refuses a seeding of the other kind.
    pub(super) fn check(self, seeding: Option<Seeding>) -> Result<()> {
        let Some(seeding) = seeding else { return Ok(()) };
        let name = seeding.method().name;
        let (is, other) = match self {
            Self::Crystal => ("crystal", !seeding.is_lattice()),
            Self::Isotropic => ("isotropic", seeding.is_lattice() || seeding == Seeding::VariableMasses),
        };
        let kind = if self == Self::Crystal { "is no lattice" } else { "is a lattice" };
        if other {
            return Err(Error::scene(
                "order",
                format!("is {is}, but seeding '{name}' {kind}; leave one of the two out"),
            ));
        }
        Ok(())
    }
}

/// ALARIC, "an ALgorithm for ARbitrary Initial Conditions". Isothermal SPH with damping, in a fictitious potential that drives the
/// density to its target (the ALARIC paper's sec. 2).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AlaricInput {
    /// Time steps per stage of splitting, at most.
    #[schemars(schema_with = "super::schema::count")]
    #[serde(deserialize_with = "super::count::count")]
    pub steps: usize,
    /// Stages of particle splitting; by default the plan decides.
    #[schemars(range(max = 8), example = 1)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub splittings: Option<usize>,
    /// Friction in inverse sound crossing times of the domain; 0 switches it off.
    pub friction: f64,
    /// Whether artificial viscosity is included.
    pub viscosity: bool,
    /// Whether the velocities of all particles are set to zero repeatedly.
    pub velocity_stops: bool,
    /// Growth of the time between stops.
    pub growth: f64,
    /// Holds particles where the target changes too much over a support radius for any arrangement to follow.
    pub hold_unresolved: bool,
    /// Whether forces include the terms for spatially varying support radii (grad-h terms).
    pub grad_h: bool,
    /// Time step over the sound crossing time of the smallest support radius.
    pub courant: f64,
    /// Convergence criterion: the change of epsilon per crossing time is smaller than this.
    pub rate_tolerance: f64,
}

impl Default for AlaricInput {
    fn default() -> Self {
        let o = AlaricOptions::new(3);
        Self {
            steps: 500,
            splittings: None,
            friction: o.friction,
            viscosity: o.viscosity,
            velocity_stops: o.velocity_stops,
            growth: o.growth,
            hold_unresolved: true,
            grad_h: o.grad_h,
            courant: o.courant,
            rate_tolerance: o.rate_tolerance,
        }
    }
}

/// AFC, away from the closest neighbor (the ALARIC paper's sec. 5.3).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AfcInput {
    /// Number of displacements of all particles.
    #[schemars(schema_with = "super::schema::count")]
    #[serde(deserialize_with = "super::count::count")]
    pub steps: usize,
    /// First displacement, in spacings.
    #[schemars(extend("x-unit" = "spacings"))]
    pub step: f64,
}

impl Default for AfcInput {
    fn default() -> Self {
        let o = AfcOptions::new(3);
        Self { steps: o.steps, step: o.step }
    }
}

impl AfcInput {
    pub(super) fn validate(&self) -> Result<()> {
        if self.step > 0.0 && self.step <= 0.5 {
            return Ok(());
        }
        Err(Error::scene("afc.step", format!("is {}, expected a positive number of spacings, at most 0.5", self.step)))
    }
}

/// The density solver.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SolverInput {
    /// Number of evaluations of density and forces; by default as many as reduce the force noise, up to 100 with 100 000 particles, more with
    /// fewer particles (240) and fewer with more (30).
    #[schemars(schema_with = "super::schema::optional_count", example = 100)]
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "super::count::optional_count")]
    pub evaluations: Option<usize>,
    /// Priority, from 0 (exact density) to 1 (least force noise); by default 0.7, or the largest value that a tolerance admits.
    #[schemars(range(min = 0.0, max = 1.0), example = 0.7)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quietness: Option<f64>,
    /// Whether the summed densities or the positions of the mass follow the target where a kernel smooths it. By default it is the densities,
    /// but the mass in a `disc`, which its rotation and pressure support, and in a completely filled box where more than a quarter of the mass
    /// would be off by more than 1 %, as in a steep atmosphere.
    #[schemars(example = &"mass")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aim: Option<AimName>,
}

/// The quantity that the density solver matches to the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AimName {
    /// The summed density: particles are placed slightly closer together than the mass, to compensate for the smoothing.
    Density,
    /// The mass itself: the density is the target's smoothed by the kernel. For up to 524 288 particles in 3-D, 1 048 576 in 2-D and
    /// 2 097 152 in 1-D.
    Mass,
}

/// Checkpoints, from which a run continues after an interrupt, a kill or its time limit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CheckpointInput {
    /// Checkpoint file. It is replaced as a whole during relaxation, and removed once the result is written.
    #[schemars(example = &"run.checkpoint")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Minutes between checkpoints, the most that an interrupt can lose.
    #[schemars(extend("x-unit" = "min"))]
    pub minutes: f64,
    /// Checkpoint to continue from.
    #[schemars(example = &"run.checkpoint")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resume: Option<PathBuf>,
}

impl Default for CheckpointInput {
    fn default() -> Self {
        Self { file: None, minutes: 5.0, resume: None }
    }
}

impl CheckpointInput {
    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

impl AlaricInput {
    pub(super) fn validate(&self) -> Result<()> {
        let checks = [
            ("alaric.friction", self.friction, self.friction >= 0.0, "0 or more"),
            ("alaric.growth", self.growth, self.growth >= 0.0, "0 or more"),
            ("alaric.courant", self.courant, self.courant > 0.0, "a positive number"),
            ("alaric.rate_tolerance", self.rate_tolerance, self.rate_tolerance >= 0.0, "0 or more"),
        ];
        for (key, value, good, expected) in checks {
            if !(value.is_finite() && good) {
                return Err(Error::scene(key, format!("is {value}, expected {expected}")));
            }
        }
        match self.splittings {
            Some(s) if s > 8 => Err(Error::scene("alaric.splittings", format!("is {s}, expected 0 to 8"))),
            _ => Ok(()),
        }
    }
}
