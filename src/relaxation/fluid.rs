//! The fluid that ALARIC evolves: its forces and its time step, see [`super::alaric`].

use super::arrangement::{Arrangement, SORT_INTERVAL};
use super::fit::{Fit, fit, fit_with, interior, resolved};
use super::snapshot::{Check, axes, rows};
use crate::target::{Positions, Target, at};
use serde::{Deserialize, Serialize};
use sph::kernel::KernelName;
use sph::lanes::Real;
use sph::sums::{DensitySums, SHEAR_CHANNELS, Search, Shear, shear};
use sph::{parallel, reduce};

/// Parameters of the relaxation; the terms can be switched off one by one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlaricOptions {
    /// N_H = V_d n H^d.
    pub kernel_neighbors: f64,
    /// Friction chi, in inverse crossing times; 0 switches it off.
    pub friction: f64,
    /// Viscosity with evolving alpha.
    pub viscosity: bool,
    /// Setting all velocities to zero every tau.
    pub velocity_stops: bool,
    /// Growth theta of tau at each stop.
    pub growth: f64,
    /// Holds particles where no arrangement has the target's density: it changes too much over a support radius.
    pub hold_unresolved: bool,
    /// Correction of the forces for the variation of H.
    pub grad_h: bool,
    /// Time step over the time in which sound crosses the smallest support radius.
    pub courant: f64,
    pub steps: usize,
    /// Converged when epsilon is below.
    pub tolerance: f64,
    /// Converged when |d epsilon/dt| between stops is below.
    pub rate_tolerance: f64,
}

impl AlaricOptions {
    /// The paper's values (sec. 2 and 4.1) in `D` dimensions. Its chi = 2 is for a domain of size 2.
    pub fn new(d: usize) -> Self {
        Self {
            kernel_neighbors: sph::kernel::default_kernel_neighbors(d),
            friction: 4.0,
            viscosity: true,
            velocity_stops: true,
            growth: 0.1,
            hold_unresolved: false,
            grad_h: true,
            courant: 0.3,
            steps: 10_000,
            tolerance: 1e-8,
            rate_tolerance: 1e-8,
        }
    }
}

/// alpha decays over the time in which sound crosses this many support radii.
const ALPHA_DECAY: f64 = 2.5;
/// No particle moves farther in a step, in its own spacing.
const MAX_STEP: f64 = 0.3;

/// The fictitious fluid.
pub(super) struct Fluid<'a, const D: usize, R> {
    pub options: &'a AlaricOptions,
    pub state: Arrangement<'a, D, R>,
    pub velocities: Vec<[f64; D]>,
    pub alpha: Vec<f64>,
    pub accelerations: Vec<[f64; D]>,
    pub support: Vec<f64>,
    sums: Vec<DensitySums<D>>,
    wanted: Vec<f64>,
    shear: Vec<Shear<D>>,
    /// How far particles are moved, from 0 to 1; empty where all are. As of the last sorting.
    weights: Vec<f64>,
    /// With the particle mass in use, and with the one that fits now.
    used: Fit,
    pub fitted: Fit,
    pub time: f64,
}

/// What the fluid goes on from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct FluidSnapshot<const D: usize> {
    #[serde(with = "axes")]
    positions: Positions<D>,
    moves: usize,
    #[serde(with = "rows")]
    velocities: Vec<[f64; D]>,
    #[serde(with = "rows")]
    accelerations: Vec<[f64; D]>,
    alpha: Vec<f64>,
    support: Vec<f64>,
    /// Empty where all particles are moved.
    weights: Vec<f64>,
    /// div v; empty without viscosity.
    divergence: Vec<f64>,
    used: Fit,
    fitted: Fit,
    time: f64,
}

impl<const D: usize> FluidSnapshot<D> {
    /// # Errors
    /// What is wrong with it for `count` particles.
    pub fn check(&self, count: usize) -> Result<(), String> {
        let check = Check::new(count)
            .positions("positions", &self.positions)
            .vectors("velocities", &self.velocities)
            .vectors("accelerations", &self.accelerations)
            .scalars("the viscosity", &self.alpha)
            .scalars("support radii", &self.support);
        let or_none = |check: Check, name: &str, values: &[f64]| {
            if values.is_empty() { check } else { check.scalars(name, values) }
        };
        let check = or_none(check, "div v", &self.divergence);
        or_none(check, "weights", &self.weights).result()
    }
}

impl<'a, const D: usize, R: Real> Fluid<'a, D, R> {
    pub fn new(kernel: KernelName, target: Target<'a, D>, positions: Positions<D>, options: &'a AlaricOptions) -> Self {
        let neighbors = options.kernel_neighbors;
        let state = Arrangement::new(kernel, target, target.domain.mirrored(), positions, neighbors);
        let n = state.len();
        let wanted = target.number_densities(state.positions());
        let support = state.target_supports();
        let unknown = Fit { factor: 1.0, epsilon: f64::INFINITY };
        let mut fluid = Self {
            options,
            state,
            velocities: vec![[0.0; D]; n],
            alpha: vec![0.0; n],
            accelerations: Vec::new(),
            support,
            sums: Vec::new(),
            wanted,
            shear: Vec::new(),
            weights: Vec::new(),
            used: unknown,
            fitted: unknown,
            time: 0.0,
        };
        fluid.weigh();
        fluid.evaluate();
        fluid
    }

    pub fn resume(
        kernel: KernelName,
        target: Target<'a, D>,
        kept: FluidSnapshot<D>,
        options: &'a AlaricOptions,
    ) -> Self {
        let FluidSnapshot { positions, moves, velocities, accelerations, alpha, support, weights, .. } = kept;
        let (mirrored, neighbors) = (target.domain.mirrored(), options.kernel_neighbors);
        let state = Arrangement::of_sorted(kernel, target, mirrored, positions, moves, neighbors);
        let shear = kept.divergence.into_iter().map(|divergence| Shear { divergence, drag: [0.0; D] }).collect();
        let FluidSnapshot { used, fitted, time, .. } = kept;
        // Sums are made again before their next use.
        let (sums, wanted) = (Vec::new(), Vec::new());
        Self {
            options,
            state,
            velocities,
            alpha,
            accelerations,
            support,
            sums,
            wanted,
            shear,
            weights,
            used,
            fitted,
            time,
        }
    }

    pub fn snapshot(&self) -> FluidSnapshot<D> {
        FluidSnapshot {
            positions: self.state.positions().clone(),
            moves: self.state.moves(),
            velocities: self.velocities.clone(),
            accelerations: self.accelerations.clone(),
            alpha: self.alpha.clone(),
            support: self.support.clone(),
            weights: self.weights.clone(),
            divergence: self.shear.iter().map(|s| s.divergence).collect(),
            used: self.used,
            fitted: self.fitted,
            time: self.time,
        }
    }

    /// Sums, error and accelerations at the present positions and velocities.
    pub fn evaluate(&mut self) {
        self.state.mirror(&self.support);
        let solved = self.state.solve(&self.support, Search::EXACT);
        self.support = parallel::map(solved.len(), |i| solved[i].support);
        self.sums = parallel::map(solved.len(), |i| solved[i].sums);
        self.wanted = self.state.target.number_densities(self.state.positions());
        self.measure();
        self.accelerations = self.ideal_acceleration();
        if self.options.viscosity {
            self.shear = self.shear();
            let signal = 1.0_f64.max(self.largest_speed());
            let shear = &self.shear;
            parallel::update(&mut self.accelerations, |i, a| {
                (0..D).for_each(|k| a[k] += signal * shear[i].drag[k]);
            });
        }
    }

    /// How well the target is resolved about each particle.
    fn weigh(&mut self) {
        if !self.options.hold_unresolved {
            return;
        }
        let (target, positions) = (&self.state.target, self.state.positions());
        let wanted = target.number_densities(positions);
        let sharpness = target.sharpnesses(positions, &wanted, self.state.ratio());
        self.weights = parallel::map(sharpness.len(), |i| resolved(sharpness[i]));
    }

    fn weight(&self, i: usize) -> f64 {
        self.weights.get(i).copied().unwrap_or(1.0)
    }

    fn measure(&mut self) {
        let weights = (!self.weights.is_empty()).then_some(self.weights.as_slice());
        let set = interior(self.state.target.domain, self.state.positions(), &self.support, weights);
        let (sums, factor) = (&self.sums, self.used.factor);
        self.fitted = fit(set.as_deref(), &self.wanted, |i| sums[i].number_density);
        self.used = fit_with(set.as_deref(), &self.wanted, |i| sums[i].number_density, factor);
    }

    fn ideal_acceleration(&self) -> Vec<[f64; D]> {
        let factor = self.used.factor;
        let strength = parallel::map(self.sums.len(), |i| {
            let s = &self.sums[i];
            let omega = if self.options.grad_h { 1.0 + s.slope / (D as f64 * s.number_density) } else { 1.0 };
            self.weight(i) * (s.number_density - self.wanted[i] / factor) / (s.number_density.powi(2) * omega)
        });
        let mut out =
            self.state.gradient(&self.support, &strength, Arrangement::<D, R>::own_gradient(&strength, &self.sums));
        parallel::update(&mut out, |i, a| *a = a.map(|v| -v * self.weight(i)));
        out
    }

    fn shear(&self) -> Vec<Shear<D>> {
        let n = self.velocities.len();
        let velocity: [Vec<f64>; 3] =
            std::array::from_fn(|k| if k < D { self.velocities.iter().map(|v| v[k]).collect() } else { vec![0.0; n] });
        let inverse: Vec<f64> = self.support.iter().map(|h| 1.0 / h).collect();
        let density: Vec<f64> = self.sums.iter().map(|s| s.number_density).collect();
        let channels: [&[f64]; SHEAR_CHANNELS] =
            [&velocity[0], &velocity[1], &velocity[2], &self.alpha, &inverse, &density];
        let (kernel, domain) = (self.state.kernel, &self.state.domain);
        self.state.with_moving_pairs(&self.support, channels, |sources| shear::<D, R>(kernel, domain, sources))
    }

    /// One leapfrog step (kick, drift, kick); friction is integrated exactly. Returns the largest
    /// displacement in spacings.
    pub fn advance(&mut self) -> f64 {
        let smallest = -reduce::max(self.support.len(), |i| -self.support[i]);
        let step = self.options.courant * smallest / (1.0 + self.largest_speed());
        let decay = (-0.5 * self.options.friction * step).exp();
        self.kick(0.5 * step);
        parallel::update(&mut self.velocities, |_, v| *v = v.map(|c| c * decay));
        let largest = self.drift(step);
        if self.options.viscosity {
            self.evolve_alpha(step);
        }
        if self.state.is_stale(SORT_INTERVAL) {
            self.sort();
        }
        self.evaluate();
        parallel::update(&mut self.velocities, |_, v| *v = v.map(|c| c * decay));
        self.kick(0.5 * step);
        self.time += step;
        largest
    }

    fn kick(&mut self, step: f64) {
        let accelerations = &self.accelerations;
        parallel::update(&mut self.velocities, |i, v| (0..D).for_each(|k| v[k] += step * accelerations[i][k]));
    }

    fn drift(&mut self, step: f64) -> f64 {
        let (target, domain, positions) = (&self.state.target, &self.state.domain, self.state.positions());
        let (ratio, support, velocities) = (self.state.ratio(), &self.support, &self.velocities);
        let moved: Vec<([f64; D], [f64; D], f64)> = parallel::map(velocities.len(), |i| {
            let (from, v) = (at(positions, i), velocities[i]);
            let spacing = support[i] / ratio;
            let length = step * v.iter().map(|c| c * c).sum::<f64>().sqrt();
            let limited = if length > MAX_STEP * spacing { MAX_STEP * spacing / length } else { 1.0 };
            let mut straight: [f64; D] = sph::array(|k| from[k] + limited * step * v[k]);
            domain.wrap(&mut straight);
            let mut x = straight;
            domain.confine(&from, &mut x);
            if !(target.admits(&x) && target.keeps_region(&from, &x)) {
                return (from, [0.0; D], 0.0);
            }
            (x, bounce(v, &straight, &x), limited * length / spacing)
        });
        self.state.place(|i| moved[i].0);
        parallel::update(&mut self.velocities, |i, v| *v = moved[i].1);
        reduce::max(moved.len(), |i| moved[i].2)
    }

    /// d alpha/dt = max(0, -div v) - alpha/tau, with the decay integrated exactly.
    fn evolve_alpha(&mut self, step: f64) {
        let (support, shear) = (&self.support, &self.shear);
        parallel::update(&mut self.alpha, |i, a| {
            *a = (*a + step * (-shear[i].divergence).max(0.0)) * (-step / (ALPHA_DECAY * support[i])).exp();
        });
    }

    fn sort(&mut self) {
        let order = self.state.sort();
        self.velocities = parallel::reordered(&self.velocities, &order);
        for values in [&mut self.alpha, &mut self.support] {
            *values = parallel::reordered(values, &order);
        }
        self.weigh();
    }

    pub fn refit_mass(&mut self) {
        self.used = self.fitted;
        self.accelerations = self.ideal_acceleration();
    }

    pub fn halt(&mut self) {
        parallel::update(&mut self.velocities, |_, v| *v = [0.0; D]);
    }

    fn largest_speed(&self) -> f64 {
        reduce::max(self.velocities.len(), |i| self.velocities[i].iter().map(|c| c * c).sum()).max(0.0).sqrt()
    }

    /// Kinetic and internal energy per unit of particle mass, see [`super::conservation`].
    pub fn energy(&self) -> f64 {
        let factor = self.used.factor;
        let internal = |i: usize| {
            let n = self.sums[i].number_density;
            n.ln() + self.wanted[i] / (factor * n)
        };
        self.kinetic_energy() + reduce::sum(self.sums.len(), internal)
    }

    /// Per unit of particle mass.
    pub fn kinetic_energy(&self) -> f64 {
        reduce::sum(self.velocities.len(), |i| 0.5 * self.velocities[i].iter().map(|c| c * c).sum::<f64>())
    }
}

/// The velocity after a wall has turned `straight` into `x`: its component along the correction is reversed.
fn bounce<const D: usize>(velocity: [f64; D], straight: &[f64; D], x: &[f64; D]) -> [f64; D] {
    let shift: [f64; D] = sph::array(|k| x[k] - straight[k]);
    let squared: f64 = shift.iter().map(|s| s * s).sum();
    if squared == 0.0 {
        return velocity;
    }
    let along = (0..D).map(|k| velocity[k] * shift[k]).sum::<f64>() / squared;
    if along < 0.0 { sph::array(|k| velocity[k] - 2.0 * along * shift[k]) } else { velocity }
}
