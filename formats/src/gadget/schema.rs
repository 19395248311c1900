//! The datasets of a GADGET initial-conditions file.

use crate::common::flavor::{BoxSize, Flavor, Need, Rule, Source, Storage};
use crate::common::quantity::Quantity;
use crate::magnetic::MagneticUnit;
use crate::particle_names as names;

#[rustfmt::skip]
const RULES: &[Rule] = &[
    Rule { name: "Coordinates", source: Source::Column(names::COORDINATES), storage: Storage::Double, unit: Quantity::Length, components: 3, need: Need::All },
    Rule { name: "Velocities", source: Source::ColumnOrZeros(names::VELOCITIES), storage: Storage::Float, unit: Quantity::Velocity, components: 3, need: Need::All },
    Rule { name: "Masses", source: Source::Column(names::MASSES), storage: Storage::Float, unit: Quantity::Mass, components: 1, need: Need::All },
    Rule { name: "ParticleIDs", source: Source::ColumnOrCount(names::PARTICLE_IDS), storage: Storage::Id, unit: Quantity::Number, components: 1, need: Need::All },
    Rule { name: "SmoothingLength", source: Source::Column(names::SUPPORT_RADIUS), storage: Storage::Float, unit: Quantity::Length, components: 1, need: Need::Optional },
    Rule { name: "InternalEnergy", source: Source::Column(names::INTERNAL_ENERGY), storage: Storage::Float, unit: Quantity::SpecificEnergy, components: 1, need: Need::Gas },
    Rule { name: "Density", source: Source::Column(names::DENSITY), storage: Storage::Float, unit: Quantity::Density, components: 1, need: Need::Optional },
    Rule { name: "MaterialIDs", source: Source::Column(names::MATERIAL_IDS), storage: Storage::Int, unit: Quantity::Number, components: 1, need: Need::Optional },
];

/// GADGET's smoothing length is the radius at which the kernel vanishes; BoxSize is one number.
pub const FLAVOR: Flavor = Flavor {
    format: "gadget",
    rules: RULES,
    header: &[],
    box_size: BoxSize::Halves,
    inside_box: false,
    extra_columns: true,
    long_columns: true,
    wide_totals: true,
    unit_parameters: true,
    magnetic: MagneticUnit::HeavisideLorentz,
    dropped: &[],
    taken: &[],
};
