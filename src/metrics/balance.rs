//! How well the pressure force cancels gravity.
//!
//! The force is that of standard SPH with grad-h terms, as in the stage that balances the two, with the
//! pressure (gamma - 1) rho u that a code makes of the energies in the file and its own summed density.

use super::Measured;
use super::wholes::{Moving, Wholes};
use crate::target::{Equilibrium, MaterialState, Positions, at};
use serde::Serialize;
use sph::domain::Domain;
use sph::gravity::{OPENING_ANGLE, sampled_gravity, softening_radius};
use sph::kernel::KernelName;
use sph::point_mass::PointMass;
use sph::{parallel, reduce};

/// |a + g| / |g| of the pressure's acceleration a and gravity g.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BalanceFigures {
    /// Mean over particles whose support lies inside the domain.
    pub interior: Option<f64>,
    /// Mean over all particles: at a surface the pressure force is a one-sided sum.
    pub all: f64,
}

/// What the particles' pressure is made of.
pub struct Thermodynamics<'a, const D: usize> {
    pub equilibrium: &'a dyn Equilibrium<D>,
    /// Specific internal energies; where `None`, P*/((gamma - 1) rho*).
    pub internal_energy: Option<&'a [f64]>,
}

/// Step of the differences of a field that holds the pressure, in support radii.
const GRADIENT_STEP: f64 = 1e-3;

/// Particles whose gravity is found from all others, about: a mean needs no more.
const SAMPLES: usize = 20_000;

/// Particles whose forces are looked at, with what they are attracted by.
struct Sampled<const D: usize> {
    particles: Vec<usize>,
    /// Places of the particles in the tree's order.
    places: Vec<usize>,
    gravity: Vec<[f64; D]>,
}

impl<const D: usize> Sampled<D> {
    /// As many as tell a mean, with what all particles and points beside them attract each with.
    fn new(measured: &Measured<D>, positions: &Positions<D>, masses: &[f64], points: &[PointMass<D>]) -> Self {
        let tree = &measured.tree;
        let softening = softening_radius::<D>(measured.sums.iter().map(|s| s.number_density));
        let every = masses.len().div_ceil(SAMPLES);
        let found = sampled_gravity(tree, &tree.to_tree_order(masses), softening, OPENING_ANGLE, every);
        let particles: Vec<usize> = found.iter().map(|(place, _)| tree.order()[*place] as usize).collect();
        let gravity = parallel::map(found.len(), |j| {
            let x = at(positions, particles[j]);
            let others = points.iter().map(|point| point.pull(&x).acceleration);
            others.fold(found[j].1.acceleration, |sum, g| sph::array(|k| sum[k] + g[k]))
        });
        Self { particles, places: found.into_iter().map(|(place, _)| place).collect(), gravity }
    }

    /// Mean of `of(j)` over those of the sample that are in the interior; `None` where there are none.
    fn interior_mean(&self, measured: &Measured<D>, of: impl Fn(usize) -> f64 + Sync) -> Option<f64> {
        mean(self.particles.len(), of, |j| measured.interior[self.particles[j]])
    }
}

/// What is left of forces on particles that stay with their bodies, and what was taken off, over gravity: means over the interior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NetForce {
    /// |a + g - c - b| / |g| with the centripetal acceleration c and the acceleration b of the body as a whole.
    pub left: f64,
    /// |c| / |g|.
    pub rotation: f64,
    /// |b| / |g|.
    pub whole: f64,
}

/// The net force over the interior, g being what the particles and `points` attract each of them with, for specific internal energies
/// in units of G M/L, positions and masses in those of L and M, and velocities in those of (G M/L)^(1/2). `None` where there is no interior.
pub fn mean_net_force<const D: usize>(
    kernel: KernelName,
    measured: &Measured<D>,
    domain: &Domain<D>,
    positions: &Positions<D>,
    (masses, points): (&[f64], &[PointMass<D>]),
    (internal_energy, gamma): (&[f64], f64),
    moving: Moving<'_, D>,
) -> Option<NetForce> {
    let sampled = Sampled::new(measured, positions, masses, points);
    let strength = strengths(measured, |i| (gamma - 1.0) * internal_energy[i]);
    let force = measured.pressure_force_at(kernel, domain, (masses, &strength), &sampled.places);
    let all = parallel::map(force.len(), |j| (sampled.particles[j], plus(&sampled.gravity[j], &force[j])));
    let wholes = Wholes::new(moving, positions, masses, &all);
    let inward = |j: usize| wholes.centripetal(positions, sampled.particles[j]);
    let whole = |j: usize| wholes.acceleration(sampled.particles[j]);
    let over_gravity = |of: &(dyn Fn(usize) -> [f64; D] + Sync)| {
        sampled.interior_mean(measured, |j| share(&of(j), &sampled.gravity[j]))
    };
    let negative = |v: [f64; D]| v.map(|x| -x);
    Some(NetForce {
        left: over_gravity(&|j| plus(&all[j].1, &negative(plus(&inward(j), &whole(j)))))?,
        rotation: over_gravity(&inward)?,
        whole: over_gravity(&whole)?,
    })
}

fn plus<const D: usize>(a: &[f64; D], b: &[f64; D]) -> [f64; D] {
    sph::array(|k| a[k] + b[k])
}

/// |a| / |g|; 0 where there is no gravity.
fn share<const D: usize>(a: &[f64; D], gravity: &[f64; D]) -> f64 {
    let pull: f64 = gravity.iter().map(|g| g * g).sum();
    let net: f64 = a.iter().map(|a| a.powi(2)).sum();
    if pull > 0.0 { (net / pull).sqrt() } else { 0.0 }
}

/// P/rho^2 with the grad-h term, from (gamma - 1) u.
pub(crate) fn strengths<const D: usize>(measured: &Measured<D>, temperature: impl Fn(usize) -> f64 + Sync) -> Vec<f64> {
    parallel::map(measured.own(), |i| {
        let sums = &measured.sums[i];
        let grad_h = 1.0 + sums.slope / (D as f64 * sums.number_density);
        temperature(i) / (sums.weighted * grad_h)
    })
}

/// Mean of `of` over a set of `0..n`; `None` where it is empty.
fn mean(n: usize, of: impl Fn(usize) -> f64 + Sync, set: impl Fn(usize) -> bool + Sync) -> Option<f64> {
    let count = parallel::count(n, &set);
    (count > 0).then(|| reduce::sum(n, |i| if set(i) { of(i) } else { 0.0 }) / count as f64)
}

impl BalanceFigures {
    /// `target_density` is rho* at the particles, in internal units as all else. `None` without gravity.
    pub fn new<const D: usize>(
        kernel: KernelName,
        measured: &Measured<D>,
        domain: &Domain<D>,
        positions: &Positions<D>,
        (masses, target_density): (&[f64], &[f64]),
        thermodynamics: &Thermodynamics<'_, D>,
    ) -> Option<Self> {
        let Thermodynamics { equilibrium, internal_energy } = thermodynamics;
        if !equilibrium.has_gravity() {
            return None;
        }
        // (gamma - 1) u = P*/rho* needs no gamma.
        let temperature = |i: usize| {
            if let Some((materials, state)) = equilibrium.materials().zip(equilibrium.material(&at(positions, i))) {
                let density = measured.sums[i].weighted;
                let energy = internal_energy.map_or(state.energy, |u| u[i]);
                return materials.pressure(&MaterialState { density, energy, ..state }) / density;
            }
            internal_energy.map_or_else(
                || equilibrium.pressure(&at(positions, i)) / target_density[i],
                |u| (equilibrium.gamma() - 1.0) * u[i],
            )
        };
        let strength = strengths(measured, temperature);
        if equilibrium.own_center().is_some() {
            let sampled = Sampled::new(measured, positions, masses, &Vec::from_iter(equilibrium.point_mass()));
            let force = measured.pressure_force_at(kernel, domain, (masses, &strength), &sampled.places);
            let error = |j: usize| share(&plus(&sampled.gravity[j], &force[j]), &sampled.gravity[j]);
            let interior = sampled.interior_mean(measured, error);
            return Some(Self { interior, all: mean(force.len(), error, |_| true).unwrap_or(0.0) });
        }
        let force = measured.pressure_force(kernel, domain, masses, &strength);
        let errors = parallel::map(force.len(), |i| {
            let gravity = equilibrium.gravity(&at(positions, i), GRADIENT_STEP * measured.support[i]);
            share(&plus(&gravity, &force[i]), &gravity)
        });
        let interior = mean(errors.len(), |i| errors[i], |i| measured.interior[i]);
        Some(Self { interior, all: mean(errors.len(), |i| errors[i], |_| true).unwrap_or(0.0) })
    }
}
