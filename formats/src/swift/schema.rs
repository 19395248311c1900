//! The datasets of a SWIFT initial-conditions file, as its hydro schemes' `hydro_io.h` lists them.

use crate::common::flavor::{BoxSize, CUBIC_SPLINE_ETA, Flavor, Need, Rule, Source, Storage};
use crate::common::quantity::Quantity;
use crate::common::snapshot::FLUX_DENSITIES;
use crate::magnetic::MagneticUnit;
use crate::particle_names as names;

#[rustfmt::skip]
const RULES: &[Rule] = &[
    Rule { name: "Coordinates", source: Source::Column(names::COORDINATES), storage: Storage::Double, unit: Quantity::Length, components: 3, need: Need::All },
    Rule { name: "Velocities", source: Source::ColumnOrZeros(names::VELOCITIES), storage: Storage::Float, unit: Quantity::Velocity, components: 3, need: Need::All },
    Rule { name: "Masses", source: Source::Column(names::MASSES), storage: Storage::Float, unit: Quantity::Mass, components: 1, need: Need::All },
    Rule { name: "ParticleIDs", source: Source::ColumnOrCount(names::PARTICLE_IDS), storage: Storage::Id, unit: Quantity::Number, components: 1, need: Need::All },
    Rule { name: "SmoothingLength", source: Source::Spacing { eta: CUBIC_SPLINE_ETA }, storage: Storage::Float, unit: Quantity::Length, components: 1, need: Need::Gas },
    Rule { name: "InternalEnergy", source: Source::Column(names::INTERNAL_ENERGY), storage: Storage::Float, unit: Quantity::SpecificEnergy, components: 1, need: Need::Gas },
    Rule { name: "Density", source: Source::Column(names::DENSITY), storage: Storage::Float, unit: Quantity::Density, components: 1, need: Need::Optional },
    Rule { name: FLUX_DENSITIES, source: Source::Column(names::MAGNETIC_FIELD), storage: Storage::Float, unit: Quantity::FluxDensity, components: 3, need: Need::Optional },
    Rule { name: "MaterialIDs", source: Source::Column(names::MATERIAL_IDS), storage: Storage::Int, unit: Quantity::Number, components: 1, need: Need::Optional },
];

/// SWIFT wants singular dataset names (its snapshots have plural ones) and every particle in the box.
pub const FLAVOR: Flavor = Flavor {
    format: "swift",
    rules: RULES,
    header: &[],
    box_size: BoxSize::Edges,
    inside_box: true,
    extra_columns: true,
    long_columns: true,
    wide_totals: false,
    unit_parameters: false,
    magnetic: MagneticUnit::Current(1.0),
    dropped: &[names::SUPPORT_RADIUS],
    taken: &[],
};
