//! `profile: disc`: gas in a disc around the central bodies of its scene, as a source like that of a file.

mod gas;
mod law;
mod own;
mod rows;
#[cfg(test)]
mod tests;
mod well;

use crate::error::{Error, Result};
use crate::field::{CarriedField, CarriedInfo, ScalarField, Source};
use crate::input::attractors;
use crate::input::beside;
use crate::input::constants::{Constants, gravity};
use crate::input::formula::Formula;
use crate::input::ingest::Ingested;
use crate::input::profile::Numbers;
use crate::input::units::RunUnits;
use crate::scene::{DiscInput, Scene, Term};
use gas::Gas;
use law::{Law, Temperature};
use sph::domain::{Axis, Domain, Wall};
use sph_formats::common::particle_names as names;
use sph_formats::{FormatSpec, Unit, UnitDimension};
use std::sync::Arc;
use well::Well;

/// The disc of a scene's profile, and the particles' other fields: pressure and rotation; rotation without pressure where
/// particles feel none.
///
/// # Errors
/// A disc that is none, with the key of what is wrong.
pub(crate) fn source<const D: usize>(
    scene: &Scene,
    formats: &[FormatSpec],
    (numbers, units): (&Numbers, &RunUnits),
) -> Result<Ingested<D>> {
    let input = scene.input.disc().ok_or_else(|| Error::scene("input.profile", "is no disc"))?;
    if !scene.domain.is_empty() {
        return Err(Error::scene("domain", "is that of the disc, from its edges and its height; leave it out"));
    }
    let stated = Stated { input, numbers, scene };
    let mut source = stated.source::<D>(formats, units)?;
    let mut of_snapshot = None;
    if let Some((found, said)) = beside::others(scene, formats, units)? {
        source.notes.extend(said);
        of_snapshot = Some(found);
    }
    Ok(Ingested { source, variables: Vec::new(), input_mass: None, of_snapshot })
}

/// A disc as its scene states it.
struct Stated<'a> {
    input: &'a DiscInput,
    numbers: &'a Numbers,
    scene: &'a Scene,
}

impl Stated<'_> {
    fn value(&self, name: &str) -> Result<f64> {
        let key = key(name);
        let (_, quantity, dimension) = self
            .input
            .quantities()
            .into_iter()
            .find(|q| q.0 == name)
            .ok_or_else(|| Error::scene(&key, "is missing"))?;
        let value = quantity.value(&key, dimension, &self.numbers.conversion)?;
        let may_be_none = name == "inner_radius";
        let expected = if may_be_none { "a radius from 0" } else { "a positive number" };
        match value.is_finite() && (value > 0.0 || value == 0.0 && may_be_none) {
            true => Ok(value),
            false => Err(Error::scene(key, format!("is {quantity}, expected {expected}"))),
        }
    }

    fn formula(&self, name: &str, term: &Term, dimension: UnitDimension) -> Result<Formula> {
        let conversion = &self.numbers.conversion;
        Formula::new((key(name), term), dimension, (&Constants::new(self.scene, conversion.from), conversion))
    }

    fn law(&self) -> Result<Law> {
        let edges = [self.value("inner_radius")?, self.value("outer_radius")?];
        if edges[0] >= edges[1] {
            let problem = format!("is {}, expected less than outer_radius", self.input.inner_radius);
            return Err(Error::scene(key("inner_radius"), problem));
        }
        let (name, term, is_speed) = self.input.temperature()?;
        let dimension = if is_speed { UnitDimension::VELOCITY } else { UnitDimension::NONE };
        let formula = self.formula(name, term, dimension)?;
        let temperature = if is_speed { Temperature::SoundSpeed(formula) } else { Temperature::AspectRatio(formula) };
        // Its scale follows from the mass, so that its unit does not count.
        let surface = self.formula("surface_density", &self.input.surface_density, UnitDimension::NONE)?;
        let law = Law { surface, temperature, edges, widths: [0.0; 2] };
        law.check()?;
        Ok(law)
    }

    fn source<const D: usize>(&self, formats: &[FormatSpec], units: &RunUnits) -> Result<Source<D>> {
        let law = self.law()?;
        let mut notes = Vec::new();
        let well = self.well(formats, units, &mut notes)?;
        let has_own = self.input.self_gravity;
        match (well.is_empty(), has_own, self.input.temperature()?.2) {
            (true, false, _) => {
                let problem = "has nothing to turn about: add a body with a `point_mass` or a halo at the same place, or `gravity_of`, or its self_gravity";
                return Err(Error::scene("input.profile.disc", problem));
            }
            (true, true, false) => {
                let problem = "counts in the circular speed about other bodies, but there are none; state sound_speed";
                return Err(Error::scene(key("aspect_ratio"), problem));
            }
            _ => {}
        }
        let is_by_distance = self.scene.code().is_some_and(|code| code.cools_discs_by_distance()) && well.is_a_point();
        let fall = is_by_distance.then(|| law.fall(&well)).flatten();
        let gas = Arc::new(Gas::new((law, well), self.value("mass")?, self.input.edge_width, (has_own, fall))?);
        notes.push(self.describe(&gas));
        notes.extend(fall.map(|fall| {
            format!(
                "the gas has the temperature of its distance from the star, as the code keeps it where this disc is all gas: sound speeds fall as r^-{fall:.3}, and density and rotation are \
                 in equilibrium with that"
            )
        }));
        let [inner, outer] = [self.value("inner_radius")?, self.value("outer_radius")?];
        let domain = Domain::cylinder([0.0; D], 2, [inner, outer], 2.0 * gas.top, (Wall::Open, Axis::OPEN))?;
        let feels_pressure = self.scene.collisionless.is_none();
        let unit = |name: &str| Unit::parse(name).filter(|_| self.numbers.has_units);
        let info = |name: &str, symbol: &str, components: usize| CarriedInfo {
            name: name.into(),
            unit: unit(symbol),
            components,
        };
        let velocity = Rotation { info: info(names::VELOCITIES, "cm/s", D), gas: Arc::clone(&gas), feels_pressure };
        let mut carried: Vec<Box<dyn CarriedField<D>>> = vec![Box::new(velocity)];
        if feels_pressure {
            carried.push(Box::new(Pressure { info: info(names::PRESSURE, "dyn/cm^2", 1), gas: Arc::clone(&gas) }));
        }
        let mass = Some(gas.mass);
        Ok(Source { density: Box::new(Density(gas)), carried, domain, mass, radial: None, notes })
    }

    /// What else attracts.
    fn well(&self, formats: &[FormatSpec], units: &RunUnits, notes: &mut Vec<String>) -> Result<Well> {
        let (beside, left) = attractors::beside(self.scene, formats, units)?;
        notes.extend(left);
        // A disc reaches up to twice its radius.
        let farthest = 3.0 * self.value("outer_radius")?;
        Ok(Well::new(beside, gravity(self.scene, self.numbers.has_units), farthest))
    }

    fn describe(&self, gas: &Gas) -> String {
        let found = gas.figures();
        let length = self.numbers.conversion.factor(UnitDimension::LENGTH);
        let [low, high] = found.aspect_ratio;
        let own = if self.input.self_gravity { "all gravity, its own with it" } else { "the gravity of other bodies" };
        let (stability, radius) = found.stability;
        let written = |r: f64| match self.numbers.has_units && length == 1.0 {
            true => format!("{r:.4e} cm"),
            false => format!("{:.4}", r / length),
        };
        let mut text = format!(
            "disc in equilibrium with {own}: sound speed {low:.4} to {high:.4} of the circular speed, Toomre Q {stability:.3} or more (least at R = {})",
            written(radius)
        );
        if !self.input.self_gravity && stability < 10.0 {
            text += "; its own gravity would change it: self_gravity is off";
        }
        if stability < 1.0 {
            text += "; it falls apart into clumps";
        }
        if let Some(r) = found.unstable_rings {
            text += &format!("; rings about R = {} are unstable, as the density falls too steeply", written(r));
        }
        text
    }
}

fn key(name: &str) -> String {
    format!("input.profile.disc.{name}")
}

/// R and z of a place.
fn cylindrical<const D: usize>(x: &[f64; D]) -> (f64, f64) {
    let at = |k: usize| x.get(k).copied().unwrap_or(0.0);
    (at(0).hypot(at(1)), at(2))
}

struct Density(Arc<Gas>);

impl<const D: usize> ScalarField<D> for Density {
    fn value(&self, x: &[f64; D]) -> f64 {
        let (radius, z) = cylindrical(x);
        self.0.density(radius, z)
    }
}

struct Pressure {
    info: CarriedInfo,
    gas: Arc<Gas>,
}

impl<const D: usize> CarriedField<D> for Pressure {
    fn info(&self) -> &CarriedInfo {
        &self.info
    }

    fn evaluate(&self, x: &[f64; D], out: &mut [f64]) {
        let (radius, z) = cylindrical(x);
        out[0] = self.gas.pressure(radius, z);
    }
}

struct Rotation {
    info: CarriedInfo,
    gas: Arc<Gas>,
    feels_pressure: bool,
}

impl<const D: usize> CarriedField<D> for Rotation {
    fn info(&self) -> &CarriedInfo {
        &self.info
    }

    fn evaluate(&self, x: &[f64; D], out: &mut [f64]) {
        let (radius, z) = cylindrical(x);
        let speed = if self.feels_pressure { self.gas.speed(radius, z) } else { self.gas.orbital_speed(radius, z) };
        out.fill(0.0);
        if radius > 0.0 {
            out[0] = -speed * x[1] / radius;
            out[1] = speed * x[0] / radius;
        }
    }
}
