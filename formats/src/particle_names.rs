//! The names that placement gives to particle columns. Each flavor maps them to its own names.

use crate::units::UnitDimension;

/// Positions, `dimension` components.
pub const COORDINATES: &str = "Coordinates";
/// Velocities, `dimension` components.
pub const VELOCITIES: &str = "Velocities";
pub const MASSES: &str = "Masses";
/// Radius at which the placement's kernel vanishes (not a smoothing length of any code's convention).
pub const SUPPORT_RADIUS: &str = "SupportRadius";
/// That of a code, whatever its convention.
pub const SMOOTHING_LENGTH: &str = "SmoothingLength";
/// Summed mass density.
pub const DENSITY: &str = "Density";
/// The one that the sum should be.
pub const TARGET_DENSITY: &str = "TargetDensity";
/// Internal energy per mass.
pub const INTERNAL_ENERGY: &str = "InternalEnergy";
pub const PRESSURE: &str = "Pressure";
/// Magnetic flux density, three components, in units whose pressure is B^2/2; [`crate::magnetic`] has what codes take it in.
pub const MAGNETIC_FIELD: &str = "MagneticField";
pub const TEMPERATURE: &str = "Temperature";
/// Of a point mass: the distance at which its softened attraction becomes that of a point.
pub const SOFTENING_RADIUS: &str = "SofteningRadius";
/// Of a point mass: within it takes up matter, where the code has such particles.
pub const ACCRETION_RADIUS: &str = "AccretionRadius";
/// Mass of dust over that of dust and gas together, of gas particles that carry dust.
pub const DUST_FRACTION: &str = "DustFraction";
/// Mass of dust per mass of gas where a particle of dust is; what has it is dust.
pub const DUST_TO_GAS_RATIO: &str = "DustToGasRatio";
/// 1 ... N, in output order.
pub const PARTICLE_IDS: &str = "ParticleIDs";
/// Number of the body that a particle is of, from 1.
pub const BODY_ID: &str = "BodyID";
/// SWIFT planetary material numbers.
pub const MATERIAL_IDS: &str = "MaterialIDs";
/// Share of the mass in elements beyond helium, by the name that GADGET, GIZMO and SWIFT read.
pub const METALLICITY: &str = "Metallicity";
/// GADGET-style particle type, where a table holds several.
pub const PARTICLE_TYPE: &str = "ParticleType";

/// The name of a column that is carried beside one which readers, or the format, would confuse it with.
pub fn apart(name: &str) -> String {
    format!("{name}OfInput")
}

/// The standard name of a column that some program calls `name`; coordinates and velocities by component are not
/// among them. A smoothing length is not either: what it means differs between programs.
pub fn standard(name: &str) -> Option<&'static str> {
    let plain: String = name.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_lowercase()).collect();
    Some(match plain.as_str() {
        "coordinates" | "coordinate" | "positions" | "position" | "pos" | "xyz" | "points" => COORDINATES,
        "velocities" | "velocity" | "vel" => VELOCITIES,
        "masses" | "mass" | "particlemass" => MASSES,
        "supportradius" => SUPPORT_RADIUS,
        "density" | "densities" | "rho" | "massdensity" => DENSITY,
        "internalenergy" | "internalenergies" | "specificenergy" | "specificinternalenergy" | "u" => INTERNAL_ENERGY,
        "pressure" | "pressures" => PRESSURE,
        "magneticfield" | "bfield" | "magneticfluxdensities" | "magneticfluxdensity" => MAGNETIC_FIELD,
        "temperature" | "temperatures" | "temp" => TEMPERATURE,
        "dustfraction" | "dustfrac" => DUST_FRACTION,
        "dusttogasratio" => DUST_TO_GAS_RATIO,
        "particleids" | "particleid" | "ids" | "id" => PARTICLE_IDS,
        "materialids" | "materialid" | "material" | "materials" | "matid" => MATERIAL_IDS,
        "metallicity" => METALLICITY,
        "particletype" | "parttype" => PARTICLE_TYPE,
        _ => return None,
    })
}

/// What a standard name is measured in, of particles in so many dimensions whose masses are masses; [`UnitDimension::NONE`] for other names.
pub fn meaning(name: &str, dimension: usize) -> UnitDimension {
    match name {
        COORDINATES | SUPPORT_RADIUS | SMOOTHING_LENGTH | SOFTENING_RADIUS | ACCRETION_RADIUS => UnitDimension::LENGTH,
        VELOCITIES => UnitDimension::VELOCITY,
        MASSES => UnitDimension::MASS,
        DENSITY => UnitDimension::mass_density(dimension),
        INTERNAL_ENERGY => UnitDimension::SPECIFIC_ENERGY,
        TEMPERATURE => UnitDimension::TEMPERATURE,
        MAGNETIC_FIELD => UnitDimension::MAGNETIC_FIELD,
        PRESSURE => UnitDimension::new(2 - dimension as i8, 1, -2, 0),
        _ => UnitDimension::NONE,
    }
}
