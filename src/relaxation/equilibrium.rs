//! The imbalance of pressure and gravity for one arrangement of particles, and the descent that reduces it, see [`super::balance`].

use super::arrangement::Arrangement;
use super::balance_states::{Best, Descent, Frame, Newton};
use super::fit::{fit, interior};
use super::lbfgs::{Lbfgs, product};
use super::newton::MinimalResidual;
use super::pairs::closer_than;
use super::pulls::{Pulls, Well};
use super::report::{Progress, StopReason};
use super::snapshot::Trace;
use super::states::{Law, States};
use super::swelling::shortfall;
use super::thermal::{Basis, Factor, enclosed_fractions};
use crate::target::{Equilibrium, Positions, Target, at};
use sph::domain::Wall;
use sph::exchange::Alone;
use sph::geometry::unit_ball_volume;
use sph::kernel::{makes_pairs, most_neighbors_without_pairs};
use sph::lanes::Real;
use sph::sums::{DensitySums, Search};
use sph::{parallel, reduce};

/// No particle moves farther in a step, in its own spacing.
const MAX_STEP: f64 = 0.2;
/// Largest move of the first step of a stage, along the force.
const FIRST_STEP: f64 = 0.02;
/// A step is taken where the slope behind it is at most this fraction of the one before it.
const CURVATURE: f64 = 0.5;
const MAX_TRIALS: usize = 5;
/// Within this many spacings of an open edge no force pushes outward: there is nowhere to go.
const EDGE: f64 = 0.1;
/// Part of the evaluations for descents; the rest is Newton's.
const DESCENTS: f64 = 0.6;
/// Products with the forces' derivatives for a Newton step, and part of the forces that may be left.
const PRODUCTS: usize = 40;
const LEFT: f64 = 0.1;
/// Particles that would come closer than this, in spacings, are held in a Newton step, in so many rounds at most.
const TOO_CLOSE: f64 = 0.5;
const ROUNDS: usize = 4;
/// Particles closer than this count as paired: somewhat more than what [`crate::metrics::Quality`] takes for a loss.
const PAIRED: f64 = 0.33;
/// Largest move over which forces are differenced, in spacings.
const DIFFERENCE: f64 = 0.02;
/// What is nearer to the surface of a body than this part of its radius takes its state from there.
const SKIN: f64 = 1e-3;
/// A factor on A_i farther from 1 is no bias of the sums, but a pressure that does not hold the body.
const LARGEST_BIAS: f64 = 0.1;
/// Pressures below this fraction of the largest P/n do not stretch steps further.
const COLDEST: f64 = 1e-6;
/// Radii are found from those of the last evaluation, to an accuracy that leaves as small a part of the forces.
const SEARCH: Search = Search { tolerance: 1e-4, margin: 1.02 };
/// Evaluations after which gravity is found anew in the last descent.
const ATTRACTED: usize = 20;
/// Part of the least error, and of that of the last state of which gravity was found, below which that of a state is found to see whether it
/// is the best.
const PROMISE: f64 = 0.95;
/// Step of the differences of a field that holds the pressure, in spacings.
const GRADIENT_STEP: f64 = 1e-3;

/// What the stage works on.
pub(super) struct Balance<'a, const D: usize, R> {
    pub arrangement: Arrangement<'a, D, R>,
    pub equilibrium: &'a dyn Equilibrium<D>,
    /// The target's g where that is of the body itself.
    pub well: Option<Well<D>>,
    /// Radius beyond which a body that holds itself has no more than half a particle.
    pub last: f64,
    pub mass: f64,
    /// The factor on A_i; 1 where it is no matter of a few percent.
    pub factor: Factor,
    /// The factor that gravity asks for.
    pub fitted_factor: Factor,
    pub evaluations: usize,
    pub best: Best<D>,
    pub trace: Trace,
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
            positions: arrangement.positions().clone(),
            internal_energy: Vec::new(),
            iteration: 0,
            error: f64::INFINITY,
            factors: [Factor::one(), Factor::one()],
            is_paired: true,
            looked_at: f64::INFINITY,
        };
        Self {
            mass: arrangement.target.mass / arrangement.target.count as f64,
            well: Well::new(equilibrium, 0.5 * arrangement.target.domain.size()),
            last: equilibrium.own_center().map_or(f64::INFINITY, |center| last_radius(&arrangement.target, &center)),
            arrangement,
            equilibrium,
            factor: Factor::one(),
            fitted_factor: Factor::one(),
            evaluations: 0,
            best,
            trace: Trace::new(),
        }
    }

    /// Whether any arrangement in which particles lie apart is a saddle, from which they would pair.
    pub fn makes_pairs(&self) -> bool {
        makes_pairs(self.arrangement.kernel, D, self.arrangement.kernel_neighbors)
    }

    /// Part of the evaluations that descents take. Where a kernel could pair particles, Newton's method would end in other
    /// saddles than the minimum that a descent approaches.
    pub fn share_of_descents(&self) -> f64 {
        if most_neighbors_without_pairs(self.arrangement.kernel, D).is_some() { 1.0 } else { DESCENTS }
    }

    /// Whether the best state has particles apart and less net force than `enough`.
    pub fn is_at_rest(&self, enough: f64) -> bool {
        self.best.error < enough && !self.best.is_paired
    }

    /// Takes A_i anew and begins a descent with it.
    pub fn descend(&mut self) -> Descent<D> {
        self.arrangement.sort();
        let (frame, mut now) = self.fitted();
        self.note(&frame, &mut now, 0.0, true);
        let Evaluation { support, gradient, .. } = now;
        Descent { frame, memory: Lbfgs::new(), support, gradient, attracted: self.evaluations }
    }

    /// A_i at the present places, with the factor that gravity asks for, and the forces.
    fn fitted(&mut self) -> (Frame, Evaluation<D>) {
        // Forces between particles on shells, as they may be at first, are not those of the body at rest. Where only Newton's steps
        // are taken, particles do not come to rest between them.
        let comes_to_rest = self.equilibrium.own_center().is_some() && !self.makes_pairs();
        let may_be_shells = self.evaluations == 0 && comes_to_rest;
        let is_fitted = self.equilibrium.has_gravity() && self.law().materials.is_none() && !may_be_shells;
        self.best.looked_at = f64::INFINITY;
        if is_fitted {
            self.take_swelling_back();
        }
        let mut frame = self.frame();
        let guess = self.arrangement.target_supports();
        let mut now = self.evaluate(&frame, &guess);
        if is_fitted {
            self.refit(&mut frame, &now);
            now = self.evaluate(&frame, &guess);
        }
        (frame, now)
    }

    /// Puts the mass of a body that its own gravity holds back to where the target has it, but for what is not smooth.
    fn take_swelling_back(&mut self) {
        // A pressure that does not hold the body is left to settle as it will.
        let Some(center) = self.equilibrium.own_center().filter(|_| self.factor == self.fitted_factor) else { return };
        let positions = self.arrangement.positions();
        let place = parallel::map(self.arrangement.len(), |i| self.inside(&at(positions, i)));
        let support = self.arrangement.target_supports();
        let set = interior(self.arrangement.target.domain, positions, &support, None);
        let found = shortfall(&self.arrangement, self.equilibrium, &center, &place, set.as_deref());
        let Some(share) = found else { return };
        let Arrangement { domain, target, .. } = &self.arrangement;
        let moved = parallel::map(place.len(), |i| {
            let from = at(positions, i);
            let mut x = sph::array(|k| from[k] + share[i] * (from[k] - center[k]));
            domain.confine(&from, &mut x);
            if target.keeps_region(&from, &x) { x } else { from }
        });
        self.arrangement.place(|i| moved[i]);
    }

    /// One step of a descent that may make evaluations up to `end`, the last of the stage or not; why it ends, if it does.
    pub fn advance(&mut self, descent: &mut Descent<D>, (end, is_last): (usize, bool)) -> Option<StopReason> {
        if self.evaluations >= end {
            return Some(StopReason::IterationLimit);
        }
        loop {
            let Descent { frame, memory, support, gradient, attracted } = descent;
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
            let Some((mut next, step)) = self.search(frame, (support, gradient), &direction, first) else {
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
            let is_due = is_last && self.evaluations >= *attracted + ATTRACTED;
            if is_due {
                *attracted = self.evaluations;
                self.attract(frame, &mut next);
            }
            let length = self.longest(frame, &step);
            self.note(frame, &mut next, length, is_due);
            (*support, *gradient) = (next.support, next.gradient);
            return None;
        }
    }

    /// Finds the gravity of the particles anew, and the error with it. Where some are so close to each other that hardly more than
    /// that keeps them apart, they would follow it together: the descent then follows its mean over shells.
    fn attract(&mut self, frame: &mut Frame, now: &mut Evaluation<D>) {
        let Some((before, fresh)) = frame.pulls.take().zip(self.pulls(&frame.spacing)) else { return };
        let (domain, positions) = (&self.arrangement.domain, self.arrangement.positions());
        let crowded = closer_than(&Alone, domain, positions, &frame.spacing, TOO_CLOSE).contains(&true);
        let center = self.equilibrium.own_center().unwrap_or([0.0; D]);
        let fraction = enclosed_fractions(positions, &center);
        let followed = if crowded { before.following(&fresh, (positions, &fraction), &center) } else { fresh.clone() };
        now.gravity = self.gravity(frame, Some(&fresh));
        now.error = self.error(frame, now);
        now.gradient = self.gradient(frame, &now.pressure_force, &self.gravity(frame, Some(&followed)));
        frame.pulls = Some(followed);
    }

    /// Goes on by a product or by a step towards the force-free arrangement nearby, whether it is a minimum or a saddle, by
    /// up to `end` evaluations; why it ends, if it does.
    pub fn advance_newton(&mut self, newton: &mut Option<Newton<D>>, end: usize) -> Option<StopReason> {
        let Some(mut under_way) = newton.take() else {
            self.arrangement.sort();
            let (frame, mut now) = self.fitted();
            self.note(&frame, &mut now, 0.0, true);
            let solver = MinimalResidual::new(&now.gradient);
            let from = self.arrangement.positions().clone();
            let Evaluation { support, gradient, .. } = now;
            *newton = Some(Newton { frame, from, support, gradient, solver, products: 0 });
            return (self.evaluations >= end).then_some(StopReason::IterationLimit);
        };
        let is_over = under_way.products == PRODUCTS || under_way.solver.is_below(LEFT) || self.evaluations >= end;
        if is_over {
            return self.step_newton(under_way);
        }
        let Newton { frame, from, support, gradient, solver, products } = &mut under_way;
        let v = solver.asks_for();
        let t = DIFFERENCE / self.longest(frame, v);
        self.arrangement.displace(from, v, t, &frame.unit, &frame.spacing, MAX_STEP);
        let there = self.evaluate(frame, support);
        let change = |i: usize| sph::array(|k| (there.gradient[i][k] - gradient[i][k]) / t);
        solver.take(parallel::map(gradient.len(), change));
        *products += 1;
        *newton = Some(under_way);
        None
    }

    /// Takes Newton's step, or a part of it that leaves less force.
    fn step_newton(&mut self, newton: Newton<D>) -> Option<StopReason> {
        let Newton { frame, from, support, gradient, solver, .. } = newton;
        let mut direction = solver.step();
        let (norm, longest) = (product(&gradient, &gradient), self.longest(&frame, &direction));
        let mut t = if longest > 0.0 { (MAX_STEP / longest).min(1.0) } else { 0.0 };
        for _ in 0..MAX_TRIALS {
            let step = self.step_apart(&frame, &from, &mut direction, t);
            let mut next = self.evaluate(&frame, &support);
            if product(&next.gradient, &next.gradient) < norm {
                let length = self.longest(&frame, &step);
                self.note(&frame, &mut next, length, false);
                return None;
            }
            t *= 0.4;
        }
        self.arrangement.put_back(from);
        Some(StopReason::Stagnated)
    }

    /// Goes along `direction`, of which it takes what would bring two particles too close.
    fn step_apart(&mut self, frame: &Frame, from: &Positions<D>, direction: &mut [[f64; D]], t: f64) -> Vec<[f64; D]> {
        for _ in 0..ROUNDS {
            self.arrangement.displace(from, direction, t, &frame.unit, &frame.spacing, MAX_STEP);
            let positions = self.arrangement.positions();
            let close = closer_than(&Alone, &self.arrangement.domain, positions, &frame.spacing, TOO_CLOSE);
            let moves = |i: usize| close[i] && direction[i] != [0.0; D];
            if !(0..close.len()).any(moves) {
                break;
            }
            parallel::update(direction, |i, d| {
                if close[i] {
                    *d = [0.0; D];
                }
            });
        }
        self.arrangement.displace(from, direction, t, &frame.unit, &frame.spacing, MAX_STEP);
        self.steps(from, frame)
    }

    /// The moves since the particles were at `from`, in units of each particle's.
    fn steps(&self, from: &Positions<D>, frame: &Frame) -> Vec<[f64; D]> {
        parallel::map(self.arrangement.len(), |i| self.arrangement.step(i, from, &frame.unit))
    }

    /// Goes along `direction` and back until the slope behind the step is small or still descends.
    fn search(
        &mut self,
        frame: &Frame,
        (support, gradient): (&[f64], &[[f64; D]]),
        direction: &[[f32; D]],
        first: f64,
    ) -> Option<(Evaluation<D>, Vec<[f64; D]>)> {
        let from = self.arrangement.positions().clone();
        let mut t = first;
        for _ in 0..MAX_TRIALS {
            self.arrangement.displace(&from, direction, t, &frame.unit, &frame.spacing, MAX_STEP);
            let step = self.steps(&from, frame);
            let next = self.evaluate(frame, support);
            let (before, after) = (product(&step, gradient), product(&step, &next.gradient));
            if after <= CURVATURE * before.abs() {
                return Some((next, step));
            }
            t *= (before / (before - after)).clamp(0.1, 0.7);
        }
        self.arrangement.put_back(from);
        None
    }

    /// The equation of state.
    fn law(&self) -> Law<'a> {
        Law { gamma: self.equilibrium.gamma(), materials: self.equilibrium.materials() }
    }

    /// Takes A_i, or the state of the material, from the target at the particles' positions.
    pub fn frame(&self) -> Frame {
        let (target, positions, law) = (&self.arrangement.target, self.arrangement.positions(), self.law());
        let n = self.arrangement.len();
        let place = parallel::map(n, |i| self.inside(&at(positions, i)));
        let density = parallel::map(n, |i| target.number_density(&place[i]));
        let spacing = parallel::map(n, |i| target.spacing(density[i]).min(target.domain.size()));
        let pressure = parallel::map(n, |i| self.equilibrium.pressure(&place[i]));
        let materials = law.materials.map(|m| (m, parallel::map(n, |i| self.equilibrium.material(&place[i]))));
        // What resists compression: P/n of a gas, the bulk modulus over n of a solid.
        let stiffness = parallel::map(n, |i| match &materials {
            Some((m, states)) => self.mass * states[i].map_or(0.0, |s| m.sound_speed(&s).powi(2)),
            None => pressure[i] / density[i],
        });
        let temperature = reduce::max(n, |i| stiffness[i]);
        let unit = parallel::map(n, |i| spacing[i] * (stiffness[i] / temperature).max(COLDEST).powf(-0.5));
        let fraction = self.equilibrium.own_center().map(|center| enclosed_fractions(positions, &center));
        let basis = Basis::new::<D>(fraction.as_deref(), self.factor.last);
        let factor = parallel::map(n, |i| basis.sum(&self.factor, i));
        let states = match materials {
            Some((_, states)) => States::of_materials(&states.into_iter().flatten().collect::<Vec<_>>()),
            None => {
                let entropy = |i: usize| factor[i] * pressure[i] / (self.mass * density[i]).powf(law.gamma);
                States::Gas(parallel::map(n, entropy))
            }
        };
        let pulls = self.pulls(&spacing);
        Frame { states, factor, fraction, pulls, spacing, unit, temperature }
    }

    /// Where the target says what a particle at `x` is like: `x`, or a place within the surface that it is beyond. Where entropy rises outwards
    /// without bounds, one that is farther out than the last of the mass would be driven out by what it is given there.
    fn inside(&self, x: &[f64; D]) -> [f64; D] {
        let Some(center) = self.equilibrium.own_center().filter(|_| self.arrangement.leaves_target) else { return *x };
        let most = ((1.0 - SKIN) * 0.5 * self.arrangement.target.domain.size()).min(self.last);
        let radius = sph::geometry::distance(x, &center);
        if radius <= most {
            return *x;
        }
        sph::array(|k| center[k] + most / radius * (x[k] - center[k]))
    }

    /// The factor on A_i with which the pressure holds gravity over the interior: one for all, or a smooth function of the
    /// enclosed mass for a body that its own gravity holds.
    fn refit(&mut self, frame: &mut Frame, now: &Evaluation<D>) {
        let set = self.interior(now);
        let basis = Basis::over::<D>(frame.fraction.as_deref(), set.as_deref());
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
            if let States::Gas(entropy) = &mut frame.states {
                parallel::update(entropy, |i, a| *a *= factor[i] / frame.factor[i]);
            }
            frame.factor = factor;
        }
    }

    /// Accelerations from A_i rho_i^gamma / (Omega_i n_i^2).
    fn pressure_force(&self, support: &[f64], strength: &[f64], sums: &[DensitySums<D>]) -> Vec<[f64; D]> {
        let own = Arrangement::<D, R>::own_gradient(strength, sums);
        let mut force = self.arrangement.gradient(support, strength, own);
        parallel::update(&mut force, |_, g| *g = g.map(|v| -v / self.mass));
        force
    }

    /// g at the particles, with what they attract each other with beyond the target's.
    fn gravity(&self, frame: &Frame, pulls: Option<&Pulls>) -> Vec<[f64; D]> {
        let positions = self.arrangement.positions();
        let held = pulls.zip(self.well.as_ref());
        parallel::map(self.arrangement.len(), |i| {
            let x = at(positions, i);
            match &held {
                Some((pulls, well)) => pulls.on(i, &x, well),
                None => self.equilibrium.gravity(&x, GRADIENT_STEP * frame.spacing[i]),
            }
        })
    }

    /// What the particles attract each other with where that holds the body.
    fn pulls(&self, spacing: &[f64]) -> Option<Pulls> {
        let well = self.well.as_ref()?;
        Some(Pulls::new(&self.arrangement, (self.equilibrium, well), self.mass, spacing))
    }

    /// Minus the net force in units of each particle's moves; none on those that are held.
    fn gradient(&self, frame: &Frame, pressure_force: &[[f64; D]], gravity: &[[f64; D]]) -> Vec<[f64; D]> {
        let positions = self.arrangement.positions();
        parallel::map(gravity.len(), |i| {
            let net: [f64; D] = sph::array(|k| pressure_force[i][k] + gravity[i][k]);
            let scale = -self.mass * frame.unit[i] / frame.temperature;
            if self.is_held(&at(positions, i), &net, frame.spacing[i]) { [0.0; D] } else { net.map(|f| scale * f) }
        })
    }

    fn interior(&self, now: &Evaluation<D>) -> Option<Vec<bool>> {
        interior(self.arrangement.target.domain, self.arrangement.positions(), &now.support, None)
    }

    pub fn evaluate(&mut self, frame: &Frame, guess: &[f64]) -> Evaluation<D> {
        self.evaluations += 1;
        let (d, law, mass) = (D as f64, self.law(), self.mass);
        if self.arrangement.domain.region.wall() == Some(Wall::Reflecting) {
            self.arrangement.mirror(guess);
        }
        let solved = self.arrangement.solve(guess, SEARCH);
        let support = parallel::map(solved.len(), |i| solved[i].support);
        let sums = parallel::map(solved.len(), |i| solved[i].sums);
        let strength = parallel::map(sums.len(), |i| {
            let s = &sums[i];
            let grad_h = 1.0 + s.slope / (d * s.number_density);
            law.pressure(&frame.states, i, mass * s.number_density) / (s.number_density.powi(2) * grad_h)
        });
        let pressure_force = self.pressure_force(&support, &strength, &sums);
        let gravity = self.gravity(frame, frame.pulls.as_ref());
        let gradient = self.gradient(frame, &pressure_force, &gravity);
        let mut now = Evaluation { support, sums, strength, pressure_force, gravity, gradient, error: 0.0 };
        now.error = self.error(frame, &now);
        now
    }

    /// Whether a particle at the edge of what is there is pushed outward.
    fn is_held(&self, x: &[f64; D], force: &[f64; D], spacing: f64) -> bool {
        let domain = &self.arrangement.domain;
        let depth = domain.distance_to_edge(x);
        if depth >= EDGE * spacing {
            return false;
        }
        let length = force.iter().map(|f| f * f).sum::<f64>().sqrt();
        let ahead: [f64; D] = sph::array(|k| x[k] + 0.5 * depth * force[k] / length);
        !(domain.distance_to_edge(&ahead) > depth)
    }

    /// Mean |a + g| / |g| over the interior, or the larger of that and of the mean over all particles where those at the surface are free; without
    /// gravity mean |a| rho spacing / P.
    fn error(&self, frame: &Frame, now: &Evaluation<D>) -> f64 {
        let set = self.interior(now);
        let counts = |i: usize| set.as_ref().is_none_or(|s| s[i]);
        let gravity = self.equilibrium.has_gravity();
        let law = self.law();
        let error = |i: usize| {
            let net: [f64; D] = sph::array(|k| now.pressure_force[i][k] + now.gravity[i][k]);
            let density = self.mass * now.sums[i].number_density;
            let unit = if gravity {
                dot(&now.gravity[i], &now.gravity[i]).sqrt()
            } else {
                law.temperature(&frame.states, i, density) / frame.spacing[i]
            };
            if unit > 0.0 { dot(&net, &net).sqrt() / unit } else { 0.0 }
        };
        let n = now.sums.len();
        let [total, within] = reduce::sums(n, |i| {
            let error = error(i);
            [error, if counts(i) { error } else { 0.0 }]
        });
        let within = within / parallel::count(n, counts).max(1) as f64;
        if self.arrangement.leaves_target { within.max(total / n as f64) } else { within }
    }

    fn longest<V: Copy + Into<f64> + Sync>(&self, frame: &Frame, v: &[[V; D]]) -> f64 {
        let squared = |i: usize| {
            let v: [f64; D] = v[i].map(Into::into);
            (frame.unit[i] / frame.spacing[i]).powi(2) * dot(&v, &v)
        };
        reduce::max(v.len(), squared).max(0.0).sqrt()
    }

    /// Whether a gas has particles that are close to others, as no stage may leave them.
    fn is_paired(&self, frame: &Frame) -> bool {
        let (domain, positions) = (&self.arrangement.domain, self.arrangement.positions());
        self.law().materials.is_none() && closer_than(&Alone, domain, positions, &frame.spacing, PAIRED).contains(&true)
    }

    /// Takes a state for the best if it is; `is_exact` where gravity is that of the particles where they are now. Otherwise it is found
    /// for a state that promises enough.
    fn note(&mut self, frame: &Frame, now: &mut Evaluation<D>, length: f64, is_exact: bool) {
        let is_exact = is_exact || frame.pulls.is_none();
        let most = if is_exact { self.best.error } else { PROMISE * self.best.error.min(self.best.looked_at) };
        let may_be_best = now.error < most || self.best.is_paired;
        let is_paired = may_be_best && self.is_paired(frame);
        if may_be_best && (is_paired, now.error) < (self.best.is_paired, self.best.error) {
            if !is_exact && let Some(fresh) = self.pulls(&frame.spacing) {
                self.best.looked_at = now.error;
                now.gravity = self.gravity(frame, Some(&fresh));
                now.error = self.error(frame, now);
            }
            self.take_if_best(frame, now, is_paired);
        }
        let wanted = self.arrangement.target_density();
        let epsilon = fit(self.interior(now).as_deref(), &wanted, |i| now.sums[i].number_density).epsilon;
        self.trace.history.push(Progress {
            iteration: self.evaluations,
            epsilon,
            force_error: Some(now.error),
            largest_step: length,
            seconds: self.trace.seconds(),
        });
    }

    fn take_if_best(&mut self, frame: &Frame, now: &Evaluation<D>, is_paired: bool) {
        if (is_paired, now.error) < (self.best.is_paired, self.best.error) {
            let law = self.law();
            let energy = |i: usize| law.energy(&frame.states, i, self.mass * now.sums[i].number_density);
            self.best = Best {
                looked_at: self.best.looked_at,
                is_paired,
                factors: [self.factor.clone(), self.fitted_factor.clone()],
                positions: self.arrangement.positions().clone(),
                internal_energy: parallel::map(now.sums.len(), energy),
                iteration: self.evaluations,
                error: now.error,
            };
        }
    }
}

/// The radius within which a radial target has all but half a particle; at least seven tenths of its own.
fn last_radius<const D: usize>(target: &Target<'_, D>, center: &[f64; D]) -> f64 {
    let radius = 0.5 * target.domain.size();
    let (step, mut beyond) = (radius * OUTER / PANELS as f64, 0.0);
    for panel in 0..PANELS {
        let r = radius - (panel as f64 + 0.5) * step;
        let x = sph::array(|k| center[k] + if k == 0 { r } else { 0.0 });
        beyond += D as f64 * unit_ball_volume(D) * r.powi(D as i32 - 1) * target.number_density(&x) * step;
        if beyond > 0.5 {
            return r;
        }
    }
    radius * (1.0 - OUTER)
}

/// Outer part of a body's radius in which its last particle is looked for, and panels of the midpoint rule there.
const OUTER: f64 = 0.3;
const PANELS: usize = 1000;

fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (0..D).map(|k| a[k] * b[k]).sum()
}
