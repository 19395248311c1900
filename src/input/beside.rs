//! Particles of a file that are added to the gas: dark matter, stars and bulges made by another tool.
//!
//! They are taken as they are, in the coordinates of the input. A file that states no units is in those of the scene.

use crate::error::{Error, Result};
use crate::input::particles::OfSnapshot;
use crate::input::totals::Totals;
use crate::input::units::RunUnits;
use crate::scene::Scene;
use sph_formats::common::particle_names as names;
use sph_formats::{FieldRequest, FileContent, FormatSpec, ParticleFile, Species, UnitSystem, Values};
use std::collections::BTreeMap;
use std::path::Path;

const KEY: &str = "input.others";

/// The particles of `input.others`, and what there is to note; `None` where the scene has none.
///
/// # Errors
/// A file that cannot be read, that is no particle file or has gas alone; one with units beside a scene without.
pub(crate) fn others(
    scene: &Scene,
    formats: &[FormatSpec],
    units: &RunUnits,
) -> Result<Option<(OfSnapshot, Vec<String>)>> {
    let Some(path) = &scene.input.others else { return Ok(None) };
    let wrong = |problem: &str| Error::scene(KEY, format!("'{}' {problem}", path.display()));
    let file = read(formats, path)?.ok_or_else(|| wrong("is no particle file"))?;
    let own = units.to_input();
    let mut notes = Vec::new();
    let has_units = file.header.units != UnitSystem::CODE;
    let system = match (has_units, own.from) {
        (true, None) => {
            let problem =
                "states units, but the scene has none to convert them to; state them, as in `units: galactic`";
            return Err(wrong(problem));
        }
        (false, Some(system)) => {
            notes.push(format!("'{}' states no units: its numbers are taken to be in the scene's", path.display()));
            system
        }
        _ => file.header.units,
    };
    let gas: usize = file.species.iter().filter(|s| s.part_type == 0).map(|s| s.table.count).sum();
    let mut species: Vec<Species> =
        file.species.into_iter().filter(|s| s.part_type != 0 && s.table.count > 0).collect();
    if species.is_empty() {
        return Err(wrong("has no particles of other types than gas"));
    }
    if gas > 0 {
        notes.push(format!("{gas} gas particles of '{}' are left out: the gas is that of the scene", path.display()));
    }
    let length = if own.from.is_some() { system.length / own.to.length } else { 1.0 };
    species.iter_mut().for_each(|s| scale(s, length));
    let found = OfSnapshot {
        totals: Totals::default(),
        scatter: None,
        doubts: Vec::new(),
        others: species,
        units: system,
        materials: BTreeMap::new(),
    };
    Ok(Some((found, notes)))
}

fn read(formats: &[FormatSpec], path: &Path) -> Result<Option<ParticleFile>> {
    match sph_formats::read(formats, path, None, &FieldRequest::default())? {
        FileContent::Particles(file) => Ok(Some(file)),
        FileContent::Field(_) => Ok(None),
    }
}

/// Coordinates in the input's unit of length; all else stays in the file's units.
fn scale(species: &mut Species, length: f64) {
    for column in species.table.columns.iter_mut().filter(|c| c.name == names::COORDINATES) {
        column.values = Values::F64(column.values.to_f64().into_iter().map(|x| x * length).collect());
    }
}
