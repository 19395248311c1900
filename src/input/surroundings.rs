//! `gravity_of`: bodies around the same center that are not among the particles. Their mass within a radius attracts in the same way as that of
//! the body itself.
//!
//! The pressure of a profile whose law is that of its density alone carries the weight in all of this gravity: it is integrated
//! inward from 0 at the surface. That of other inputs is what they say.

use crate::error::{Error, Result};
use crate::field::{CarriedField, CarriedInfo};
use crate::input::attractors::{self, Attractor};
use crate::input::constants::gravity;
use crate::input::internal_units::Prepared;
use crate::input::units::RunUnits;
use crate::input::weight::AtRest;
use crate::scene::Scene;
use sph::geometry::distance;
use sph::point_mass::PointMass;
use sph_formats::common::particle_names as names;
use sph_formats::{FormatSpec, Unit};

/// Adds the bodies of `gravity_of` to what attracts, and the weight in their gravity to a pressure that carries it; returns what
/// there is to note.
///
/// # Errors
/// Those of reading the bodies, with their keys; one in other units or dimensions; a body that they are not about.
pub(crate) fn attach<const D: usize>(
    scene: &Scene,
    formats: &[FormatSpec],
    prepared: &mut Prepared<D>,
    units: &RunUnits,
) -> Result<Vec<String>> {
    let mut notes = Vec::new();
    if scene.gravity_of.is_empty() {
        return Ok(notes);
    }
    if D != 3 {
        return Err(Error::scene(
            "gravity_of",
            format!("is of bodies in 3-D, but the scene is in {D}-D; leave it out"),
        ));
    }
    for found in attractors::find(scene, formats, units)? {
        let (length, mass) = (prepared.length, prepared.mass.value);
        match found {
            Attractor::Point(point) => {
                let point = PointMass { mass: point.mass / mass, radius: point.radius / length, ..point };
                notes.push(format!(
                    "the gravity of a point mass of {:.4} times the body's mass is included",
                    point.mass
                ));
                prepared.beside.points.push(point);
            }
            Attractor::Sphere { profile, end, mass: own, name } => {
                let profile = profile.scaled(1.0 / length, length.powi(3) / mass);
                prepared.beside.spheres.push((profile, end / length));
                notes.push(format!("the gravity of {name} is felt, {:.4} times the body's mass", own / mass));
            }
            Attractor::Left(note) => notes.push(note),
        }
    }
    notes.extend(carry_weight(scene, prepared, units)?);
    Ok(notes)
}

/// The pressure of a body at rest, in cgs or in numbers without units.
struct Weight<const D: usize> {
    info: CarriedInfo,
    body: AtRest<D>,
    center: [f64; D],
    unit: f64,
}

impl<const D: usize> CarriedField<D> for Weight<D> {
    fn info(&self) -> &CarriedInfo {
        &self.info
    }

    fn evaluate(&self, x: &[f64; D], out: &mut [f64]) {
        out[0] = self.unit * self.body.pressure(distance(x, &self.center));
    }
}

/// Replaces the pressure of a profile that carries its own weight alone; says where other gas is not held.
fn carry_weight<const D: usize>(scene: &Scene, prepared: &mut Prepared<D>, units: &RunUnits) -> Result<Option<String>> {
    // These have all of it in their pressure, or in pressure and rotation.
    let is_held = scene.input.disc().is_some() || scene.input.hydrostatic().is_some();
    if scene.collisionless.is_some() || is_held || prepared.beside.is_empty() {
        return Ok(None);
    }
    let by_law = scene.input.profile.as_ref().is_some_and(|p| !p.carries_weight());
    let thermal = [names::PRESSURE, names::INTERNAL_ENERGY, names::TEMPERATURE];
    let is_carried = |name: &str| prepared.source.carried.iter().any(|f| f.info().name == name);
    let is_stated = scene.input.profile.is_none() && thermal.iter().any(|name| is_carried(name));
    let is_of_fields = ["pressure", "internal_energy", "temperature", "entropy"];
    let is_of_fields = scene.fields.stated().any(|(name, _)| is_of_fields.contains(&name));
    if by_law || is_stated || is_of_fields || scene.thermal.internal_energy.is_some() {
        let note = "the gas has the pressure that the scene states, whatever the gravity of gravity_of";
        return Ok(Some(note.into()));
    }
    let Some(radial) = prepared.source.radial.clone() else {
        return Ok(Some(
            "the input is not a radial profile, so gravity_of does not give it a pressure; state one in \
             `fields`"
                .into(),
        ));
    };
    let body = AtRest::new(&radial, prepared.point_mass(), &prepared.beside);
    let (length, density) = units.input.map_or((1.0, 1.0), |u| (u.length, u.density));
    let (size, constant) = (prepared.length * length, gravity(scene, units.input.is_some()));
    let mass = prepared.mass.value * density * length.powi(3);
    let unit = Unit::parse("dyn/cm^2").filter(|_| units.input.is_some());
    let info = CarriedInfo { name: names::PRESSURE.into(), unit, components: 1 };
    prepared.source.carried.retain(|f| f.info().name != names::PRESSURE);
    let unit = constant * mass * mass / size.powi(4);
    prepared.source.carried.push(Box::new(Weight { info, body, center: radial.center, unit }));
    Ok(Some("the gas is hydrostatic in its own gravity and that of gravity_of: its pressure carries the weight in both, and is 0 at its surface".into()))
}
