//! Weighted Voronoi tessellation relaxation (Diehl et al. 2015, PASA 32, e048, sec. 4).
//!
//! Displacement dx_i = mu h_i sum_j f(h, r_ij) r^_ij away from neighbors, h = H/2, with
//! f = [h/(r + eps)]^2 + const (const such that f(2h) = 0) or f = the SPH kernel.
//!
//! The paper's sum has a bias where the wanted spacing varies: a perfect arrangement still feels a force along
//! the gradient, and the relaxation drifts away from the target. Here each neighbor counts with its target
//! volume V_j = 1/n*_j and distances are measured by the particle's own h, so that in the continuum limit the sum is
//! int n/n* f(r) r^ d^dr, which vanishes by symmetry exactly where n is proportional to n*. [`Bias::Plain`]
//! switches back to the paper's form.
//!
//! The sum lacks the particle's own cell, which reaches farther where particles are sparser: with a cell of
//! radius R(theta) = R_0 (1 - R_0 |grad ln n*| cos(theta) / d) the missing push is f(R_0) R_0 / d grad ln n*, and is
//! added. Without it the error of a 100:1 Gaussian grows again after 16 iterations; with it, it is ten times
//! lower and stays.
//!
//! The smoothing by the kernel is taken out by feedback: V_j is
//! multiplied by a power of the summed over the target density at j, and by a slowly forgetting memory of it.

use super::arrangement::GHOST_DEPTH;
use super::fit::{fit, interior, resolved};
use super::snapshot::{Best, Check, Keep, Start, Trace, axes, forget};
use super::stiffness::stiffness;
use super::{COINCIDENT, Ghosts, Progress, StageReport, StopReason, part_pairs, relaxation_domain};
use crate::domain::Domain;
use crate::kernel::{Kernel, KernelName, default_kernel_neighbors, evaluate, support_over_spacing};
use crate::neighbors::lanes::Real;
use crate::neighbors::{Batch, Compiled, LeafPass, Reach, Shape, Sources, Tree, compiled, drive, in_shape};
use crate::reduce;
use crate::smoothing::{separation, splat};
use crate::target::{Positions, Target, at};
use crate::with_kernel;
use pulp::Simd;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::any::Any;

/// The weight f of a neighbor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Weight {
    /// [h/(r + eps)]^2 + const, the paper's own.
    InverseSquare,
    /// The SPH kernel, the paper's alternative and ALARIC's choice.
    #[default]
    Kernel,
}

impl Weight {
    /// Factor on the step that makes the pushes alike with any kernel and neighbor number, and with both weights: at the
    /// distance of the closest neighbors [h/r]^2 + const is about eight times the kernel's shape.
    fn step_scale(self, kernel: KernelName, d: usize, kernel_neighbors: f64) -> f64 {
        let usual = default_kernel_neighbors(d);
        match self {
            Self::Kernel if (kernel, kernel_neighbors) == (KernelName::default(), usual) => 1.0,
            Self::Kernel => {
                let of = |kernel, neighbors| stiffness(kernel, d, neighbors, FEEDBACK);
                of(KernelName::default(), usual) / of(kernel, kernel_neighbors)
            }
            Self::InverseSquare => 0.125 * usual / kernel_neighbors,
        }
    }
}

/// How neighbors of different target volume count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Bias {
    /// By target volume: no drift along gradients.
    #[default]
    Corrected,
    /// All alike with the mean h of the pair, as in the paper.
    Plain,
}

/// Parameters of the relaxation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WvtOptions {
    pub weight: Weight,
    pub bias: Bias,
    pub iterations: usize,
    /// First displacement scale mu, in units in which the response to one missing neighbor is a spacing.
    pub step: f64,
    /// mu of the last iteration over that of the first.
    pub final_step: f64,
    /// N_H = V_d n H^d.
    pub kernel_neighbors: f64,
    /// Stop when epsilon (re-fitted) is below.
    pub tolerance: f64,
}

impl WvtOptions {
    /// The defaults in `D` dimensions.
    pub fn new(d: usize) -> Self {
        Self {
            weight: Weight::default(),
            bias: Bias::default(),
            iterations: 60,
            step: DEFAULT_STEP,
            final_step: 0.7,
            kernel_neighbors: default_kernel_neighbors(d),
            tolerance: 0.0,
        }
    }
}

const DEFAULT_STEP: f64 = 0.4;

/// Softening of the inverse-square weight, in h; the paper's eps.
const SOFTENING: f64 = 0.01;
/// No particle moves farther per iteration, in its own spacing.
const MAX_STEP: f64 = 0.3;
/// Power of the density ratio in the corrected volumes. Twice as much makes the relaxation oscillate.
const FEEDBACK: f64 = 2.0;
/// What the memory of the density ratio keeps per iteration, and takes up: together a gain of 3.3 for
/// errors that last.
const MEMORY: f64 = 0.97;
const MEMORY_GAIN: f64 = 0.1;
/// Bound on the logarithm of the correction.
const MAX_FEEDBACK: f64 = 1.0;
/// Iterations between sortings of the tree; in between its boxes are fitted to the moved particles.
const SORT_INTERVAL: usize = 8;
/// Iterations without a better state after which the relaxation has stagnated.
const PATIENCE: usize = 20;

/// Sums of one particle.
#[derive(Debug, Clone, Copy)]
struct Push<const D: usize> {
    /// Sum of W at the particle's target support radius.
    number_density: f64,
    /// sum_j (V_j / V_i) f r^_ij, away from neighbors.
    shift: [f64; D],
}

impl<const D: usize> Default for Push<D> {
    fn default() -> Self {
        Self { number_density: 0.0, shift: [0.0; D] }
    }
}

struct PushPass<K> {
    kernel: K,
    weight: Weight,
    bias: Bias,
    kernel_neighbors: f64,
}

fn push_pass(kernel: KernelName, options: &WvtOptions, shape: Shape) -> Box<dyn Any> {
    let &WvtOptions { weight, bias, kernel_neighbors, .. } = options;
    in_shape!(shape, D => with_kernel!(kernel, kernel => {
        let pass = PushPass { kernel, weight, bias, kernel_neighbors };
        Box::new(Box::new(pass) as Compiled<D, 2, f32, Push<D>>)
    }))
}

/// Channel 0: target volume (corrected) or support radius (plain).
impl<const D: usize, K: Kernel, R: Real> LeafPass<D, 2, R> for PushPass<K> {
    type Output = Push<D>;

    #[inline(always)]
    fn leaf<S: Simd>(&self, simd: S, batch: &mut Batch<'_, D, 2, R>, out: &mut [Self::Output]) {
        match (self.weight, self.bias) {
            (Weight::Kernel, Bias::Corrected) => self.targets::<D, R, S, true, true>(simd, batch, out),
            (Weight::Kernel, Bias::Plain) => self.targets::<D, R, S, true, false>(simd, batch, out),
            (Weight::InverseSquare, Bias::Corrected) => self.targets::<D, R, S, false, true>(simd, batch, out),
            (Weight::InverseSquare, Bias::Plain) => self.targets::<D, R, S, false, false>(simd, batch, out),
        }
    }
}

impl<K: Kernel> PushPass<K> {
    #[inline(always)]
    fn targets<const D: usize, R: Real, S: Simd, const KERNEL: bool, const CORRECTED: bool>(
        &self,
        simd: S,
        batch: &Batch<'_, D, 2, R>,
        out: &mut [Push<D>],
    ) {
        let constant = |x: f64| R::splat(simd, R::from_f64(x));
        let length = batch.unit().length;
        let (zero, tiny) = (constant(0.0), constant(1e-12));
        let edge = constant(-(2.0 + SOFTENING).powi(-2));
        for (i, out) in batch.targets().zip(out) {
            let (xs, channels) = batch.registers::<S>();
            let target = splat::<D, R, S>(simd, &batch.target(i));
            let inverse = constant(length / batch.support(i));
            let (mut sum, mut shift, mut gradient) = (zero, [zero; D], [zero; D]);
            let own_volume = batch.target_channel(1, i);
            let (one, per_own) = (constant(1.0), constant(1.0 / own_volume));
            // Plain: H_ij = (H_i + H_j)/2 in buffer units.
            let pair_scale = constant(0.5 * batch.unit().channels[0] / length);
            let pair_own = constant(0.5 * batch.support(i) / length);
            for j in 0..xs[0].len() {
                let (d, q) = separation::<D, R, S>(simd, &xs, &target, inverse, j);
                let (value, slope) = self.kernel.shape::<D, R, S>(simd, q);
                sum = R::add(simd, sum, value);
                let pair_q = if CORRECTED {
                    q
                } else {
                    let pair_support = R::mul_add(simd, pair_scale, channels[0][j], pair_own);
                    R::div(simd, R::mul(simd, q, constant(batch.support(i) / length)), pair_support)
                };
                let mut f = if KERNEL {
                    if CORRECTED { value } else { self.kernel.shape::<D, R, S>(simd, pair_q).0 }
                } else {
                    let root =
                        R::div(simd, constant(1.0), R::mul_add(simd, pair_q, constant(2.0), constant(SOFTENING)));
                    R::max(simd, R::mul_add(simd, root, root, edge), zero)
                };
                if CORRECTED {
                    f = R::mul(simd, f, channels[0][j]);
                    // V_j (V_j / V_i - 1) grad W sums to grad V / V.
                    let volume = channels[1][j];
                    let change = R::sub(simd, R::mul(simd, volume, per_own), one);
                    let pull = R::mul(simd, R::mul(simd, volume, change), slope);
                    for k in 0..D {
                        gradient[k] = R::mul_add(simd, d[k], pull, gradient[k]);
                    }
                }
                // r^ = d / r; q H is r. The particle itself has d = 0.
                let pull = R::div(simd, f, R::max(simd, q, tiny));
                for k in 0..D {
                    shift[k] = R::mul_add(simd, d[k], pull, shift[k]);
                }
            }
            let scale = length / batch.support(i) / if CORRECTED { batch.target_channel(0, i) } else { 1.0 };
            let support = batch.support(i);
            let per_length = K::SIGMA[D - 1] * batch.unit().channels[1] * length / support.powi(D as i32 + 2);
            let own_cell = if CORRECTED { self.own_cell::<D>() * support * per_length } else { 0.0 };
            out.number_density = K::SIGMA[D - 1] / batch.support(i).powi(D as i32) * R::sum(simd, sum);
            for k in 0..D {
                out.shift[k] = -scale * R::sum(simd, shift[k]) - own_cell * R::sum(simd, gradient[k]);
            }
        }
    }
}

impl<K: Kernel> PushPass<K> {
    /// f(R_0) R_0 / (d H), R_0 the radius of a ball of one particle's volume: what the missing push of a
    /// particle's own cell weighs against H grad ln n*.
    fn own_cell<const D: usize>(&self) -> f64 {
        let q = self.kernel_neighbors.powf(-1.0 / D as f64);
        let f = match self.weight {
            Weight::Kernel => evaluate::<K, D>(self.kernel, q).0,
            Weight::InverseSquare => (2.0 * q + SOFTENING).powi(-2) - (2.0 + SOFTENING).powi(-2),
        };
        f * q / D as f64
    }
}

/// Relaxes `positions` towards `target` and returns the best state met, by epsilon (re-fitted) of the number
/// density over the interior.
pub fn relax<const D: usize>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: Positions<D>,
    options: &WvtOptions,
    control: &super::Control<'_>,
) -> (Positions<D>, StageReport) {
    relax_kept(kernel, target, Start::New(positions), options, control, &mut forget())
}

/// [`relax`] from new positions or a snapshot, offering snapshots to `keep`.
pub fn relax_kept<const D: usize>(
    kernel: KernelName,
    target: &Target<'_, D>,
    start: Start<D, WvtSnapshot<D>>,
    options: &WvtOptions,
    control: &super::Control<'_>,
    keep: Keep<'_, WvtSnapshot<D>>,
) -> (Positions<D>, StageReport) {
    let domain = relaxation_domain(target.domain);
    let (mut state, mut best, mut trace) = match start {
        Start::New(mut positions) => {
            part_pairs(target, &mut positions, COINCIDENT);
            let state = State::new(target, &domain, positions, options.kernel_neighbors);
            let best = Best { epsilon: f64::INFINITY, iteration: 0, positions: state.positions.clone() };
            (state, best, Trace::new())
        }
        Start::Kept(snapshot) => State::resume(target, &domain, *snapshot, options.kernel_neighbors),
    };
    let step = options.step * options.weight.step_scale(kernel, D, options.kernel_neighbors);
    let mut stop = StopReason::IterationLimit;
    for iteration in state.iterations..=options.iterations {
        let outside = control.stop_reason();
        keep(outside.is_some(), &|| state.snapshot(&best, &trace));
        let pushes = state.pushes(kernel, options);
        let epsilon = state.epsilon(&pushes);
        state.note_excess(&pushes);
        best.note(epsilon, iteration, &state.positions);
        let mut entry = Progress { iteration, epsilon, force_error: None, largest_step: 0.0, seconds: trace.seconds() };
        let reason = stop_reason(&best, iteration, options).or(outside);
        if reason.is_none() && iteration < options.iterations {
            let t = iteration as f64 / options.iterations.max(1) as f64;
            entry.largest_step = state.displace(&pushes, step * options.final_step.powf(t));
        }
        trace.history.push(entry);
        control.report("WVT", iteration, options.iterations, epsilon);
        if let Some(reason) = reason {
            stop = reason;
            break;
        }
    }
    let report = StageReport {
        stage: "wvt",
        stop,
        best_iteration: best.iteration,
        seconds: trace.seconds(),
        history: trace.history,
    };
    (best.positions, report)
}

fn stop_reason<const D: usize>(best: &Best<D>, iteration: usize, options: &WvtOptions) -> Option<StopReason> {
    if best.epsilon <= options.tolerance {
        Some(StopReason::ToleranceReached)
    } else if iteration >= best.iteration + PATIENCE {
        Some(StopReason::Stagnated)
    } else {
        None
    }
}

/// What goes on after an interrupt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WvtSnapshot<const D: usize> {
    iteration: usize,
    #[serde(with = "axes")]
    positions: Positions<D>,
    excess: Vec<f64>,
    memory: Vec<f64>,
    weights: Vec<f64>,
    best: Best<D>,
    trace: Trace,
}

impl<const D: usize> WvtSnapshot<D> {
    /// The best positions, for a run that does not go on.
    pub fn into_positions(self) -> Positions<D> {
        self.best.positions
    }

    /// # Errors
    /// What is wrong with it for `count` particles.
    pub fn check(&self, count: usize) -> Result<(), String> {
        Check::new(count)
            .positions("positions", &self.positions)
            .positions("the best positions", &self.best.positions)
            .scalars("the density excess", &self.excess)
            .scalars("the memory of it", &self.memory)
            .scalars("weights", &self.weights)
            .result()
    }
}

/// Positions with what is derived from them.
struct State<'a, const D: usize> {
    target: &'a Target<'a, D>,
    domain: &'a Domain<D>,
    positions: Positions<D>,
    number_density: Vec<f64>,
    support: Vec<f64>,
    /// H n*^(1/d).
    support_over_spacing: f64,
    tree: Tree<D>,
    iterations: usize,
    /// ln(summed / target density) at the last pass.
    excess: Vec<f64>,
    /// What the corrected volumes remember of it.
    memory: Vec<f64>,
    /// Whether a particle could have the target's density where it began.
    weights: Vec<f64>,
}

impl<'a, const D: usize> State<'a, D> {
    fn new(target: &'a Target<'a, D>, domain: &'a Domain<D>, positions: Positions<D>, kernel_neighbors: f64) -> Self {
        let ratio = support_over_spacing(D, kernel_neighbors);
        let tree = Tree::build(&positions);
        let count = tree.len();
        let wanted = target.number_densities(&positions);
        let weights = target.sharpnesses(&positions, &wanted, ratio).into_par_iter().map(resolved).collect();
        let mut state = Self {
            target,
            domain,
            positions,
            number_density: Vec::new(),
            support: Vec::new(),
            support_over_spacing: ratio,
            tree,
            iterations: 0,
            excess: vec![0.0; count],
            memory: vec![0.0; count],
            weights,
        };
        state.sort();
        state
    }

    fn resume(
        target: &'a Target<'a, D>,
        domain: &'a Domain<D>,
        snapshot: WvtSnapshot<D>,
        kernel_neighbors: f64,
    ) -> (Self, Best<D>, Trace) {
        let WvtSnapshot { iteration, positions, excess, memory, weights, best, trace } = snapshot;
        let state = Self {
            tree: Tree::of_sorted(&positions),
            target,
            domain,
            positions,
            number_density: Vec::new(),
            support: Vec::new(),
            support_over_spacing: support_over_spacing(D, kernel_neighbors),
            iterations: iteration,
            excess,
            memory,
            weights,
        };
        (state, best, trace.resumed())
    }

    fn snapshot(&self, best: &Best<D>, trace: &Trace) -> WvtSnapshot<D> {
        WvtSnapshot {
            iteration: self.iterations,
            positions: self.positions.clone(),
            excess: self.excess.clone(),
            memory: self.memory.clone(),
            weights: self.weights.clone(),
            best: best.clone(),
            trace: trace.kept(),
        }
    }

    /// Sorts particles into tree order, so that arrays and tree agree.
    fn sort(&mut self) {
        self.tree = Tree::build(&self.positions);
        let tree = &self.tree;
        self.positions = std::array::from_fn(|k| tree.to_tree_order(&self.positions[k]));
        self.excess = tree.to_tree_order(&self.excess);
        self.memory = tree.to_tree_order(&self.memory);
        self.weights = tree.to_tree_order(&self.weights);
        self.tree.forget_order();
    }

    fn pushes(&mut self, kernel: KernelName, options: &WvtOptions) -> Vec<Push<D>> {
        if self.iterations > 0 {
            if self.iterations.is_multiple_of(SORT_INTERVAL) { self.sort() } else { self.tree.refit(&self.positions) }
        }
        self.iterations += 1;
        self.number_density = self.target.number_densities(&self.positions);
        let (ratio, target) = (self.support_over_spacing, self.target);
        self.support = self.number_density.par_iter().map(|&n| ratio * target.spacing(n)).collect();
        let channel: Vec<f64> = match options.bias {
            Bias::Corrected => self.corrected_volumes(),
            Bias::Plain => self.support.clone(),
        };
        let volume: Vec<f64> = self.number_density.par_iter().map(|n| 1.0 / n).collect();
        let reach = match options.bias {
            Bias::Corrected => Reach::Target,
            Bias::Plain => Reach::Either,
        };
        let ghosts = Ghosts::mirror(self.domain, &self.positions, |i| GHOST_DEPTH * self.support[i]);
        let real = Sources::new(&self.tree, &self.support, [&channel, &volume], reach);
        if ghosts.positions.is_empty() {
            return self.sum_pushes(kernel, &[real], options);
        }
        let ghost_tree = Tree::build(&ghosts.soa());
        let inherit = |values: &[f64], power: f64| -> Vec<f64> {
            let own: Vec<f64> =
                ghosts.parents.iter().zip(&ghosts.stretch).map(|(&p, s)| values[p as usize] * s.powf(power)).collect();
            ghost_tree.to_tree_order(&own)
        };
        let ghost_support = inherit(&self.support, 1.0 / D as f64);
        let ghost_channel = match options.bias {
            Bias::Corrected => inherit(&channel, 1.0),
            Bias::Plain => ghost_support.clone(),
        };
        let ghost_volume = inherit(&volume, 1.0);
        let mirrored = Sources::new(&ghost_tree, &ghost_support, [&ghost_channel, &ghost_volume], reach);
        self.sum_pushes(kernel, &[real, mirrored], options)
    }

    fn sum_pushes(&self, kernel: KernelName, sources: &[Sources<'_, D, 2>], options: &WvtOptions) -> Vec<Push<D>> {
        let pass = compiled::<D, 2, f32, Push<D>>(|shape| push_pass(kernel, options, shape));
        drive(self.domain, sources, 1.0, &*pass)
    }

    /// Target volumes, raised where the density was above the target at the last pass and lowered where below.
    fn corrected_volumes(&mut self) -> Vec<f64> {
        let excess = &self.excess;
        self.memory.par_iter_mut().zip(excess).for_each(|(m, e)| *m = MEMORY * *m + MEMORY_GAIN * e);
        let feedback = |e: f64, m: f64| (FEEDBACK * e + m).clamp(-MAX_FEEDBACK, MAX_FEEDBACK).exp();
        self.number_density.par_iter().zip(excess).zip(&self.memory).map(|((n, &e), &m)| feedback(e, m) / n).collect()
    }

    /// Keeps ln(summed / target density) for the next pass, with mean density ratio 1.
    fn note_excess(&mut self, pushes: &[Push<D>]) {
        let n = pushes.len();
        let ratio = |i: usize| pushes[i].number_density / self.number_density[i];
        let mean = reduce::sum(n, ratio) / n as f64;
        self.excess = (0..n).into_par_iter().map(|i| (ratio(i) / mean).ln()).collect();
    }

    fn epsilon(&self, pushes: &[Push<D>]) -> f64 {
        let set = interior(self.target.domain, &self.positions, &self.support, Some(&self.weights));
        fit(set.as_deref(), &self.number_density, |i| pushes[i].number_density).epsilon
    }

    /// Moves all particles; returns the largest displacement in spacings.
    fn displace(&mut self, pushes: &[Push<D>], step: f64) -> f64 {
        let (target, domain, positions, support) = (self.target, self.domain, &self.positions, &self.support);
        let ratio = self.support_over_spacing;
        let moved: Vec<([f64; D], f64)> = (0..pushes.len())
            .into_par_iter()
            .map(|i| {
                let from = at(positions, i);
                let spacing = support[i] / ratio;
                let shift = pushes[i].shift;
                let size = step * shift.iter().map(|s| s * s).sum::<f64>().sqrt();
                let limited = if size > MAX_STEP { MAX_STEP / size } else { 1.0 };
                let mut x: [f64; D] = std::array::from_fn(|k| from[k] + limited * step * spacing * shift[k]);
                domain.confine(&from, &mut x);
                if target.admits(&x) { (x, size * limited) } else { (from, 0.0) }
            })
            .collect();
        let largest = reduce::max(moved.len(), |i| moved[i].1);
        for k in 0..D {
            self.positions[k].par_iter_mut().zip(&moved).for_each(|(x, m)| *x = m.0[k]);
        }
        largest
    }
}
