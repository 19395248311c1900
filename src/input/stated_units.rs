//! The units of an input, as stated by the file and by the scene.

use super::ingest::RawInput;
use super::surfaces::density_within;
use super::units::{InputUnits, named_unit};
use crate::error::Result;
use crate::scene::{SAME_GAS, Scene};
use sph_formats::model::FIELD_ADIABATIC_INDEX;
use sph_formats::{Geometry, RawField, Unit, UnitDimension, UnitSystem};

/// The units of an input, with what there is to say of them.
#[derive(Debug, Clone, Default)]
pub struct Stated {
    /// `None` where not all of them are known.
    pub input: Option<InputUnits>,
    pub notes: Vec<String>,
    /// What is probably not meant.
    pub doubts: Vec<String>,
}

/// Whether it is a snapshot whose units are those of the scene's keys alone.
fn is_without_time(raw: &RawInput) -> bool {
    matches!(raw, RawInput::Snapshot(snapshot) if snapshot.units == UnitSystem::CODE)
}

const WITHOUT_TIME: &str = "input.length_unit and input.density_unit say nothing of time: velocities and energies of the snapshot are written as they stand; \
     state `units` instead, which says what all its numbers are in";

/// Units of the input: the scene's statement over the file's.
///
/// # Errors
/// A unit that cannot be read or has the wrong dimension.
pub fn units(scene: &Scene, raw: &RawInput) -> Result<Stated> {
    let mut stated = by_scene_or_file(scene, raw)?;
    if let RawInput::Snapshot(snapshot) = raw {
        stated.doubts.extend(snapshot.cosmology.clone());
    }
    stated.doubts.extend(another_gas(scene, raw));
    stated.doubts.extend(label_alone(scene, &stated));
    Ok(stated)
}

/// What is said where the output's units are but a label of numbers that a file has without units.
fn label_alone(scene: &Scene, stated: &Stated) -> Option<String> {
    let is_without = scene.input.file.is_some() && stated.input.is_none() && stated.doubts.is_empty();
    let name = scene.output.units.as_deref().filter(|name| is_without && scene.units.is_none() && *name != "code")?;
    Some(format!(
        "the input states no units: its numbers are written unchanged, as if they were in {name} (output.units); if \
         they are not, `units` says what \
         they are in"
    ))
}

/// What is said where the run that wrote a field had another adiabatic index than the scene.
fn another_gas(scene: &Scene, raw: &RawInput) -> Option<String> {
    let own = scene.thermal.gamma;
    let stated = raw.field()?.metadata.iter().find(|(key, _)| key == FIELD_ADIABATIC_INDEX)?;
    let gamma = stated.1.parse::<f64>().ok().filter(|gamma| *gamma > 1.0 && (gamma / own - 1.0).abs() > SAME_GAS)?;
    // Digits of single precision.
    let gamma = (gamma * 1e6).round() / 1e6;
    Some(format!(
        "the file is from a run with an adiabatic index of {gamma}, but thermal.gamma is {own:.6}, with which \
         pressures are converted to energies: state \
         `thermal: {{gamma: {gamma}}}`, or the index that the code is to have"
    ))
}

/// The units of length and density that a field states.
pub(super) fn units_in_field(field: &RawField) -> (Option<Unit>, Option<Unit>) {
    let length = match &field.geometry {
        Geometry::Radial { unit, .. }
        | Geometry::Mesh { unit, .. }
        | Geometry::Cloud { unit, .. }
        | Geometry::Surface { unit, .. } => unit.clone(),
        Geometry::Refined(grid) => grid.unit.clone(),
        // Longitude and latitude have no unit of length.
        Geometry::Grid { axes, .. } => axes.iter().find_map(|a| a.unit.clone()),
    };
    (length, field.density.as_ref().and_then(|name| field.variable(name)).and_then(|v| v.unit.clone()))
}

/// The units of a field by itself, where it states both.
pub fn of_field(field: &RawField) -> Option<InputUnits> {
    let (length, density) = units_in_field(field);
    Some(InputUnits { length: length?.to_cgs, density: density?.to_cgs, time: 1.0 })
}

fn by_scene_or_file(scene: &Scene, raw: &RawInput) -> Result<Stated> {
    let known = |input: InputUnits| Stated { input: Some(input), ..Stated::default() };
    if let RawInput::Disc(numbers) | RawInput::Hydrostatic(numbers) = raw {
        let cgs = numbers.has_units.then_some(InputUnits { length: 1.0, density: 1.0, time: 1.0 });
        return Ok(Stated { input: cgs, ..Stated::default() });
    }
    let (mut length, mut density) = raw.field().map(units_in_field).unwrap_or_default();
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
                "variables of the input without a stated unit are assumed to be in the scene's units ({})",
                scene.units.as_deref().unwrap_or("")
            );
            let notes = raw.field().map(|_| note).into_iter().collect();
            return Ok(Stated { notes, ..known(InputUnits { length, density, time: system.time }) });
        }
        _ => (length, density),
    };
    let half = |known: &str, missing: &str, key: &str| {
        let doubt = format!(
            "the input has a unit of {known}, but no known unit of {missing}: no unit is used, and all numbers are \
             written unchanged, whatever \
             the output calls its units; state input.{key}, or `units`"
        );
        Stated { doubts: vec![doubt], ..Stated::default() }
    };
    Ok(match (length, density) {
        (Some(l), Some(d)) if is_without_time(raw) => Stated {
            doubts: vec![WITHOUT_TIME.into()],
            ..known(InputUnits { length: l.to_cgs, density: d.to_cgs, time })
        },
        (Some(l), Some(d)) => known(InputUnits { length: l.to_cgs, density: d.to_cgs, time }),
        (None, None) => Stated::default(),
        (Some(_), None) => half("length", "density", "density_unit"),
        (None, Some(_)) => half("density", "length", "length_unit"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sph_formats::Geometry;

    #[test]
    fn another_adiabatic_index_than_the_scenes_is_told() {
        let told = |stated: &str, scene: &str| {
            let geometry = Geometry::Radial { nodes: vec![0.0, 1.0], unit: None };
            let facts = vec![(FIELD_ADIABATIC_INDEX.to_owned(), stated.to_owned())];
            let (variables, notes) = (Vec::new(), Vec::new());
            let field = RawField {
                path: "a.h5".into(),
                format: "test",
                geometry,
                variables,
                density: None,
                metadata: facts,
                notes,
            };
            let scene = Scene::parse(&format!("input: {{file: a.h5}}\n{scene}")).unwrap();
            units(&scene, &RawInput::File(Box::new(field))).unwrap().doubts
        };
        assert!(told("1.399999976158142", "").iter().any(|doubt| doubt.contains("`thermal: {gamma: 1.4}`")));
        for (stated, scene) in [
            ("1.6667", ""),
            ("1.399999976158142", "thermal: {gamma: 1.4}"),
            ("1.4", "thermal: {gamma: 1.4}"),
            ("0", ""),
            ("x", ""),
        ] {
            assert_eq!(told(stated, scene), Vec::<String>::new(), "{stated} {scene}");
        }
    }
}
