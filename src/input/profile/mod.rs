//! Inputs made from physics: the tables of [`ProfileInput`], as if they had been read from a file.
//!
//! | model | density | pressure |
//! |---|---|---|
//! | polytrope, composite-polytrope, isothermal, bonnor-ebert, king-1966, white-dwarf | solution under its own gravity | of the equation of state |
//! | plummer, hernquist, nfw, king, beta-model, power-law | closed form, cut at the outer radius | that carries the weight, 0 at the outer radius |
//! | evrard | closed form | of one specific internal energy |
//! | toy-star | closed form | k rho^2 |
//! | hydrostatic | solution in the gravity of others and its own | of the temperature that is given, or K rho^(1 + 1/n) |
//! | disc | no function of the radius: [`crate::input::disc`] | |
//! | planet | of layers of materials under their own gravity | of their equations of state |

mod composite;
mod emden;
mod hydrostatic;
mod layers;
mod planet;
#[cfg(test)]
mod planet_tests;
mod spheres;
mod table;
mod well;
mod white_dwarf;

use crate::eos::Material;
use crate::error::{Error, Result};
use crate::input::constants::{Constants, gravity};
use crate::input::formula::Formula;
use crate::input::weight::Beside;
use crate::scene::{Conversion, HydrostaticInput, ProfileInput, Quantity, Scene, beside_units};
use hydrostatic::{Gas, Heat};
use sph_formats::{Geometry, Location, RawField, Unit, UnitDimension, UnitSystem, Values, Variable};
use spheres::{Cut, key};
use table::Table;
use well::Well;

/// The field of a scene's profile: in cgs where the scene has units or its numbers have, else in its plain numbers.
///
/// # Errors
/// Numbers that make no body.
pub(crate) fn field(scene: &Scene, profile: &ProfileInput) -> Result<RawField> {
    let d = scene.input.dimension.unwrap_or(3);
    let is_of_nature = matches!(profile, ProfileInput::WhiteDwarf { .. } | ProfileInput::Planet(_));
    let Numbers { conversion, has_units } = Numbers::new(scene, profile, is_of_nature)?;
    let model = Model { profile, d, gravity: gravity(scene, has_units), conversion };
    let mut table = model.table()?;
    if let Some(mass) = model.stated_mass()? {
        table.hold(d, mass);
    }
    materials(scene)?;
    raw(profile.name(), table, has_units)
}

/// The gas of a scene's profile at rest in the gravity of what is `beside` it, in the units of its numbers, and its own.
///
/// # Errors
/// Numbers that make no such gas.
pub(crate) fn hydrostatic(
    scene: &Scene,
    input: &HydrostaticInput,
    (numbers, beside): (&Numbers, &Beside),
) -> Result<RawField> {
    let profile = ProfileInput::Hydrostatic(input.clone());
    let model = Model {
        profile: &profile,
        d: scene.input.dimension.unwrap_or(3),
        gravity: gravity(scene, numbers.has_units),
        conversion: numbers.conversion,
    };
    let mut table = model.hydrostatic(input, beside, &Constants::new(scene, numbers.conversion.from))?;
    table.hold(3, model.value("mass")?);
    raw(profile.name(), table, numbers.has_units)
}

/// A table as if it had been read.
///
/// # Errors
/// Numbers beyond f64.
fn raw(name: &str, table: Table, has_units: bool) -> Result<RawField> {
    let worst = table.density.iter().chain(&table.radii).find(|v| !v.is_finite());
    if let Some(v) = worst {
        let problem = format!("has a density or radius of {v}: its mass and radii are beyond f64; choose other units");
        return Err(Error::scene(format!("input.profile.{name}"), problem));
    }
    let unit = |symbol: &str| Unit::parse(symbol).filter(|_| has_units);
    let variable = |name: &str, symbol: &str, values: Vec<f64>| Variable {
        name: name.into(),
        description: None,
        unit: unit(symbol),
        location: Location::Node,
        components: 1,
        values: Values::F64(values),
    };
    let mut variables = vec![variable("density", "g/cm^3", table.density)];
    variables.extend(table.pressure.map(|p| variable("pressure", "dyn/cm^2", p)));
    variables.extend(table.internal_energy.map(|u| variable("internal_energy", "erg/g", u)));
    variables.extend(table.temperature.map(|t| variable("temperature", "K", t)));
    variables.extend(table.material.map(|m| Variable { unit: None, ..variable("material_id", "", m) }));
    Ok(RawField {
        path: format!("profile {name}").into(),
        format: "profile",
        geometry: Geometry::Radial { nodes: table.radii, unit: unit("cm") },
        variables,
        density: Some("density".into()),
        metadata: Vec::new(),
        notes: table.notes,
    })
}

/// What to know of where a gas ends.
fn edge_note(table: &Table, outer: f64) -> Option<String> {
    let pressure = table.pressure.as_ref()?;
    let (end, edge) = (table.radii.last()?, pressure.last()? / pressure.first()?);
    if edge > LITTLE_PRESSURE {
        return Some(format!(
            "the gas is cut at its outer radius, where its pressure is {:.3} % of that in the center: the \
             surroundings have to balance this pressure",
            100.0 * edge
        ));
    }
    let share = end / outer;
    (share < 1.0 - ROUNDING).then(|| format!("the gas ends within its outer radius, at {share:.6} of it"))
}

/// Part of the pressure in the center that at an edge is none.
const LITTLE_PRESSURE: f64 = 1e-6;
const ROUNDING: f64 = 1e-9;

/// What the numbers of a profile are in.
pub struct Numbers {
    /// To cgs, or to nothing.
    pub conversion: Conversion,
    pub has_units: bool,
}

impl Numbers {
    /// `is_of_nature` is whether the body has units by what it is made of.
    ///
    /// # Errors
    /// Plain numbers beside others, in a scene without units.
    pub fn new(scene: &Scene, profile: &ProfileInput, is_of_nature: bool) -> Result<Self> {
        let quantities = profile.quantities(scene.input.dimension.unwrap_or(3));
        let has_text = profile.has_units(scene.input.dimension.unwrap_or(3));
        // None of something is none in any unit.
        let is_plain = |q: &Quantity| matches!(q, Quantity::Plain(number) if *number != 0.0);
        let plain = quantities.iter().find(|(_, q, _)| is_plain(q));
        if let (true, Some((name, value, _)), None) = (has_text, plain, scene.stated_units()?) {
            return Err(beside_units(key(profile.name(), name), value));
        }
        let own = (has_text || is_of_nature).then(UnitSystem::cgs);
        let conversion = Conversion::new(scene.stated_units()?.or(own), UnitSystem::cgs());
        Ok(Self { has_units: conversion.from.is_some(), conversion })
    }
}

/// The materials of a planet's layers, from the inside outward; none for other profiles.
///
/// # Errors
/// As for [`field`].
pub(crate) fn materials(scene: &Scene) -> Result<Vec<Material>> {
    let Some(ProfileInput::Planet(planet)) = &scene.input.profile else { return Ok(Vec::new()) };
    let conversion = Conversion::new(scene.stated_units()?.or(Some(UnitSystem::cgs())), UnitSystem::cgs());
    let materials: Vec<Material> =
        planet.layers.iter().map(|layer| layers::material(layer, &conversion)).collect::<Result<_>>()?;
    layers::refuse_unnumbered(&materials, scene.code().as_ref())?;
    Ok(materials)
}

/// A profile with all that its numbers depend on.
struct Model<'a> {
    profile: &'a ProfileInput,
    d: usize,
    gravity: f64,
    conversion: Conversion,
}

impl Model<'_> {
    fn positive(&self, name: &str, value: f64) -> Result<f64> {
        match value.is_finite() && value > 0.0 {
            true => Ok(value),
            false => {
                Err(Error::scene(key(self.profile.name(), name), format!("is {value}, expected a positive number")))
            }
        }
    }

    /// One of the profile's quantities.
    fn value(&self, name: &str) -> Result<f64> {
        let key = key(self.profile.name(), name);
        let missing = || Error::scene(&key, "is missing");
        let (_, quantity, dimension) =
            self.profile.quantities(self.d).into_iter().find(|q| q.0 == name).ok_or_else(missing)?;
        self.positive(name, quantity.value(&key, dimension, &self.conversion)?)
    }

    /// The mass that the body is to have; none where it follows from the rest.
    fn stated_mass(&self) -> Result<Option<f64>> {
        let is_stated = self.profile.quantities(self.d).iter().any(|q| q.0 == "mass");
        is_stated.then(|| self.value("mass")).transpose()
    }

    fn cut(&self, scale: &str, outer: &str) -> Result<Cut> {
        Ok(Cut { mass: self.value("mass")?, scale: self.value(scale)?, outer: self.value(outer)? })
    }

    fn hydrostatic(&self, input: &HydrostaticInput, beside: &Beside, constants: &Constants) -> Result<Table> {
        if !input.self_gravity && beside.is_empty() {
            let problem = "has nothing that holds it: add a body with a `point_mass` or a halo at the same place, or `gravity_of`, or its self_gravity";
            return Err(Error::scene("input.profile.hydrostatic", problem));
        }
        let (mass, outer) = (self.value("mass")?, self.value("outer_radius")?);
        let key = |name: &str| key(self.profile.name(), name);
        let formula =
            |term| Formula::new((key("sound_speed"), term), UnitDimension::VELOCITY, (constants, &self.conversion));
        let speed = input.sound_speed.as_ref().map(formula).transpose()?;
        if let Some(speed) = &speed {
            speed.check([0.0, outer])?;
        }
        let at = |r: f64| speed.as_ref().map_or(0.0, |speed| speed.at(r));
        let (heat, central) = match input.n {
            None => (Heat::Speeds(&at), None),
            Some(n) => (Heat::Polytrope(n), speed.as_ref().map(|speed| speed.at(0.0))),
        };
        if central.is_some_and(|speed| !speed.is_finite()) {
            return Err(Error::scene(
                key("sound_speed"),
                "with `n` is that in the center, where it is infinite; expected a number",
            ));
        }
        let well = Well::new(beside, outer);
        let gas = Gas { gravity: self.gravity, well: &well, feels_itself: input.self_gravity, outer, heat };
        let mut table = gas.table(mass, central).map_err(|refusal| {
            let (name, problem) = refusal.explain(input, mass);
            Error::scene(key(name), problem)
        })?;
        table.notes.extend(edge_note(&table, outer));
        Ok(table)
    }

    fn table(&self) -> Result<Table> {
        let (profile, d, gravity) = (self.profile, self.d, self.gravity);
        let is_of_any_dimension = matches!(
            profile,
            ProfileInput::Polytrope { .. }
                | ProfileInput::BonnorEbert { .. }
                | ProfileInput::PowerLaw { .. }
                | ProfileInput::ToyStar { .. }
        );
        if d != 3 && !is_of_any_dimension {
            let problem = format!("is {d}, but the profile '{}' is one in 3 dimensions", profile.name());
            return Err(Error::scene("input.dimension", problem));
        }
        if let ProfileInput::Planet(input) = profile {
            return layers::planet(input, &self.conversion, gravity)?.table();
        }
        let mass = self.value("mass")?;
        match *profile {
            ProfileInput::Planet(_) | ProfileInput::Disc(_) | ProfileInput::Hydrostatic(_) => {
                Err(Error::scene("input.profile", "is no table of radii"))
            }
            ProfileInput::Polytrope { n, .. } => spheres::polytrope(d, n, mass, self.value("radius")?, gravity),
            ProfileInput::CompositePolytrope { ref zones, .. } => {
                let (zones, bounds) = composite::zones(zones)?;
                composite::composite(&zones, bounds, mass, self.value("radius")?, gravity)
            }
            ProfileInput::Isothermal { .. } => {
                let speed = self.conversion.factor(UnitDimension::VELOCITY);
                spheres::isothermal(mass, self.value("radius")?, (self.value("sound_speed")?, speed), gravity)
            }
            ProfileInput::BonnorEbert { xi, .. } => {
                spheres::bonnor_ebert(d, self.positive("xi", xi)?, mass, self.value("radius")?, gravity)
            }
            ProfileInput::Plummer { .. } => {
                let cut = self.cut("scale_radius", "outer_radius")?;
                Ok(spheres::cored(cut, gravity, &|x| (1.0 + x * x).powf(-2.5)))
            }
            ProfileInput::Hernquist { .. } => {
                let cut = self.cut("scale_radius", "outer_radius")?;
                Ok(spheres::cusped(cut, gravity, &|x| 1.0 / (x * (1.0 + x).powi(3))))
            }
            ProfileInput::Nfw { .. } => {
                let cut = self.cut("scale_radius", "outer_radius")?;
                Ok(spheres::cusped(cut, gravity, &|x| 1.0 / (x * (1.0 + x).powi(2))))
            }
            ProfileInput::King { .. } => {
                let cut = self.cut("core_radius", "tidal_radius")?;
                Ok(spheres::cored(cut, gravity, &spheres::king(cut.outer / cut.scale)))
            }
            ProfileInput::KingCluster { w0, .. } => {
                spheres::king_cluster(w0, mass, self.value("tidal_radius")?, gravity)
            }
            ProfileInput::BetaModel { beta, .. } => {
                let cut = self.cut("core_radius", "outer_radius")?;
                let power = -1.5 * self.positive("beta", beta)?;
                Ok(spheres::cored(cut, gravity, &|x| (1.0 + x * x).powf(power)))
            }
            ProfileInput::Evrard { energy, .. } => {
                Ok(spheres::evrard(mass, self.value("radius")?, self.positive("energy", energy)?, gravity))
            }
            ProfileInput::PowerLaw { slope, .. } => spheres::power_law(d, slope, mass, self.value("radius")?, gravity),
            ProfileInput::ToyStar { k, .. } => {
                let [pressure, density] =
                    [UnitDimension::PRESSURE, UnitDimension::mass_density(3)].map(|d| self.conversion.factor(d));
                let k = self.positive("k", k)? * pressure / (density * density);
                Ok(spheres::toy_star(d, mass, self.value("radius")?, k))
            }
            ProfileInput::WhiteDwarf { nucleons_per_electron, .. } => {
                let per_electron = self.positive("nucleons_per_electron", nucleons_per_electron)?;
                white_dwarf::white_dwarf(mass, per_electron, gravity)
            }
        }
    }
}
