//! The physical quantities of the datasets in particle files.

use crate::units::UnitDimension;

/// What a dataset measures, from which follows the unit of its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    Length,
    Velocity,
    Mass,
    /// Mass per volume of the particles' dimension.
    Density,
    /// Energy per mass.
    SpecificEnergy,
    /// Magnetic flux density in units of mass per time^2 and current.
    FluxDensity,
    /// Without a unit.
    Number,
}

impl Quantity {
    /// In `d` dimensions.
    pub fn dimension(self, d: usize) -> UnitDimension {
        match self {
            Self::Length => UnitDimension::LENGTH,
            Self::Velocity => UnitDimension::VELOCITY,
            Self::Mass => UnitDimension::MASS,
            Self::Density => UnitDimension::mass_density(d),
            Self::SpecificEnergy => UnitDimension::SPECIFIC_ENERGY,
            Self::FluxDensity => UnitDimension::new(0, 1, -2, 0),
            Self::Number => UnitDimension::NONE,
        }
    }
}
