//! The function that the density solver minimizes, and its gradient, see [`super::solver`].

use super::aim::{Aims, Points, Smoothed, share};
use super::arrangement::Arrangement;
use super::fit::{Fit, fit_among, interior_among, resolved};
use super::hold::{Held, Hold};
use super::interfaces::Interfaces;
use super::layers::Layers;
use crate::metrics::LedgerOf;
use crate::target::at;
use serde::{Deserialize, Serialize};
use sph::kernel::{KernelName, support_over_spacing};
use sph::lanes::Real;
use sph::sums::{DensitySums, Search};
use sph::{parallel, reduce};
use std::sync::Arc;

/// The objective of an arrangement that changes.
pub(super) struct Objective<'a, const D: usize, R> {
    pub arrangement: Arrangement<'a, D, R>,
    /// With the present kernel; none before the first evaluation with it.
    pub kappa: Option<f64>,
    /// The start is in order: where no sum can follow the target, nothing is better.
    pub settled: bool,
    /// All particles aim at the smoothed target, wherever it is resolved.
    pub smoothed: bool,
    /// Made so far.
    pub evaluations: usize,
    /// Where the target is not resolved; none where it is.
    pub aims: Option<Aims<D>>,
    pub points: Points<D>,
    /// What is known of the whole target already.
    pub ledger: Option<Arc<LedgerOf<'a, D>>>,
    /// Particles that move along layers thinner than their spacing; none where there are none.
    pub layers: Option<Layers<D>>,
    /// Which particles stay, of a block of a target.
    pub holds: Option<Held>,
    /// Kappa of all blocks, where it is known: then it is that of this one.
    pub common: Option<f64>,
}

/// What is held within a descent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Frame {
    /// Weight of the pressure energy.
    pub lambda: f64,
    kappa: f64,
    pub weights: Vec<f64>,
    /// What the pressure energy counts particles that see far more than their own surroundings; empty where there are none.
    pressure: Vec<f64>,
    /// Particles near jumps, and where the target is steep, which stay; empty without any.
    pub held: Vec<bool>,
    /// Spacing of each particle, the unit of its moves.
    pub spacing: Vec<f64>,
}

impl Frame {
    /// Follows the particles into a new order, see [`Arrangement::sort`].
    pub fn reorder(&mut self, order: &[u32]) {
        self.weights = parallel::reordered(&self.weights, order);
        self.spacing = parallel::reordered(&self.spacing, order);
        if !self.pressure.is_empty() {
            self.pressure = parallel::reordered(&self.pressure, order);
        }
        if !self.held.is_empty() {
            self.held = parallel::reordered(&self.held, order);
        }
    }

    /// Takes weight from particles of which more than [`CROWDED`] times their density is within their support: what they
    /// see is not theirs to change, and would drown what all others see.
    fn forget_crowds(&mut self, crowding: &[f64]) {
        let share = |i: usize| (CROWDED / crowding[i]).min(1.0);
        if crowding.iter().all(|c| *c <= CROWDED) {
            return;
        }
        parallel::update(&mut self.weights, |i, w| *w *= share(i).powi(4));
        self.pressure = parallel::map(crowding.len(), |i| share(i).powi(2));
    }

    /// Holds those that stay; what sums do not tell of some of them does not count.
    fn hold(&mut self, holds: &Held) {
        let count = self.weights.len();
        let is_beyond = |i: usize| holds.of(i) == Hold::Beyond;
        parallel::update(&mut self.weights, |i, w| *w = if is_beyond(i) { 0.0 } else { *w });
        self.pressure.resize(count, 1.0);
        parallel::update(&mut self.pressure, |i, p| *p = if is_beyond(i) { 0.0 } else { *p });
        self.held.resize(count, false);
        parallel::update(&mut self.held, |i, held| *held |= holds.of(i) != Hold::Free);
    }

    fn pressure(&self, i: usize) -> f64 {
        self.pressure.get(i).copied().unwrap_or(1.0)
    }
}

/// The objective at one arrangement.
pub(super) struct Evaluation<const D: usize> {
    pub energy: f64,
    pub fit: Fit,
    support: Vec<f64>,
    /// n*, and what the particle aims at where that is something else.
    wanted: Vec<f64>,
    aimed: Option<Vec<f64>>,
    sums: Vec<DensitySums<D>>,
    mean: f64,
    mean_square: f64,
}

impl<const D: usize> Evaluation<D> {
    /// What the particles aim at.
    fn aimed(&self) -> &[f64] {
        self.aimed.as_ref().unwrap_or(&self.wanted)
    }
}

impl<'a, const D: usize, R: Real> Objective<'a, D, R> {
    pub fn new(arrangement: Arrangement<'a, D, R>) -> Self {
        Self {
            arrangement,
            kappa: None,
            settled: false,
            smoothed: false,
            evaluations: 0,
            aims: None,
            points: Points::unknown(),
            ledger: None,
            layers: None,
            holds: None,
            common: None,
        }
    }

    /// Goes on with another kernel.
    pub fn see_with(&mut self, kernel: KernelName, kernel_neighbors: f64) {
        let now = (self.arrangement.kernel, self.arrangement.kernel_neighbors);
        if now != (kernel, kernel_neighbors) {
            (self.arrangement.kernel, self.arrangement.kernel_neighbors) = (kernel, kernel_neighbors);
            (self.kappa, self.aims) = (None, None);
            self.see_interfaces(None);
        }
    }

    /// See [`Arrangement::see_interfaces`]; there are no pushes here. A region that is thinner than a spacing is a sheet: no medium
    /// goes on beyond it, and particles move along it.
    pub fn see_interfaces(&mut self, known: Option<Interfaces>) {
        self.arrangement.see_interfaces(known, &|_| 0.0);
        let ratio = self.arrangement.ratio();
        let spacing = self.arrangement.target_supports().into_iter().map(|h| h / ratio).collect::<Vec<f64>>();
        let exchange = self.arrangement.exchange();
        let normals = self.arrangement.interfaces().and_then(|found| found.normals_if_thin(exchange, &spacing));
        self.layers = normals.map(Layers::of_all);
        if self.layers.is_some() {
            self.arrangement.forget_interfaces();
        }
    }

    /// Sum over particles of what their region lacks, as a part of its number density: the medium beyond feels them as they
    /// feel it.
    fn beyond(&self, support: &[f64], aimed: &[f64]) -> f64 {
        if self.arrangement.interfaces().is_none() {
            return 0.0;
        }
        let lacks = |i: usize| self.arrangement.missing(i, support[i]).map_or(0.0, |(m, medium)| medium * m.share);
        reduce::sum(aimed.len(), |i| lacks(i) / aimed[i])
    }

    /// What the potential that holds particles where smoothing matters has changed by, in the pressure energy.
    fn drift(&self, frame: &Frame) -> f64 {
        let Some(aims) = &self.aims else { return 0.0 };
        let (domain, positions) = (&self.arrangement.domain, self.arrangement.positions());
        reduce::sum(positions[0].len(), |i| frame.pressure(i) * aims.drift(domain, i, &at(positions, i)).0)
    }

    fn supports(&self, aimed: &[f64], kappa: f64) -> Vec<f64> {
        let target = &self.arrangement.target;
        let ratio = support_over_spacing(D, self.arrangement.kernel_neighbors) * kappa.powf(1.0 / D as f64);
        parallel::map(aimed.len(), |i| ratio * target.spacing(aimed[i]).min(self.arrangement.domain.size()))
    }

    /// What the particles aim at, where the target has `wanted` and they aim at something else.
    fn aimed(&self, wanted: &[f64]) -> Option<Vec<f64>> {
        let (domain, positions) = (&self.arrangement.domain, self.arrangement.positions());
        let aims = self.aims.as_ref()?;
        Some(parallel::map(wanted.len(), |i| aims.density(domain, i, &at(positions, i), wanted[i])))
    }

    /// Follows particles into a new order, see [`Arrangement::sort`].
    pub fn sort(&mut self) -> Vec<u32> {
        let order = self.arrangement.sort();
        self.aims.iter_mut().for_each(|aims| aims.reorder(&order));
        self.layers.iter_mut().for_each(|layers| layers.reorder(&order));
        self.holds.iter_mut().for_each(|holds| holds.reorder(&order));
        order
    }

    /// Looks for the smoothed target where particles aim at it, beginning with the radii `support`, by as many `steps` towards those that
    /// belong to it; whether any do. In the first look of a descent all that stays the same in it is found as well.
    fn look(&mut self, mut support: Vec<f64>, steps: usize, is_first: bool) -> bool {
        let Some(aims) = &mut self.aims else { return false };
        let arrangement = &self.arrangement;
        let (Arrangement { kernel, domain, target, .. }, positions) = (arrangement, arrangement.positions());
        if !self.points.find(target, self.ledger.as_deref()) {
            return false;
        }
        let ratio =
            support_over_spacing(D, arrangement.kernel_neighbors) * self.kappa.unwrap_or(1.0).powf(1.0 / D as f64);
        let mut found = vec![(0.0, [0.0; D]); support.len()];
        let radius = |n: f64| ratio * target.spacing(n).min(domain.size());
        for _ in 0..steps {
            let looked = parallel::map(support.len(), |i| if aims.is_aimed(i) { support[i] } else { 0.0 });
            let sums = match self.points.get() {
                Some(points) => points.number_densities(*kernel, domain, (positions, &looked), target.count),
                None => return false,
            };
            let steps = parallel::map(sums.len(), |i| Smoothed::new(&sums[i], support[i], radius));
            found = parallel::map(steps.len(), |i| (steps[i].density, steps[i].gradient));
            parallel::update(&mut support, |i, h| *h = steps[i].radius);
        }
        if is_first {
            self.points.strengthen(*kernel, domain, (positions, &support), (target.count, |i| aims.is_aimed(i)));
        }
        let drift = self.points.drift(*kernel, domain, (positions, &support), |i| aims.is_aimed(i));
        aims.look(|i| at(positions, i), &found, drift.as_deref());
        true
    }

    /// Looks for the smoothed target anew where particles have moved far; whether they have.
    pub fn look_again(&mut self, frame: &Frame) -> bool {
        let (domain, positions) = (&self.arrangement.domain, self.arrangement.positions());
        let Some(aims) = &self.aims else { return false };
        if !self.arrangement.exchange().any(aims.are_stale(domain, positions, &frame.spacing)) {
            return false;
        }
        let wanted = self.arrangement.target.number_densities(self.arrangement.positions());
        let support = self.supports(&self.aimed(&wanted).unwrap_or(wanted), frame.kappa);
        self.look(support, 1, false)
    }

    /// Lets particles aim at the smoothed target where the target is too sharp, if it is so for more than a few. What ends at an
    /// open edge does not count: sums see a mirror there, and not the end. Of a thin layer it is not the edge that is too sharp.
    fn take_aim(&mut self, sharpness: &[f64], spacing: &[f64]) {
        // Those of all other blocks would be found, too.
        if self.holds.is_some() && !self.points.are_known() {
            return;
        }
        // Points of mass do not show what goes on beyond the surfaces of a region.
        let exchange = self.arrangement.exchange();
        let goes_on = exchange.any(self.arrangement.interfaces().is_some_and(|interfaces| !interfaces.are_none()));
        let count = exchange.count(sharpness.len()) as f64;
        let many = |unresolved: usize| exchange.count(unresolved) as f64 > FEW_UNRESOLVED * count;
        if self.settled && !self.smoothed
            || goes_on
            || !many(parallel::count(sharpness.len(), |i| share(sharpness[i]) > 0.0))
        {
            return;
        }
        let ratio = support_over_spacing(D, self.arrangement.kernel_neighbors);
        let domain = self.arrangement.domain.clone();
        let even = (domain.volume() / count).powf(1.0 / D as f64);
        let guess = parallel::map(spacing.len(), |i| ratio * spacing[i].min(even));
        self.arrangement.mirror(&guess);
        let solved = self.arrangement.solve_among(&guess, Search::EXACT);
        let support = parallel::map(solved.len(), |i| solved[i].support.min(domain.size()));
        let positions = self.arrangement.positions();
        let target = &self.arrangement.target;
        let ends = |i: usize| {
            let x = at(positions, i);
            target.ends_within(&x, AT_AN_END * support[i]) && target.thin_along(&x, spacing[i]).is_none()
        };
        if !many(parallel::count(sharpness.len(), |i| share(sharpness[i]) > 0.0 && !ends(i))) {
            return;
        }
        self.aims = Some(Aims::new(parallel::map(sharpness.len(), |i| share(sharpness[i]))));
        if !self.look(support, STEPS, true) {
            self.aims = None;
        }
    }

    /// Fits kappa and freezes what a stage holds.
    pub fn frame(&mut self, lambda: f64) -> Frame {
        let target = self.arrangement.target;
        let wanted = target.number_densities(self.arrangement.positions());
        let positions = self.arrangement.positions();
        let mut spacing = parallel::map(wanted.len(), |i| target.spacing(wanted[i]));
        let ratio = support_over_spacing(D, self.arrangement.kernel_neighbors);
        let sharpness = target.sharpnesses(positions, &wanted, ratio);
        let mut weights = parallel::map(sharpness.len(), |i| resolved(sharpness[i]));
        let is_sheet = self.layers.as_ref().is_some_and(|layers| layers.are_all);
        if !is_sheet {
            self.layers = Layers::find(&target, positions, &wanted, |i| !(sharpness[i] < 1.0));
        }
        let everywhere = if is_sheet || self.smoothed { vec![f64::INFINITY; sharpness.len()] } else { Vec::new() };
        // Sums can follow the target nowhere in a sheet.
        let unresolved = if is_sheet { &everywhere } else { &sharpness };
        self.take_aim(if everywhere.is_empty() { &sharpness } else { &everywhere }, &spacing);
        let held = match &self.aims {
            Some(aims) => {
                let aimed = self.aimed(&wanted).unwrap_or(wanted);
                parallel::update(&mut spacing, |i, s| *s = target.spacing(aimed[i]));
                parallel::update(&mut weights, |i, w| *w = aims.weight(i, *w, unresolved[i]));
                Vec::new()
            }
            None => self.held(&wanted, (&sharpness, &weights)),
        };
        self.kappa = self.common.or(self.kappa);
        let kappa = self.kappa.unwrap_or(1.0);
        let mut frame = Frame { lambda, kappa, weights, pressure: Vec::new(), held, spacing };
        self.holds.iter().for_each(|holds| frame.hold(holds));
        // The first evaluation tells kappa; from then on it barely changes.
        let now = self.evaluate(&frame);
        if self.kappa.is_none() {
            frame.kappa = now.fit.factor;
            self.kappa = Some(frame.kappa);
        } else {
            self.evaluations -= 1;
        }
        let aimed = now.aimed();
        frame.forget_crowds(&parallel::map(aimed.len(), |i| now.sums[i].number_density / aimed[i]));
        self.holds.iter().for_each(|holds| frame.hold(holds));
        frame
    }

    /// Particles that stay where they are because no density near them is one that they could have; empty without any.
    fn held(&self, wanted: &[f64], (sharpness, weights): (&[f64], &[f64])) -> Vec<bool> {
        let (target, positions) = (&self.arrangement.target, self.arrangement.positions());
        let ratio = support_over_spacing(D, self.arrangement.kernel_neighbors);
        let mut held = target.near_discontinuities(positions, wanted, sharpness, ratio);
        let most = if self.settled { STEEP_FOR_ORDER } else { STEEP };
        let steep = parallel::map(wanted.len(), |i| {
            weights[i] < 0.5 && target.steepness(&at(positions, i), target.support(wanted[i], ratio)) > most
        });
        if steep.contains(&true) {
            held.resize(steep.len(), false);
            held.iter_mut().zip(steep).for_each(|(held, steep)| *held |= steep);
        }
        held
    }

    pub fn evaluate(&mut self, frame: &Frame) -> Evaluation<D> {
        self.evaluations += 1;
        let wanted = self.arrangement.target_density();
        let other = self.aimed(&wanted);
        let aimed = other.as_ref().unwrap_or(&wanted);
        let support = self.supports(aimed, frame.kappa);
        self.arrangement.medium = frame.kappa;
        self.arrangement.mirror(&support);
        let sums = self.arrangement.densities(&support);
        let (n, w, exchange) = (wanted.len(), &frame.weights, self.arrangement.exchange());
        let q = |i: usize| sums[i].number_density / aimed[i];
        let [total, weighted, pressure] = reduce::sums(n, |i| [w[i], w[i] * q(i), frame.pressure(i) * q(i)]);
        let pressure = pressure + self.beyond(&support, aimed) - self.drift(frame);
        let [total, weighted, pressure] = exchange.together([total, weighted, pressure]);
        let mean = self.common.map_or(weighted / total, f64::recip);
        let [squares] = exchange.together(reduce::sums(n, |i| [w[i] * (q(i) / mean - 1.0).powi(2)]));
        let energy = 0.5 * squares + frame.lambda * pressure;
        let domain = self.arrangement.target.domain;
        let set = interior_among(exchange, domain, self.arrangement.positions(), &support, Some(w));
        let fit = fit_among(exchange, set.as_deref(), aimed, |i| sums[i].number_density);
        Evaluation { energy, fit, support, wanted, aimed: other, sums, mean, mean_square: squares / total }
    }

    /// dE/dx in units of the particles' spacings. What it is made of is let go of on the way.
    pub fn gradient(&self, frame: &Frame, mut now: Evaluation<D>) -> Vec<[f64; D]> {
        let aimed = now.aimed();
        let strength = parallel::map(now.wanted.len(), |i| {
            let q = now.sums[i].number_density / aimed[i];
            let pressure = frame.lambda * frame.pressure(i);
            let of_mean = if self.common.is_some() { 0.0 } else { now.mean_square };
            let response = frame.weights[i] * (q / now.mean - 1.0 - of_mean) / now.mean + pressure;
            response / aimed[i]
        });
        // What is aimed at enters through q and through the support radius.
        let through_aim = parallel::map(strength.len(), |i| {
            let follows = self.arrangement.target.spacing_follows(aimed[i]);
            let through_support = if follows { now.sums[i].slope / D as f64 } else { 0.0 };
            -strength[i] * (now.sums[i].number_density + through_support)
        });
        let own = Arrangement::<D, R>::own_gradient(&strength, &now.sums);
        now.sums = Vec::new();
        let mut out = self.arrangement.gradient(&now.support, &strength, own);
        let aimed = now.aimed();
        let positions = self.arrangement.positions();
        parallel::update(&mut out, |i, g| {
            if frame.held.get(i) == Some(&true) {
                *g = [0.0; D];
                return;
            }
            let of_target = || self.log_slope(&at(positions, i), now.wanted[i], frame.spacing[i]);
            let slope = self.aims.as_ref().map_or_else(of_target, |aims| aims.log_slope(i, of_target));
            let mut own = through_aim[i];
            if let Some((missing, medium)) = self.arrangement.missing(i, now.support[i]) {
                let weight = frame.lambda / aimed[i] * medium;
                (0..D).for_each(|k| g[k] += weight * missing.gradient[k]);
                own -= weight * missing.slope / D as f64;
            }
            if let Some(aims) = &self.aims {
                let (_, drift) = aims.drift(&self.arrangement.domain, i, &at(positions, i));
                (0..D).for_each(|k| g[k] -= frame.lambda * frame.pressure(i) * drift[k]);
            }
            *g = sph::array(|k| frame.spacing[i] * (g[k] + own * slope[k]));
            if let Some(layers) = &self.layers {
                *g = layers.along(i, *g);
            }
        });
        out
    }

    /// Epsilon as it is measured in the end: at solved support radii, and over what is resolved now.
    pub fn measured(&mut self) -> f64 {
        let (wanted, kappa) = (self.arrangement.target_density(), self.kappa.unwrap_or(1.0));
        let solved = self.arrangement.solve_among(&self.supports(&wanted, kappa), Search::EXACT);
        let (target, positions) = (&self.arrangement.target, self.arrangement.positions());
        let ratio = support_over_spacing(D, self.arrangement.kernel_neighbors);
        let support = parallel::map(solved.len(), |i| target.support(wanted[i], ratio));
        let weights =
            parallel::map(wanted.len(), |i| resolved(target.sharpness(&at(positions, i), wanted[i], support[i])));
        let exchange = self.arrangement.exchange();
        let set = interior_among(exchange, target.domain, positions, &support, Some(&weights));
        fit_among(exchange, set.as_deref(), &wanted, |i| solved[i].sums.number_density).epsilon
    }

    fn log_slope(&self, x: &[f64; D], wanted: f64, spacing: f64) -> [f64; D] {
        let step = GRADIENT_STEP * spacing.min(self.arrangement.domain.size());
        self.arrangement.target.log_slope(x, wanted, step)
    }
}

/// Logarithm of the target's change over a support radius beyond which a particle stays where the seeding has put it; of a
/// start in order, nothing less steep is placed better either.
pub(super) const STEEP: f64 = 3.0;
const STEEP_FOR_ORDER: f64 = 0.4;

/// Density within the support, over the target's, beyond which a particle counts less.
const CROWDED: f64 = 3.0;

/// Share of the particles for which the target is not resolved up to which those are left to the pressure energy.
const FEW_UNRESOLVED: f64 = 0.01;

/// Support radii from an open edge within which the target may not be resolved because of it.
const AT_AN_END: f64 = 1.5;

/// Steps towards the support radius that belongs to a smoothed density, at first; later looks go on from there.
const STEPS: usize = 6;

/// Step of the differences of the target, in spacings: truncation and rounding both stay below 1e-6.
const GRADIENT_STEP: f64 = 1e-6;
