//! A star whose core is replaced by a point mass with a softened potential: converts a source to one of the gas alone, and the point mass.
//!
//! What is within the radius is replaced as [`inner`] says; beyond it all stays what it is, and so does the mass of gas and point
//! within any larger radius. Pressure, internal energy and temperature follow the new pressure as in an ideal gas of the same
//! composition, P/rho ~ u ~ T, from their values at the radius; all other scalars are what they are there.

mod inner;

use crate::error::{Error, Result};
use crate::field::{CarriedField, CarriedInfo, Inside, RadialSource, Source};
use crate::input::constants::GRAVITATIONAL_CONSTANT;
use crate::input::units::{InputUnits, RunUnits};
use crate::input::weight::{AtRest, Beside};
use crate::scene::{CoreGas, CoreInput, Scene, SofteningName};
use inner::{Edge, Inner};
use sph::point_mass::{PointMass, Softening};
use sph_formats::UnitDimension;
use sph_formats::common::particle_names as names;

/// Index of a lane-emden core (Ohlmann et al. 2017, sec. 2.2).
const INDEX: f64 = 3.0;
/// Part of the radius over which the model's gradient there is taken, to either side.
const STEP: f64 = 0.01;
/// The default type of a point mass.
pub(crate) const PART_TYPE: u8 = 1;

/// A point mass in the center, in the input's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Core<const D: usize> {
    pub point: PointMass<D>,
    /// In files.
    pub part_type: u8,
}

impl<const D: usize> Core<D> {
    /// The point in units of a length and a mass.
    pub fn scaled(&self, length: f64, mass: f64) -> PointMass<D> {
        let PointMass { center, mass: own, radius, softening } = self.point;
        PointMass { center: center.map(|c| c / length), mass: own / mass, radius: radius / length, softening }
    }
}

/// Replaces the core of the source where the scene asks for that.
///
/// # Errors
/// A source that is no radial profile of gas about its center, or of which no core can be made.
pub(crate) fn attach<const D: usize>(
    scene: &Scene,
    source: Source<D>,
    units: &RunUnits,
) -> Result<(Source<D>, Option<Core<D>>)> {
    let Some(input) = &scene.input.core else { return Ok((source, None)) };
    let radial = source.radial.clone().filter(|_| D == 3).ok_or_else(|| {
        Error::scene("input.core", "is of a radial profile in 3 dimensions, which the input is not; leave it out")
    })?;
    let conversion = units.to_input();
    let radius = input.radius.value("input.core.radius", UnitDimension::LENGTH, &conversion)?;
    let shown =
        Shown { length: conversion.factor(UnitDimension::LENGTH), mass: conversion.factor(UnitDimension::MASS) };
    let outer = radial.profile.outer_radius();
    let depth = source.domain.distance_to_edge(&radial.center);
    if !(radius * (1.0 + STEP) < outer.min(depth) && source.domain.contains(&radial.center)) {
        let problem = format!(
            "is {:.6e}, but the model ends at {:.6e} and the domain at {:.6e} from its center; expected a much \
             smaller radius",
            radius / shown.length,
            outer / shown.length,
            depth / shown.length
        );
        return Err(Error::scene("input.core.radius", problem));
    }
    let softening = match input.softening {
        Some(SofteningName::CubicSpline) => Softening::CubicSpline,
        Some(SofteningName::WendlandC2) => Softening::WendlandC2,
        None => scene.code().map_or(Softening::CubicSpline, |code| code.sheet.softening),
    };
    let mass = input.mass.as_ref();
    let mass = mass.map(|m| m.value("input.core.mass", UnitDimension::MASS, &conversion)).transpose()?;
    let part_type = input.part_type.unwrap_or(PART_TYPE);
    let made = |mass: f64| Core { point: PointMass { center: radial.center, mass, radius, softening }, part_type };
    if let (CoreGas::Keep, Some(mass)) = (input.gas, mass) {
        let mut source = source;
        source.notes.push(describe(&made(mass), radial.profile.enclosed_mass(radius), input.gas));
        return Ok((source, Some(made(mass))));
    }
    let model = Model { scene, source: &source, radial: &radial, units: units.input, radius, shown };
    let Inner { radii, density, pressure, .. } = model.inner(input, mass, softening)?;
    let edge = radial.profile.density(radius);
    let nodes: Vec<f64> = radii.iter().map(|x| x * radius).collect();
    let ratio: Vec<f64> = pressure.iter().zip(&density).map(|(p, rho)| p / rho).collect();
    let density: Vec<f64> = density.iter().map(|rho| rho * edge).collect();
    let inside = |info: &CarriedInfo| match info.name.as_str() {
        names::PRESSURE => Inside::Times(pressure.clone()),
        names::INTERNAL_ENERGY | names::TEMPERATURE => Inside::Times(ratio.clone()),
        _ => Inside::AtRadius,
    };
    let mut source = source.with_interior(&radial, (&nodes, &density), &inside);
    let gas = source.radial.as_ref().map_or(0.0, |r| r.profile.enclosed_mass(radius));
    let core = made(radial.profile.enclosed_mass(radius) - gas);
    source.notes.push(describe(&core, gas, input.gas));
    Ok((source, Some(core)))
}

fn describe<const D: usize>(core: &Core<D>, gas: f64, kind: CoreGas) -> String {
    let PointMass { mass, radius, softening, .. } = core.point;
    let law = match kind {
        CoreGas::Cubic => "a cubic density",
        CoreGas::ConstantEntropy => "one entropy",
        CoreGas::LaneEmden => "the modified Lane-Emden equation",
        CoreGas::Keep => "the density of the input",
    };
    let kernel = match softening {
        Softening::CubicSpline => "a cubic spline",
        Softening::WendlandC2 => "Wendland's C2 function",
    };
    format!(
        "the core is a point mass of {mass:.6e} in gas of {gas:.6e} with {law}, in the input's units; it is softened by {kernel} that ends at \
         {radius:.6e}: hsoft {:.6e} in Phantom, a Plummer-equivalent length of {:.6e} in GADGET and AREPO, {:.6e} in SWIFT",
        radius / 2.0,
        radius / Softening::CubicSpline.radius_over_plummer(),
        radius / Softening::WendlandC2.radius_over_plummer()
    )
}

/// The model that loses its core, in the input's units.
struct Model<'a, const D: usize> {
    scene: &'a Scene,
    source: &'a Source<D>,
    radial: &'a RadialSource<D>,
    units: Option<InputUnits>,
    radius: f64,
    shown: Shown,
}

/// Plain numbers of the scene in those of the input: errors speak of the former.
#[derive(Debug, Clone, Copy)]
struct Shown {
    length: f64,
    mass: f64,
}

impl<const D: usize> Model<'_, D> {
    fn inner(&self, input: &CoreInput, mass: Option<f64>, softening: Softening) -> Result<Inner> {
        let (profile, radius) = (&self.radial.profile, self.radius);
        let shown = radius / self.shown.length;
        let (density, enclosed) = (profile.density(radius), profile.enclosed_mass(radius));
        let at = |factor: f64| profile.density(radius * factor);
        let slope = (at(1.0 + STEP) / at(1.0 - STEP)).ln() / ((1.0 + STEP) / (1.0 - STEP)).ln();
        let concentration = 4.0 * std::f64::consts::PI * density * radius.powi(3) / enclosed;
        let pressure = self.pressure()? * radius / (density * enclosed);
        if !(slope < 0.0 && slope.is_finite() && concentration > 0.0 && pressure > 0.0 && pressure.is_finite()) {
            let problem = format!(
                "is {shown:.6e}, where the model's d ln rho/d ln r is {slope:.3} and its pressure {pressure:.3e} rho G M/r; expected a density that \
                 falls outward and a positive pressure"
            );
            return Err(Error::scene("input.core.radius", problem));
        }
        let edge = Edge { concentration, slope, pressure };
        let found = match input.gas {
            CoreGas::ConstantEntropy => edge.isentropic(self.scene.thermal.gamma, softening),
            CoreGas::LaneEmden => edge.lane_emden(input.n.unwrap_or(INDEX), softening),
            CoreGas::Cubic | CoreGas::Keep => {
                let model = |x: f64| profile.density(x * radius) / density;
                let shares = edge.cubic(mass.map(|m| m / enclosed), &model, softening);
                return shares.map_err(|[least, most]| {
                    let in_scene = |share: f64| share * enclosed / self.shown.mass;
                    no_cubic(mass.map(|m| m / self.shown.mass), [in_scene(least), in_scene(most)], shown)
                });
            }
        };
        found.ok_or_else(|| {
            let problem = format!(
                "is {shown:.6e}, within which gas of this kind would weigh more than the model's {:.6e}: there is nothing left for a point \
                 mass; choose another radius, or the gas cubic",
                enclosed / self.shown.mass
            );
            Error::scene("input.core.radius", problem)
        })
    }

    /// P/G at the radius: what the input carries, by its energy, or that which holds the layers above.
    fn pressure(&self) -> Result<f64> {
        let energy_factor = (self.scene.thermal.gamma - 1.0) * self.radial.profile.density(self.radius);
        if let Some(value) = self.carried(names::PRESSURE, UnitDimension::PRESSURE, 2)? {
            return Ok(value);
        }
        if let Some(value) = self.carried(names::INTERNAL_ENERGY, UnitDimension::SPECIFIC_ENERGY, 1)? {
            return Ok(energy_factor * value);
        }
        Ok(AtRest::new(self.radial, None, &Beside::default()).pressure(self.radius))
    }

    /// A scalar at the radius over G, in the input's length, and its density to a power.
    fn carried(&self, name: &str, dimension: UnitDimension, power: i32) -> Result<Option<f64>> {
        let is_it = |f: &&dyn CarriedField<D>| f.info().name == name && f.info().components == 1;
        let Some(field) = self.source.carried.iter().map(AsRef::as_ref).find(is_it) else { return Ok(None) };
        let mut value = [0.0];
        field.evaluate(&self.radial.at(self.radius), &mut value);
        let Some(units) = self.units else {
            let constant = self.scene.balance.on().cloned().unwrap_or_default().constant;
            return Ok(Some(value[0] / constant));
        };
        let gravity = self.scene.code().map_or(GRAVITATIONAL_CONSTANT, |code| code.sheet.gravity);
        let unit = field.info().unit.as_ref().filter(|u| u.dimension == dimension).ok_or_else(|| {
            let problem = "has no unit of its quantity while length and density have one; give it one, or leave it out with input.carry";
            Error::field(name, problem)
        })?;
        Ok(Some(value[0] * unit.to_cgs / (gravity * units.density.powi(power) * units.length.powi(2))))
    }
}

fn no_cubic(mass: Option<f64>, [least, most]: [f64; 2], radius: f64) -> Error {
    match mass {
        None if least == 0.0 && most > 0.0 => {
            let problem = format!(
                "is missing: gas without any point mass would not be much denser than the model within {radius:.6e}; state more than 0, up to {most:.6e}, \
                 from where on the density rises outward"
            );
            Error::scene("input.core.mass", problem)
        }
        Some(mass) if least < most => {
            let problem = format!(
                "is {mass:.6e}, expected {least:.6e} to {most:.6e}: with less the gas is denser than 1.3 times the model, with more its density rises \
                 outward"
            );
            Error::scene("input.core.mass", problem)
        }
        _ => {
            let problem = format!(
                "is {radius:.6e}, within which the model is too even for a point mass and a cubic density; choose another radius, or other gas"
            );
            Error::scene("input.core.radius", problem)
        }
    }
}
