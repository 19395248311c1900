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
//! brings them to rest, and past [`most_neighbors_without_pairs`] the last stage fits the density alone.
//!
//! H follows the target, not the particles, so that no smoothing-length iteration is needed and the gradient
//! is exact with one density pass and one pass over what others see. kappa = <n*/n> is held within a stage;
//! at the solution n = n*/kappa, and H is the support radius with N_H neighbors.
//!
//! Weights w_i = 1 / (1 + S_i^4), S_i the sharpness of the target ([`Target::sharpness`]), leave out particles at
//! steep surfaces, jumps and kinks: no arrangement has the target's density there, and chasing it would clump
//! them. There the pressure energy alone places the particles, except within reach of a jump
//! ([`Target::is_discontinuous_near`]): what a sum counts too much on the thin side of it would drive particles away, so those
//! stay where seed and WVT have put them.

use super::arrangement::{Arrangement, reordered};
use super::fit::{Fit, fit, interior, resolved};
use super::lbfgs::{Lbfgs, product};
use super::snapshot::{Check, Keep, Start, Trace, axes, forget, rows};
use super::{COINCIDENT, Control, Progress, StageReport, StopReason, part_pairs};
use crate::target::{Positions, Target, at};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sph::kernel::{
    KernelName, default_kernel_neighbors, most_neighbors_without_pairs, own_count, support_over_spacing,
};
use sph::lanes::Real;
use sph::reduce;
use sph::sums::DensitySums;

/// Parameters of the solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverOptions {
    /// N_H = V_d n H^d.
    pub kernel_neighbors: f64,
    /// Evaluations of the objective, at most.
    pub evaluations: usize,
    /// What matters more: 0 the exact density, 1 quiet forces.
    pub quietness: f64,
    /// Stop when epsilon (re-fitted, as measured in the end) is below.
    pub tolerance: f64,
    /// The start is in order (shells, a lattice, a glass): there is no stage that brings it to rest.
    pub settled: bool,
}

impl SolverOptions {
    /// The defaults in `D` dimensions.
    pub fn new(d: usize) -> Self {
        Self {
            kernel_neighbors: default_kernel_neighbors(d),
            evaluations: 100,
            quietness: 0.5,
            tolerance: 0.0,
            settled: false,
        }
    }

    /// The quietest forces with which epsilon gets below `tolerance`: with the weight lambda it ends between about
    /// 1e-3 (a uniform box) and 3e-2 lambda^2 (a planet's jump), as the default does in `cargo bench --bench roads`.
    pub fn quietness_for(tolerance: f64) -> f64 {
        let lambda = (tolerance / 2.5e-2).sqrt();
        (1.0 + lambda.log10() / QUIETNESS_DECADES).clamp(0.0, 1.0)
    }

    /// The stages for `kernel` in `d` dimensions.
    fn schedule(&self, kernel: KernelName, d: usize) -> Vec<Stage> {
        // 0 at the end: an exact density leaves no room for the pressure energy.
        let last = if self.quietness > 0.0 { 10f64.powf(QUIETNESS_DECADES * (self.quietness - 1.0)) } else { 0.0 };
        let single = self.settled || self.tolerance > 0.0;
        let own = |lambda, share| Stage { kernel, kernel_neighbors: self.kernel_neighbors, lambda, share };
        let at_rest = if single { last } else { 1.0 };
        match most_neighbors_without_pairs(kernel, d) {
            Some(most) => {
                let (kernel, kernel_neighbors) = (KernelName::default(), default_kernel_neighbors(d));
                // Without a pressure energy of its own the last stage is the shorter the quieter the end is to be.
                let (last, share) = match self.kernel_neighbors > most {
                    true => (0.0, 0.4 * (2.0 - 2.0 * self.quietness).min(1.0)),
                    false => (last, 0.4),
                };
                vec![Stage { kernel, kernel_neighbors, lambda: at_rest, share: 1.0 - share }, own(last, share)]
            }
            None if single => vec![own(last, 1.0)],
            None => vec![own(at_rest, 0.6), own(last, 0.4)],
        }
    }
}

/// A part of the descent.
#[derive(Debug, Clone, Copy)]
struct Stage {
    kernel: KernelName,
    kernel_neighbors: f64,
    /// Weight of the pressure energy, before [`weight_with`].
    lambda: f64,
    /// Of the evaluations.
    share: f64,
}

/// Decades of lambda between most exact and most quiet, where it is 1.
const QUIETNESS_DECADES: f64 = 5.0;

/// Weight of the pressure energy with any kernel for one `lambda`, which is meant for the default kernel and
/// neighbor number. Both sums change with what one neighbor counts, the energy in proportion, the squares faster:
/// the weight follows the share that a particle has in its own density.
fn weight_with(kernel: KernelName, d: usize, kernel_neighbors: f64, lambda: f64) -> f64 {
    let usual = own_count(KernelName::default(), d) / default_kernel_neighbors(d);
    lambda * own_count(kernel, d) / kernel_neighbors / usual
}

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

/// Improves `positions`. What comes out is the last state, or the first where epsilon rose.
pub fn solve_density<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: Positions<D>,
    options: &SolverOptions,
    control: &Control<'_>,
) -> (Positions<D>, StageReport) {
    solve_density_kept::<D, R>(kernel, target, Start::New(positions), options, control, &mut forget())
}

/// [`solve_density`] from new positions or a snapshot, offering snapshots to `keep`.
pub fn solve_density_kept<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    start: Start<D, SolverSnapshot<D>>,
    options: &SolverOptions,
    control: &Control<'_>,
    keep: Keep<'_, SolverSnapshot<D>>,
) -> (Positions<D>, StageReport) {
    rayon::scope(|_| run::<D, R>(kernel, target, start, options, control, keep))
}

fn run<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    start: Start<D, SolverSnapshot<D>>,
    options: &SolverOptions,
    control: &Control<'_>,
    keep: Keep<'_, SolverSnapshot<D>>,
) -> (Positions<D>, StageReport) {
    let domain = target.domain.mirrored();
    let schedule = options.schedule(kernel, D);
    let (mut solver, before, first, mut kept) = match start {
        Start::New(mut positions) => {
            part_pairs(target, &mut positions, COINCIDENT);
            let before = positions.clone();
            let arrangement = Arrangement::new(kernel, target, &domain, positions, options.kernel_neighbors);
            let mut solver = Solver::<D, R>::new(arrangement, options, control);
            if schedule[0].kernel != kernel {
                // What the end is compared with.
                let frame = solver.frame(0.0);
                let now = solver.evaluate(&frame);
                solver.note(&now, 0.0);
            }
            (solver, before, 0, None)
        }
        Start::Kept(snapshot) => {
            let SolverSnapshot { stage, positions, moves, before, descent, kappa, evaluations, trace } = *snapshot;
            let Stage { kernel, kernel_neighbors, .. } = schedule[stage.min(schedule.len() - 1)];
            let arrangement = Arrangement::of_sorted(kernel, target, &domain, positions, moves, kernel_neighbors);
            let (kappa, trace) = (Some(kappa), trace.resumed());
            let solver = Solver { arrangement, options, control, kappa, evaluations, trace };
            (solver, before, stage, Some(descent))
        }
    };
    let mut stop = StopReason::IterationLimit;
    for (index, stage) in schedule.iter().enumerate().skip(first) {
        let share: f64 = schedule[..=index].iter().map(|s| s.share).sum();
        let last = index + 1 == schedule.len();
        let end = if last { options.evaluations } else { (share * options.evaluations as f64) as usize };
        let mut keep_stage = |stopping: bool, snapshot: &dyn Fn() -> SolverSnapshot<D>| {
            keep(stopping, &|| SolverSnapshot { stage: index, before: before.clone(), ..snapshot() });
        };
        solver.see_with(stage.kernel, stage.kernel_neighbors);
        let lambda = weight_with(stage.kernel, D, stage.kernel_neighbors, stage.lambda);
        stop = solver.stage(lambda, end, last, kept.take(), &mut keep_stage);
        if matches!(stop, StopReason::TimeLimit | StopReason::Interrupted | StopReason::ToleranceReached) {
            break;
        }
    }
    let Solver { arrangement, trace, .. } = solver;
    let ends = trace.history.first().zip(trace.history.last());
    // Cut short, the first stage may not have made up yet for what it gave away.
    let rose = ends.is_some_and(|(first, last)| last.epsilon > first.epsilon);
    let best_iteration = ends.map_or(0, |(first, last)| if rose { first.iteration } else { last.iteration });
    let positions = if rose { before } else { arrangement.positions };
    let report =
        StageReport { stage: "solver", stop, best_iteration, seconds: trace.seconds(), history: trace.history };
    (positions, report)
}

/// Seconds that one evaluation of the objective with its gradient takes at `positions`, the mean of `repeats`: what a step
/// costs beside its direction and its move.
pub fn time_evaluation<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: Positions<D>,
    options: &SolverOptions,
    repeats: u32,
) -> f64 {
    let domain = target.domain.mirrored();
    let never = std::sync::atomic::AtomicBool::new(false);
    let control = Control { deadline: None, interrupted: &never, observer: &|_, _, _, _| {} };
    let arrangement = Arrangement::new(kernel, target, &domain, positions, options.kernel_neighbors);
    let mut solver = Solver::<D, R>::new(arrangement, options, &control);
    let frame = solver.frame(weight_with(kernel, D, options.kernel_neighbors, 1.0));
    let start = std::time::Instant::now();
    for _ in 0..repeats {
        let now = solver.evaluate(&frame);
        std::hint::black_box(solver.gradient(&frame, &now));
    }
    start.elapsed().as_secs_f64() / f64::from(repeats.max(1))
}

/// What goes on after an interrupt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolverSnapshot<const D: usize> {
    /// Of the schedule.
    stage: usize,
    #[serde(with = "axes")]
    positions: Positions<D>,
    /// Since the last sorting.
    moves: usize,
    /// Where the solver began.
    #[serde(with = "axes")]
    before: Positions<D>,
    descent: Descent<D>,
    kappa: f64,
    evaluations: usize,
    trace: Trace,
}

impl<const D: usize> SolverSnapshot<D> {
    /// The best positions, for a run that does not go on.
    pub fn into_positions(self) -> Positions<D> {
        self.positions
    }

    /// # Errors
    /// What is wrong with it for `count` particles.
    pub fn check(&self, count: usize) -> Result<(), String> {
        Check::new(count)
            .positions("positions", &self.positions)
            .positions("the first positions", &self.before)
            .scalars("weights", &self.descent.frame.weights)
            .scalars("spacings", &self.descent.frame.spacing)
            .vectors("the gradient", &self.descent.gradient)
            .holds(
                [0, count].contains(&self.descent.frame.held.len()),
                "says of another number of particles which are held",
            )
            .holds(self.descent.memory.is_of(count), "has another number of gradients than of particles")
            .result()
    }
}

pub(super) struct Solver<'a, const D: usize, R> {
    pub arrangement: Arrangement<'a, D, R>,
    options: &'a SolverOptions,
    control: &'a Control<'a>,
    /// With the present kernel; none before the first evaluation with it.
    kappa: Option<f64>,
    evaluations: usize,
    trace: Trace,
}

/// What is held within a stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Frame {
    lambda: f64,
    kappa: f64,
    weights: Vec<f64>,
    /// Particles near jumps, which stay; empty without any.
    held: Vec<bool>,
    /// Spacing of each particle, the unit of its moves.
    pub spacing: Vec<f64>,
}

/// A descent under way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Descent<const D: usize> {
    frame: Frame,
    memory: Lbfgs<D>,
    #[serde(with = "rows")]
    gradient: Vec<[f64; D]>,
    energy: f64,
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
        self.frame.weights = reordered(&self.frame.weights, order);
        self.frame.spacing = reordered(&self.frame.spacing, order);
        if !self.frame.held.is_empty() {
            self.frame.held = reordered(&self.frame.held, order);
        }
        self.gradient = reordered(&self.gradient, order);
        self.memory.reorder(order);
    }
}

/// The objective at one arrangement.
pub(super) struct Evaluation<const D: usize> {
    pub energy: f64,
    fit: Fit,
    support: Vec<f64>,
    wanted: Vec<f64>,
    sums: Vec<DensitySums<D>>,
    mean: f64,
    mean_square: f64,
}

impl<'a, const D: usize, R: Real> Solver<'a, D, R> {
    pub fn new(arrangement: Arrangement<'a, D, R>, options: &'a SolverOptions, control: &'a Control<'a>) -> Self {
        Self { arrangement, options, control, kappa: None, evaluations: 0, trace: Trace::new() }
    }

    /// Goes on with another kernel.
    fn see_with(&mut self, kernel: KernelName, kernel_neighbors: f64) {
        let now = (self.arrangement.kernel, self.arrangement.kernel_neighbors);
        if now != (kernel, kernel_neighbors) {
            (self.arrangement.kernel, self.arrangement.kernel_neighbors) = (kernel, kernel_neighbors);
            self.kappa = None;
        }
    }

    /// Minimizes for one lambda until `end` evaluations have been made, from the beginning or from what was `kept`.
    fn stage(
        &mut self,
        lambda: f64,
        end: usize,
        may_finish: bool,
        kept: Option<Descent<D>>,
        keep: Keep<'_, SolverSnapshot<D>>,
    ) -> StopReason {
        let mut descent = kept.unwrap_or_else(|| self.begin(lambda));
        loop {
            if self.arrangement.is_stale(SORT_INTERVAL) {
                let order = self.arrangement.sort();
                descent.reorder(&order);
            }
            let outside = self.control.stop_reason();
            keep(outside.is_some(), &|| self.snapshot(&descent));
            if let Some(reason) = outside {
                return reason;
            }
            if descent.epsilon <= descent.aim {
                // Only the last stage has the kernel that the tolerance is meant for.
                if !may_finish {
                    return StopReason::IterationLimit;
                }
                let measured = self.measured();
                if measured <= self.options.tolerance {
                    return StopReason::ToleranceReached;
                }
                descent.aim = descent.epsilon * (0.95 * self.options.tolerance / measured).max(0.5);
            }
            if self.evaluations >= end {
                return StopReason::IterationLimit;
            }
            let in_vain = self.evaluations > descent.lowest.1 + PATIENCE;
            if may_finish && in_vain && !(self.options.tolerance > 0.0) {
                return StopReason::Stagnated;
            }
            if !self.step(&mut descent) {
                return StopReason::Stagnated;
            }
        }
    }

    fn begin(&mut self, lambda: f64) -> Descent<D> {
        self.arrangement.sort();
        let frame = self.frame(lambda);
        let now = self.evaluate(&frame);
        let gradient = self.gradient(&frame, &now);
        self.note(&now, 0.0);
        let epsilon = now.fit.epsilon;
        let lowest = (epsilon, self.evaluations);
        let aim = self.options.tolerance;
        Descent { frame, memory: Lbfgs::new(), gradient, energy: now.energy, epsilon, aim, lowest }
    }

    /// One step downhill; false where there is no way down.
    fn step(&mut self, descent: &mut Descent<D>) -> bool {
        loop {
            let Descent { frame, memory, gradient, energy, .. } = descent;
            let mut direction = memory.direction(gradient);
            let mut slope = product(&direction, gradient);
            if !(slope < 0.0) {
                memory.clear();
                direction = memory.direction(gradient);
                slope = product(&direction, gradient);
            }
            let longest = longest(&direction);
            if !(longest > 0.0 && longest.is_finite()) {
                return false;
            }
            let first = if memory.is_empty() { FIRST_STEP / longest } else { (MAX_STEP / longest).min(1.0) };
            let Some((next, step, length)) = self.search(frame, *energy, &direction, slope, first) else {
                if memory.is_empty() {
                    return false;
                }
                memory.clear();
                continue;
            };
            let next_gradient = self.gradient(frame, &next);
            memory.push(&step, gradient, &next_gradient);
            *gradient = next_gradient;
            descent.take(&next, self.evaluations);
            self.note(&next, length);
            return true;
        }
    }

    /// All but what the schedule knows.
    fn snapshot(&self, descent: &Descent<D>) -> SolverSnapshot<D> {
        SolverSnapshot {
            stage: 0,
            positions: self.arrangement.positions.clone(),
            moves: self.arrangement.moves(),
            before: std::array::from_fn(|_| Vec::new()),
            descent: descent.clone(),
            kappa: self.kappa.unwrap_or(1.0),
            evaluations: self.evaluations,
            trace: self.trace.kept(),
        }
    }

    /// Back-tracks along `direction` until the energy falls enough.
    fn search(
        &mut self,
        frame: &Frame,
        energy: f64,
        direction: &[[f64; D]],
        slope: f64,
        first: f64,
    ) -> Option<(Evaluation<D>, Vec<[f64; D]>, f64)> {
        let from = self.arrangement.positions.clone();
        let mut t = first;
        for _ in 0..=MAX_HALVINGS {
            let step = self.arrangement.displace(&from, direction, t, &frame.spacing, &frame.spacing, MAX_STEP);
            let next = self.evaluate(frame);
            if next.energy <= energy + ARMIJO * t * slope {
                let length = longest(&step);
                return Some((next, step, length));
            }
            // The parabola through both energies and the slope, within bounds.
            let parabola = -0.5 * slope * t * t / (next.energy - energy - slope * t);
            t = if parabola.is_finite() { parabola.clamp(0.1 * t, 0.5 * t) } else { 0.25 * t };
        }
        self.arrangement.positions = from;
        self.arrangement.moved();
        None
    }

    fn supports(&self, wanted: &[f64], kappa: f64) -> Vec<f64> {
        let target = self.arrangement.target;
        let ratio = support_over_spacing(D, self.arrangement.kernel_neighbors) * kappa.powf(1.0 / D as f64);
        wanted.par_iter().map(|&w| ratio * target.spacing(w).min(self.arrangement.domain.size())).collect()
    }

    /// Fits kappa and freezes what a stage holds.
    pub fn frame(&mut self, lambda: f64) -> Frame {
        let target = self.arrangement.target;
        let wanted = target.number_densities(&self.arrangement.positions);
        let positions = &self.arrangement.positions;
        let spacing: Vec<f64> = wanted.par_iter().map(|&w| target.spacing(w)).collect();
        let ratio = support_over_spacing(D, self.arrangement.kernel_neighbors);
        let sharpness = target.sharpnesses(positions, &wanted, ratio);
        let held = target.near_discontinuities(positions, &wanted, &sharpness, ratio);
        let weights = sharpness.into_par_iter().map(resolved).collect();
        let mut frame = Frame { lambda, kappa: self.kappa.unwrap_or(1.0), weights, held, spacing };
        // The first evaluation tells kappa; from then on it barely changes.
        if self.kappa.is_none() {
            frame.kappa = self.evaluate(&frame).fit.factor;
            self.kappa = Some(frame.kappa);
        }
        frame
    }

    pub fn evaluate(&mut self, frame: &Frame) -> Evaluation<D> {
        self.evaluations += 1;
        let wanted = self.arrangement.wanted();
        let support = self.supports(&wanted, frame.kappa);
        self.arrangement.mirror(&support);
        let sums = self.arrangement.densities(&support);
        let (n, w) = (wanted.len(), &frame.weights);
        let q = |i: usize| sums[i].number_density / wanted[i];
        let [total, weighted, pressure] = reduce::sums(n, |i| [w[i], w[i] * q(i), q(i)]);
        let mean = weighted / total;
        let [squares] = reduce::sums(n, |i| [w[i] * (q(i) / mean - 1.0).powi(2)]);
        let energy = 0.5 * squares + frame.lambda * pressure;
        let set = interior(self.arrangement.target.domain, &self.arrangement.positions, &support, Some(w));
        let fit = fit(set.as_deref(), &wanted, |i| sums[i].number_density);
        Evaluation { energy, fit, support, wanted, sums, mean, mean_square: squares / total }
    }

    /// dE/dx in units of the particles' spacings.
    pub fn gradient(&self, frame: &Frame, now: &Evaluation<D>) -> Vec<[f64; D]> {
        let response: Vec<f64> = (0..now.wanted.len())
            .into_par_iter()
            .map(|i| {
                let q = now.sums[i].number_density / now.wanted[i];
                frame.weights[i] * (q / now.mean - 1.0 - now.mean_square) / now.mean + frame.lambda
            })
            .collect();
        let strength: Vec<f64> = response.par_iter().zip(&now.wanted).map(|(r, w)| r / w).collect();
        let mut out = self.arrangement.gradient(&now.support, &strength, &now.sums);
        let positions = &self.arrangement.positions;
        out.par_iter_mut().enumerate().for_each(|(i, g)| {
            if frame.held.get(i) == Some(&true) {
                *g = [0.0; D];
                return;
            }
            let slope = self.log_slope(&at(positions, i), now.wanted[i], frame.spacing[i]);
            // n* enters through q and through the support radius.
            let through_support =
                if self.arrangement.target.spacing_follows(now.wanted[i]) { now.sums[i].slope / D as f64 } else { 0.0 };
            let own = -strength[i] * (now.sums[i].number_density + through_support);
            *g = std::array::from_fn(|k| frame.spacing[i] * (g[k] + own * slope[k]));
        });
        out
    }

    /// Epsilon as it is measured in the end: at solved support radii, and over what is resolved now.
    fn measured(&mut self) -> f64 {
        let (wanted, kappa) = (self.arrangement.wanted(), self.kappa.unwrap_or(1.0));
        let solved = self.arrangement.solve(&self.supports(&wanted, kappa));
        let support: Vec<f64> = solved.par_iter().map(|s| s.support).collect();
        let (target, positions) = (self.arrangement.target, &self.arrangement.positions);
        let weights: Vec<f64> = (0..wanted.len())
            .into_par_iter()
            .map(|i| resolved(target.sharpness(&at(positions, i), wanted[i], support[i])))
            .collect();
        let set = interior(target.domain, positions, &support, Some(&weights));
        fit(set.as_deref(), &wanted, |i| solved[i].sums.number_density).epsilon
    }

    fn log_slope(&self, x: &[f64; D], wanted: f64, spacing: f64) -> [f64; D] {
        let step = GRADIENT_STEP * spacing.min(self.arrangement.domain.size());
        self.arrangement.target.log_slope(x, wanted, step)
    }

    fn note(&mut self, now: &Evaluation<D>, length: f64) {
        self.trace.history.push(Progress {
            iteration: self.evaluations,
            epsilon: now.fit.epsilon,
            force_error: None,
            largest_step: length,
            seconds: self.trace.seconds(),
        });
        self.control.report("solver", self.evaluations, self.options.evaluations, now.fit.epsilon);
    }
}

/// Step of the differences of the target, in spacings: truncation and rounding both stay below 1e-6.
const GRADIENT_STEP: f64 = 1e-6;

fn longest<const D: usize>(v: &[[f64; D]]) -> f64 {
    reduce::max(v.len(), |i| v[i].iter().map(|c| c * c).sum()).max(0.0).sqrt()
}
