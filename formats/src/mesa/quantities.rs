//! The physical quantities of the columns of a profile.

/// Unit of a column, where solar ones depend on the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// Already in the cgs unit of the quantity.
    Cgs,
    /// A fixed multiple of it.
    Times(f64),
    SolarRadius,
    SolarMass,
    SolarLuminosity,
}

/// Where a column lives in a zone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// Average of the zone.
    Inside,
    /// At the outer face; the value at the center is 0.
    FaceFromZero,
    /// At the outer face; the center has the value of the innermost face.
    FaceFlat,
}

/// A column that is understood.
#[derive(Debug)]
pub struct Quantity {
    /// As in the file.
    pub column: &'static str,
    /// The variable it becomes; several columns may give the same one, the first listed here wins.
    pub name: &'static str,
    /// Symbol of the variable's cgs unit.
    pub unit: &'static str,
    pub log: bool,
    pub scale: Scale,
    pub place: Place,
}

const fn q(
    column: &'static str,
    name: &'static str,
    unit: &'static str,
    log: bool,
    scale: Scale,
    place: Place,
) -> Quantity {
    Quantity { column, name, unit, log, scale, place }
}

pub const RADIUS: &str = "radius";
pub const MASS: &str = "enclosed_mass";
pub const DENSITY: &str = "density";

const DENSITY_UNIT: &str = "g/cm^3";
const PRESSURE_UNIT: &str = "dyn/cm^2";

use Place::{FaceFlat, FaceFromZero, Inside};
use Scale::{Cgs, SolarLuminosity, SolarMass, SolarRadius, Times};

/// Linear columns before logarithmic ones: they need no power and lose no digits.
pub const QUANTITIES: &[Quantity] = &[
    q("radius_cm", RADIUS, "cm", false, Cgs, FaceFromZero),
    q("radius", RADIUS, "cm", false, SolarRadius, FaceFromZero),
    q("radius_km", RADIUS, "cm", false, Times(1e5), FaceFromZero),
    q("logR_cm", RADIUS, "cm", true, Cgs, FaceFromZero),
    q("logR", RADIUS, "cm", true, SolarRadius, FaceFromZero),
    q("log_R", RADIUS, "cm", true, SolarRadius, FaceFromZero),
    q("mass_grams", MASS, "g", false, Cgs, FaceFromZero),
    q("mass", MASS, "g", false, SolarMass, FaceFromZero),
    q("logM", MASS, "g", true, SolarMass, FaceFromZero),
    q("log_mass", MASS, "g", true, SolarMass, FaceFromZero),
    q("rho", DENSITY, DENSITY_UNIT, false, Cgs, Inside),
    q("density", DENSITY, DENSITY_UNIT, false, Cgs, Inside),
    q("logRho", DENSITY, DENSITY_UNIT, true, Cgs, Inside),
    q("log_rho", DENSITY, DENSITY_UNIT, true, Cgs, Inside),
    q("temperature", "temperature", "K", false, Cgs, Inside),
    q("logT", "temperature", "K", true, Cgs, Inside),
    q("pressure", "pressure", PRESSURE_UNIT, false, Cgs, Inside),
    q("logP", "pressure", PRESSURE_UNIT, true, Cgs, Inside),
    q("pgas", "gas_pressure", PRESSURE_UNIT, false, Cgs, Inside),
    q("logPgas", "gas_pressure", PRESSURE_UNIT, true, Cgs, Inside),
    q("prad", "radiation_pressure", PRESSURE_UNIT, false, Cgs, Inside),
    q("energy", "internal_energy", "erg/g", false, Cgs, Inside),
    q("logE", "internal_energy", "erg/g", true, Cgs, Inside),
    q("logS", "specific_entropy", "erg/g/K", true, Cgs, Inside),
    q("csound", "sound_speed", "cm/s", false, Cgs, Inside),
    q("opacity", "opacity", "cm^2/g", false, Cgs, Inside),
    q("log_opacity", "opacity", "cm^2/g", true, Cgs, Inside),
    q("velocity", "velocity", "cm/s", false, Cgs, FaceFromZero),
    q("vel_km_per_s", "velocity", "cm/s", false, Times(1e5), FaceFromZero),
    q("luminosity", "luminosity", "erg/s", false, SolarLuminosity, FaceFromZero),
    q("logL", "luminosity", "erg/s", true, SolarLuminosity, FaceFromZero),
    q("omega", "angular_velocity", "rad/s", false, Cgs, FaceFlat),
    q("log_omega", "angular_velocity", "rad/s", true, Cgs, FaceFlat),
];

/// Whether a column holds a mass fraction: `x_mass_fraction_H` and the like, or an isotope such as `he4`.
pub fn is_mass_fraction(column: &str) -> bool {
    let letters = column.find(|c: char| c.is_ascii_digit()).unwrap_or(0);
    let (element, nucleons) = column.split_at(letters);
    let isotope = (1..=2).contains(&element.len())
        && element.bytes().all(|b| b.is_ascii_lowercase())
        && nucleons.len() <= 3
        && nucleons.bytes().all(|b| b.is_ascii_digit());
    isotope || column.contains("_mass_fraction_") || column == "neut" || column == "prot"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Unit;

    #[test]
    fn every_unit_is_a_known_cgs_unit() {
        for quantity in QUANTITIES {
            assert_eq!(Unit::parse(quantity.unit).map(|u| u.to_cgs), Some(1.0), "{}", quantity.column);
        }
    }

    #[test]
    fn isotopes_are_told_from_other_columns() {
        for yes in ["h1", "he4", "fe56", "c12", "x_mass_fraction_H", "neut"] {
            assert!(is_mass_fraction(yes), "{yes}");
        }
        for no in ["zone", "gamma1", "logR", "5", "dq", "cno"] {
            assert!(!is_mass_fraction(no), "{no}");
        }
    }
}
