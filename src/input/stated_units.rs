//! What the units of an input are, by the file and by the scene.

use super::ingest::RawInput;
use super::surfaces::density_within;
use super::units::{InputUnits, named_unit};
use crate::error::Result;
use crate::scene::Scene;
use sph_formats::{Geometry, UnitDimension};

/// The units of an input, with what there is to say of them.
#[derive(Debug, Clone, Default)]
pub struct Stated {
    /// `None` where not all of them are known.
    pub input: Option<InputUnits>,
    pub notes: Vec<String>,
    /// What is probably not meant.
    pub doubts: Vec<String>,
}

/// Units of the input: the scene's statement over the file's.
///
/// # Errors
/// A unit that cannot be read or has the wrong dimension.
pub fn units(scene: &Scene, raw: &RawInput) -> Result<Stated> {
    let known = |input: InputUnits| Stated { input: Some(input), ..Stated::default() };
    if let RawInput::Disc(numbers) = raw {
        let cgs = numbers.has_units.then_some(InputUnits { length: 1.0, density: 1.0, time: 1.0 });
        return Ok(Stated { input: cgs, ..Stated::default() });
    }
    let (mut length, mut density) = (None, None);
    if let Some(field) = raw.field() {
        length = match &field.geometry {
            Geometry::Radial { unit, .. }
            | Geometry::Mesh { unit, .. }
            | Geometry::Cloud { unit, .. }
            | Geometry::Surface { unit, .. } => unit.clone(),
            Geometry::Refined(grid) => grid.unit.clone(),
            // Longitude and latitude have no unit of length.
            Geometry::Grid { axes, .. } => axes.iter().find_map(|a| a.unit.clone()),
        };
        density = field.density.as_ref().and_then(|name| field.variable(name)).and_then(|v| v.unit.clone());
    }
    length = named_unit("input.length_unit", scene.input.length_unit.as_deref(), UnitDimension::LENGTH)?
        .or(length.filter(|u| u.dimension == UnitDimension::LENGTH));
    density = density_within(scene, raw.field()).and_then(|(_, unit)| unit).or(density);
    density = named_unit("input.density_unit", scene.input.density_unit.as_deref(), UnitDimension::mass_density(3))?
        .or(density.filter(|u| u.dimension == UnitDimension::mass_density(3)));
    let time = if let RawInput::Snapshot(snapshot) = raw { snapshot.time_unit } else { 1.0 };
    let (length, density) = match scene.stated_units()? {
        Some(system) if length.is_none() || density.is_none() => {
            let length = length.map_or(system.length, |l| l.to_cgs);
            let density = density.map_or(system.to_cgs(UnitDimension::mass_density(3)), |d| d.to_cgs);
            let note = format!(
                "what the input does not state the units of is taken to be in the scene's ({})",
                scene.units.as_deref().unwrap_or("")
            );
            let notes = raw.field().map(|_| note).into_iter().collect();
            return Ok(Stated { notes, ..known(InputUnits { length, density, time: system.time }) });
        }
        _ => (length, density),
    };
    let half = |known: &str, missing: &str, key: &str| {
        let doubt = format!(
            "the input has a unit of {known}, but none that is known of {missing}: no unit counts, and all numbers are written as they stand, whatever \
             the output calls its units; state input.{key}, or `units`"
        );
        Stated { doubts: vec![doubt], ..Stated::default() }
    };
    Ok(match (length, density) {
        (Some(l), Some(d)) => known(InputUnits { length: l.to_cgs, density: d.to_cgs, time }),
        (None, None) => Stated::default(),
        (Some(_), None) => half("length", "density", "density_unit"),
        (None, Some(_)) => half("density", "length", "length_unit"),
    })
}
