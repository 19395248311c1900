//! The datasets of an AREPO initial-conditions file.

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
    Rule { name: "InternalEnergy", source: Source::Column(names::INTERNAL_ENERGY), storage: Storage::Float, unit: Quantity::SpecificEnergy, components: 1, need: Need::Gas },
    Rule { name: "Density", source: Source::Column(names::DENSITY), storage: Storage::Float, unit: Quantity::Density, components: 1, need: Need::Optional },
];

/// Mesh generators without a kernel, all in the box.
pub const FLAVOR: Flavor = Flavor {
    format: "arepo",
    rules: RULES,
    header: &[("Omega0", 0.0), ("OmegaLambda", 0.0), ("OmegaBaryon", 0.0), ("HubbleParam", 1.0)],
    box_size: BoxSize::First,
    inside_box: true,
    extra_columns: true,
    long_columns: true,
    wide_totals: false,
    unit_parameters: true,
    magnetic: MagneticUnit::Gaussian,
    dropped: &[names::SUPPORT_RADIUS],
    taken: &[],
};
