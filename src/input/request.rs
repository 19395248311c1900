//! The request to a reader: which variables a scene needs from its file.

use crate::error::Result;
use crate::field::mass_columns;
use crate::scene::{Conversion, Quantity, Role, Scene};
use sph_formats::{FieldRequest, Unit, UnitDimension, UnitSystem};

/// What readers are asked for.
///
/// # Errors
/// A radius of a planet that is none.
pub(super) fn of(scene: &Scene) -> Result<FieldRequest> {
    Ok(FieldRequest {
        density: scene.density_name()?,
        carry: variables_to_read(scene),
        optional: mass_columns().map(str::to_owned).collect(),
        time: scene.input.time,
        ..planet(scene)?
    })
}

/// What depths count from. A plain number is in the unit of their axis, unless the scene states its units.
pub(super) fn planet(scene: &Scene) -> Result<FieldRequest> {
    let Some(radius) = &scene.input.planet_radius else { return Ok(FieldRequest::default()) };
    let system = scene.stated_units()?;
    let planet_radius = match (radius, system) {
        (Quantity::Plain(number), None) => return Ok(request_of(*number, None)),
        _ => {
            let conversion = Conversion::new(system.or(Some(UnitSystem::cgs())), UnitSystem::cgs());
            radius.value("input.planet_radius", UnitDimension::LENGTH, &conversion)?
        }
    };
    Ok(request_of(planet_radius, Unit::parse("cm")))
}

fn request_of(planet_radius: f64, planet_radius_unit: Option<Unit>) -> FieldRequest {
    FieldRequest { planet_radius: Some(planet_radius), planet_radius_unit, ..FieldRequest::default() }
}

/// The carried variables with those that the resolution needs from the same file.
fn variables_to_read(scene: &Scene) -> Option<Vec<String>> {
    let mut names = scene.input.carry.clone()?;
    names.extend(scene.map.iter().filter(|(_, role)| **role != Role::Density).map(|(name, _)| name.clone()));
    if let Some(resolution) = scene.resolution.as_ref().filter(|r| r.file.is_none()) {
        names.extend(resolution.variable().map(str::to_owned));
    }
    Some(names)
}
