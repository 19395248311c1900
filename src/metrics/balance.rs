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
use sph::neighbors::Tree;
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

/// What the particles attract each other with, and points beside them, of as many as are sampled.
fn own_gravity<const D: usize>(
    measured: &Measured<D>,
    positions: &Positions<D>,
    masses: &[f64],
    points: &[PointMass<D>],
) -> Vec<Option<[f64; D]>> {
    let tree = Tree::build(positions);
    let softening = softening_radius::<D>(measured.sums.iter().map(|s| s.number_density));
    let every = masses.len().div_ceil(SAMPLES);
    let mut own = vec![None; masses.len()];
    for (place, pull) in sampled_gravity(&tree, &tree.to_tree_order(masses), softening, OPENING_ANGLE, every) {
        let i = tree.order()[place] as usize;
        let x = at(positions, i);
        let others = points.iter().map(|point| point.pull(&x).acceleration);
        own[i] = Some(others.fold(pull.acceleration, |sum, g| sph::array(|k| sum[k] + g[k])));
    }
    own
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
    let temperature = |i: usize| (gamma - 1.0) * internal_energy[i];
    let own = own_gravity(measured, positions, masses, points);
    let force = pressure_forces(kernel, measured, domain, masses, &temperature);
    let all = |i: usize| Some(plus(&own[i]?, &force[i]));
    let wholes = Wholes::new(moving, positions, masses, &parallel::map(masses.len(), all));
    let inward = wholes.centripetal(positions);
    let interior = |i: usize| measured.interior[i];
    let over_gravity = |of: &(dyn Fn(usize, &[f64; D]) -> [f64; D] + Sync)| {
        mean(&parallel::map(masses.len(), |i| own[i].map(|g| share(&of(i, &g), &g))), &interior)
    };
    let negative = |v: [f64; D]| v.map(|x| -x);
    let needed = |i: usize| negative(plus(&inward[i], &wholes.acceleration(i)));
    Some(NetForce {
        left: over_gravity(&|i, g| plus(&plus(g, &force[i]), &needed(i)))?,
        rotation: over_gravity(&|i, _| inward[i])?,
        whole: over_gravity(&|i, _| wholes.acceleration(i))?,
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

/// Accelerations by pressure, from (gamma - 1) u.
fn pressure_forces<const D: usize>(
    kernel: KernelName,
    measured: &Measured<D>,
    domain: &Domain<D>,
    masses: &[f64],
    temperature: &(dyn Fn(usize) -> f64 + Sync),
) -> Vec<[f64; D]> {
    let strength = parallel::map(masses.len(), |i| {
        let sums = &measured.sums[i];
        let grad_h = 1.0 + sums.slope / (D as f64 * sums.number_density);
        temperature(i) / (sums.weighted * grad_h)
    });
    measured.pressure_force(kernel, domain, masses, &strength)
}

/// |a + g| / |g| of each particle, from (gamma - 1) u and g; 0 where there is no gravity, `None` where it is not known.
fn errors<const D: usize>(
    kernel: KernelName,
    measured: &Measured<D>,
    domain: &Domain<D>,
    masses: &[f64],
    temperature: &(dyn Fn(usize) -> f64 + Sync),
    gravity: &(dyn Fn(usize) -> Option<[f64; D]> + Sync),
) -> Vec<Option<f64>> {
    let force = pressure_forces(kernel, measured, domain, masses, temperature);
    parallel::map(masses.len(), |i| {
        let gravity = gravity(i)?;
        Some(share(&plus(&gravity, &force[i]), &gravity))
    })
}

/// Mean over those of a set that are known; `None` where there are none.
fn mean(errors: &[Option<f64>], set: &(dyn Fn(usize) -> bool + Sync)) -> Option<f64> {
    let known = |i: usize| errors[i].filter(|_| set(i));
    let count = parallel::count(errors.len(), |i| known(i).is_some());
    (count > 0).then(|| reduce::sum(errors.len(), |i| known(i).unwrap_or(0.0)) / count as f64)
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
        let own = equilibrium.own_center().map(|_| {
            let point = Vec::from_iter(equilibrium.point_mass());
            own_gravity(measured, positions, masses, &point)
        });
        let pull = |i: usize| {
            let step = GRADIENT_STEP * measured.support[i];
            own.as_ref().map_or_else(|| Some(equilibrium.gravity(&at(positions, i), step)), |own| own[i])
        };
        let errors = errors(kernel, measured, domain, masses, &temperature, &pull);
        let interior = mean(&errors, &|i| measured.interior[i]);
        Some(Self { interior, all: mean(&errors, &|_| true).unwrap_or(0.0) })
    }
}
