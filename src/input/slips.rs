//! Detects names of a scene's fields that are close to known names: misspelled fields become columns that no code reads.

use super::fields::VECTOR_POTENTIAL;
use super::thermal;
use crate::scene::Scene;
use sph_formats::common::particle_names as names;
use sph_formats::did_you_mean;

/// Names that mean more than a column does.
const MEANT: [&str; 17] = [
    "velocity",
    "v_x",
    "v_y",
    "v_z",
    "v_R",
    "v_r",
    "v_theta",
    "v_phi",
    "pressure",
    "temperature",
    "internal_energy",
    thermal::ENTROPY,
    thermal::MEAN_MOLECULAR_WEIGHT,
    "magnetic_field",
    VECTOR_POTENTIAL,
    "material",
    "dust_fraction",
];

/// Fields that become columns of their names, whose names are nearly those of others, in words.
pub(crate) fn slips(scene: &Scene) -> Vec<String> {
    let is_meant =
        |name: &str| MEANT.contains(&name) || names::standard(name).is_some() || thermal::name_of(name).is_some();
    let of = |(name, _): (&str, _)| {
        let hint = did_you_mean(name, MEANT);
        let is_slip = !is_meant(name) && !hint.is_empty();
        is_slip.then(|| format!("fields.{name} is written as a column of that name{hint}"))
    };
    scene.fields.stated().filter_map(of).collect()
}
