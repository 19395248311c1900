//! The layers of a planet as a scene states them.

use super::planet::{Boundary, Layer, Planet};
use super::spheres::key;
use crate::codes::{AS_PLANETARY, TargetCode};
use crate::eos::{Barotropic, EosError, EquationOfState, Material, Table};
use crate::error::{Error, Result};
use crate::scene::{Conversion, LayerInput, MaterialInput, PlanetInput, Quantity};
use sph_formats::UnitDimension;
use std::sync::Arc;

/// In cgs.
///
/// # Errors
/// Quantities and constants that are none, and layers that state their end twice.
pub(super) fn planet(input: &PlanetInput, conversion: &Conversion, gravity: f64) -> Result<Planet> {
    let value = |name: &str, q: &Quantity, dimension: UnitDimension| -> Result<f64> {
        let key = key("planet", name);
        match q.value(&key, dimension, conversion)? {
            v if v.is_finite() && v > 0.0 => Ok(v),
            v => Err(Error::scene(key, format!("is {v}, expected a positive number"))),
        }
    };
    let optional =
        |name: &str, q: &Option<Quantity>, dimension| q.as_ref().map(|q| value(name, q, dimension)).transpose();
    let mut layers: Vec<Layer> = Vec::new();
    let count = input.layers.len();
    // Mass, or share of the mass, of the layers so far.
    let mut within = (0.0, 0.0);
    for (i, layer) in input.layers.iter().enumerate() {
        let name = |what: &str| format!("layers[{i}].{what}");
        let material =
            material(layer, conversion).map_err(|e| Error::scene(key("planet", &name("material")), e.to_string()))?;
        let stated = [layer.radius.is_some(), layer.mass.is_some(), layer.mass_fraction.is_some()];
        let stated = stated.into_iter().filter(|s| *s).count();
        if stated > 1 {
            let problem = "states more than one of radius, mass and mass_fraction; state one";
            return Err(Error::scene(key("planet", &format!("layers[{i}]")), problem));
        }
        if i + 1 == count && stated > 0 {
            let problem = "is the outermost, which ends at the surface; state the planet's mass or radius instead";
            return Err(Error::scene(key("planet", &format!("layers[{i}]")), problem));
        }
        let end = match (&layer.radius, &layer.mass, layer.mass_fraction) {
            (Some(r), ..) => Boundary::Radius(value(&name("radius"), r, UnitDimension::LENGTH)?),
            (_, Some(m), _) => {
                within.0 += value(&name("mass"), m, UnitDimension::MASS)?;
                Boundary::Mass(within.0)
            }
            (.., Some(f)) if f > 0.0 && f < 1.0 => {
                within.1 += f;
                Boundary::Fraction(within.1)
            }
            (.., Some(f)) => {
                return Err(Error::scene(
                    key("planet", &name("mass_fraction")),
                    format!("is {f}, expected a fraction between 0 and 1"),
                ));
            }
            _ => Boundary::Unknown,
        };
        let before = layers.last().map(|l| l.end);
        let mixed = matches!((before, end), (Some(a), Boundary::Mass(_)) if !matches!(a, Boundary::Mass(_)))
            || matches!((before, end), (Some(a), Boundary::Fraction(_)) if !matches!(a, Boundary::Fraction(_)));
        if mixed {
            let problem = "has its mass stated, but the layer within it does not in the same way, so that the mass within is not known";
            return Err(Error::scene(key("planet", &format!("layers[{i}]")), problem));
        }
        layers.push(Layer { material, state: layer.state.unwrap_or(input.state), end });
    }
    let temperature = optional("surface_temperature", &input.surface_temperature, UnitDimension::TEMPERATURE)?;
    if let (None, Some(i)) = (temperature, layers.iter().position(|l| !l.material.equation.is_barotropic())) {
        let problem = format!("is missing, and the pressure of layers[{i}] depends on it");
        return Err(Error::scene(key("planet", "surface_temperature"), problem));
    }
    let zero = |q: &Option<Quantity>| q.as_ref().is_none_or(|q| q.number() == 0.0);
    let surface_pressure = match zero(&input.surface_pressure) {
        true => 0.0,
        false => optional("surface_pressure", &input.surface_pressure, UnitDimension::PRESSURE)?.unwrap_or(0.0),
    };
    Ok(Planet {
        layers,
        mass: optional("mass", &input.mass, UnitDimension::MASS)?,
        radius: optional("radius", &input.radius, UnitDimension::LENGTH)?,
        surface_pressure,
        surface_temperature: temperature.unwrap_or(0.0),
        gravity,
    })
}

/// # Errors
/// A layer without a number of its material, where files need one: beside layers that have one, and for a code that takes the equation of state
/// by it.
pub(super) fn refuse_unnumbered(materials: &[Material], code: Option<&TargetCode>) -> Result<()> {
    let Some(i) = materials.iter().position(|m| m.id.is_none()) else { return Ok(()) };
    let needed_by = code.filter(|code| AS_PLANETARY.contains(&code.scheme.name)).map(|code| {
        let is_swift = "which takes equations of state by number (MaterialIDs): 300 to 303 are SESAME's iron, basalt, water and SS08 water, 400 to 402 \
                        ANEOS's forsterite, iron and Fe85Si15, 900 to 909 your own tables";
        format!("the file is for {}, {is_swift}", code.sheet.title)
    });
    let other = materials.iter().find_map(|m| m.id).map(|id| format!("another layer has the number {id}"));
    let Some(why) = needed_by.or(other) else { return Ok(()) };
    let problem =
        format!("is missing, and its material has no number of its own, but {why}; state it, as in `id: 400`");
    Err(Error::scene(key("planet", &format!("layers[{i}].id")), problem))
}

pub(super) fn material(layer: &LayerInput, conversion: &Conversion) -> Result<Material> {
    let of_eos = |e: EosError| Error::scene("material", e.to_string());
    let known =
        |id: i32| Material::of_id(id).map(|m| m.equation).ok_or_else(|| Error::scene("material", "is not known"));
    let barotropic = |law: Barotropic| law.checked().map(EquationOfState::Barotropic).map_err(of_eos);
    let own = match &layer.material {
        MaterialInput::TillotsonIron => Some(100),
        MaterialInput::TillotsonGranite => Some(101),
        MaterialInput::TillotsonWater => Some(102),
        MaterialInput::TillotsonBasalt => Some(103),
        MaterialInput::TillotsonIce => Some(104),
        MaterialInput::IdealGas { .. } => Some(0),
        _ => None,
    };
    let [pressure, density] = [UnitDimension::PRESSURE, UnitDimension::mass_density(3)].map(|d| conversion.factor(d));
    let equation = match &layer.material {
        MaterialInput::IdealGas { gamma, mean_molecular_weight } => {
            EquationOfState::ideal_gas(*gamma, *mean_molecular_weight).map_err(of_eos)?
        }
        MaterialInput::Isothermal { sound_speed } => {
            let sound_speed = sound_speed.value("sound_speed", UnitDimension::VELOCITY, conversion)?;
            barotropic(Barotropic::Isothermal { sound_speed })?
        }
        MaterialInput::Polytrope { constant, gamma } => {
            barotropic(Barotropic::Polytrope { constant: constant * pressure / density.powf(*gamma), gamma: *gamma })?
        }
        MaterialInput::Murnaghan { density, bulk_modulus, exponent } => barotropic(Barotropic::Murnaghan {
            density: density.value("density", UnitDimension::mass_density(3), conversion)?,
            bulk_modulus: bulk_modulus.value("bulk_modulus", UnitDimension::PRESSURE, conversion)?,
            exponent: *exponent,
        })?,
        MaterialInput::Table { file } => EquationOfState::Table(Arc::new(Table::read(file).map_err(of_eos)?)),
        _ => known(own.unwrap_or(0))?,
    };
    Ok(Material { id: layer.id.or(own), equation })
}
