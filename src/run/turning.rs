//! How fast bodies turn, against what holds them: a body that is at rest by itself is not so once it turns.

use super::assembly::{Body, State, length, masses_of};
use super::states::gravity_in;
use super::verdict::{Finding, Grade, Topic};
use crate::error::Result;
use crate::field::turned_back;
use crate::input::constants::gravity;
use crate::scene::{Conversion, Scene, values};
use serde::Serialize;
use sph_formats::{ParticleFile, UnitDimension};

/// Share of gravity that a motion may carry and leave a body almost as it is.
const LITTLE_FORCE: f64 = 0.01;
/// Kinetic energy over that of drawn velocities from which on a collisionless body spreads.
const SPREADS: f64 = 1.05;

/// A body that turns as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Turning {
    /// Angular velocity, in the output's units.
    pub rate: f64,
    /// The centrifugal force over gravity at its equator, taken for a ball.
    pub over_gravity: f64,
}

impl Turning {
    /// Of a body of `mass` that ends at the radius `surface`, with the constant of gravity `constant`, all in the same units; `None` at rest.
    pub fn new(rate: f64, (mass, surface): (f64, f64), constant: f64) -> Option<Self> {
        let over_gravity = rate.powi(2) * surface.powi(3) / (constant * mass);
        (over_gravity > 0.0).then_some(Self { rate, over_gravity })
    }

    /// What is said where its gravity does not hold it.
    pub fn flies_apart(&self) -> Option<String> {
        (self.over_gravity > 1.0).then(|| {
            format!(
                "turns so fast that it flies apart: at its surface the centrifugal force is {:.2} times its gravity; spin up to {:.4e} is held",
                self.over_gravity,
                self.rate / self.over_gravity.sqrt()
            )
        })
    }
}

/// How the scene turns a body that ends at `radius`, whose particles are those of `file`; `None` where it does not.
///
/// # Errors
/// Units that are not those of a rate.
pub fn of_scene(
    scene: &Scene,
    (file, radius): (&ParticleFile, f64),
    (conversion, are_known): (&Conversion, bool),
) -> Result<Option<Turning>> {
    let rotation = values("motion.rotation", &scene.motion.rotation, UnitDimension::RATE, conversion)?;
    let rate = rotation.iter().map(|v| v * v).sum::<f64>().sqrt();
    let mass = file.species.iter().flat_map(|s| masses_of(&s.table)).sum();
    Ok(Turning::new(rate, (mass, radius), gravity_in(gravity(scene, are_known), are_known, &file.header.units)))
}

/// The share of gravity that a motion of a balanced body carries, in words, for the end of a line on its balance.
pub fn carried(share: f64) -> String {
    format!("{:.0} % of gravity: `settle` balances rotating bodies, and `certify` shows how they evolve", 100.0 * share)
}

/// The angular velocity that a body by itself is to have among others, in its own orientation.
///
/// # Errors
/// Units that are not those of a rate.
pub fn own_spin(scene: &Scene, conversion: &Conversion) -> Result<[f64; 3]> {
    let turning = &scene.turning;
    Ok(match *values("spin", &turning.spin, UnitDimension::RATE, conversion)?.as_slice() {
        [x, y, z] => match *turning.orientation.as_slice() {
            [a, b, c] => turned_back(&[a, b, c], &[x, y, z]),
            _ => [x, y, z],
        },
        [z] => [0.0, 0.0, z],
        _ => [0.0; 3],
    })
}

/// What the spins of bodies do to each: `constant` is that of gravity where there is any, `supports` what the pressure of each holds, where
/// that is known.
pub fn of_bodies(
    (bodies, states): (&[Body], &[State]),
    supports: &[Option<f64>],
    (constant, settles): (Option<f64>, bool),
) -> Vec<Finding> {
    let told = |((body, state), support): ((&Body, &State), &Option<f64>)| {
        let rate = length(state.spin);
        if rate == 0.0 {
            return None;
        }
        let say =
            |grade, text: String| Some(Finding::new(grade, Topic::Balance, format!("body {} {text}", body.title)));
        if body.is_collisionless {
            let factor = body.kinetic(state) / body.kinetic(&State::default());
            let text = format!(
                "turns: with its spin the kinetic energy of its particles is {factor:.3} times that of the velocities that it had by itself, and 2 K/|W| \
                 with it, so that it will spread"
            );
            return if factor > SPREADS && factor.is_finite() { say(Grade::Look, text) } else { None };
        }
        let turning = constant.and_then(|g| Turning::new(rate, (body.mass, body.surface), g));
        if let Some(text) = turning.filter(|_| body.is_gas()).and_then(|t| t.flies_apart()) {
            return say(Grade::Bad, text);
        }
        let turns = State { spin: state.spin, ..State::default() };
        let share = (*support).map(|support| (body.kinetic(&turns) - body.kinetic(&State::default())) * 2.0 / support);
        let share = share.filter(|share| *share > LITTLE_FORCE && !settles)?;
        say(Grade::Look, format!("is placed at rest, and its spin carries {}", carried(share)))
    };
    bodies.iter().zip(states).zip(supports).filter_map(told).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At breakup, omega^2 = G M/R^3.
    #[test]
    fn a_body_flies_apart_from_the_rate_on_at_which_its_equator_is_in_orbit() {
        let (mass, surface, constant): (f64, f64, f64) = (3.0, 2.0, 0.5);
        let breakup = (constant * mass / surface.powi(3)).sqrt();
        let at = |share: f64| Turning::new(share * breakup, (mass, surface), constant).unwrap();
        assert!((at(0.6).over_gravity - 0.36).abs() < 1e-12 && at(0.99).flies_apart().is_none());
        let told = at(2.0).flies_apart().unwrap();
        assert!(told.contains("4.00 times") && told.contains(&format!("up to {breakup:.4e} is held")), "{told}");
        assert_eq!(Turning::new(0.0, (mass, surface), constant), None);
    }
}
