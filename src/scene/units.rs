//! The systems of units that a scene can name.

use super::Scene;
use crate::error::{Error, Result};
use sph_formats::{UnitDimension, UnitSystem, did_you_mean};

/// Names for `units` of a scene and of its output.
const NAMES: [&str; 6] = ["cgs", "si", "solar", "planetary", "galactic", "code"];

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
             # `time_limit` is in seconds, `checkpoint.minutes` in minutes, `certify` in dynamical times of the body.\n{}",
            self.to_yaml()
        ))
    }
}

/// A system of units by its name.
///
/// # Errors
/// A name that is none, with those that are.
pub fn system_of(key: &str, name: &str) -> Result<UnitSystem> {
    UnitSystem::by_name(name).ok_or_else(|| {
        let hint = did_you_mean(name, NAMES);
        Error::scene(key, format!("is '{name}', expected cgs, si, solar, planetary, galactic or code{hint}"))
    })
}
