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
//! Gravity is what the particles attract each other with where the body holds itself, as in the target code, else the
//! target's. Summed densities are off by the self-contribution, about 1 %, and so is the force; the mass within a particle's
//! radius is not quite the target's. A factor on A_i that depends smoothly on the enclosed mass (one common factor where nothing
//! is radial), fitted to gravity over the interior, takes that out instead of letting the body swell or shrink.
//!
//! Line searches use slopes alone (no potential is needed, so any field may be balanced). At an open edge there
//! is vacuum, as in the target code; particles leave the domain only where the body holds itself, and find their places
//! beyond its surface as they would in the code.

use super::arrangement::Arrangement;
use super::fit::{fit, interior};
use super::lbfgs::{Lbfgs, product};
use super::report::{Progress, StageName, StageReport, StopReason};
use super::snapshot::{Check, Trace, axes, decode, encode, rows};
use super::stage::{Particles, Relaxed, Running, Stage};
use super::thermal::{Basis, Factor, enclosed_fractions};
use crate::target::{Equilibrium, Positions, Target, at};
use serde::{Deserialize, Serialize};
use sph::domain::{Domain, Region, Wall};
use sph::gravity::{OPENING_ANGLE, gravity, softening_radius};
use sph::kernel::KernelName;
use sph::lanes::Real;
use sph::sums::DensitySums;
use sph::{parallel, reduce};

pub const NAME: StageName = StageName { name: "balance", title: "balance" };

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

/// Shares of the evaluations after which A_i, and gravity, are taken anew.
const SHARES: [f64; 5] = [0.1, 0.2, 0.4, 0.7, 1.0];
/// No particle moves farther in a step, in its own spacing.
const MAX_STEP: f64 = 0.2;
/// Largest move of the first step of a stage, along the force.
const FIRST_STEP: f64 = 0.02;
/// A step is taken where the slope behind it is at most this fraction of the one before it.
const CURVATURE: f64 = 0.5;
const MAX_TRIALS: usize = 5;
/// Within this many spacings of an open edge no force pushes outward: there is nowhere to go.
const EDGE: f64 = 0.1;
/// Radius of what is there for a body that holds itself, in the body's own.
const SPACE: f64 = 2.0;
/// What is nearer to the surface of a body than this part of its radius takes its state from there.
const SKIN: f64 = 1e-3;
/// A factor on A_i farther from 1 is no bias of the sums, but a pressure that does not hold the body.
const LARGEST_BIAS: f64 = 0.1;
/// Pressures below this fraction of the largest P/n do not stretch steps further.
const COLDEST: f64 = 1e-6;
/// Step of the differences of a field that holds the pressure, in spacings.
const GRADIENT_STEP: f64 = 1e-3;

/// The stage: moves particles of equal mass towards balance. The state with the smallest force error comes out, with the
/// internal energy that each particle needs there. Pair distances are in single precision.
pub struct PressureBalance<'a, const D: usize> {
    pub kernel: KernelName,
    pub target: Target<'a, D>,
    pub equilibrium: &'a dyn Equilibrium<D>,
    pub options: BalanceOptions,
}

impl<const D: usize> Stage<D> for PressureBalance<'_, D> {
    fn name(&self) -> StageName {
        NAME
    }

    fn begin(&self, particles: Particles<D>) -> Box<dyn Running<D> + '_> {
        let (positions, neighbors) = (particles.positions, self.options.kernel_neighbors);
        let space = self.space();
        let arrangement = Arrangement::<D, f32>::new(self.kernel, self.target, space, positions, neighbors);
        let mut balance = Balance::new(arrangement, self.equilibrium);
        let descent = balance.descend();
        Box::new(Run { options: &self.options, balance, share: 0, descent })
    }

    fn resume(&self, kept: &[u8]) -> Result<Box<dyn Running<D> + '_>, String> {
        let kept: Snapshot<D> = decode(kept)?;
        kept.check(self.target.count)?;
        let Snapshot { share, positions, moves, descent, factor, fitted_factor, evaluations, best, trace } = kept;
        let (space, neighbors) = (self.space(), self.options.kernel_neighbors);
        let arrangement =
            Arrangement::<D, f32>::of_sorted(self.kernel, self.target, space, positions, moves, neighbors);
        let trace = trace.resumed();
        let balance =
            Balance { factor, fitted_factor, evaluations, best, trace, ..Balance::new(arrangement, self.equilibrium) };
        Ok(Box::new(Run { options: &self.options, balance, share, descent }))
    }
}

impl<const D: usize> PressureBalance<'_, D> {
    /// Where particles may go: as far as they like from a body that holds itself in vacuum, else not out of the domain.
    fn space(&self) -> Domain<D> {
        let domain = self.target.domain;
        match &domain.region {
            Region::Ball { center, radius, wall: Wall::Open, .. } if self.equilibrium.own_center().is_some() => {
                Domain::ball(*center, SPACE * radius, Wall::Open).unwrap_or_else(|_| domain.clone())
            }
            _ => domain.clone(),
        }
    }
}

/// What goes on after an interrupt.
#[derive(Serialize, Deserialize)]
struct Snapshot<const D: usize> {
    /// In [`SHARES`].
    share: usize,
    #[serde(with = "axes")]
    positions: Positions<D>,
    moves: usize,
    descent: Descent<D>,
    factor: Factor,
    fitted_factor: Factor,
    evaluations: usize,
    best: Best<D>,
    trace: Trace,
}

impl<const D: usize> Snapshot<D> {
    /// # Errors
    /// What is wrong with it for `count` particles.
    fn check(&self, count: usize) -> Result<(), String> {
        let Descent { frame, support, gradient, memory } = &self.descent;
        Check::new(count)
            .holds(self.share < SHARES.len(), "is of a part of the balance that this run does not have")
            .positions("positions", &self.positions)
            .positions("the best positions", &self.best.positions)
            .scalars("the best internal energies", &self.best.internal_energy)
            .scalars("entropies", &frame.entropy)
            .scalars("factors", &frame.factor)
            .holds(
                frame.own.as_ref().is_none_or(|g| g.len() == count * D),
                "has gravity of another number of particles",
            )
            .scalars("spacings", &frame.spacing)
            .scalars("units", &frame.unit)
            .scalars("support radii", support)
            .vectors("the gradient", gradient)
            .holds(memory.is_of(count), "has another number of gradients than of particles")
            .result()
    }
}

/// The stage under way.
struct Run<'a, const D: usize> {
    options: &'a BalanceOptions,
    balance: Balance<'a, D, f32>,
    /// In [`SHARES`].
    share: usize,
    descent: Descent<D>,
}

impl<const D: usize> Running<D> for Run<'_, D> {
    fn advance(&mut self, outside: Option<StopReason>) -> Option<StopReason> {
        if outside.is_some() {
            return outside;
        }
        let end = (SHARES[self.share] * self.options.evaluations as f64).ceil() as usize;
        let stop = self.balance.advance(&mut self.descent, end)?;
        self.share += 1;
        if self.share == SHARES.len() {
            return Some(stop);
        }
        self.descent = self.balance.descend();
        None
    }

    fn progress(&self) -> (&[Progress], usize) {
        (&self.balance.trace.history, self.options.evaluations)
    }

    fn snapshot(&self, to: Vec<u8>) -> Result<Vec<u8>, String> {
        let balance = &self.balance;
        encode(
            &Snapshot {
                share: self.share,
                positions: balance.arrangement.positions.clone(),
                moves: balance.arrangement.moves(),
                descent: self.descent.clone(),
                factor: balance.factor.clone(),
                fitted_factor: balance.fitted_factor.clone(),
                evaluations: balance.evaluations,
                best: balance.best.clone(),
                trace: balance.trace.kept(),
            },
            to,
        )
    }

    fn finish(self: Box<Self>, stop: StopReason) -> Relaxed<D> {
        let Balance { best, trace, factor, fitted_factor, .. } = self.balance;
        let (best_iteration, seconds) = (best.iteration, trace.seconds());
        let report = StageReport { stage: NAME, stop, best_iteration, history: trace.history, seconds };
        let particles =
            Particles { positions: best.positions, masses: None, internal_energy: Some(best.internal_energy) };
        Relaxed { particles, reports: vec![report], notes: vec![factor_note(&factor, &fitted_factor)] }
    }
}

fn factor_note(factor: &Factor, fitted: &Factor) -> String {
    if factor == fitted {
        return format!("internal energies are the target's times {factor}: with it the pressure force holds gravity");
    }
    format!(
        "the pressure would have to be {fitted} times the target's to hold gravity; it is left as it is, \
         and what comes out is a body that settles: check the input's pressure, units and balance.constant"
    )
}

/// What the stage works on.
pub(super) struct Balance<'a, const D: usize, R> {
    pub arrangement: Arrangement<'a, D, R>,
    equilibrium: &'a dyn Equilibrium<D>,
    mass: f64,
    /// The factor on A_i; 1 where it is no matter of a few percent.
    factor: Factor,
    /// The factor that gravity asks for.
    fitted_factor: Factor,
    evaluations: usize,
    best: Best<D>,
    trace: Trace,
}

/// The best state so far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Best<const D: usize> {
    #[serde(with = "axes")]
    positions: Positions<D>,
    internal_energy: Vec<f64>,
    iteration: usize,
    error: f64,
}

/// What is held until A_i is taken anew.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Frame {
    /// A_i with the factor, and the factor.
    pub entropy: Vec<f64>,
    factor: Vec<f64>,
    /// Share of the mass nearer to the center of a body that its own gravity holds.
    fraction: Option<Vec<f64>>,
    /// Per particle, what all others attract it with beyond the target's g: it changes little as particles move.
    own: Option<Vec<f64>>,
    spacing: Vec<f64>,
    /// Unit of each particle's moves: longer where the fluid is cold, so that all respond alike.
    pub unit: Vec<f64>,
    /// Largest P/n, which makes gradients dimensionless.
    temperature: f64,
}

/// A descent under way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Descent<const D: usize> {
    frame: Frame,
    memory: Lbfgs<D>,
    support: Vec<f64>,
    #[serde(with = "rows")]
    gradient: Vec<[f64; D]>,
}

/// Forces at one arrangement.
pub(super) struct Evaluation<const D: usize> {
    support: Vec<f64>,
    sums: Vec<DensitySums<D>>,
    strength: Vec<f64>,
    /// Acceleration of the pressure.
    pub pressure_force: Vec<[f64; D]>,
    gravity: Vec<[f64; D]>,
    /// Minus the net force in units of each particle's moves.
    pub gradient: Vec<[f64; D]>,
    error: f64,
}

impl<'a, const D: usize, R: Real> Balance<'a, D, R> {
    pub fn new(mut arrangement: Arrangement<'a, D, R>, equilibrium: &'a dyn Equilibrium<D>) -> Self {
        arrangement.leaves_target = arrangement.domain.size() > arrangement.target.domain.size();
        let best = Best {
            positions: arrangement.positions.clone(),
            internal_energy: Vec::new(),
            iteration: 0,
            error: f64::INFINITY,
        };
        Self {
            mass: arrangement.target.mass / arrangement.target.count as f64,
            arrangement,
            equilibrium,
            factor: Factor::one(),
            fitted_factor: Factor::one(),
            evaluations: 0,
            best,
            trace: Trace::new(),
        }
    }

    /// Takes A_i anew and begins a descent with it.
    fn descend(&mut self) -> Descent<D> {
        self.arrangement.sort();
        let mut frame = self.frame();
        let guess = self.arrangement.target_supports();
        let mut now = self.evaluate(&frame, &guess);
        if self.equilibrium.has_gravity() {
            self.refit(&mut frame, &now);
            now = self.evaluate(&frame, &guess);
        }
        self.note(&frame, &now, 0.0);
        Descent { frame, memory: Lbfgs::new(), support: now.support, gradient: now.gradient }
    }

    /// One step of a descent that may make evaluations up to `end`; why it ends, if it does.
    fn advance(&mut self, descent: &mut Descent<D>, end: usize) -> Option<StopReason> {
        if self.evaluations >= end {
            return Some(StopReason::IterationLimit);
        }
        loop {
            let Descent { frame, memory, support, gradient } = descent;
            let mut direction = memory.direction(gradient);
            if !(product(&direction, gradient) < 0.0) {
                memory.clear();
                direction = memory.direction(gradient);
            }
            let longest = self.longest(frame, &direction);
            if !(longest > 0.0 && longest.is_finite()) {
                return Some(StopReason::Stagnated);
            }
            let first = if memory.is_empty() { FIRST_STEP / longest } else { (MAX_STEP / longest).min(1.0) };
            let Some((next, step)) = self.search(frame, (support, gradient), &direction, first) else {
                if memory.is_empty() {
                    return Some(StopReason::Stagnated);
                }
                memory.clear();
                if self.evaluations >= end {
                    return Some(StopReason::IterationLimit);
                }
                continue;
            };
            memory.push(&step, gradient, &next.gradient);
            let length = self.longest(frame, &step);
            self.note(frame, &next, length);
            (*support, *gradient) = (next.support, next.gradient);
            return None;
        }
    }

    /// Goes along `direction` and back until the slope behind the step is small or still descends.
    fn search(
        &mut self,
        frame: &Frame,
        (support, gradient): (&[f64], &[[f64; D]]),
        direction: &[[f64; D]],
        first: f64,
    ) -> Option<(Evaluation<D>, Vec<[f64; D]>)> {
        let from = self.arrangement.positions.clone();
        let mut t = first;
        for _ in 0..MAX_TRIALS {
            let step = self.arrangement.displace(&from, direction, t, &frame.unit, &frame.spacing, MAX_STEP);
            let next = self.evaluate(frame, support);
            let (before, after) = (product(&step, gradient), product(&step, &next.gradient));
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
            (&self.arrangement.target, &self.arrangement.positions, self.equilibrium.gamma());
        let n = self.arrangement.len();
        let place = parallel::map(n, |i| self.inside(&at(positions, i)));
        let density = parallel::map(n, |i| target.number_density(&place[i]));
        let spacing = parallel::map(n, |i| target.spacing(density[i]).min(target.domain.size()));
        let pressure = parallel::map(n, |i| self.equilibrium.pressure(&place[i]));
        let temperature = reduce::max(n, |i| pressure[i] / density[i]);
        let unit = parallel::map(n, |i| spacing[i] * (pressure[i] / density[i] / temperature).max(COLDEST).powf(-0.5));
        let fraction = self.equilibrium.own_center().map(|center| enclosed_fractions(positions, &center));
        let basis = Basis::new(fraction.as_deref());
        let factor = parallel::map(n, |i| basis.sum(&self.factor, i));
        let entropy = parallel::map(n, |i| factor[i] * pressure[i] / (self.mass * density[i]).powf(gamma));
        let own = self.own_gravity(&spacing);
        Frame { entropy, factor, fraction, own, spacing, unit, temperature }
    }

    /// Where the target says what a particle at `x` is like: `x`, or a place within the surface that it is beyond.
    fn inside(&self, x: &[f64; D]) -> [f64; D] {
        let Some(center) = self.equilibrium.own_center().filter(|_| self.arrangement.leaves_target) else { return *x };
        let depth = self.arrangement.target.domain.distance_to_edge(x);
        let radius = 0.5 * self.arrangement.target.domain.size();
        if depth >= SKIN * radius {
            return *x;
        }
        let share = (1.0 - SKIN) * radius / (radius - depth);
        std::array::from_fn(|k| center[k] + share * (x[k] - center[k]))
    }

    /// The factor on A_i with which the pressure holds gravity over the interior: one for all, or a smooth function of the
    /// enclosed mass for a body that its own gravity holds.
    fn refit(&mut self, frame: &mut Frame, now: &Evaluation<D>) {
        let set = self.interior(now);
        let basis = Basis::new(frame.fraction.as_deref());
        let forces: Vec<Vec<[f64; D]>> = (0..basis.len())
            .map(|k| {
                let strength = parallel::map(now.sums.len(), |i| basis.value(k, i) * now.strength[i] / frame.factor[i]);
                self.pressure_force(&now.support, &strength, &now.sums)
            })
            .collect();
        let Some(fitted) = basis.fitted(&forces, &now.gravity, set.as_deref()) else { return };
        self.fitted_factor = fitted;
        if self.fitted_factor.bias() < LARGEST_BIAS {
            self.factor = self.fitted_factor.clone();
            let factor = parallel::map(now.sums.len(), |i| basis.sum(&self.factor, i));
            parallel::update(&mut frame.entropy, |i, a| *a *= factor[i] / frame.factor[i]);
            frame.factor = factor;
        }
    }

    /// Accelerations from A_i rho_i^gamma / (Omega_i n_i^2).
    fn pressure_force(&self, support: &[f64], strength: &[f64], sums: &[DensitySums<D>]) -> Vec<[f64; D]> {
        let mut force = self.arrangement.gradient(support, strength, sums);
        parallel::update(&mut force, |_, g| *g = g.map(|v| -v / self.mass));
        force
    }

    /// g at the particles.
    fn gravity(&self, frame: &Frame) -> Vec<[f64; D]> {
        let positions = &self.arrangement.positions;
        parallel::map(self.arrangement.len(), |i| {
            let step = GRADIENT_STEP * frame.spacing[i];
            let wanted = self.equilibrium.gravity(&at(positions, i), step);
            frame.own.as_ref().map_or(wanted, |own| std::array::from_fn(|k| wanted[k] + own[i * D + k]))
        })
    }

    /// What the particles attract each other with beyond the target's g, where that is their own.
    fn own_gravity(&self, spacing: &[f64]) -> Option<Vec<f64>> {
        self.equilibrium.own_center()?;
        let Arrangement { positions, .. } = &self.arrangement;
        let softening = softening_radius::<D>(spacing.iter().map(|s| s.powi(-(D as i32))));
        let masses = vec![self.mass; spacing.len()];
        let pulls = gravity(self.arrangement.tree(), &masses, softening, OPENING_ANGLE);
        let beyond = parallel::map(pulls.len(), |i| {
            let wanted = self.equilibrium.gravity(&at(positions, i), GRADIENT_STEP * spacing[i]);
            std::array::from_fn::<f64, D, _>(|k| pulls[i].acceleration[k] - wanted[k])
        });
        Some(beyond.into_iter().flatten().collect())
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
        let solved = self.arrangement.solve(guess);
        let support = parallel::map(solved.len(), |i| solved[i].support);
        let sums = parallel::map(solved.len(), |i| solved[i].sums);
        let strength = parallel::map(sums.len(), |i| {
            let s = &sums[i];
            let grad_h = 1.0 + s.slope / (d * s.number_density);
            frame.entropy[i] * (mass * s.number_density).powf(gamma) / (s.number_density.powi(2) * grad_h)
        });
        let pressure_force = self.pressure_force(&support, &strength, &sums);
        let gravity = self.gravity(frame);
        let positions = &self.arrangement.positions;
        let gradient = parallel::map(sums.len(), |i| {
            let net: [f64; D] = std::array::from_fn(|k| pressure_force[i][k] + gravity[i][k]);
            let scale = -mass * frame.unit[i] / frame.temperature;
            if self.is_held(&at(positions, i), &net, frame.spacing[i]) { [0.0; D] } else { net.map(|f| scale * f) }
        });
        let mut now = Evaluation { support, sums, strength, pressure_force, gravity, gradient, error: 0.0 };
        now.error = self.error(frame, &now);
        now
    }

    /// Whether a particle at an open edge is pushed outward.
    fn is_held(&self, x: &[f64; D], force: &[f64; D], spacing: f64) -> bool {
        let domain = &self.arrangement.domain;
        let depth = domain.distance_to_edge(x);
        if self.arrangement.leaves_target || depth >= EDGE * spacing {
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
        total / parallel::count(n, counts).max(1) as f64
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
                internal_energy: parallel::map(now.sums.len(), |i| {
                    let density = self.mass * now.sums[i].number_density;
                    frame.entropy[i] * density.powf(gamma - 1.0) / (gamma - 1.0)
                }),
                iteration: self.evaluations,
                error: now.error,
            };
        }
        self.trace.history.push(Progress {
            iteration: self.evaluations,
            epsilon,
            force_error: Some(now.error),
            largest_step: length,
            seconds: self.trace.seconds(),
        });
    }
}

fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (0..D).map(|k| a[k] * b[k]).sum()
}
