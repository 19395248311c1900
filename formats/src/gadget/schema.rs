//! The datasets of a GADGET initial-conditions file.

use crate::common::flavor::{Flavor, Need, Rule, Source, Storage};
use crate::common::particle_names as names;
use crate::units::UnitDimension;

#[rustfmt::skip]
const RULES: &[Rule] = &[
    Rule { name: "Coordinates", source: Source::Column(names::COORDINATES), storage: Storage::Double, components: 3, need: Need::All },
    Rule { name: "Velocities", source: Source::ColumnOrZeros(names::VELOCITIES, UnitDimension::VELOCITY), storage: Storage::Float, components: 3, need: Need::All },
    Rule { name: "Masses", source: Source::Column(names::MASSES), storage: Storage::Float, components: 1, need: Need::All },
    Rule { name: "ParticleIDs", source: Source::ColumnOrCount(names::PARTICLE_IDS), storage: Storage::Id, components: 1, need: Need::All },
    Rule { name: "SmoothingLength", source: Source::Column(names::SUPPORT_RADIUS), storage: Storage::Float, components: 1, need: Need::Gas },
    Rule { name: "InternalEnergy", source: Source::Column(names::INTERNAL_ENERGY), storage: Storage::Float, components: 1, need: Need::Gas },
    Rule { name: "Density", source: Source::Column(names::DENSITY), storage: Storage::Float, components: 1, need: Need::Optional },
    Rule { name: "MaterialIDs", source: Source::Column(names::MATERIAL_IDS), storage: Storage::Int, components: 1, need: Need::Optional },
];

/// GADGET's smoothing length is the radius at which the kernel vanishes; BoxSize is one number.
pub const FLAVOR: Flavor = Flavor {
    format: "gadget",
    rules: RULES,
    header: &[],
    box_vector: false,
    inside_box: false,
    extra_columns: true,
    dropped: &[],
};
