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

use super::arrangement::{Arrangement, SORT_INTERVAL};
use super::fit::{fit_among, interior_among, resolved};
use super::hold::{Held, Hold, as_given};
use super::interfaces::Interfaces;
use super::layers::Layers;
use super::objective::STEEP;
use super::on_ranks::{OverRanks, agreed_stop};
use super::pairs::{COINCIDENT, part_pairs_among};
use super::report::{Progress, StageName, StageReport, StopReason};
use super::snapshot::{Best, Check, Trace, axes, decode, encode};
use super::stage::{Particles, Relaxed, Running, Stage};
use super::stiffness::stiffness;
use crate::target::{Positions, Target, at};
use serde::{Deserialize, Serialize};
use sph::exchange::{Alone, Exchange};
use sph::kernel::{KernelName, default_kernel_neighbors, support_over_spacing};
use sph::neighbors::Sees;
use sph::sums::{self, Bias, Push, Pushes, Weight, push_weight};
use sph::{parallel, reduce};

pub const NAME: StageName = StageName { name: "wvt", title: "WVT" };

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
/// Spacings of an even arrangement beyond which nothing is seen from where the target is not resolved.
const FARTHEST: f64 = 2.0;
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

/// The stage: relaxes particles towards `target`; what comes out is the best state met, by epsilon (re-fitted) of the
/// number density over the interior.
pub struct Wvt<'a, const D: usize> {
    pub kernel: KernelName,
    pub target: Target<'a, D>,
    pub options: WvtOptions,
}

impl<const D: usize> Stage<D> for Wvt<'_, D> {
    fn name(&self) -> StageName {
        NAME
    }

    fn begin(&self, particles: Particles<D>) -> Box<dyn Running<D> + '_> {
        self.begin_among(particles, &Alone)
    }

    fn resume(&self, kept: &[u8]) -> Result<Box<dyn Running<D> + '_>, String> {
        let kept: Snapshot<D> = decode(kept)?;
        kept.check(self.target.count)?;
        Ok(Box::new(self.resumed(kept, &Alone)))
    }

    fn left(&self, kept: &[u8]) -> Result<Particles<D>, String> {
        self.left_by_a_rank(kept)
    }
}

impl<const D: usize> OverRanks<D> for Wvt<'_, D> {
    fn begin_among<'s>(&'s self, particles: Particles<D>, exchange: &'s dyn Exchange) -> Box<dyn Running<D> + 's> {
        let mut positions = particles.positions;
        part_pairs_among(exchange, &self.target, &mut positions, COINCIDENT);
        Box::new(self.begun(positions, None, exchange))
    }

    fn resume_among<'s>(&'s self, kept: &[u8], exchange: &'s dyn Exchange) -> Result<Box<dyn Running<D> + 's>, String> {
        let kept: Snapshot<D> = decode(kept)?;
        kept.check(kept.positions[0].len())?;
        Ok(Box::new(self.resumed(kept, exchange)))
    }

    fn steps(&self, history: &[Progress]) -> (usize, &'static str) {
        (history.len(), "step of WVT")
    }
}

/// The same for some of the particles, in the order in which they were given: others stay where they are, to the bit.
pub struct Holding<'a, const D: usize> {
    pub wvt: Wvt<'a, D>,
    pub others: Others<'a>,
}

/// Those that stay where they are, by the order in which particles are given.
#[derive(Debug, Clone, Copy)]
pub enum Others<'a> {
    /// The target is nothing where they are.
    Apart {
        held: &'a [bool],
        /// Whether densities jump between the two, so that sums across the surface tell nothing: there is no feedback by them then, and the last
        /// state is the best.
        has_jump: bool,
    },
    /// They are of the target as well, in other blocks of it.
    OfTarget(&'a [Hold]),
}

impl Others<'_> {
    fn holds(&self) -> Vec<Hold> {
        match self {
            Self::Apart { held, .. } => held.iter().map(|h| if *h { Hold::Beyond } else { Hold::Free }).collect(),
            Self::OfTarget(holds) => holds.to_vec(),
        }
    }
}

impl<const D: usize> Stage<D> for Holding<'_, D> {
    fn name(&self) -> StageName {
        NAME
    }

    fn begin(&self, particles: Particles<D>) -> Box<dyn Running<D> + '_> {
        Box::new(self.wvt.begun(particles.positions, Some(self.others), &Alone))
    }

    fn resume(&self, _: &[u8]) -> Result<Box<dyn Running<D> + '_>, String> {
        Err("belongs to particles of which some are held, and cannot be continued; start without it".into())
    }
}

/// Which particle each place holds, now and in the best state.
struct Order {
    now: Held,
    best: Vec<u32>,
    has_jump: bool,
}

impl<const D: usize> Wvt<'_, D> {
    /// At the start; without `others` all particles move.
    fn begun<'s>(
        &'s self,
        positions: Positions<D>,
        others: Option<Others<'_>>,
        exchange: &'s dyn Exchange,
    ) -> Relaxation<'s, D> {
        let trace = Trace::new();
        let (neighbors, mirrored) = (self.options.kernel_neighbors, self.target.domain.mirrored());
        let density = self.target.number_densities(&positions);
        let ratio = support_over_spacing(D, neighbors);
        // The target of free particles is nothing where others are held, which is no edge of what they sum over.
        let sharpness = match others {
            Some(Others::Apart { .. }) => Vec::new(),
            _ => self.target.sharpnesses(&positions, &density, ratio),
        };
        let (mut state, order) = Arrangement::with_order(self.kernel, self.target, mirrored, positions, neighbors);
        self.see_interfaces(&mut state, None);
        state.share(exchange, Sees::Targets);
        let count = state.len();
        let is_unresolved = |i: usize| sharpness.get(order[i] as usize).is_some_and(|s| !(*s < 1.0));
        let sorted = parallel::reordered(&density, &order);
        let layers = Layers::find(&self.target, state.positions(), &sorted, is_unresolved);
        let held = others.map(|others| Held::new(order.clone(), &others.holds()));
        Relaxation {
            weights: parallel::map(count, |i| {
                let old = order[i] as usize;
                if held.as_ref().is_some_and(|held| held.of(i) != Hold::Free) {
                    return 0.0;
                }
                if sharpness.is_empty() {
                    return 1.0;
                }
                let support = self.target.support(density[old], ratio);
                let steep = sharpness[old] > STEEP && self.target.steepness(&at(state.positions(), i), support) > STEEP;
                if steep { 0.0 } else { resolved(sharpness[old]) }
            }),
            options: &self.options,
            first_step: self.first_step(),
            iteration: 0,
            excess: vec![0.0; count],
            memory: vec![0.0; count],
            layers,
            best: Best { epsilon: f64::INFINITY, iteration: 0, positions: state.positions().clone() },
            trace,
            state,
            exchange,
            order: held.map(|now| Order {
                now,
                best: order,
                has_jump: matches!(others, Some(Others::Apart { has_jump: true, .. })),
            }),
        }
    }

    /// As it was kept.
    fn resumed<'s>(&'s self, kept: Snapshot<D>, exchange: &'s dyn Exchange) -> Relaxation<'s, D> {
        let Snapshot { iteration, positions, moves, excess, memory, weights, layers, best, interfaces, trace } = kept;
        let (neighbors, mirrored) = (self.options.kernel_neighbors, self.target.domain.mirrored());
        let mut state = Arrangement::of_sorted(self.kernel, self.target, mirrored, positions, moves, neighbors);
        self.see_interfaces(&mut state, interfaces);
        state.share(exchange, Sees::Targets);
        let (options, first_step, trace) = (&self.options, self.first_step(), trace.resumed());
        Relaxation {
            options,
            first_step,
            state,
            exchange,
            iteration,
            excess,
            memory,
            weights,
            layers,
            best,
            trace,
            order: None,
        }
    }

    fn see_interfaces(&self, state: &mut Arrangement<'_, D, f32>, known: Option<Interfaces>) {
        state.see_interfaces(known, &|q| push_weight::<D>(self.options.weight, self.kernel, q));
    }

    fn first_step(&self) -> f64 {
        self.options.step * step_scale(self.options.weight, self.kernel, D, self.options.kernel_neighbors)
    }
}

/// What goes on after an interrupt.
#[derive(Serialize, Deserialize)]
struct Snapshot<const D: usize> {
    iteration: usize,
    #[serde(with = "axes")]
    positions: Positions<D>,
    moves: usize,
    excess: Vec<f64>,
    memory: Vec<f64>,
    weights: Vec<f64>,
    layers: Option<Layers<D>>,
    best: Best<D>,
    /// Of a region that is relaxed by itself.
    interfaces: Option<Interfaces>,
    trace: Trace,
}

impl<const D: usize> Snapshot<D> {
    /// # Errors
    /// What is wrong with it for `count` particles.
    fn check(&self, count: usize) -> Result<(), String> {
        Check::new(count)
            .positions("positions", &self.positions)
            .positions("the best positions", &self.best.positions)
            .scalars("the density excess", &self.excess)
            .scalars("the memory of it", &self.memory)
            .scalars("weights", &self.weights)
            .holds(self.layers.as_ref().is_none_or(|l| l.is_of(count)), "has layers of another number of particles")
            .holds(
                self.interfaces.as_ref().is_none_or(|i| i.is_of::<D>(count)),
                "has surfaces of another number of particles",
            )
            .result()
    }
}

/// The stage under way.
struct Relaxation<'a, const D: usize> {
    options: &'a WvtOptions,
    /// mu of the first iteration.
    first_step: f64,
    state: Arrangement<'a, D, f32>,
    exchange: &'a dyn Exchange,
    iteration: usize,
    /// ln(summed / target density) at the last pass.
    excess: Vec<f64>,
    /// What the corrected volumes remember of it.
    memory: Vec<f64>,
    /// Whether a particle could have the target's density where it began; 0 for those that stay there.
    weights: Vec<f64>,
    layers: Option<Layers<D>>,
    best: Best<D>,
    trace: Trace,
    /// Where particles come out as they were given.
    order: Option<Order>,
}

impl<const D: usize> Running<D> for Relaxation<'_, D> {
    fn advance(&mut self, outside: Option<StopReason>) -> Option<StopReason> {
        if self.state.is_stale(SORT_INTERVAL) {
            self.sort();
        }
        let (iteration, options) = (self.iteration, self.options);
        let density = self.state.target_density();
        let (ratio, target) = (self.state.ratio(), self.state.target);
        // Where the target is not resolved particles need not see far: from next to vacuum, all of the rest.
        let even = target.domain.mean_spacing(target.count);
        let is_free = |i: usize| self.order.as_ref().is_none_or(|order| order.now.of(i) == Hold::Free);
        let weights = &self.weights;
        let farthest = |i: usize| if weights[i] < 0.5 && is_free(i) { FARTHEST * even } else { f64::INFINITY };
        let support = parallel::map(density.len(), |i| ratio * target.spacing(density[i]).min(farthest(i)));
        let pushes = self.pushes(&density, &support);
        let epsilon = self.epsilon(&pushes, &density, &support);
        if self.order.as_ref().is_some_and(|order| order.has_jump) {
            self.best.epsilon = f64::INFINITY;
        } else {
            self.note_excess(&pushes, &density);
        }
        self.best.note(epsilon, iteration, self.state.positions());
        if let Some(order) = self.order.as_mut().filter(|_| self.best.iteration == iteration) {
            order.best.clear();
            order.best.extend_from_slice(order.now.order());
        }
        let reason = self.stop_reason().or(agreed_stop(self.exchange, outside));
        let mut largest_step = 0.0;
        if reason.is_none() && iteration < options.iterations {
            let t = iteration as f64 / options.iterations.max(1) as f64;
            let largest = self.displace(&pushes, &support, self.first_step * options.final_step.powf(t));
            largest_step = self.exchange.max(largest);
        }
        let seconds = self.trace.seconds();
        self.trace.history.push(Progress { iteration, epsilon, force_error: None, largest_step, seconds });
        self.iteration += 1;
        reason.or((iteration >= options.iterations).then_some(StopReason::IterationLimit))
    }

    fn progress(&self) -> (&[Progress], usize) {
        (&self.trace.history, self.options.iterations)
    }

    fn snapshot(&self, to: Vec<u8>) -> Result<Vec<u8>, String> {
        encode(
            &Snapshot {
                iteration: self.iteration,
                positions: self.state.positions().clone(),
                moves: self.state.moves(),
                excess: self.excess.clone(),
                memory: self.memory.clone(),
                weights: self.weights.clone(),
                layers: self.layers.clone(),
                best: self.best.clone(),
                interfaces: self.state.interfaces().cloned(),
                trace: self.trace.kept(),
            },
            to,
        )
    }

    fn finish(self: Box<Self>, stop: StopReason) -> Relaxed<D> {
        let Self { mut best, trace, order, .. } = *self;
        if let Some(order) = order {
            for axis in &mut best.positions {
                *axis = as_given(&order.best, axis);
            }
        }
        let report = StageReport {
            stage: NAME,
            stop,
            best_iteration: best.iteration,
            seconds: trace.seconds(),
            history: trace.history,
        };
        Relaxed { particles: best.positions.into(), reports: vec![report], notes: Vec::new() }
    }
}

impl<const D: usize> Relaxation<'_, D> {
    fn stop_reason(&self) -> Option<StopReason> {
        if self.best.epsilon <= self.options.tolerance {
            Some(StopReason::ToleranceReached)
        } else if self.iteration >= self.best.iteration + PATIENCE {
            Some(StopReason::Stagnated)
        } else {
            None
        }
    }

    fn sort(&mut self) {
        let order = self.state.sort();
        for values in [&mut self.excess, &mut self.memory, &mut self.weights] {
            *values = parallel::reordered(values, &order);
        }
        self.layers.iter_mut().for_each(|layers| layers.reorder(&order));
        if let Some(own) = &mut self.order {
            own.now.reorder(&order);
        }
        self.state.refresh_interfaces();
    }

    fn pushes(&mut self, density: &[f64], support: &[f64]) -> Vec<Push<D>> {
        let &WvtOptions { weight, bias, kernel_neighbors, .. } = self.options;
        let options = Pushes { weight, bias, kernel_neighbors };
        let volume = parallel::map(density.len(), |i| 1.0 / density[i]);
        self.state.mirror(support);
        let mut pushes = match bias {
            Bias::Corrected => {
                let channels = [self.corrected_volumes(density), volume];
                let channels = channels.each_ref().map(Vec::as_slice);
                let state = &self.state;
                state.with_channels(support, channels, [1.0, 1.0], |s| {
                    sums::pushes(state.kernel, &state.domain, s, options)
                })
            }
            Bias::Plain => {
                let (channels, powers) = ([support, &volume], [1.0 / D as f64, 1.0]);
                let state = &self.state;
                state.with_pairs(support, channels, powers, |s| sums::pushes(state.kernel, &state.domain, s, options))
            }
        };
        self.add_beyond(&mut pushes, support);
        pushes
    }

    /// What lies beyond the surfaces of a region pushes, and counts.
    fn add_beyond(&self, pushes: &mut [Push<D>], support: &[f64]) {
        if self.state.interfaces().is_none() {
            return;
        }
        let per_volume = self.state.ratio().powi(D as i32);
        parallel::update(pushes, |i, push| {
            if let Some((missing, medium)) = self.state.missing(i, support[i]) {
                push.number_density += medium * missing.share;
                (0..D).for_each(|k| push.shift[k] += per_volume * missing.push[k]);
            }
        });
    }

    /// Target volumes, raised where the density was above the target at the last pass and lowered where below.
    fn corrected_volumes(&mut self, density: &[f64]) -> Vec<f64> {
        let excess = &self.excess;
        parallel::update(&mut self.memory, |i, m| *m = MEMORY * *m + MEMORY_GAIN * excess[i]);
        let memory = &self.memory;
        let feedback = |e: f64, m: f64| (FEEDBACK * e + m).clamp(-MAX_FEEDBACK, MAX_FEEDBACK).exp();
        parallel::map(density.len(), |i| feedback(excess[i], memory[i]) / density[i])
    }

    /// Keeps ln(summed / target density) for the next pass, with mean density ratio 1.
    fn note_excess(&mut self, pushes: &[Push<D>], density: &[f64]) {
        let n = pushes.len();
        let ratio = |i: usize| pushes[i].number_density / density[i];
        if let Some(order) = &self.order {
            // Those that are not of the target cannot follow: beside finer ones their sums are large, and they would push these away.
            let counts = |i: usize| order.now.of(i) != Hold::Beyond;
            let counted = parallel::count(n, counts).max(1) as f64;
            let mean = reduce::sum(n, |i| if counts(i) { ratio(i) } else { 0.0 }) / counted;
            self.excess = parallel::map(n, |i| if counts(i) { (ratio(i) / mean).ln() } else { 0.0 });
            return;
        }
        let [sum, count] = self.exchange.together([reduce::sum(n, ratio), n as f64]);
        let mean = sum / count;
        self.excess = parallel::map(n, |i| (ratio(i) / mean).ln());
    }

    fn epsilon(&self, pushes: &[Push<D>], density: &[f64], support: &[f64]) -> f64 {
        let (exchange, state) = (self.exchange, &self.state);
        let set = interior_among(exchange, state.target.domain, state.positions(), support, Some(&self.weights));
        fit_among(exchange, set.as_deref(), density, |i| pushes[i].number_density).epsilon
    }

    /// Moves all particles; returns the largest displacement in spacings.
    fn displace(&mut self, pushes: &[Push<D>], support: &[f64], step: f64) -> f64 {
        let ratio = self.state.ratio();
        let (weights, layers) = (&self.weights, self.layers.as_ref());
        self.state.shift(|i, from| {
            if weights[i] == 0.0 {
                return (from, 0.0);
            }
            let spacing = support[i] / ratio;
            let shift = layers.map_or(pushes[i].shift, |layers| layers.along(i, pushes[i].shift));
            let size = step * shift.iter().map(|s| s * s).sum::<f64>().sqrt();
            let limited = if size > MAX_STEP { MAX_STEP / size } else { 1.0 };
            (sph::array(|k| from[k] + limited * step * spacing * shift[k]), size * limited)
        })
    }
}
