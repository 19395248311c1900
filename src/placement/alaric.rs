//! ALARIC: isothermal SPH under a fictitious potential that drives the density to its target, with friction,
//! viscosity and velocity stops that bring it to rest (the ALARIC paper, sec. 2).
//!
//! All runs in number densities. With n* the wanted one and kappa = mean(n*/n) the re-fitted particle mass,
//! p_a = n_a - n*_a / kappa and
//!
//! dv_a/dt = -sum_b (p_a/n_a^2 grad W(H_a)/Omega_a + p_b/n_b^2 grad W(H_b)/Omega_b) + viscosity - chi v_a.
//!
//! For equal masses this is the paper's p = c^2 (rho - rho*) divided by the mass. Where masses vary (the
//! resolution is a field apart from the density) it is the same dynamics for the particles' number density:
//! n* is the resolution, masses follow as rho*/n* afterwards, and no force couples particles of different mass.
//!
//! Units: the isothermal sound speed is 1, lengths are in sizes of the domain, so the friction chi and all
//! times are in crossings of the domain whatever the input's units.

use super::arrangement::Arrangement;
use super::fit::{Fit, fit, fit_with, interior};
use super::splitting::{coarse_count, split};
use super::viscosity::{CHANNELS, Shear, shear};
use super::{COINCIDENT, Control, Progress, StageReport, StopReason, part_pairs, relaxation_domain};
use crate::domain::Domain;
use crate::kernel::{KernelName, support_over_spacing};
use crate::neighbors::lanes::Real;
use crate::reduce;
use crate::smoothing::DensitySums;
use crate::target::{Positions, Target, at};
use rayon::prelude::*;
use std::time::Instant;

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
            kernel_neighbors: crate::kernel::default_kernel_neighbors(d),
            friction: 4.0,
            viscosity: true,
            velocity_stops: true,
            growth: 0.1,
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

/// Relaxes `positions` and returns the state with the lowest epsilon met at a stop.
pub fn alaric<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: Positions<D>,
    options: &AlaricOptions,
    control: &Control<'_>,
) -> (Positions<D>, StageReport) {
    // Within the pool, where small passes need not be handed to another thread.
    rayon::scope(|_| run::<D, R>(kernel, target, positions, options, control))
}

fn run<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: Positions<D>,
    options: &AlaricOptions,
    control: &Control<'_>,
) -> (Positions<D>, StageReport) {
    let start = Instant::now();
    let domain = relaxation_domain(target.domain);
    let mut positions = positions;
    part_pairs(target, &mut positions, COINCIDENT);
    let mut fluid = Fluid::<D, R>::new(kernel, target, &domain, positions, options);
    let mut best = (fluid.fitted.epsilon, 0, fluid.state.positions.clone());
    let mut history = vec![fluid.progress(0, 0.0, start)];
    let mut clock = StopClock::new(&domain, options);
    let mut last_stop = (0.0, fluid.fitted.epsilon);
    let mut stop = StopReason::IterationLimit;
    if best.0 <= options.tolerance {
        stop = StopReason::ToleranceReached;
    }
    for step in 1..=options.steps {
        if stop == StopReason::ToleranceReached {
            break;
        }
        let largest = fluid.advance();
        history.push(fluid.progress(step, largest, start));
        control.report("ALARIC", step, options.steps, fluid.fitted.epsilon);
        let outside = control.stop_reason();
        if clock.is_due(fluid.time, fluid.kinetic_energy()) || step == options.steps || outside.is_some() {
            fluid.refit_mass();
            if options.velocity_stops {
                fluid.halt();
            }
            let epsilon = fluid.fitted.epsilon;
            if epsilon < best.0 {
                best = (epsilon, step, fluid.state.positions.clone());
            }
            let rate = (epsilon - last_stop.1).abs() / (fluid.time - last_stop.0);
            last_stop = (fluid.time, epsilon);
            let reason = if epsilon <= options.tolerance {
                Some(StopReason::ToleranceReached)
            } else if rate < options.rate_tolerance {
                Some(StopReason::Stagnated)
            } else {
                outside
            };
            if let Some(reason) = reason {
                stop = reason;
                break;
            }
        }
    }
    let report =
        StageReport { stage: "alaric", stop, best_iteration: best.1, history, seconds: start.elapsed().as_secs_f64() };
    (best.2, report)
}

/// Looser criteria for all but the last stage of splitting: what the children disturb need not be exact.
const COARSE_RATE: f64 = 1e-4;

/// Relaxes few particles first and splits them `splittings` times, to `target.count` in the end (sec. 2.4).
/// `positions` are [`coarse_count`] particles.
pub fn alaric_by_splitting<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    mut positions: Positions<D>,
    splittings: usize,
    options: &AlaricOptions,
    control: &Control<'_>,
) -> (Positions<D>, Vec<StageReport>) {
    let mut reports = Vec::with_capacity(splittings + 1);
    for left in (0..=splittings).rev() {
        let coarse = target.with_count(positions[0].len());
        let rate_tolerance = if left > 0 { options.rate_tolerance.max(COARSE_RATE) } else { options.rate_tolerance };
        let stage = AlaricOptions { rate_tolerance, ..*options };
        let (relaxed, report) = alaric::<D, R>(kernel, &coarse, positions, &stage, control);
        reports.push(report);
        positions = match left {
            0 => relaxed,
            _ => split(&coarse, &relaxed, options.kernel_neighbors, coarse_count(D, target.count, left - 1)),
        };
    }
    (positions, reports)
}

/// When particles are stopped: every tau = min(tau_cross, tau_NE), growing by 1 + theta (sec. 2.3).
struct StopClock {
    crossing: f64,
    growth: f64,
    interval: Option<f64>,
    last: f64,
    energy: f64,
}

impl StopClock {
    fn new<const D: usize>(domain: &Domain<D>, options: &AlaricOptions) -> Self {
        Self { crossing: domain.size(), growth: options.growth, interval: None, last: 0.0, energy: 0.0 }
    }

    /// Whether a stop is due at `time`; the first comes when the kinetic energy falls.
    fn is_due(&mut self, time: f64, energy: f64) -> bool {
        let since = time - self.last;
        let due = match self.interval {
            Some(interval) => since >= interval,
            None => since >= self.crossing || energy < self.energy,
        };
        self.energy = energy;
        if due {
            self.interval = Some((1.0 + self.growth) * self.interval.unwrap_or(since.min(self.crossing)));
            self.last = time;
            self.energy = 0.0;
        }
        due
    }
}

/// The fictitious fluid.
pub(super) struct Fluid<'a, const D: usize, R> {
    pub options: &'a AlaricOptions,
    state: Arrangement<'a, D, R>,
    pub velocities: Vec<[f64; D]>,
    alpha: Vec<f64>,
    pub accelerations: Vec<[f64; D]>,
    support: Vec<f64>,
    sums: Vec<DensitySums<D>>,
    wanted: Vec<f64>,
    shear: Vec<Shear<D>>,
    /// With the particle mass in use, and with the one that fits now.
    used: Fit,
    fitted: Fit,
    time: f64,
}

impl<'a, const D: usize, R: Real> Fluid<'a, D, R> {
    pub fn new(
        kernel: KernelName,
        target: &'a Target<'a, D>,
        domain: &'a Domain<D>,
        positions: Positions<D>,
        options: &'a AlaricOptions,
    ) -> Self {
        let state = Arrangement::new(kernel, target, domain, positions, options.kernel_neighbors);
        let n = state.len();
        let wanted = target.number_densities(&state.positions);
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
            used: unknown,
            fitted: unknown,
            time: 0.0,
        };
        fluid.evaluate();
        fluid
    }

    fn progress(&self, iteration: usize, largest_step: f64, start: Instant) -> Progress {
        Progress { iteration, epsilon: self.fitted.epsilon, largest_step, seconds: start.elapsed().as_secs_f64() }
    }

    /// Sums, error and accelerations at the present positions and velocities.
    fn evaluate(&mut self) {
        self.state.mirror(&self.support);
        let solved = self.state.solve(&self.support);
        self.support = solved.par_iter().map(|s| s.support).collect();
        self.sums = solved.into_par_iter().map(|s| s.sums).collect();
        self.wanted = self.state.target.number_densities(&self.state.positions);
        self.measure();
        self.accelerations = self.ideal_acceleration();
        if self.options.viscosity {
            self.shear = self.shear();
            let signal = 1.0_f64.max(self.largest_speed());
            self.accelerations.par_iter_mut().zip(&self.shear).for_each(|(a, s)| {
                (0..D).for_each(|k| a[k] += signal * s.drag[k]);
            });
        }
    }

    fn measure(&mut self) {
        let set = interior(self.state.target.domain, &self.state.positions, &self.support);
        let (sums, factor) = (&self.sums, self.used.factor);
        self.fitted = fit(set.as_deref(), &self.wanted, |i| sums[i].number_density);
        self.used = fit_with(set.as_deref(), &self.wanted, |i| sums[i].number_density, factor);
    }

    fn ideal_acceleration(&self) -> Vec<[f64; D]> {
        let factor = self.used.factor;
        let strength: Vec<f64> = self
            .sums
            .par_iter()
            .zip(&self.wanted)
            .map(|(s, w)| {
                let omega = if self.options.grad_h { 1.0 + s.slope / (D as f64 * s.number_density) } else { 1.0 };
                (s.number_density - w / factor) / (s.number_density.powi(2) * omega)
            })
            .collect();
        let mut out = self.state.gradient(&self.support, &strength, &self.sums);
        out.par_iter_mut().for_each(|a| *a = a.map(|v| -v));
        out
    }

    fn shear(&self) -> Vec<Shear<D>> {
        let n = self.velocities.len();
        let velocity: [Vec<f64>; 3] =
            std::array::from_fn(|k| if k < D { self.velocities.iter().map(|v| v[k]).collect() } else { vec![0.0; n] });
        let inverse: Vec<f64> = self.support.iter().map(|h| 1.0 / h).collect();
        let density: Vec<f64> = self.sums.iter().map(|s| s.number_density).collect();
        let channels: [&[f64]; CHANNELS] = [&velocity[0], &velocity[1], &velocity[2], &self.alpha, &inverse, &density];
        let (kernel, domain, support) = (self.state.kernel, self.state.domain, &self.support);
        self.state.with_pairs(support, channels, |sources| shear::<D, R>(kernel, domain, sources, support))
    }

    /// One leapfrog step (kick, drift, kick); friction is integrated exactly. Returns the largest
    /// displacement in spacings.
    pub fn advance(&mut self) -> f64 {
        let smallest = -reduce::max(self.support.len(), |i| -self.support[i]);
        let step = self.options.courant * smallest / (1.0 + self.largest_speed());
        let decay = (-0.5 * self.options.friction * step).exp();
        self.kick(0.5 * step);
        self.velocities.par_iter_mut().for_each(|v| *v = v.map(|c| c * decay));
        let largest = self.drift(step);
        if self.options.viscosity {
            self.evolve_alpha(step);
        }
        if self.state.is_stale() {
            self.sort();
        }
        self.evaluate();
        self.velocities.par_iter_mut().for_each(|v| *v = v.map(|c| c * decay));
        self.kick(0.5 * step);
        self.time += step;
        largest
    }

    fn kick(&mut self, step: f64) {
        self.velocities.par_iter_mut().zip(&self.accelerations).for_each(|(v, a)| {
            (0..D).for_each(|k| v[k] += step * a[k]);
        });
    }

    fn drift(&mut self, step: f64) -> f64 {
        let (target, domain, positions) = (self.state.target, self.state.domain, &self.state.positions);
        let ratio = support_over_spacing(D, self.options.kernel_neighbors);
        let support = &self.support;
        let moved: Vec<([f64; D], [f64; D], f64)> = self
            .velocities
            .par_iter()
            .enumerate()
            .map(|(i, &v)| {
                let from = at(positions, i);
                let spacing = support[i] / ratio;
                let length = step * v.iter().map(|c| c * c).sum::<f64>().sqrt();
                let limited = if length > MAX_STEP * spacing { MAX_STEP * spacing / length } else { 1.0 };
                let mut straight: [f64; D] = std::array::from_fn(|k| from[k] + limited * step * v[k]);
                domain.wrap(&mut straight);
                let mut x = straight;
                domain.confine(&from, &mut x);
                if !target.admits(&x) {
                    return (from, [0.0; D], 0.0);
                }
                (x, bounce(v, &straight, &x), limited * length / spacing)
            })
            .collect();
        for k in 0..D {
            self.state.positions[k].par_iter_mut().zip(&moved).for_each(|(x, m)| *x = m.0[k]);
        }
        self.velocities.par_iter_mut().zip(&moved).for_each(|(v, m)| *v = m.1);
        self.state.moved();
        reduce::max(moved.len(), |i| moved[i].2)
    }

    /// d alpha/dt = max(0, -div v) - alpha/tau, with the decay integrated exactly.
    fn evolve_alpha(&mut self, step: f64) {
        let support = &self.support;
        self.alpha.par_iter_mut().zip(&self.shear).zip(support).for_each(|((a, s), h)| {
            *a = (*a + step * (-s.divergence).max(0.0)) * (-step / (ALPHA_DECAY * h)).exp();
        });
    }

    fn sort(&mut self) {
        let order = self.state.sort();
        let reorder = |values: &mut Vec<[f64; D]>| *values = order.par_iter().map(|&i| values[i as usize]).collect();
        reorder(&mut self.velocities);
        let scalar = |values: &mut Vec<f64>| *values = order.par_iter().map(|&i| values[i as usize]).collect();
        scalar(&mut self.alpha);
        scalar(&mut self.support);
    }

    fn refit_mass(&mut self) {
        self.used = self.fitted;
        self.accelerations = self.ideal_acceleration();
    }

    fn halt(&mut self) {
        self.velocities.par_iter_mut().for_each(|v| *v = [0.0; D]);
    }

    fn largest_speed(&self) -> f64 {
        reduce::max(self.velocities.len(), |i| self.velocities[i].iter().map(|c| c * c).sum()).max(0.0).sqrt()
    }

    /// Per unit of particle mass.
    fn kinetic_energy(&self) -> f64 {
        reduce::sum(self.velocities.len(), |i| 0.5 * self.velocities[i].iter().map(|c| c * c).sum::<f64>())
    }
}

/// The velocity after a wall has turned `straight` into `x`: its component along the correction is reversed.
fn bounce<const D: usize>(velocity: [f64; D], straight: &[f64; D], x: &[f64; D]) -> [f64; D] {
    let shift: [f64; D] = std::array::from_fn(|k| x[k] - straight[k]);
    let squared: f64 = shift.iter().map(|s| s * s).sum();
    if squared == 0.0 {
        return velocity;
    }
    let along = (0..D).map(|k| velocity[k] * shift[k]).sum::<f64>() / squared;
    if along < 0.0 { std::array::from_fn(|k| velocity[k] - 2.0 * along * shift[k]) } else { velocity }
}
