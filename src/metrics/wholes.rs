//! Accelerations of bodies as wholes: the force that a particle needs to stay with a body that rotates, or that other bodies attract.
//!
//! A rigid rotation with the body's angular momentum `L` has the angular velocity `w`, `I w = L`, `I` being the inertia about the center of mass
//! `c`, and the centripetal acceleration `w x (w x (x - c))`. A body that others attract has the mean acceleration of its mass.

use crate::target::{Positions, at};
use nalgebra::{Matrix3, Vector3};

/// How particles move, and which body each is of.
#[derive(Debug, Clone, Copy)]
pub struct Moving<'a, const D: usize> {
    pub velocities: Option<&'a [[f64; D]]>,
    /// Place of each particle's body among all; empty for one.
    pub bodies: &'a [usize],
    /// Whether there are others that attract the particles.
    pub is_attracted: bool,
}

/// What is known of one body.
#[derive(Debug, Clone, Copy)]
struct Whole {
    mass: f64,
    center: Vector3<f64>,
    spin: Vector3<f64>,
    acceleration: Vector3<f64>,
}

/// Accelerations of particles, by those of their bodies.
#[derive(Debug, Clone)]
pub(super) struct Wholes<'a, const D: usize> {
    moving: Moving<'a, D>,
    wholes: Vec<Whole>,
}

fn filled<const D: usize>(v: &[f64; D]) -> Vector3<f64> {
    Vector3::from_fn(|k, _| v.get(k).copied().unwrap_or(0.0))
}

impl<'a, const D: usize> Wholes<'a, D> {
    /// Of particles with these masses, and the accelerations of some.
    pub fn new(
        moving: Moving<'a, D>,
        positions: &Positions<D>,
        masses: &[f64],
        accelerations: &[(usize, [f64; D])],
    ) -> Self {
        let count = moving.bodies.iter().max().map_or(1, |last| last + 1);
        let body = |i: usize| moving.bodies.get(i).copied().unwrap_or(0);
        let zero = Vector3::zeros();
        let mut wholes = vec![Whole { mass: 0.0, center: zero, spin: zero, acceleration: zero }; count];
        let (mut known, mut drift) = (vec![0.0; count], vec![zero; count]);
        let velocity = |i: usize| moving.velocities.map_or(zero, |v| filled(&v[i]));
        for (i, m) in masses.iter().enumerate() {
            let own = &mut wholes[body(i)];
            own.mass += m;
            own.center += filled(&at(positions, i)) * *m;
            drift[body(i)] += velocity(i) * *m;
        }
        for (i, a) in accelerations {
            known[body(*i)] += masses[*i];
            wholes[body(*i)].acceleration += filled(a) * masses[*i];
        }
        for (b, own) in wholes.iter_mut().enumerate() {
            own.center /= own.mass;
            drift[b] /= own.mass;
            own.acceleration = match count > 1 || moving.is_attracted {
                true if known[b] > 0.0 => own.acceleration / known[b],
                _ => zero,
            };
        }
        let (mut momentum, mut inertia) = (vec![zero; count], vec![Matrix3::zeros(); count]);
        for (i, m) in masses.iter().enumerate() {
            let b = body(i);
            let x = filled(&at(positions, i)) - wholes[b].center;
            momentum[b] += x.cross(&(velocity(i) - drift[b])) * *m;
            inertia[b] += (Matrix3::from_diagonal_element(x.norm_squared()) - x * x.transpose()) * *m;
        }
        for (own, (momentum, inertia)) in wholes.iter_mut().zip(momentum.into_iter().zip(inertia)) {
            own.spin = inertia.try_inverse().map_or(zero, |inverse: Matrix3<f64>| inverse * momentum);
            if !own.spin.iter().all(|w| w.is_finite()) {
                own.spin = zero;
            }
        }
        Self { moving, wholes }
    }

    fn of(&self, i: usize) -> &Whole {
        &self.wholes[self.moving.bodies.get(i).copied().unwrap_or(0)]
    }

    /// Centripetal acceleration of a particle.
    pub fn centripetal(&self, positions: &Positions<D>, i: usize) -> [f64; D] {
        let Whole { center, spin, .. } = self.of(i);
        let inward = spin.cross(&spin.cross(&(filled(&at(positions, i)) - center)));
        sph::array(|k| inward[k])
    }

    /// Acceleration of the body that a particle is of.
    pub fn acceleration(&self, i: usize) -> [f64; D] {
        let own = self.of(i).acceleration;
        sph::array(|k| own[k])
    }
}
