//! The scene: all parameters of a run, as one YAML document.
//!
//! Unknown keys are errors with line and column. Numbers that have a dimension are [`Quantity`]s: with a unit, or in the
//! scene's `units`, which are those of the input by default. What is left out takes the default that `--print-scene` shows.

mod ambient;
mod balance;
mod beside;
mod bodies;
mod collisionless;
mod core;
mod count;
mod dimensions;
mod disc;
mod displacement;
mod domain;
mod dust;
mod fields;
mod files;
mod gravity;
mod hydrostatic;
mod input;
mod interpolation;
mod of_ambient;
mod of_body;
mod origin;
mod own_turning;
mod physics;
mod planet;
mod profile;
mod quantity;
mod read;
pub mod reference;
mod refine;
mod resolution;
mod role;
mod schema;
mod shape;
mod stages;
mod switch;
mod systems;
mod turbulence;
mod units;
mod walls;
mod yaml;

pub use ambient::{AmbientInput, MatchName};
pub use balance::{BalanceInput, EquationOfState, GravityName};
pub(crate) use beside::RATIO as DUST_RATIO;
pub(crate) use bodies::in_body;
pub use bodies::{BodyInput, OrbitInput};
pub use collisionless::{AttractorInput, CollisionlessInput, VelocityName};
pub use core::{CoreGas, CoreInput, SofteningName};
pub use count::parse_count;
pub use switch::Switch;

pub use disc::DiscInput;
pub(crate) use displacement::check_points;
pub use displacement::{DisplacementInput, SpectrumInput};
pub use domain::{BoundaryName, DomainInput};
pub use dust::DustInput;
pub use fields::{FieldFile, FieldValue, FieldsInput, Term, VariableNames};
pub(crate) use gravity::{SAME_GAS, is_heat};
pub use hydrostatic::HydrostaticInput;
pub(crate) use input::orientation;
pub use input::{Atmosphere, CenteringName, Input, MissingValues, OtherTypes, StaggeringName};
pub use interpolation::InterpolationName;
pub use origin::{OriginInput, OriginName};
#[doc(hidden)]
pub use own_turning::OwnTurning;
pub use physics::{MaterialLayer, Motion, Thermal};
pub use planet::{LayerInput, MaterialInput, PlanetInput, ThermalState};
pub use profile::{PolytropeZone, ProfileInput};
pub use quantity::{Conversion, Quantity, check_all, values};
pub(crate) use quantity::{beside_units, vector};
pub use refine::RefineInput;
pub use resolution::ResolutionInput;
pub use role::{Part, Role, Vector, parse_mapping};
pub use shape::{
    AxisName, BallInput, CylinderInput, EllipsoidInput, HalfSpaceInput, RotateInput, ShapeInput, SurfaceInput,
    TorusInput,
};
pub use stages::{AfcInput, AimName, AlaricInput, CheckpointInput, Order, Polish, SolverInput, WvtInput};
pub(crate) use systems::name_of;
pub use systems::system_of;
pub use turbulence::TurbulenceInput;
pub use walls::WallsInput;

use crate::codes::{SHEETS, TargetCode};
use crate::error::{Error, Result};
use crate::seeding::Seeding;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sph::kernel::{KernelName, default_kernel_neighbors};
use sph_formats::WriteOptions;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// One run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Scene {
    pub input: Input,
    /// Units of all numbers of the scene that are written without one: cgs, si, solar, planetary or galactic; by default
    /// those of the input. They are also those of an expression, and of a file that states none.
    #[schemars(example = &"solar")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub units: Option<String>,
    /// Roles of variables of the input, if their names do not determine them: `{vel1: velocity-x, E: none}`.
    #[schemars(example = serde_json::json!({"vel1": "velocity-x", "E": "none"}))]
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub map: BTreeMap<String, Role>,
    /// A particle number density that is independent of the mass density; masses then vary.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resolution: Option<ResolutionInput>,
    /// A sphere with finer or coarser particles; in a snapshot, all other particles are kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refine: Option<RefineInput>,
    pub domain: DomainInput,
    /// Number of particles N, met exactly: 100000, 1e5 or 100k.
    #[schemars(schema_with = "schema::optional_count", example = &"100k")]
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "count::optional_count")]
    pub particles: Option<usize>,
    /// Seed of all random numbers. Another seed gives another arrangement of the same quality.
    pub seed: u64,
    /// Method for the initial positions; by default equal-area shells for radial targets in a 3-D ball if the density solver follows, else
    /// mass bisection.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seeding: Option<Seeding>,
    /// Whether particles form a crystal, which has the least noise (a face-centered cubic lattice unless `seeding` names another), or an
    /// isotropic arrangement; by default the latter, unless `seeding` names a lattice.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub order: Option<Order>,
    /// The simulation code, with its build options, for which the particles are made: `swift`, `swift:wendland-c4,eta=1.2348,scheme=planetary`,
    /// `gadget4:neighbors=64`, `gadget2`, `phantom:hfact=1.2`, `arepo`, `pysph`, `dualsphysics`. Sets the kernel, the number of neighbors and
    /// the format if they are left out, and the gravitational constant, and balances self-gravitating bodies.
    #[schemars(example = &"swift:wendland-c4,eta=1.2348")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_code: Option<String>,
    /// Kernel of all sums; by default that of the target code, otherwise Wendland C4.
    #[schemars(schema_with = "schema::optional_kernel")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kernel: Option<KernelName>,
    /// Number of kernel neighbors V_d n H^d; by default that of the target code, otherwise 64 in 3-D, and the same H per spacing in 2-D and 1-D
    /// (19.3, 4.96).
    #[schemars(range(min = 2.0, max = 1000.0), example = 64.0)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub neighbors: Option<f64>,
    /// Ratio of densities across a discontinuity above which the regions on its sides are relaxed separately, each as if it continued beyond:
    /// by default 7.4, and 1.4 for the other discontinuities if any exceeds 7.4. Use a smaller value, such as 1.5, for contact discontinuities.
    #[schemars(example = 1.5)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region_contrast: Option<f64>,
    pub wvt: WvtInput,
    /// The method that follows WVT; by default the density solver if time and memory allow.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polish: Option<Polish>,
    pub alaric: AlaricInput,
    pub solver: SolverInput,
    pub afc: AfcInput,
    /// Moves the particles until the pressure force of the target code cancels gravity; by default for a self-gravitating body if a target code
    /// is stated. `true`, `false`, or its keys.
    #[schemars(example = true)]
    #[serde(skip_serializing_if = "Switch::is_unset")]
    pub balance: Switch<BalanceInput>,
    /// Number of dynamical times for which the result is evolved, to see whether it stays at rest; for a self-gravitating body, and for bodies
    /// and the medium around them in a box that contains both.
    #[schemars(extend("x-unit" = "dynamical times"), example = 3.0)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certify: Option<f64>,
    /// Number of dynamical times of the whole for which the placed particles move under the forces of the target code while their motion is
    /// damped, except for the rotation of the whole. This is for bodies that cannot be balanced, such as two bodies in each other's tidal
    /// field, or a rotating one. `certify` then evolves them from there.
    #[schemars(extend("x-unit" = "dynamical times"), example = 4.0)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settle: Option<f64>,
    /// Largest fraction by which masses may change to make the density exact; masses are equal otherwise.
    #[schemars(example = 0.05)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trim_masses: Option<f64>,
    /// Stop when epsilon (mass re-fitted) is below this value; if it is not reached, the exit code is 3.
    #[schemars(example = 1e-5)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Time in seconds after which relaxation stops with the best state so far. Bodies share it in proportion to their numbers of particles.
    #[schemars(extend("x-unit" = "s"), range(min = 0.0), example = 3500.0)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_limit: Option<f64>,
    #[serde(skip_serializing_if = "CheckpointInput::is_default")]
    pub checkpoint: CheckpointInput,
    /// Columns of the particles in addition to their mass, as expressions or variables of files (`{file: F, variable: V}`). They are added to
    /// the input's columns, or replace them.
    #[schemars(example = serde_json::json!({"velocity": ["-y", "x", 0]}))]
    #[serde(skip_serializing_if = "FieldsInput::is_empty")]
    pub fields: FieldsInput,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turbulence: Option<TurbulenceInput>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement: Option<DisplacementInput>,
    pub motion: Motion,
    pub thermal: Thermal,
    /// Makes the particles collisionless, like dark matter and stars: `true`, or its keys.
    #[schemars(schema_with = "schema::switch_or_keys::<CollisionlessInput>", example = true)]
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "switch::switch_or_keys")]
    pub collisionless: Option<CollisionlessInput>,
    /// Dust, as separate particles in addition to the gas.
    #[schemars(example = serde_json::json!({"ratio": 0.01, "particles": "20k"}))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dust: Option<DustInput>,
    /// Bodies around the same center that are not among the particles, but whose gravity acts on them: inputs, or point masses.
    #[schemars(example = serde_json::json!([{"input": {"profile": {"nfw": {"mass": "1e12 Msun", "scale_radius": "20 kpc", "outer_radius": "200 kpc"}}}}]))]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gravity_of: Vec<AttractorInput>,
    /// Of a body by itself that is followed: how it will turn among others. No key of the document.
    #[doc(hidden)]
    #[serde(skip)]
    pub turning: OwnTurning,
    /// Materials by distance from the center, from the inside outward; they override carried ones.
    #[schemars(example = serde_json::json!([{"id": 402, "radius": 0.5}, {"id": 400}]))]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub material: Vec<MaterialLayer>,
    /// Particles of solid walls around the fluid.
    #[schemars(example = serde_json::json!({"layers": 3}))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub walls: Option<WallsInput>,
    /// Several bodies, each a separate scene, instead of `input` and its related keys.
    #[schemars(example = serde_json::json!([{"input": {"file": "star.nc"}, "position": [0, 0, 0]}]))]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<BodyInput>,
    /// A medium that fills the rest of the box around the bodies; the box is that of the `domain`.
    #[schemars(example = serde_json::json!({"density": 0.01, "fields": {"pressure": 1, "velocity": [2, 0, 0]}}))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ambient: Option<AmbientInput>,
    /// The orbit of two bodies around each other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub orbit: Option<OrbitInput>,
    /// Folder in which placed bodies are stored, so that another orbit of the same bodies takes no time.
    #[schemars(example = &"placed")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cache: Option<PathBuf>,
    /// Mass of each particle, the same in all bodies, instead of a number of particles.
    #[schemars(extend("x-unit" = "mass"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub particle_mass: Option<Quantity>,
    pub output: Output,
    /// The file that it was read from, which no output replaces; set by [`Scene::load`].
    #[serde(skip)]
    pub read_from: Option<PathBuf>,
}

fn positive(key: &str, v: f64) -> Result<()> {
    match v.is_finite() && v > 0.0 {
        true => Ok(()),
        false => Err(Error::scene(key, format!("is {v}, expected a positive number"))),
    }
}

/// The output file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Particle file to write; the extension selects the format; .png writes an image instead.
    #[schemars(example = &"ic.hdf5")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// A self-contained HTML page about the run: verdict, images, figures, plan and scene.
    #[schemars(example = &"ic.html")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub report: Option<PathBuf>,
    /// Format, if the extension does not determine it.
    #[schemars(example = &"swift")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub format: Option<String>,
    /// cgs, si, solar, planetary, galactic or code; by default the one that suits the input.
    #[schemars(example = &"cgs")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub units: Option<String>,
    /// Number of files for the particles: `NAME.0.EXT` and so on for GADGET and similar formats, pieces of a `.pvtu` for VTK.
    #[schemars(range(min = 1), example = 8)]
    #[serde(skip_serializing_if = "is_one")]
    pub files: usize,
    /// Edge length of the box of an isolated body, relative to the size of the body.
    pub box_factor: f64,
    /// Which point of the result is at the origin: `corner` of the box, `center` of the box, `center-of-mass`, that of the `input`,
    /// or a point of the input. By default the center of mass for Phantom, and the corner for others.
    #[schemars(extend("x-unit" = "length"), example = &"center-of-mass")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin: Option<OriginInput>,
    /// Whether an existing file is an error instead of being replaced.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub no_clobber: bool,
    /// Deflate level, 0 to 9.
    #[schemars(range(max = 9))]
    pub compression: u8,
    /// Whether f64 is written where the format's default is f32.
    pub double_precision: bool,
    /// Whether to write a column `TargetDensity` with the target density at each particle.
    pub target_density: bool,
    /// Whether to write parameter files of the target code, with which it starts and runs the output without changes.
    pub parameters: bool,
    pub on_interrupt: OnInterrupt,
}

/// Result that an interrupt (Ctrl-C) leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OnInterrupt {
    /// No file: an interrupt means that no result is wanted, and an earlier file of this name is kept.
    #[default]
    Discard,
    /// The best state so far, marked as not converged.
    Write,
}

fn is_one(count: &usize) -> bool {
    *count == 1
}

impl Output {
    /// How numbers are written.
    pub(crate) fn write_options(&self) -> WriteOptions {
        WriteOptions { compression: self.compression, double_precision: self.double_precision }
    }
}

impl Default for Output {
    fn default() -> Self {
        Self {
            file: None,
            report: None,
            format: None,
            units: None,
            files: 1,
            no_clobber: false,
            box_factor: 4.0,
            origin: None,
            compression: 4,
            double_precision: false,
            target_density: false,
            parameters: false,
            on_interrupt: OnInterrupt::default(),
        }
    }
}

/// Particles when nothing else is said.
pub const DEFAULT_PARTICLES: usize = 100_000;

impl Scene {
    /// N_H in `d` dimensions, as given or customary.
    pub fn kernel_neighbors(&self, d: usize) -> f64 {
        let by_code = || self.code().map(|code| code.kernel_neighbors(d));
        self.neighbors.or_else(by_code).unwrap_or_else(|| default_kernel_neighbors(d))
    }

    /// The kernel, as given, that of the target code, or the default.
    pub fn kernel(&self) -> KernelName {
        self.kernel.or_else(|| Some(self.code()?.kernel)).unwrap_or_default()
    }

    /// The target code; `None` where there is none, or none that [`Self::validate`] admits.
    pub fn code(&self) -> Option<TargetCode> {
        TargetCode::parse(self.target_code.as_deref()?).ok()
    }

    /// Whether the particles' number density follows something else than the density, so that masses vary.
    pub fn has_own_resolution(&self) -> bool {
        self.resolution.is_some() || self.refine.is_some() || self.seeding == Some(Seeding::VariableMasses)
    }

    /// Whether the density solver is to bring mass to where the target has it, in place of summed densities; `None` where the target
    /// decides.
    pub(crate) fn aims_at_mass(&self) -> Option<bool> {
        let by_input = self.has_disc().then_some(true);
        self.solver.aim.map(|aim| aim == AimName::Mass).or(by_input)
    }

    /// Whether a run that is interrupted is to leave no particles.
    pub(crate) fn discards_interrupted(&self) -> bool {
        self.output.on_interrupt == OnInterrupt::Discard
    }

    /// The input as reports name it.
    pub fn input_name(&self) -> String {
        match (&self.input.file, &self.input.profile, &self.input.expression) {
            (Some(file), ..) => file.display().to_string(),
            (None, Some(profile), _) => format!("profile '{}'", profile.name()),
            (None, None, expression) => format!("expression '{}'", expression.as_deref().unwrap_or("")),
        }
    }

    /// Checks what can be checked without the input.
    ///
    /// # Errors
    /// [`Error::Scene`] naming key, value and what was expected.
    pub fn validate(&self) -> Result<()> {
        self.target_code.as_deref().map_or(Ok(()), |code| TargetCode::parse(code).map(|_| ()))?;
        self.check_input()?;
        self.input.validate_of_file()?;
        self.input.validate_orientation()?;
        self.check_stages()?;
        self.stated_units()?;
        self.check_quantities()?;
        self.input.disc().map_or(Ok(()), DiscInput::validate)?;
        self.input.hydrostatic().map_or(Ok(()), HydrostaticInput::validate)?;
        self.check_bodies()?;
        self.check_ambient()?;
        self.check_collisionless()?;
        self.check_dust()?;
        self.check_physics()?;
        self.check_settling()?;
        self.check_output()
    }

    fn check_input(&self) -> Result<()> {
        let Input { file, expression, profile, .. } = &self.input;
        match [file.is_some(), expression.is_some(), profile.is_some()].into_iter().filter(|given| *given).count() {
            1 => {}
            0 if !self.bodies.is_empty() => {}
            0 => {
                let problem = "names neither a `file` nor an `expression` nor a `profile`; give one (--in FILE)";
                return Err(Error::scene("input", problem));
            }
            _ => {
                let problem = "names more than one of `file`, `expression` and `profile`; give one";
                return Err(Error::scene("input", problem));
            }
        }
        if self.particles == Some(0) {
            return Err(Error::scene("particles", "is 0, expected at least 1"));
        }
        if self.particles.is_some_and(|n| n > u32::MAX as usize) {
            return Err(Error::scene(
                "particles",
                format!("is more than {}, the most that one run can place", u32::MAX),
            ));
        }
        if let Some(core) = &self.input.core {
            let is_of_gas =
                expression.is_none() && !matches!(profile, Some(ProfileInput::Planet(_) | ProfileInput::Disc(_)));
            core.validate(is_of_gas, self.input.dimension)?;
        }
        if let Some(d) = self.input.dimension.filter(|d| !(1..=3).contains(d)) {
            return Err(Error::scene("input.dimension", format!("is {d}, expected 1, 2 or 3")));
        }
        if let Some(n) = self.neighbors.filter(|n| !(2.0..=1000.0).contains(n)) {
            return Err(Error::scene("neighbors", format!("is {n}, expected 2 to 1000")));
        }
        Ok(())
    }

    fn check_stages(&self) -> Result<()> {
        positive("wvt.step", self.wvt.step)?;
        self.order.map_or(Ok(()), |order| order.check(self.seeding))?;
        positive("wvt.final_step", self.wvt.final_step)?;
        if self.wvt.final_step > 1.0 {
            return Err(Error::scene(
                "wvt.final_step",
                format!("is {}, expected at most 1: steps shrink", self.wvt.final_step),
            ));
        }
        if let Some(ratio) = self.region_contrast.filter(|r| !(r.is_finite() && *r > 1.0)) {
            return Err(Error::scene("region_contrast", format!("is {ratio}, expected a ratio of densities above 1")));
        }
        self.alaric.validate()?;
        self.afc.validate()?;
        if let Some(t) = self.trim_masses.filter(|t| !(*t > 0.0 && *t < 1.0)) {
            return Err(Error::scene("trim_masses", format!("is {t}, expected a fraction between 0 and 1")));
        }
        if let Some(quietness) = self.solver.quietness.filter(|q| !(0.0..=1.0).contains(q)) {
            return Err(Error::scene(
                "solver.quietness",
                format!("is {quietness}, expected 0 (exact density) to 1 (quiet forces)"),
            ));
        }
        if let Some(balance) = self.balance.on() {
            balance.validate()?;
            self.check_what_balance_excludes()?;
        }
        Ok(())
    }

    fn check_physics(&self) -> Result<()> {
        for (key, value) in [
            ("tolerance", self.tolerance),
            ("certify", self.certify),
            ("settle", self.settle),
            ("input.planet_radius", self.input.planet_radius.as_ref().map(Quantity::number)),
            ("thermal.internal_energy", self.thermal.internal_energy.as_ref().map(Quantity::number)),
        ] {
            value.map_or(Ok(()), |v| positive(key, v))?;
        }
        if let Some(seconds) = self.time_limit.filter(|s| !(*s >= 0.0)) {
            return Err(Error::scene("time_limit", format!("is {seconds}, expected seconds, at least 0")));
        }
        if !(self.checkpoint.minutes >= 0.0) {
            let problem = format!("is {}, expected minutes, at least 0", self.checkpoint.minutes);
            return Err(Error::scene("checkpoint.minutes", problem));
        }
        if !(self.thermal.gamma.is_finite() && self.thermal.gamma > 1.0) {
            return Err(Error::scene("thermal.gamma", format!("is {}, expected more than 1", self.thermal.gamma)));
        }
        self.turbulence.as_ref().map_or(Ok(()), TurbulenceInput::validate)?;
        self.displacement.as_ref().map_or(Ok(()), DisplacementInput::validate)?;
        self.fields.validate()
    }

    fn check_output(&self) -> Result<()> {
        self.output.units.as_deref().map_or(Ok(()), |name| system_of("output.units", name).map(|_| ()))?;
        if !(self.output.box_factor.is_finite() && self.output.box_factor >= 1.0) {
            return Err(Error::scene(
                "output.box_factor",
                format!("is {}, expected at least 1", self.output.box_factor),
            ));
        }
        self.output.origin.as_ref().map_or(Ok(()), OriginInput::validate)?;
        if self.output.parameters && !self.code().is_some_and(|code| code.sheet.has_parameters) {
            let known: Vec<&str> = SHEETS.iter().filter(|s| s.has_parameters).map(|s| s.name).collect();
            let problem = format!("needs a target_code (--for CODE) whose parameters are known: {}", known.join(", "));
            return Err(Error::scene("output.parameters", problem));
        }
        if self.output.parameters && !self.has_gas() {
            return Err(Error::scene(
                "output.parameters",
                "need gas particles, of which the scene has none: leave it out",
            ));
        }
        if self.output.files == 0 || self.output.files > self.particles.unwrap_or(DEFAULT_PARTICLES) {
            let problem = format!("is {}, expected at least 1, and no more files than particles", self.output.files);
            return Err(Error::scene("output.files", problem));
        }
        if self.output.compression > 9 {
            return Err(Error::scene("output.compression", format!("is {}, expected 0 to 9", self.output.compression)));
        }
        self.domain.validate()?;
        self.walls.as_ref().map_or(Ok(()), WallsInput::validate)?;
        self.refine.as_ref().map_or(Ok(()), RefineInput::validate)?;
        self.resolution.as_ref().map_or(Ok(()), ResolutionInput::validate)
    }

    /// What cannot go with a balance.
    fn check_what_balance_excludes(&self) -> Result<()> {
        self.excludes_balance()
            .map_or(Ok(()), |why| Err(Error::scene("balance", format!("cannot go with {why}; leave one out"))))
    }

    /// The key that a balance cannot go with, if there is one, and why.
    pub(crate) fn excludes_balance(&self) -> Option<String> {
        let excluded = [
            (
                "resolution",
                self.has_own_resolution(),
                "masses vary then, and codes differ in how their correction terms see them",
            ),
            ("trim_masses", self.trim_masses.is_some(), "trimmed masses would undo the balance"),
            (
                "thermal.internal_energy",
                self.thermal.internal_energy.is_some(),
                "the balance needs an energy of its own at each particle",
            ),
            ("displacement", self.displacement.is_some(), "the balance would undo it, or it the balance"),
            ("material", !self.material.is_empty(), "the balance knows the pressure of an ideal gas alone"),
        ];
        let force = || self.code().and_then(|code| code.unknown_force()).map(|why| format!("target_code: {why}"));
        excluded.iter().find(|e| e.1).map(|(key, _, why)| format!("{key}: {why}")).or_else(force)
    }
}
