//! The systems of units that a scene can name.

use crate::error::{Error, Result};
use sph_formats::{UnitSystem, did_you_mean};

/// Names for `units` of a scene and of its output.
const NAMES: [&str; 6] = ["cgs", "si", "solar", "planetary", "galactic", "code"];

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

/// The name of a system of units that has one: cgs for numbers without units, whose factors are the same.
pub(crate) fn name_of(system: UnitSystem) -> Option<&'static str> {
    NAMES.into_iter().find(|name| UnitSystem::by_name(name) == Some(system))
}
