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
use super::{COINCIDENT, Progress, StageReport, StopReason, part_pairs};
use crate::target::{Positions, Target, at};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sph::domain::Domain;
use sph::kernel::{KernelName, default_kernel_neighbors, support_over_spacing};
use sph::neighbors::{GhostTree, Reach, Sources, Tree};
use sph::reduce;
use sph::sums::{Bias, Push, Pushes, Weight, pushes};

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

/// Factor on the step that makes the pushes alike with any kernel and neighbor number, and with both weights: at the
/// distance of the closest neighbors [h/r]^2 + const is about eight times the kernel's shape.
fn step_scale(weight: Weight, kernel: KernelName, d: usize, kernel_neighbors: f64) -> f64 {
    let usual = default_kernel_neighbors(d);
    match weight {
        Weight::Kernel if (kernel, kernel_neighbors) == (KernelName::default(), usual) => 1.0,
        Weight::Kernel => {
            let of = |kernel, neighbors| stiffness(kernel, d, neighbors, FEEDBACK);
            of(KernelName::default(), usual) / of(kernel, kernel_neighbors)
        }
        Weight::InverseSquare => 0.125 * usual / kernel_neighbors,
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
    let domain = target.domain.mirrored();
    let (mut state, mut best, mut trace) = match start {
        Start::New(mut positions) => {
            part_pairs(target, &mut positions, COINCIDENT);
            let state = State::new(target, &domain, positions, options.kernel_neighbors);
            let best = Best { epsilon: f64::INFINITY, iteration: 0, positions: state.positions.clone() };
            (state, best, Trace::new())
        }
        Start::Kept(snapshot) => State::resume(target, &domain, *snapshot, options.kernel_neighbors),
    };
    let step = options.step * step_scale(options.weight, kernel, D, options.kernel_neighbors);
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
        let ghosts = GhostTree::mirror(self.domain, &self.positions, |i| GHOST_DEPTH * self.support[i]);
        let real = Sources::new(&self.tree, &self.support, [&channel, &volume], reach);
        let Some(ghosts) = ghosts else { return self.sum_pushes(kernel, &[real], options) };
        let ghost_support = ghosts.inherit(&self.support, 1.0 / D as f64);
        let ghost_channel = match options.bias {
            Bias::Corrected => ghosts.inherit(&channel, 1.0),
            Bias::Plain => ghost_support.clone(),
        };
        let ghost_volume = ghosts.inherit(&volume, 1.0);
        let mirrored = Sources::new(&ghosts.tree, &ghost_support, [&ghost_channel, &ghost_volume], reach);
        self.sum_pushes(kernel, &[real, mirrored], options)
    }

    fn sum_pushes(&self, kernel: KernelName, sources: &[Sources<'_, D, 2>], options: &WvtOptions) -> Vec<Push<D>> {
        let &WvtOptions { weight, bias, kernel_neighbors, .. } = options;
        pushes(kernel, self.domain, sources, Pushes { weight, bias, kernel_neighbors })
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
