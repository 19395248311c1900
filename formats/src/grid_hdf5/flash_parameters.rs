//! Runtime parameters of a FLASH file: lists of names and values.

use crate::common::hdf5_read::{Member, Reader};
use crate::error::Result;
use crate::units::UnitSystem;

/// Lists of names and values. The first ones are of the state written, and come before those of the run's parameters.
const LISTS: [&str; 7] = [
    "integer scalars",
    "real scalars",
    "string scalars",
    "logical scalars",
    "integer runtime parameters",
    "real runtime parameters",
    "string runtime parameters",
];
/// FLASH2 has one record of them.
const OLD: &str = "simulation parameters";
const COSMOLOGY: &str = "logical runtime parameters";

/// All scalars and parameters, in lowercase.
pub struct Parameters(Vec<(String, Member)>);

impl Parameters {
    /// Reads those lists that are among the `datasets`.
    ///
    /// # Errors
    /// Damaged lists.
    pub fn read(file: &Reader, datasets: &[String]) -> Result<Self> {
        let mut all = Vec::new();
        let lists = || LISTS.into_iter().chain([COSMOLOGY]);
        for list in lists().filter(|list| datasets.iter().any(|d| d == list)) {
            for record in file.records(list)? {
                if let [(_, Member::Text(name)), (_, value)] = record.as_slice() {
                    all.push((name.to_ascii_lowercase(), value.clone()));
                }
            }
        }
        if datasets.iter().any(|d| d == OLD) {
            let records = file.records(OLD)?;
            all.extend(records.into_iter().flatten().map(|(name, value)| (name.to_ascii_lowercase(), value)));
        }
        Ok(Self(all))
    }

    pub fn number(&self, name: &str) -> Option<f64> {
        self.0.iter().find_map(|(own, value)| match value {
            Member::Number(x) if own == name => Some(*x),
            _ => None,
        })
    }

    pub fn text(&self, name: &str) -> Option<&str> {
        self.0.iter().find_map(|(own, value)| match value {
            Member::Text(text) if own == name => Some(text.trim()),
            _ => None,
        })
    }

    /// Whether the box repeats along the axes.
    pub fn periodic(&self) -> [bool; 3] {
        ["x", "y", "z"].map(|axis| {
            let repeats = |side: &str| {
                let name = format!("{axis}{side}_boundary_type");
                self.text(&name).is_some_and(|kind| kind.eq_ignore_ascii_case("periodic"))
            };
            repeats("l") && repeats("r")
        })
    }

    /// The units of the run; `None` where it has none.
    pub fn units(&self) -> Option<UnitSystem> {
        match self.text("pc_unitsbase").map(str::to_ascii_lowercase).as_deref() {
            None | Some("cgs" | "") => Some(UnitSystem::cgs()),
            Some("mks") => Some(UnitSystem::si()),
            Some(_) => None,
        }
    }
}
