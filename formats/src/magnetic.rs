//! Magnetic fields of particles, in the units and form that each code expects.
//!
//! In memory a column [`MAGNETIC_FIELD`] is in units in which the magnetic pressure is B^2/2 (Lorentz and Heaviside's), as in most codes
//! and tests of codes: one is sqrt(4 pi P) gauss for a unit of pressure P in cgs. Files have
//!
//! | code | a number of 1 is | after |
//! |---|---|---|
//! | Phantom | that unit | `units.f90`: unit_Bfield = umass/(utime sqrt(umass udist/(4 pi))) |
//! | AREPO | sqrt(P) gauss: Gaussian numbers, 4 pi apart in the pressure | `io_fields.c`, `io_func_bfield` |
//! | GIZMO | a gauss (`UnitMagneticField_in_gauss` 1) | `init.c`, gauss2gizmo |
//! | SWIFT | a unit of mass per unit of time^2 and ampere; with its vacuum permeability of 4 pi/100 g cm s^-2 A^-2 | `mhd_io.h`, `physical_constants_cgs.h` |
//! | others | as in memory | |

use crate::model::{ParticleTable, Values};
use crate::particle_names::MAGNETIC_FIELD;
use crate::units::{UnitDimension, UnitSystem};

/// What a file's numbers of a magnetic field are in.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum MagneticUnit {
    /// The magnetic pressure is B^2/2.
    #[default]
    HeavisideLorentz,
    /// The magnetic pressure is B^2/(8 pi).
    Gaussian,
    Gauss,
    /// Units of mass per time^2 and so many ampere.
    Current(f64),
}

/// Gauss in g s^-2 A^-1.
const GAUSS: f64 = 0.1;

impl MagneticUnit {
    /// By what numbers in memory become those of a file.
    pub fn factor(self, units: &UnitSystem) -> f64 {
        let gauss = units.to_cgs(UnitDimension::MAGNETIC_FIELD);
        match self {
            Self::HeavisideLorentz => 1.0,
            Self::Gaussian => (4.0 * std::f64::consts::PI).sqrt(),
            Self::Gauss => gauss,
            Self::Current(ampere) => gauss * GAUSS * units.time * units.time * ampere / units.mass,
        }
    }

    /// In words, for reports.
    pub fn describe(self, units: &UnitSystem) -> String {
        let factor = self.factor(units);
        match self {
            Self::HeavisideLorentz => "units whose magnetic pressure is B^2/2".to_owned(),
            Self::Gaussian => {
                format!("units whose magnetic pressure is B^2/(8 pi), {factor:.6} of them for one of B^2/2")
            }
            Self::Gauss => format!("gauss (UnitMagneticField_in_gauss 1), {factor:.6e} of them for one of B^2/2"),
            Self::Current(_) => format!(
                "units of mass per time^2 and ampere, {factor:.6e} of them for one of B^2/2, which are right with the code's own vacuum \
                 permeability (leave PhysicalConstants:mu_0 out)"
            ),
        }
    }

    /// Numbers of a file as they are in memory.
    #[cfg_attr(not(feature = "gadget"), allow(dead_code))]
    pub(crate) fn read(self, table: &mut ParticleTable, units: &UnitSystem) {
        let factor = self.factor(units);
        if factor == 1.0 || !(factor.is_finite() && factor > 0.0) {
            return;
        }
        for column in table.columns.iter_mut().filter(|c| c.name == MAGNETIC_FIELD) {
            column.values = Values::F64((0..column.values.len()).map(|i| column.values.get(i) / factor).collect());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// A field of 3 gauss has the pressure 9/(8 pi) in every code's own terms.
    #[test]
    fn the_pressure_is_that_of_the_field_in_gauss() {
        for units in [UnitSystem::cgs(), UnitSystem::si(), UnitSystem::galactic(), UnitSystem::solar()] {
            let pressure = units.to_cgs(UnitDimension::PRESSURE);
            let memory = 3.0 / units.to_cgs(UnitDimension::MAGNETIC_FIELD);
            let expected = 9.0 / (8.0 * PI) / pressure;
            let number = |unit: MagneticUnit| memory * unit.factor(&units);
            // GIZMO's own unit is sqrt(4 pi P) gauss.
            let gizmo = number(MagneticUnit::Gauss) / (4.0 * PI * pressure).sqrt();
            // SWIFT's vacuum permeability in units of the system and the ampere.
            let mu = 4.0 * PI / 100.0 * units.time.powi(2) / (units.mass * units.length);
            for (code, found) in [
                ("Phantom", 0.5 * number(MagneticUnit::HeavisideLorentz).powi(2)),
                ("AREPO", number(MagneticUnit::Gaussian).powi(2) / (8.0 * PI)),
                ("GIZMO", 0.5 * gizmo * gizmo),
                ("SWIFT", 0.5 * number(MagneticUnit::Current(1.0)).powi(2) / mu),
            ] {
                assert!((found / expected - 1.0).abs() < 1e-12, "{code}: {found:e}, expected {expected:e}");
            }
            assert!((number(MagneticUnit::Gauss) - 3.0).abs() < 1e-12);
        }
    }
}
