//! The datasets of a SWIFT initial-conditions file, as its hydro schemes' `hydro_io.h` lists them.

use crate::common::flavor::{Flavor, Need, Rule, Source, Storage};
use crate::common::particle_names as names;
use crate::units::UnitDimension;

/// SWIFT's h over the mean particle spacing (`SPH:resolution_eta`; 48 neighbors with the cubic spline in 3-D).
pub const RESOLUTION_ETA: f64 = 1.2348;

#[rustfmt::skip]
const RULES: &[Rule] = &[
    Rule { name: "Coordinates", source: Source::Column(names::COORDINATES), storage: Storage::Double, components: 3, need: Need::All },
    Rule { name: "Velocities", source: Source::ColumnOrZeros(names::VELOCITIES, UnitDimension::VELOCITY), storage: Storage::Float, components: 3, need: Need::All },
    Rule { name: "Masses", source: Source::Column(names::MASSES), storage: Storage::Float, components: 1, need: Need::All },
    Rule { name: "ParticleIDs", source: Source::ColumnOrCount(names::PARTICLE_IDS), storage: Storage::Id, components: 1, need: Need::All },
    Rule { name: "SmoothingLength", source: Source::Spacing { eta: RESOLUTION_ETA }, storage: Storage::Float, components: 1, need: Need::Gas },
    Rule { name: "InternalEnergy", source: Source::Column(names::INTERNAL_ENERGY), storage: Storage::Float, components: 1, need: Need::Gas },
    Rule { name: "Density", source: Source::Column(names::DENSITY), storage: Storage::Float, components: 1, need: Need::Optional },
    Rule { name: "MaterialIDs", source: Source::Column(names::MATERIAL_IDS), storage: Storage::Int, components: 1, need: Need::Optional },
];

/// SWIFT wants singular dataset names (its snapshots have plural ones) and every particle in the box.
pub const FLAVOR: Flavor = Flavor {
    format: "swift",
    rules: RULES,
    header: &[],
    box_vector: true,
    inside_box: true,
    extra_columns: true,
    dropped: &[names::SUPPORT_RADIUS],
};
