//! Keys of a scene for the units of its numbers, and of its density.

use super::{Role, Scene, system_of};
use crate::error::{Error, Result};
use sph_formats::{UnitDimension, UnitSystem};

impl Scene {
    /// The system that `units` names; `None` for that of the input.
    ///
    /// # Errors
    /// A name that is none.
    pub fn stated_units(&self) -> Result<Option<UnitSystem>> {
        match self.units.as_deref() {
            None | Some("input") => Ok(None),
            Some("code") => Err(Error::scene(
                "units",
                "is 'code', which says nothing of what numbers mean; expected input, cgs, si, solar, planetary or galactic",
            )),
            Some(name) => system_of("units", name).map(Some),
        }
    }
}

impl Scene {
    /// The scene as YAML, under a comment that says what numbers without a unit are in.
    ///
    /// # Errors
    /// As for [`Scene::stated_units`].
    pub fn to_commented_yaml(&self) -> Result<String> {
        Ok(self.units_comment()? + &self.to_yaml())
    }

    /// What numbers without a unit are in.
    pub(super) fn units_comment(&self) -> Result<String> {
        let meaning = match (self.stated_units()?, self.units.as_deref()) {
            (Some(system), Some(name)) => {
                let of = |d: UnitDimension| system.symbol(d);
                format!(
                    "in {name} units: lengths in {}, masses in {}, times in {},\n# velocities in {}, specific energies in {}",
                    of(UnitDimension::LENGTH),
                    of(UnitDimension::MASS),
                    of(UnitDimension::TIME),
                    of(UnitDimension::VELOCITY),
                    of(UnitDimension::SPECIFIC_ENERGY)
                )
            }
            _ => "in the input's units (`units` chooses others): its unit of length, the mass in a cube of\n\
                  # that length at its unit of density, and seconds, or the unit of time of a particle file"
                .to_owned(),
        };
        Ok(format!(
            "# Numbers without a unit are {meaning}.\n\
             # `time_limit` is in seconds, `checkpoint.minutes` in minutes, `certify` and `settle` in dynamical times.\n"
        ))
    }
}

impl Scene {
    /// The variable that is the density, as `input.density` or `map` say.
    ///
    /// # Errors
    /// Where they differ.
    pub fn density_name(&self) -> Result<Option<String>> {
        let mapped = self.map.iter().find(|(_, role)| **role == Role::Density).map(|(name, _)| name);
        match (&self.input.density, mapped) {
            (Some(given), Some(mapped)) if given != mapped => Err(Error::scene(
                "map",
                format!("gives '{mapped}' the role density, but input.density is '{given}'; leave one out"),
            )),
            (given, mapped) => Ok(given.as_ref().or(mapped).cloned()),
        }
    }
}
