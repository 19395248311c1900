//! The columns of SPH-EXA and its constants.

use crate::common::flavor::{BoxSize, Flavor, Need, Rule, Source, Storage};
use crate::common::quantity::Quantity;
use crate::magnetic::MagneticUnit;
use crate::particle_names as names;

/// Prefix of the group of one point in time.
pub const STEP: &str = "Step#";
/// Adiabatic index and mean molecular weight that the code takes unless told otherwise (`particles_data.hpp`).
pub const GAMMA: f64 = 5.0 / 3.0;
pub const MUI: f64 = 10.0;
/// The gas constant in the code's equation of state, erg / (K mol), whatever the units (`sph/eos.hpp`).
pub const GAS_CONSTANT: f64 = 8.317e7;
/// Floor of the artificial viscosity.
pub const ALPHA_MIN: f64 = 0.05;
/// The kernel's support is twice h.
pub const SUPPORT: f64 = 2.0;

/// Attribute of a dataset: exponents of length, mass, time and temperature in its unit.
pub const EXPONENTS: &str = "unit exponents";

/// u per temperature.
pub fn heat_capacity(gamma: f64, mui: f64) -> f64 {
    GAS_CONSTANT / mui / (gamma - 1.0)
}

/// One dataset of a step: `factor` times a component of the planned column `from`.
pub struct Part {
    pub name: &'static str,
    pub from: &'static str,
    pub component: usize,
    pub factor: Factor,
    /// f8 whatever the requested precision.
    pub double: bool,
}

/// What a column is multiplied by.
#[derive(Clone, Copy, PartialEq)]
pub enum Factor {
    One,
    Half,
    /// The previous time step.
    Step,
    /// Temperature per internal energy.
    Temperature,
}

const fn part(name: &'static str, from: &'static str, component: usize, factor: Factor, double: bool) -> Part {
    Part { name, from, component, factor, double }
}

/// Besides the ids, the constant columns and the columns of other names.
pub const PARTS: &[Part] = &[
    part("x", names::COORDINATES, 0, Factor::One, true),
    part("y", names::COORDINATES, 1, Factor::One, true),
    part("z", names::COORDINATES, 2, Factor::One, true),
    part("vx", names::VELOCITIES, 0, Factor::One, false),
    part("vy", names::VELOCITIES, 1, Factor::One, false),
    part("vz", names::VELOCITIES, 2, Factor::One, false),
    part("x_m1", names::VELOCITIES, 0, Factor::Step, false),
    part("y_m1", names::VELOCITIES, 1, Factor::Step, false),
    part("z_m1", names::VELOCITIES, 2, Factor::Step, false),
    part("h", names::SUPPORT_RADIUS, 0, Factor::Half, false),
    part("m", names::MASSES, 0, Factor::One, false),
    part("temp", names::INTERNAL_ENERGY, 0, Factor::Temperature, true),
    part("u", names::INTERNAL_ENERGY, 0, Factor::One, true),
    part("rho", names::DENSITY, 0, Factor::One, false),
];

/// Columns that are the same for every particle: name and value.
pub const CONSTANTS: &[(&str, f64)] = &[("alpha", ALPHA_MIN), ("du_m1", 0.0)];

#[rustfmt::skip]
const RULES: &[Rule] = &[
    Rule { name: names::COORDINATES, source: Source::Column(names::COORDINATES), storage: Storage::Double, unit: Quantity::Length, components: 3, need: Need::All },
    Rule { name: names::VELOCITIES, source: Source::ColumnOrZeros(names::VELOCITIES), storage: Storage::Float, unit: Quantity::Velocity, components: 3, need: Need::All },
    Rule { name: names::SUPPORT_RADIUS, source: Source::Column(names::SUPPORT_RADIUS), storage: Storage::Float, unit: Quantity::Length, components: 1, need: Need::All },
    Rule { name: names::MASSES, source: Source::Column(names::MASSES), storage: Storage::Float, unit: Quantity::Mass, components: 1, need: Need::All },
    Rule { name: names::INTERNAL_ENERGY, source: Source::Column(names::INTERNAL_ENERGY), storage: Storage::Float, unit: Quantity::SpecificEnergy, components: 1, need: Need::All },
    Rule { name: names::DENSITY, source: Source::Column(names::DENSITY), storage: Storage::Float, unit: Quantity::Density, components: 1, need: Need::Optional },
    Rule { name: "id", source: Source::ColumnOrCount(names::PARTICLE_IDS), storage: Storage::Id, unit: Quantity::Number, components: 1, need: Need::All },
];

/// Every particle has to be in the box, from which the code makes its tree.
pub const FLAVOR: Flavor = Flavor {
    format: "sph-exa",
    rules: RULES,
    header: &[],
    box_size: BoxSize::Edges,
    inside_box: true,
    extra_columns: true,
    long_columns: false,
    wide_totals: false,
    unit_parameters: false,
    magnetic: MagneticUnit::HeavisideLorentz,
    dropped: &[],
    taken: &["x", "y", "z", "vx", "vy", "vz", "x_m1", "y_m1", "z_m1", "h", "m", "temp", "u", "rho"],
};
