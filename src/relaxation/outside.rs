//! External influences on the particles that are followed: a field, and walls.

use crate::target::{Equilibrium, Target};
use sph::domain::Domain;

/// Length over which a field is differenced, in spacings.
const GRADIENT_STEP: f64 = 0.04;

/// An external field: that which holds the pressure of a target.
#[derive(Clone, Copy)]
pub struct Field<'a, const D: usize> {
    pub equilibrium: &'a dyn Equilibrium<D>,
    /// Its domain is where the field is known; beyond, it is taken to be that inside, at the same distance from the surface.
    pub target: Target<'a, D>,
}

impl<const D: usize> std::fmt::Debug for Field<'_, D> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Field").field("domain", self.target.domain).finish_non_exhaustive()
    }
}

impl<const D: usize> Field<'_, D> {
    pub(super) fn acceleration(&self, x: &[f64; D]) -> [f64; D] {
        let mut inside = *x;
        self.target.domain.confine(x, &mut inside);
        let step =
            GRADIENT_STEP * self.target.spacing(self.target.number_density(&inside)).min(self.target.domain.size());
        self.equilibrium.gravity(&inside, step)
    }
}

/// Place and velocity of a particle that has moved freely from `from`: walls throw it back.
pub(super) fn reflected<const D: usize>(
    domain: &Domain<D>,
    from: &[f64; D],
    (free, velocity): (&[f64; D], &[f64; D]),
) -> ([f64; D], [f64; D]) {
    let mut x = domain.wrapped(free);
    if domain.contains(&x) {
        return (x, *velocity);
    }
    let before = x;
    domain.confine(from, &mut x);
    let normal: [f64; D] = sph::array(|k| x[k] - before[k]);
    let length = normal.iter().map(|n| n * n).sum::<f64>();
    let along: f64 = (0..D).map(|k| velocity[k] * normal[k]).sum();
    let back = if along < 0.0 && length > 0.0 { 2.0 * along / length } else { 0.0 };
    (x, sph::array(|k| velocity[k] - back * normal[k]))
}
