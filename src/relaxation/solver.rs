//! The density solver: minimizes the density error and the noise of the pressure force together over the
//! particles' positions.
//!
//! With q_i = n_i / n*(x_i), n_i summed at the target's own support radius H_i = eta (kappa/n*_i)^(1/d), and
//! r_i = q_i / mean(q) - 1, the objective is
//!
//! E = sum_i w_i r_i^2 / 2 + lambda sum_i q_i.
//!
//! The first sum vanishes where the density is the target up to a constant factor. The second is a pressure
//! energy: at its minimum the forces of a fluid at constant pressure cancel, and it is what keeps particles
//! apart. N equations in d N unknowns leave room for both; lambda weighs them. From a disordered start it is lowered
//! in two stages: first the particles come to rest in a force-free arrangement, then the density is made exact with
//! the smallest moves that do it. Starts that are in order, and runs that are to reach a tolerance soon, need the
//! second alone. The pressure energy of a B-spline is low where particles pair: with one of those the default kernel
//! brings them to rest, and past [`sph::kernel::most_neighbors_without_pairs`] the last stage fits the density alone.
//!
//! H follows the target, not the particles, so that no smoothing-length iteration is needed and the gradient
//! is exact with one density pass and one pass over what others see. kappa = <n*/n> is held within a stage;
//! at the solution n = n*/kappa, and H is the support radius with N_H neighbors.
//!
//! Weights w_i = 1 / (1 + S_i^4), S_i the sharpness of the target ([`Target::sharpness`]), leave out particles at
//! steep surfaces, jumps and kinks: no arrangement has the target's density there, and chasing it would clump
//! them. There the pressure energy alone places the particles, except within reach of a jump
//! ([`Target::is_discontinuous_near`]): what a sum counts too much on the thin side of it would drive particles away, so those
//! stay where the seeding and WVT have put them. In layers thinner than a spacing particles move along the layer ([`super::layers`]).

use super::aim::{Aims, Points};
use super::arrangement::Arrangement;
use super::course::Course;
use super::hold::{Held, Hold, as_given};
use super::interfaces::Interfaces;
use super::layers::Layers;
use super::lbfgs::{Lbfgs, product_among};
use super::objective::{Evaluation, Frame, Objective};
use super::on_ranks::{OverRanks, agreed_stop};
use super::pairs::{COINCIDENT, part_pairs_among};
use super::report::{Progress, StageName, StageReport, StopReason};
use super::schedule::{SolverOptions, Stretch, weight_with};
use super::snapshot::{Check, Trace, axes, decode, encode, rows};
use super::stage::{Particles, Relaxed, Running, Stage};
use crate::metrics::LedgerOf;
use crate::target::mass_points::MassPoints;
use crate::target::{Positions, Target};
use serde::{Deserialize, Serialize};
use sph::exchange::{Alone, Exchange};
use sph::kernel::{KernelName, makes_pairs};
use sph::lanes::Real;
use sph::neighbors::Sees;
use sph::{parallel, reduce};
use std::marker::PhantomData;
use std::sync::Arc;

pub const NAME: StageName = StageName { name: "solver", title: "density solver" };

/// No particle moves farther in a step, in its own spacing.
const MAX_STEP: f64 = 0.3;
/// Largest move of the first step of a stage, along the gradient.
const FIRST_STEP: f64 = 0.05;
/// Sufficient decrease (Armijo), and halvings until a direction is given up.
const ARMIJO: f64 = 1e-4;
const MAX_HALVINGS: usize = 6;
/// Moves between sortings: steps are long, and leaves across a periodic face soon span the domain.
const SORT_INTERVAL: usize = 4;
/// Evaluations without a new lowest epsilon after which the last stage ends: what still falls is the pressure energy,
/// at the density's cost. A run that is to reach a tolerance goes on.
const PATIENCE: usize = 40;

/// Share of the particles about which surfaces are looked for anew after which curvature is forgotten.
const MANY: f64 = 0.05;

/// The stage. What comes out is the last state, or the first where epsilon rose and the descent had no time to make up for it. `R` is the
/// precision of pair distances.
pub struct DensitySolver<'a, const D: usize, R = f32> {
    kernel: KernelName,
    target: Target<'a, D>,
    options: SolverOptions,
    /// In the order in which particles are given, of a block; empty where all may move.
    holds: &'a [Hold],
    /// Kappa of all blocks, where it is known.
    common: Option<f64>,
    /// Points of mass about a block, where its particles may aim at the smoothed target.
    points: Option<Arc<MassPoints<D>>>,
    /// What is known of the whole target already.
    ledger: Option<Arc<LedgerOf<'a, D>>>,
    precision: PhantomData<R>,
}

impl<const D: usize, R: Real> Stage<D> for DensitySolver<'_, D, R> {
    fn name(&self) -> StageName {
        NAME
    }

    fn begin(&self, particles: Particles<D>) -> Box<dyn Running<D> + '_> {
        self.begin_among(particles, &Alone)
    }

    fn resume(&self, kept: &[u8]) -> Result<Box<dyn Running<D> + '_>, String> {
        if !self.holds.is_empty() {
            return Err("is of a block, and is not kept; start without it".into());
        }
        let kept: Snapshot<D> = decode(kept)?;
        self.resumed(kept, self.target.count, &Alone)
    }

    fn left(&self, kept: &[u8]) -> Result<Particles<D>, String> {
        self.left_by_a_rank(kept)
    }
}

/// Points of mass, by which particles aim at the smoothed target, are those of the whole target on each rank; their radii are those of the nearest of
/// its own particles.
impl<const D: usize, R: Real> OverRanks<D> for DensitySolver<'_, D, R> {
    fn begin_among<'s>(&'s self, particles: Particles<D>, exchange: &'s dyn Exchange) -> Box<dyn Running<D> + 's> {
        let trace = Trace::new();
        let mut positions = particles.positions;
        if self.holds.is_empty() {
            part_pairs_among(exchange, &self.target, &mut positions, COINCIDENT);
        }
        let schedule = self.options.schedule(self.kernel, D);
        // What comes out is the last state, where there is no stretch that may leave less.
        let before = if schedule.len() > 1 { positions.clone() } else { std::array::from_fn(|_| Vec::new()) };
        let (arrangement, order) = self.arrangement(positions);
        let mut solver = Solver::<D, R>::new(arrangement, &self.options, exchange);
        solver.trace = trace;
        solver.objective.holds = (!self.holds.is_empty()).then(|| Held::new(order, self.holds));
        // Another kernel has another.
        solver.objective.common = self.common.filter(|_| schedule.iter().all(|s| s.kernel == self.kernel));
        if let Some(points) = &self.points {
            solver.objective.points = Points::of_block(Arc::clone(points));
        }
        solver.objective.ledger.clone_from(&self.ledger);
        solver.objective.see_interfaces(None);
        if schedule[0].kernel != self.kernel {
            // What the end is compared with.
            let frame = solver.objective.frame(0.0);
            let now = solver.objective.evaluate(&frame);
            solver.note(&now, 0.0);
        }
        let descent = solver.descend(&schedule[0]);
        Box::new(Run { solver, schedule, index: 0, descent, before })
    }

    fn resume_among<'s>(&'s self, kept: &[u8], exchange: &'s dyn Exchange) -> Result<Box<dyn Running<D> + 's>, String> {
        let kept: Snapshot<D> = decode(kept)?;
        let count = kept.positions[0].len();
        self.resumed(kept, count, exchange)
    }

    fn steps(&self, history: &[Progress]) -> (usize, &'static str) {
        (history.last().map_or(0, |last| last.iteration), "evaluation of the density solver")
    }
}

impl<'a, const D: usize, R: Real> DensitySolver<'a, D, R> {
    pub fn new(kernel: KernelName, target: Target<'a, D>, options: SolverOptions) -> Self {
        Self { kernel, target, options, holds: &[], common: None, points: None, ledger: None, precision: PhantomData }
    }

    /// The same for a block of the target, among particles of others that stay where they are; they come out as they are given.
    /// `common` is the kappa of all blocks, where it is known.
    #[must_use]
    pub fn within(self, holds: &'a [Hold], common: Option<f64>) -> Self {
        Self { holds, common, ..self }
    }

    /// With what is known of the whole target.
    #[must_use]
    pub fn knowing(self, ledger: Arc<LedgerOf<'a, D>>) -> Self {
        Self { ledger: Some(ledger), ..self }
    }

    /// With points of mass about the block.
    #[must_use]
    pub(crate) fn seeing(self, points: Option<Arc<MassPoints<D>>>) -> Self {
        Self { points, ..self }
    }

    /// With the particle that each place holds.
    fn arrangement(&self, positions: Positions<D>) -> (Arrangement<'a, D, R>, Vec<u32>) {
        let mirrored = self.target.domain.mirrored();
        Arrangement::with_order(self.kernel, self.target, mirrored, positions, self.options.kernel_neighbors)
    }

    /// As it was kept of `count` particles.
    fn resumed<'s>(
        &'s self,
        kept: Snapshot<D>,
        count: usize,
        exchange: &'s dyn Exchange,
    ) -> Result<Box<dyn Running<D> + 's>, String> {
        let schedule = self.options.schedule(self.kernel, D);
        kept.check(count, schedule.len())?;
        let Snapshot {
            index,
            positions,
            moves,
            before,
            descent,
            kappa,
            evaluations,
            interfaces,
            aims,
            strength,
            layers,
            trace,
        } = kept;
        let Stretch { kernel, kernel_neighbors, .. } = schedule[index];
        let mirrored = self.target.domain.mirrored();
        let mut arrangement = Arrangement::of_sorted(kernel, self.target, mirrored, positions, moves, kernel_neighbors);
        arrangement.share(exchange, Sees::Either);
        let SolverOptions { settled, smoothed, .. } = self.options;
        let mut objective =
            Objective { kappa: Some(kappa), settled, smoothed, evaluations, ..Objective::new(arrangement) };
        if interfaces.is_some() {
            objective.see_interfaces(interfaces);
        }
        (objective.aims, objective.layers) = (aims, layers);
        objective.points.strength = strength;
        objective.ledger.clone_from(&self.ledger);
        let solver = Solver::<D, R> { objective, options: &self.options, exchange, trace: trace.resumed() };
        Ok(Box::new(Run { solver, schedule, index, descent, before }))
    }

    /// Seconds that one evaluation of the objective with its gradient takes at `positions`, the mean of `repeats`: what a
    /// step costs beside its direction and its move.
    pub fn time_evaluation(&self, positions: Positions<D>, repeats: u32) -> f64 {
        let mut objective = Objective::<D, R>::new(self.arrangement(positions).0);
        let frame = objective.frame(weight_with(self.kernel, D, self.options.kernel_neighbors, 1.0));
        let start = std::time::Instant::now();
        for _ in 0..repeats {
            let now = objective.evaluate(&frame);
            std::hint::black_box(objective.gradient(&frame, now));
        }
        start.elapsed().as_secs_f64() / f64::from(repeats.max(1))
    }
}

/// What goes on after an interrupt.
#[derive(Serialize, Deserialize)]
struct Snapshot<const D: usize> {
    /// In the schedule.
    index: usize,
    #[serde(with = "axes")]
    positions: Positions<D>,
    /// Since the last sorting.
    moves: usize,
    /// Where the solver began; empty where that does not matter.
    #[serde(with = "axes")]
    before: Positions<D>,
    descent: Descent<D>,
    kappa: f64,
    evaluations: usize,
    /// Of a region that is relaxed by itself.
    interfaces: Option<Interfaces>,
    aims: Option<Aims<D>>,
    /// Of the points of mass, see [`super::aim::Points`].
    strength: Option<(Vec<f64>, Vec<f64>)>,
    /// Of a region that is a sheet.
    layers: Option<Layers<D>>,
    trace: Trace,
}

impl<const D: usize> Snapshot<D> {
    /// # Errors
    /// What is wrong with it for `count` particles and so many stretches.
    fn check(&self, count: usize, stretches: usize) -> Result<(), String> {
        Check::new(count)
            .holds(self.index < stretches, "is of a part of the descent that this run does not have")
            .positions("positions", &self.positions)
            .positions("the first positions", if stretches > 1 { &self.before } else { &self.positions })
            .scalars("weights", &self.descent.frame.weights)
            .scalars("spacings", &self.descent.frame.spacing)
            .vectors("the gradient", &self.descent.gradient)
            .holds(self.descent.course.is_finite(), "has energies that are none")
            .holds(
                [0, count].contains(&self.descent.frame.held.len()),
                "says of another number of particles which are held",
            )
            .holds(
                self.interfaces.as_ref().is_none_or(|i| i.is_of::<D>(count)),
                "has surfaces of another number of particles",
            )
            .holds(self.aims.as_ref().is_none_or(|a| a.is_of(count)), "has aims of another number of particles")
            .holds(self.layers.as_ref().is_none_or(|l| l.is_of(count)), "has layers of another number of particles")
            .holds(self.descent.memory.is_of(count), "has another number of gradients than of particles")
            .result()
    }
}

/// The stage under way.
struct Run<'a, const D: usize, R> {
    solver: Solver<'a, D, R>,
    schedule: Vec<Stretch>,
    /// In the schedule.
    index: usize,
    descent: Descent<D>,
    before: Positions<D>,
}

impl<const D: usize, R: Real> Running<D> for Run<'_, D, R> {
    fn advance(&mut self, outside: Option<StopReason>) -> Option<StopReason> {
        let Self { solver, descent, .. } = self;
        let outside = agreed_stop(solver.exchange, outside);
        if solver.objective.arrangement.is_stale(SORT_INTERVAL) {
            let order = solver.objective.sort();
            descent.reorder(&order);
            if outside.is_none() {
                solver.look_again(descent);
            }
        }
        if outside.is_some() {
            return outside;
        }
        let last = self.index + 1 == self.schedule.len();
        let share: f64 = self.schedule[..=self.index].iter().map(|s| s.share).sum();
        let end = if last { solver.options.evaluations } else { (share * solver.options.evaluations as f64) as usize };
        let stop = solver.advance(descent, end, last)?;
        if last || stop == StopReason::ToleranceReached {
            return Some(stop);
        }
        self.index += 1;
        self.descent = solver.descend(&self.schedule[self.index]);
        None
    }

    fn progress(&self) -> (&[Progress], usize) {
        (&self.solver.trace.history, self.solver.options.evaluations)
    }

    fn snapshot(&self, to: Vec<u8>) -> Result<Vec<u8>, String> {
        encode(
            &Snapshot {
                index: self.index,
                positions: self.solver.objective.arrangement.positions().clone(),
                moves: self.solver.objective.arrangement.moves(),
                before: self.before.clone(),
                descent: self.descent.clone(),
                kappa: self.solver.objective.kappa.unwrap_or(1.0),
                evaluations: self.solver.objective.evaluations,
                interfaces: self.solver.objective.arrangement.interfaces().cloned(),
                aims: self.solver.objective.aims.clone(),
                strength: self.solver.objective.points.strength.clone(),
                layers: self.solver.objective.layers.clone(),
                trace: self.solver.trace.kept(),
            },
            to,
        )
    }

    fn finish(self: Box<Self>, stop: StopReason) -> Relaxed<D> {
        let Self { solver: Solver { objective, trace, options, .. }, before, schedule, .. } = *self;
        let (arrangement, holds) = (objective.arrangement, objective.holds);
        let kernel = schedule.last().map_or(arrangement.kernel, |stretch| stretch.kernel);
        let mut last = arrangement.into_positions();
        if let Some(holds) = holds {
            for axis in &mut last {
                *axis = as_given(holds.order(), axis);
            }
        }
        let ends = trace.history.first().zip(trace.history.last());
        // Cut short, the last stretch may not have made up yet for what the first gave away. Where smoothed densities are the aim, others say
        // nothing of what it has come to.
        let is_short = schedule.len() > 1 && (stop.is_cut() || !options.smoothed && stop != StopReason::Stagnated);
        let rose = is_short && ends.is_some_and(|(first, last)| last.epsilon > first.epsilon);
        let best_iteration = ends.map_or(0, |(first, last)| if rose { first.iteration } else { last.iteration });
        let positions = if rose { before } else { last };
        let seconds = trace.seconds();
        let report = StageReport { stage: NAME, stop, best_iteration, seconds, history: trace.history };
        let ends_exact = schedule.last().is_some_and(|s| s.share > 0.0);
        let notes = Vec::from_iter(pairing_note(kernel, D, options.kernel_neighbors, ends_exact));
        Relaxed { particles: positions.into(), reports: vec![report], notes }
    }
}

/// What is to be said of a kernel whose particles pair at rest.
fn pairing_note(kernel: KernelName, d: usize, neighbors: f64, ends_exact: bool) -> Option<String> {
    makes_pairs(kernel, d, neighbors).then(|| {
        let end = match ends_exact {
            true => "the solver ended with the density alone",
            false => "they stay as it leaves them (solver.quietness below 1 makes the density exact and the forces uneven)",
        };
        format!(
            "{} with {neighbors:.0} neighbors has the pairing instability: {} has brought the particles to rest, and {end}",
            kernel.title(),
            KernelName::default().title()
        )
    })
}

/// Objective, options and history.
struct Solver<'a, const D: usize, R> {
    objective: Objective<'a, D, R>,
    options: &'a SolverOptions,
    exchange: &'a dyn Exchange,
    trace: Trace,
}

/// A descent under way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Descent<const D: usize> {
    frame: Frame,
    memory: Lbfgs<D>,
    #[serde(with = "rows")]
    gradient: Vec<[f32; D]>,
    energy: f64,
    course: Course,
    epsilon: f64,
    /// Below which it is worth measuring whether the tolerance is met.
    aim: f64,
    /// Lowest epsilon of this descent, and the evaluation that had it.
    lowest: (f64, usize),
}

impl<const D: usize> Descent<D> {
    /// Takes up what an evaluation has found.
    fn take(&mut self, now: &Evaluation<D>, evaluation: usize) {
        (self.energy, self.epsilon) = (now.energy, now.fit.epsilon);
        if self.epsilon < self.lowest.0 {
            self.lowest = (self.epsilon, evaluation);
        }
    }

    /// Follows the particles into a new order, see [`Arrangement::sort`].
    fn reorder(&mut self, order: &[u32]) {
        self.frame.reorder(order);
        self.gradient = parallel::reordered(&self.gradient, order);
        self.memory.reorder(order);
    }
}

impl<'a, const D: usize, R: Real> Solver<'a, D, R> {
    fn new(mut arrangement: Arrangement<'a, D, R>, options: &'a SolverOptions, exchange: &'a dyn Exchange) -> Self {
        let SolverOptions { settled, smoothed, .. } = *options;
        arrangement.share(exchange, Sees::Either);
        let objective = Objective { settled, smoothed, ..Objective::new(arrangement) };
        Self { objective, options, exchange, trace: Trace::new() }
    }

    /// One step of a descent that may make evaluations up to `end`; why it ends, if it does.
    fn advance(&mut self, descent: &mut Descent<D>, end: usize, may_finish: bool) -> Option<StopReason> {
        if descent.epsilon <= descent.aim {
            // Only the last stretch has the kernel that the tolerance is meant for.
            if !may_finish {
                return Some(StopReason::IterationLimit);
            }
            let measured = self.measured(descent.epsilon);
            if measured <= self.options.tolerance {
                return Some(StopReason::ToleranceReached);
            }
            descent.aim = descent.epsilon * (0.95 * self.options.tolerance / measured).max(0.5);
        }
        if self.objective.evaluations >= end {
            return Some(StopReason::IterationLimit);
        }
        let in_vain = self.objective.evaluations > descent.lowest.1 + PATIENCE;
        let stagnated = may_finish && in_vain || self.gains_little(descent);
        let ends = stagnated && !(self.options.tolerance > 0.0);
        (ends || !self.step(descent)).then_some(StopReason::Stagnated)
    }

    /// Whether more evaluations would hardly make the forces quieter, nor the density better by as much in the energy. A descent
    /// for the density alone has no such measure.
    fn gains_little(&self, descent: &Descent<D>) -> bool {
        let Arrangement { kernel, kernel_neighbors, .. } = self.objective.arrangement;
        let count = self.exchange.count(descent.gradient.len()) as f64;
        let unit = descent.frame.lambda * weight_with(kernel, D, kernel_neighbors, 1.0) * count;
        let least = self.options.least_gain * unit;
        descent.course.gain_of_latter_half().is_some_and(|gain| gain < least)
    }

    /// Epsilon as it is measured in the end. At the surfaces of a region that is relaxed by itself it cannot be, and up to
    /// a sixth is added.
    fn measured(&mut self, epsilon: f64) -> f64 {
        if self.objective.arrangement.interfaces().is_some() { 1.2 * epsilon } else { self.objective.measured() }
    }

    /// Begins a stretch of the schedule.
    fn descend(&mut self, stretch: &Stretch) -> Descent<D> {
        let Stretch { kernel, kernel_neighbors, lambda, .. } = *stretch;
        self.objective.see_with(kernel, kernel_neighbors);
        self.begin(weight_with(kernel, D, kernel_neighbors, lambda))
    }

    fn begin(&mut self, lambda: f64) -> Descent<D> {
        self.objective.sort();
        let frame = self.objective.frame(lambda);
        let now = self.objective.evaluate(&frame);
        self.note(&now, 0.0);
        let (energy, epsilon) = (now.energy, now.fit.epsilon);
        let gradient = self.gradient(&frame, now);
        let lowest = (epsilon, self.objective.evaluations);
        let aim = self.options.tolerance;
        let course = Course::new(self.objective.evaluations, energy);
        Descent { frame, memory: Lbfgs::new(), gradient, energy, course, epsilon, aim, lowest }
    }

    /// That of the objective.
    fn gradient(&self, frame: &Frame, now: Evaluation<D>) -> Vec<[f32; D]> {
        let gradient = self.objective.gradient(frame, now);
        parallel::map(gradient.len(), |i| gradient[i].map(|g| g as f32))
    }

    /// Looks for surfaces and for the smoothed target anew, and takes up what the objective is then.
    fn look_again(&mut self, descent: &mut Descent<D>) {
        let surfaces = self.exchange.count(self.objective.arrangement.refresh_interfaces());
        let aims = self.objective.look_again(&descent.frame);
        if surfaces == 0 && !aims {
            return;
        }
        let now = self.objective.evaluate(&descent.frame);
        descent.course.shift(now.energy - descent.energy);
        descent.take(&now, self.objective.evaluations);
        descent.gradient = self.gradient(&descent.frame, now);
        // Curvature does not change much with the surfaces about a few.
        if aims || surfaces as f64 > MANY * self.exchange.count(descent.gradient.len()) as f64 {
            descent.memory.clear();
        }
    }

    /// One step downhill; false where there is no way down.
    fn step(&mut self, descent: &mut Descent<D>) -> bool {
        loop {
            let Descent { frame, memory, gradient, energy, .. } = descent;
            let exchange = self.exchange;
            let mut direction = memory.direction_among(exchange, gradient);
            let mut slope = product_among(exchange, &direction, gradient);
            if !(slope < 0.0) {
                memory.clear();
                direction = memory.direction_among(exchange, gradient);
                slope = product_among(exchange, &direction, gradient);
            }
            let longest = exchange.max(longest(&direction));
            if !(longest > 0.0 && longest.is_finite()) {
                return false;
            }
            let first = if memory.is_empty() { FIRST_STEP / longest } else { (MAX_STEP / longest).min(1.0) };
            let Some((next, step, length)) = self.search(frame, *energy, direction, slope, first) else {
                if memory.is_empty() {
                    return false;
                }
                memory.clear();
                continue;
            };
            descent.take(&next, self.objective.evaluations);
            descent.course.push(self.objective.evaluations, next.energy);
            self.note(&next, length);
            let next_gradient = self.gradient(&descent.frame, next);
            descent.memory.push_among(exchange, &step, &descent.gradient, &next_gradient);
            descent.gradient = next_gradient;
            return true;
        }
    }

    /// Back-tracks along `direction` until the energy falls enough.
    fn search(
        &mut self,
        frame: &Frame,
        energy: f64,
        direction: Vec<[f32; D]>,
        slope: f64,
        first: f64,
    ) -> Option<(Evaluation<D>, Vec<[f32; D]>, f64)> {
        let from = self.objective.arrangement.positions().clone();
        let mut t = first;
        for _ in 0..=MAX_HALVINGS {
            let arrangement = &mut self.objective.arrangement;
            arrangement.displace(&from, &direction, t, &frame.spacing, &frame.spacing, MAX_STEP);
            let next = self.objective.evaluate(frame);
            if next.energy <= energy + ARMIJO * t * slope {
                drop(direction);
                let arrangement = &self.objective.arrangement;
                let step =
                    parallel::map(from[0].len(), |i| arrangement.step(i, &from, &frame.spacing).map(|v| v as f32));
                let length = self.exchange.max(longest(&step));
                return Some((next, step, length));
            }
            // The parabola through both energies and the slope, within bounds.
            let parabola = -0.5 * slope * t * t / (next.energy - energy - slope * t);
            t = if parabola.is_finite() { parabola.clamp(0.1 * t, 0.5 * t) } else { 0.25 * t };
        }
        self.objective.arrangement.put_back(from);
        None
    }

    fn note(&mut self, now: &Evaluation<D>, length: f64) {
        self.trace.history.push(Progress {
            iteration: self.objective.evaluations,
            epsilon: now.fit.epsilon,
            force_error: None,
            largest_step: length,
            seconds: self.trace.seconds(),
        });
    }
}

fn longest<const D: usize>(v: &[[f32; D]]) -> f64 {
    reduce::max(v.len(), |i| v[i].iter().map(|c| f64::from(*c).powi(2)).sum()).max(0.0).sqrt()
}
