//! Where the bodies of a scene are and how they move: as it states, or on an orbit of two.

use super::assembly::{Body, State};
use super::orbit::{self, Relative};
use super::shares::Common;
use crate::error::{Error, Result};
use crate::scene::{Conversion, OrbitInput, Quantity, Scene, values};
use sph_formats::{UnitDimension, UnitSystem};

const GRAVITY: UnitDimension = UnitDimension::new(3, -1, -2, 0);

/// A constant of gravity, in cgs where units are known, in those of the output.
pub fn gravity_in(constant: f64, are_known: bool, out: &UnitSystem) -> f64 {
    if are_known { constant / out.to_cgs(GRAVITY) } else { constant }
}

impl Common {
    /// The constant of gravity in the output's units.
    pub fn gravity_in(&self, out: &UnitSystem) -> f64 {
        gravity_in(self.gravity, self.has_units(), out)
    }

    /// The second body as the first sees it.
    pub fn relative(
        &self,
        orbit: &OrbitInput,
        bodies: &[Body],
        (out, conversion): (&UnitSystem, &Conversion),
    ) -> Result<Relative> {
        if self.dimension != 3 {
            return Err(Error::scene("orbit", format!("is one in 3-D, but the bodies are in {}-D", self.dimension)));
        }
        let gravity = self.gravity_in(out);
        let [a, b] = bodies else { return Err(Error::scene("orbit", "is of two bodies")) };
        let (strength, contact) = (gravity * (a.mass + b.mass), a.surface + b.surface);
        let speed = |key: &str, q: &Quantity| q.value(key, UnitDimension::VELOCITY, conversion);
        let length = |key: &str, q: &Quantity| q.value(key, UnitDimension::LENGTH, conversion);
        if let Some(axis) = &orbit.semi_major_axis {
            let axis = length("orbit.semi_major_axis", axis)?;
            let relative = orbit::ellipse(strength, axis, orbit.eccentricity, orbit.phase);
            let apart = relative.position[0].hypot(relative.position[1]);
            if !(apart > contact) {
                let problem = format!(
                    "is {axis:.6e}, which is too small: at the start the centers are {apart:.6e} apart, and the bodies touch at \
                     {contact:.6e}; choose more, or another phase"
                );
                return Err(Error::scene("orbit.semi_major_axis", problem));
            }
            return Ok(relative);
        }
        let escape = orbit::escape_velocity(strength, contact);
        let at_contact = match (&orbit.velocity_at_contact, orbit.velocity_over_escape, &orbit.velocity_at_infinity) {
            (Some(v), ..) => speed("orbit.velocity_at_contact", v)?,
            (None, Some(ratio), _) => ratio * escape,
            (None, None, Some(v)) => speed("orbit.velocity_at_infinity", v)?.hypot(escape),
            _ => escape,
        };
        let distance = orbit.distance.as_ref().map_or(Ok(0.0), |q| length("orbit.distance", q))?;
        orbit::encounter(strength, contact, at_contact, orbit.impact_parameter.unwrap_or(0.0), distance)
    }

    pub fn states(
        &self,
        scene: &Scene,
        bodies: &[Body],
        relative: Option<&Relative>,
        conversion: &Conversion,
    ) -> Result<Vec<State>> {
        let total: f64 = bodies.iter().map(|b| b.mass).sum();
        let mut states = Vec::new();
        for (i, (input, body)) in scene.bodies.iter().zip(bodies).enumerate() {
            let key = |name: &str| format!("bodies[{}].{name}", input.title(i));
            let vector = |name: &str, quantities: &[Quantity], dimension: UnitDimension| {
                let d = self.dimension;
                let given = values(&key(name), quantities, dimension, conversion)?;
                if !given.is_empty() && given.len() != d {
                    return Err(Error::scene(key(name), format!("has {} components, expected {d}", given.len())));
                }
                Ok(std::array::from_fn::<f64, 3, _>(|k| given.get(k).copied().unwrap_or(0.0)))
            };
            let mut state = State {
                position: vector("position", &input.position, UnitDimension::LENGTH)?,
                velocity: vector("velocity", &input.velocity, UnitDimension::VELOCITY)?,
                spin: self.spin(&key("spin"), &input.spin, conversion)?,
            };
            if let Some(relative) = relative {
                // The second is at its share of the separation, the first at the other end.
                let share = if i == 0 { body.mass / total - 1.0 } else { 1.0 - body.mass / total };
                for k in 0..2 {
                    state.position[k] = share * relative.position[k];
                    state.velocity[k] = share * relative.velocity[k];
                }
                if scene.orbit.as_ref().is_some_and(|o| o.corotation) {
                    state.spin = [0.0, 0.0, relative.mean_motion];
                }
            }
            states.push(state);
        }
        Ok(states)
    }

    fn spin(&self, key: &str, quantities: &[Quantity], conversion: &Conversion) -> Result<[f64; 3]> {
        let given = values(key, quantities, UnitDimension::RATE, conversion)?;
        match (self.dimension, given.as_slice()) {
            (_, []) => Ok([0.0; 3]),
            (3, [x, y, z]) => Ok([*x, *y, *z]),
            (2, [z]) => Ok([0.0, 0.0, *z]),
            (1, _) => Err(Error::scene(key, "means nothing in 1-D")),
            (d, found) => {
                let expected = if d == 3 { 3 } else { 1 };
                Err(Error::scene(key, format!("has {} components, expected {expected}", found.len())))
            }
        }
    }
}

/// Relative to the speed on the orbit: less is rounding.
const OWN_MOTION: f64 = 1e-9;

/// Takes out what a body moves by as a whole without its orbit, which is that of centers of mass.
pub fn stopped(body: &mut Body, orbit: &Relative) -> Option<String> {
    let own = body.stop(OWN_MOTION * orbit.velocity[0].hypot(orbit.velocity[1]))?;
    Some(format!(
        "'{}' had a bulk velocity of [{:.4e}, {:.4e}, {:.4e}] of its own, now removed: the orbit sets its velocity",
        body.title, own[0], own[1], own[2]
    ))
}

/// What is said of a body that moves as a whole without an orbit.
pub fn moving(body: &Body) -> Option<String> {
    let own = body.drift()?;
    Some(format!(
        "'{}' has a bulk velocity of [{:.4e}, {:.4e}, {:.4e}] of its own, to which its `velocity` is added",
        body.title, own[0], own[1], own[2]
    ))
}
