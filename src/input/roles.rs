//! What a carried variable is, by its name.

use sph_formats::common::particle_names as names;

/// The standard name of a carried variable, or its own.
pub fn standard_name(name: &str) -> &str {
    match name.to_ascii_lowercase().as_str() {
        "temperature" | "temp" | "t" => names::TEMPERATURE,
        "pressure" | "press" | "p" => names::PRESSURE,
        "internal_energy" | "internalenergy" | "specific_energy" | "specific_internal_energy" | "u" | "eint" => {
            names::INTERNAL_ENERGY
        }
        "velocity" | "velocities" | "vel" => names::VELOCITIES,
        _ if names::standard(name) == Some(names::MATERIAL_IDS) => names::MATERIAL_IDS,
        _ => name,
    }
}
