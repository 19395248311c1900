//! The datasets of a model.

pub const NAME: &str = "gyre-hdf5";

/// Datasets of GSM, what they are called here, and their units.
#[cfg(feature = "gyre-hdf5")]
pub const PROFILES: &[(&str, &str, &str)] = &[
    ("rho", "density", "g/cm^3"),
    ("T", "temperature", "K"),
    ("P", "pressure", "dyn/cm^2"),
    ("p", "pressure", "dyn/cm^2"),
    ("L_r", "luminosity", "erg/s"),
    ("M_r", "enclosed_mass", "g"),
    ("w", "enclosed_mass", "g"),
    ("Gamma_1", "gamma_1", ""),
    ("nabla", "nabla", ""),
    ("nabla_ad", "nabla_ad", ""),
    ("delta", "delta", ""),
    ("N2", "brunt_vaisala_squared", "s^-2"),
    ("kap", "opacity", "cm^2/g"),
    ("kappa", "opacity", "cm^2/g"),
    ("eps", "energy_generation", "erg/g/s"),
    ("epsilon", "energy_generation", "erg/g/s"),
    ("Omega_rot", "angular_velocity", "rad/s"),
];
