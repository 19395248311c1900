//! The names under which placement hands particle columns to the writers. Each flavor maps them to its own.

/// Positions, `dimension` components.
pub const COORDINATES: &str = "Coordinates";
/// Velocities, `dimension` components.
pub const VELOCITIES: &str = "Velocities";
pub const MASSES: &str = "Masses";
/// Radius at which the placement's kernel vanishes (not a smoothing length of any code's convention).
pub const SUPPORT_RADIUS: &str = "SupportRadius";
/// Summed mass density.
pub const DENSITY: &str = "Density";
/// Internal energy per mass.
pub const INTERNAL_ENERGY: &str = "InternalEnergy";
pub const PRESSURE: &str = "Pressure";
pub const TEMPERATURE: &str = "Temperature";
/// 1 ... N, in output order.
pub const PARTICLE_IDS: &str = "ParticleIDs";
/// SWIFT planetary material numbers.
pub const MATERIAL_IDS: &str = "MaterialIDs";
