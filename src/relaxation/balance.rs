//! Balance of the pressure force: moves particles until the SPH acceleration of the target code cancels gravity.
//!
//! The force is that of standard SPH with grad-h terms (Springel & Hernquist 2002, MNRAS 333, 649, eq. 8; the
//! density-energy form of GADGET, Phantom and SWIFT):
//!
//! a_i = -sum_j m_j (P_i/(Omega_i rho_i^2) grad W_ij(H_i) + P_j/(Omega_j rho_j^2) grad W_ij(H_j)).
//!
//! With P_i = A_i rho_i^gamma and A_i held by the particle it is minus the gradient of the internal energy, and
//! an arrangement at rest is a minimum of that energy and the potential together, found by L-BFGS over the
//! positions. A_i = P*/rho*^gamma is taken anew from the target between stages. The internal energy that comes
//! out, u_i = A_i rho_i^(gamma-1)/(gamma-1) with the summed density, gives the target code the very pressures
//! that were balanced, and each particle then keeps its A_i there too, so that what is at rest stays at rest.
//!
//! A summed density is off by a constant factor (self-term, about 1 %), and so is the force: one common factor on
//! all A_i, fitted to gravity over the interior, takes that out instead of letting the body swell or shrink.
//!
//! Line searches use slopes alone (no potential is needed, so any field may be balanced). At an open edge there
//! is vacuum, as in the target code; particles do not leave the domain.

use super::arrangement::Arrangement;
use super::fit::{fit, interior};
use super::lbfgs::{Lbfgs, product};
use super::{Control, Progress, StageReport, StopReason};
use crate::target::{Equilibrium, Positions, Target, at};
use rayon::prelude::*;
use sph::domain::Wall;
use sph::kernel::KernelName;
use sph::lanes::Real;
use sph::reduce;
use sph::sums::DensitySums;
use std::time::Instant;

/// Parameters of the balance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BalanceOptions {
    /// N_H = V_d n H^d.
    pub kernel_neighbors: f64,
    /// Evaluations of the force, at most.
    pub evaluations: usize,
}

impl BalanceOptions {
    /// The defaults in `d` dimensions.
    pub fn new(d: usize) -> Self {
        Self { kernel_neighbors: sph::kernel::default_kernel_neighbors(d), evaluations: 200 }
    }
}

/// What a balance comes to.
pub struct Balanced<const D: usize> {
    pub positions: Positions<D>,
    /// Specific internal energy of each particle.
    pub internal_energy: Vec<f64>,
    /// The common factor on A_i; 1 where it is no matter of a few percent.
    pub factor: f64,
    /// The factor that gravity asked for.
    pub wanted_factor: f64,
    pub report: StageReport,
}

/// Share of the evaluations after which A_i is taken anew.
const STAGES: [f64; 3] = [0.25, 0.5, 1.0];
/// No particle moves farther in a step, in its own spacing.
const MAX_STEP: f64 = 0.2;
/// Largest move of the first step of a stage, along the force.
const FIRST_STEP: f64 = 0.02;
/// A step is taken where the slope behind it is at most this fraction of the one before it.
const CURVATURE: f64 = 0.5;
const MAX_TRIALS: usize = 5;
/// Within this many spacings of an open edge no force pushes outward: there is nowhere to go.
const EDGE: f64 = 0.1;
/// A factor on A_i farther from 1 is no bias of the sums, but a pressure that does not hold the body.
const LARGEST_BIAS: f64 = 0.1;
/// Pressures below this fraction of the largest P/n do not stretch steps further.
const COLDEST: f64 = 1e-6;
/// Step of the differences of a field that holds the pressure, in spacings.
const GRADIENT_STEP: f64 = 1e-3;

/// Moves `positions` (equal masses) towards balance. The state with the smallest force error comes out.
pub fn balance_pressure<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    equilibrium: &dyn Equilibrium<D>,
    positions: Positions<D>,
    options: &BalanceOptions,
    control: &Control<'_>,
) -> Balanced<D> {
    let start = Instant::now();
    let arrangement = Arrangement::<D, R>::new(kernel, target, target.domain, positions, options.kernel_neighbors);
    let mut balance = Balance::new(arrangement, equilibrium, options, control);
    let mut stop = StopReason::IterationLimit;
    for share in STAGES {
        stop = balance.stage((share * options.evaluations as f64).ceil() as usize);
        if matches!(stop, StopReason::TimeLimit | StopReason::Interrupted) {
            break;
        }
    }
    let Balance { best, history, factor, wanted_factor, .. } = balance;
    let report = StageReport {
        stage: "balance",
        stop,
        best_iteration: best.iteration,
        history,
        seconds: start.elapsed().as_secs_f64(),
    };
    Balanced { positions: best.positions, internal_energy: best.internal_energy, factor, wanted_factor, report }
}

pub(super) struct Balance<'a, const D: usize, R> {
    pub arrangement: Arrangement<'a, D, R>,
    equilibrium: &'a dyn Equilibrium<D>,
    options: &'a BalanceOptions,
    control: &'a Control<'a>,
    start: Instant,
    mass: f64,
    factor: f64,
    wanted_factor: f64,
    history: Vec<Progress>,
    evaluations: usize,
    best: Best<D>,
}

/// The best state so far.
struct Best<const D: usize> {
    positions: Positions<D>,
    internal_energy: Vec<f64>,
    iteration: usize,
    error: f64,
}

/// What is held within a stage.
pub(super) struct Frame {
    /// A_i with the common factor.
    pub entropy: Vec<f64>,
    spacing: Vec<f64>,
    /// Unit of each particle's moves: longer where the fluid is cold, so that all respond alike.
    pub unit: Vec<f64>,
    /// Largest P/n, which makes gradients dimensionless.
    temperature: f64,
}

/// Forces at one arrangement.
pub(super) struct Evaluation<const D: usize> {
    support: Vec<f64>,
    sums: Vec<DensitySums<D>>,
    /// Acceleration of the pressure.
    pub pressure_force: Vec<[f64; D]>,
    gravity: Vec<[f64; D]>,
    /// Minus the net force in units of each particle's moves.
    pub gradient: Vec<[f64; D]>,
    error: f64,
}

impl<'a, const D: usize, R: Real> Balance<'a, D, R> {
    pub fn new(
        arrangement: Arrangement<'a, D, R>,
        equilibrium: &'a dyn Equilibrium<D>,
        options: &'a BalanceOptions,
        control: &'a Control<'a>,
    ) -> Self {
        let target = arrangement.target;
        let best = Best {
            positions: arrangement.positions.clone(),
            internal_energy: Vec::new(),
            iteration: 0,
            error: f64::INFINITY,
        };
        Self {
            mass: target.mass / target.count as f64,
            arrangement,
            equilibrium,
            options,
            control,
            start: Instant::now(),
            factor: 1.0,
            wanted_factor: 1.0,
            history: Vec::new(),
            evaluations: 0,
            best,
        }
    }

    fn stage(&mut self, end: usize) -> StopReason {
        self.arrangement.sort();
        let mut frame = self.frame();
        let guess = self.arrangement.target_supports();
        let mut now = self.evaluate(&frame, &guess);
        if self.equilibrium.has_gravity() {
            self.refit(&mut frame, &now);
            now = self.evaluate(&frame, &guess);
        }
        self.note(&frame, &now, 0.0);
        let mut memory = Lbfgs::new();
        loop {
            if let Some(reason) = self.control.stop_reason() {
                return reason;
            }
            if self.evaluations >= end {
                return StopReason::IterationLimit;
            }
            let mut direction = memory.direction(&now.gradient);
            if !(product(&direction, &now.gradient) < 0.0) {
                memory.clear();
                direction = memory.direction(&now.gradient);
            }
            let longest = self.longest(&frame, &direction);
            if !(longest > 0.0 && longest.is_finite()) {
                return StopReason::Stagnated;
            }
            let first = if memory.is_empty() { FIRST_STEP / longest } else { (MAX_STEP / longest).min(1.0) };
            let Some((next, step)) = self.search(&frame, &now, &direction, first) else {
                if memory.is_empty() {
                    return StopReason::Stagnated;
                }
                memory.clear();
                continue;
            };
            memory.push(&step, &now.gradient, &next.gradient);
            now = next;
            let length = self.longest(&frame, &step);
            self.note(&frame, &now, length);
        }
    }

    /// Goes along `direction` and back until the slope behind the step is small or still descends.
    fn search(
        &mut self,
        frame: &Frame,
        now: &Evaluation<D>,
        direction: &[[f64; D]],
        first: f64,
    ) -> Option<(Evaluation<D>, Vec<[f64; D]>)> {
        let from = self.arrangement.positions.clone();
        let mut t = first;
        for _ in 0..MAX_TRIALS {
            let step = self.arrangement.displace(&from, direction, t, &frame.unit, &frame.spacing, MAX_STEP);
            let next = self.evaluate(frame, &now.support);
            let (before, after) = (product(&step, &now.gradient), product(&step, &next.gradient));
            if after <= CURVATURE * before.abs() {
                return Some((next, step));
            }
            t *= (before / (before - after)).clamp(0.1, 0.7);
        }
        self.arrangement.positions = from;
        self.arrangement.moved();
        None
    }

    /// Takes A_i from the target at the particles' positions.
    pub fn frame(&self) -> Frame {
        let (target, positions, gamma) =
            (self.arrangement.target, &self.arrangement.positions, self.equilibrium.gamma());
        let wanted = target.number_densities(positions);
        let spacing: Vec<f64> =
            wanted.par_iter().map(|&w| target.spacing(w).min(self.arrangement.domain.size())).collect();
        let pressure: Vec<f64> =
            (0..wanted.len()).into_par_iter().map(|i| self.equilibrium.pressure(&at(positions, i))).collect();
        let temperature = reduce::max(wanted.len(), |i| pressure[i] / wanted[i]);
        let unit = (0..wanted.len())
            .into_par_iter()
            .map(|i| spacing[i] * (pressure[i] / wanted[i] / temperature).max(COLDEST).powf(-0.5))
            .collect();
        let entropy = (0..wanted.len())
            .into_par_iter()
            .map(|i| self.factor * pressure[i] / (self.mass * wanted[i]).powf(gamma))
            .collect();
        Frame { entropy, spacing, unit, temperature }
    }

    /// The common factor on A_i with which the pressure holds gravity over the interior.
    fn refit(&mut self, frame: &mut Frame, now: &Evaluation<D>) {
        let set = self.interior(now);
        let over = |f: &(dyn Fn(usize) -> f64 + Sync)| {
            reduce::sum(now.gravity.len(), |i| if set.as_ref().is_none_or(|s| s[i]) { f(i) } else { 0.0 })
        };
        let pull = over(&|i| dot(&now.gravity[i], &now.gravity[i]));
        let push = over(&|i| -dot(&now.gravity[i], &now.pressure_force[i]));
        let change = pull / push;
        self.wanted_factor = self.factor * change;
        if change.is_finite() && (self.wanted_factor - 1.0).abs() < LARGEST_BIAS {
            self.factor = self.wanted_factor;
            frame.entropy.par_iter_mut().for_each(|a| *a *= change);
        }
    }

    fn interior(&self, now: &Evaluation<D>) -> Option<Vec<bool>> {
        interior(self.arrangement.target.domain, &self.arrangement.positions, &now.support, None)
    }

    pub fn evaluate(&mut self, frame: &Frame, guess: &[f64]) -> Evaluation<D> {
        self.evaluations += 1;
        let (d, gamma, mass) = (D as f64, self.equilibrium.gamma(), self.mass);
        if self.arrangement.domain.region.wall() == Some(Wall::Reflecting) {
            self.arrangement.mirror(guess);
        }
        let (support, sums): (Vec<f64>, Vec<DensitySums<D>>) =
            self.arrangement.solve(guess).into_par_iter().map(|s| (s.support, s.sums)).unzip();
        let strength: Vec<f64> = sums
            .par_iter()
            .zip(&frame.entropy)
            .map(|(s, a)| {
                let grad_h = 1.0 + s.slope / (d * s.number_density);
                a * (mass * s.number_density).powf(gamma) / (s.number_density.powi(2) * grad_h)
            })
            .collect();
        let energy_gradient = self.arrangement.gradient(&support, &strength, &sums);
        let positions = &self.arrangement.positions;
        let pressure_force: Vec<[f64; D]> = energy_gradient.into_par_iter().map(|g| g.map(|v| -v / mass)).collect();
        let gravity: Vec<[f64; D]> = (0..sums.len())
            .into_par_iter()
            .map(|i| self.equilibrium.gravity(&at(positions, i), GRADIENT_STEP * frame.spacing[i]))
            .collect();
        let gradient = (0..sums.len())
            .into_par_iter()
            .map(|i| {
                let net: [f64; D] = std::array::from_fn(|k| pressure_force[i][k] + gravity[i][k]);
                let scale = -mass * frame.unit[i] / frame.temperature;
                if self.is_held(&at(positions, i), &net, frame.spacing[i]) { [0.0; D] } else { net.map(|f| scale * f) }
            })
            .collect();
        let mut now = Evaluation { support, sums, pressure_force, gravity, gradient, error: 0.0 };
        now.error = self.error(frame, &now);
        now
    }

    /// Whether a particle at an open edge is pushed outward.
    fn is_held(&self, x: &[f64; D], force: &[f64; D], spacing: f64) -> bool {
        let domain = self.arrangement.domain;
        let depth = domain.distance_to_edge(x);
        if depth >= EDGE * spacing {
            return false;
        }
        let length = force.iter().map(|f| f * f).sum::<f64>().sqrt();
        let ahead: [f64; D] = std::array::from_fn(|k| x[k] + 0.5 * depth * force[k] / length);
        !(domain.distance_to_edge(&ahead) > depth)
    }

    /// Mean |a + g| / |g| over the interior; without gravity mean |a| rho spacing / P.
    fn error(&self, frame: &Frame, now: &Evaluation<D>) -> f64 {
        let set = self.interior(now);
        let counts = |i: usize| set.as_ref().is_none_or(|s| s[i]);
        let gravity = self.equilibrium.has_gravity();
        let gamma = self.equilibrium.gamma();
        let error = |i: usize| {
            let net: [f64; D] = std::array::from_fn(|k| now.pressure_force[i][k] + now.gravity[i][k]);
            let density = self.mass * now.sums[i].number_density;
            let unit = if gravity {
                dot(&now.gravity[i], &now.gravity[i]).sqrt()
            } else {
                frame.entropy[i] * density.powf(gamma - 1.0) / frame.spacing[i]
            };
            if unit > 0.0 { dot(&net, &net).sqrt() / unit } else { 0.0 }
        };
        let n = now.sums.len();
        let total = reduce::sum(n, |i| if counts(i) { error(i) } else { 0.0 });
        total / (0..n).into_par_iter().filter(|&i| counts(i)).count().max(1) as f64
    }

    fn longest(&self, frame: &Frame, v: &[[f64; D]]) -> f64 {
        reduce::max(v.len(), |i| (frame.unit[i] / frame.spacing[i]).powi(2) * dot(&v[i], &v[i])).max(0.0).sqrt()
    }

    fn note(&mut self, frame: &Frame, now: &Evaluation<D>, length: f64) {
        let gamma = self.equilibrium.gamma();
        let wanted = self.arrangement.target.number_densities(&self.arrangement.positions);
        let epsilon = fit(self.interior(now).as_deref(), &wanted, |i| now.sums[i].number_density).epsilon;
        if now.error < self.best.error {
            self.best = Best {
                positions: self.arrangement.positions.clone(),
                internal_energy: (0..now.sums.len())
                    .into_par_iter()
                    .map(|i| {
                        let density = self.mass * now.sums[i].number_density;
                        frame.entropy[i] * density.powf(gamma - 1.0) / (gamma - 1.0)
                    })
                    .collect(),
                iteration: self.evaluations,
                error: now.error,
            };
        }
        self.history.push(Progress {
            iteration: self.evaluations,
            epsilon,
            force_error: Some(now.error),
            largest_step: length,
            seconds: self.start.elapsed().as_secs_f64(),
        });
        self.control.report("balance", self.evaluations, self.options.evaluations, now.error);
    }
}

fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (0..D).map(|k| a[k] * b[k]).sum()
}
