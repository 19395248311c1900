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
//! Beyond the paper: where the target changes by more than a factor of about e over a support radius (the surface
//! of a star, a jump) no arrangement has its density. What is left of p there never vanishes, and as the force is
//! that of no potential it drives a flow without end, which stirs up the interior: in a polytrope of 1000
//! particles epsilon of the interior turns at 1.5e-5 and its noise rises from 22 % to 131 % of a random set's.
//! `hold_unresolved` weighs p and the acceleration of such particles down to nothing, as the density solver does:
//! epsilon falls to 1.3e-7, the noise stays at 37 %. Elsewhere the force, and its momentum, are the paper's.
//!
//! Units: the isothermal sound speed is 1, lengths are in sizes of the domain, so the friction chi and all
//! times are in crossings of the domain whatever the input's units.

use super::fluid::{AlaricOptions, Fluid, FluidSnapshot};
use super::pairs::{COINCIDENT, part_pairs};
use super::report::{Progress, StageName, StageReport, StopReason};
use super::snapshot::{Best, Check, Trace, decode, encode};
use super::splitting::{coarse_count, split};
use super::stage::{Particles, Relaxed, Running, Stage};
use crate::target::{Positions, Target};
use serde::{Deserialize, Serialize};
use sph::domain::Domain;
use sph::kernel::KernelName;
use sph::lanes::Real;
use std::marker::PhantomData;

pub const NAME: StageName = StageName { name: "alaric", title: "ALARIC" };
/// The same dynamics without velocity stops and splitting (the paper's sec. 1.4.3).
pub const DAMPED: StageName = StageName { name: "damped-relaxation", title: "damped relaxation" };

/// The stage: relaxes few particles first and splits them `splittings` times, to `target.count` in the end (sec. 2.4). It
/// begins with [`coarse_count`] particles; what comes out is the state with the lowest epsilon met at a stop. `R` is the
/// precision of pair distances.
pub struct Alaric<'a, const D: usize, R = f32> {
    name: StageName,
    kernel: KernelName,
    target: Target<'a, D>,
    options: AlaricOptions,
    splittings: usize,
    precision: PhantomData<R>,
}

/// Looser criteria for all but the last stage of splitting: what the children disturb need not be exact.
const COARSE_RATE: f64 = 1e-4;

impl<'a, const D: usize, R: Real> Alaric<'a, D, R> {
    /// [`NAME`], or [`DAMPED`] for options without velocity stops.
    pub fn new(
        name: StageName,
        kernel: KernelName,
        target: Target<'a, D>,
        options: AlaricOptions,
        splittings: usize,
    ) -> Self {
        Self { name, kernel, target, options, splittings, precision: PhantomData }
    }

    /// The target with `left` splittings to come.
    fn coarse_target(&self, left: usize) -> Target<'a, D> {
        self.target.with_count(coarse_count(D, self.target.count, left))
    }

    /// The criteria with `left` splittings to come.
    fn rate_tolerance(&self, left: usize) -> f64 {
        let rate = self.options.rate_tolerance;
        if left > 0 { rate.max(COARSE_RATE) } else { rate }
    }

    /// Begins with the particles of `left` splittings before the end.
    fn descend(&self, mut positions: Positions<D>, left: usize) -> (Fluid<'_, D, R>, Course<D>) {
        let target = self.coarse_target(left);
        part_pairs(&target, &mut positions, COINCIDENT);
        let fluid = Fluid::new(self.kernel, target, positions, &self.options);
        let course = Course::new(&fluid, StopClock::new(&fluid.state.domain, &self.options));
        (fluid, course)
    }
}

impl<const D: usize, R: Real> Stage<D> for Alaric<'_, D, R> {
    fn name(&self) -> StageName {
        self.name
    }

    fn begin(&self, particles: Particles<D>) -> Box<dyn Running<D> + '_> {
        let left = self.splittings;
        let (fluid, course) = self.descend(particles.positions, left);
        Box::new(Run { stage: self, fluid, course, left, reports: Vec::with_capacity(left + 1) })
    }

    fn resume(&self, kept: &[u8]) -> Result<Box<dyn Running<D> + '_>, String> {
        let kept: Snapshot<D> = decode(kept)?;
        kept.check(self.target.count, self.splittings)?;
        let Snapshot { left, reports, fluid, course } = kept;
        let fluid = Fluid::resume(self.kernel, self.coarse_target(left), fluid, &self.options);
        let course = Course { trace: course.trace.resumed(), ..course };
        let reports = reports.into_iter().map(|r| r.with_name(self.name)).collect();
        Ok(Box::new(Run { stage: self, fluid, course, left, reports }))
    }
}

/// What goes on after an interrupt.
#[derive(Serialize, Deserialize)]
struct Snapshot<const D: usize> {
    /// Splittings to come.
    left: usize,
    /// Of what came before the last splitting; its name is that of the stage.
    reports: Vec<StageReport<()>>,
    fluid: FluidSnapshot<D>,
    course: Course<D>,
}

impl<const D: usize> Snapshot<D> {
    /// # Errors
    /// What is wrong with it for `count` particles in the end, after `splittings`.
    fn check(&self, count: usize, splittings: usize) -> Result<(), String> {
        if self.left > splittings {
            return Err(format!("has {} splittings to come of {splittings}", self.left));
        }
        let coarse = coarse_count(D, count, self.left);
        self.fluid.check(coarse)?;
        Check::new(coarse).positions("the best positions", &self.course.best.positions).result()
    }
}

/// The stage under way.
struct Run<'a, const D: usize, R> {
    stage: &'a Alaric<'a, D, R>,
    fluid: Fluid<'a, D, R>,
    course: Course<D>,
    /// Splittings to come.
    left: usize,
    reports: Vec<StageReport>,
}

impl<const D: usize, R: Real> Running<D> for Run<'_, D, R> {
    fn advance(&mut self, outside: Option<StopReason>) -> Option<StopReason> {
        let stop = self.course.advance(&mut self.fluid, self.stage.rate_tolerance(self.left), outside)?;
        if self.left == 0 || stop.is_cut() {
            return Some(stop);
        }
        let report = self.course.report(self.stage.name, stop);
        self.reports.push(report);
        let coarse = self.stage.coarse_target(self.left);
        self.left -= 1;
        let count = coarse_count(D, self.stage.target.count, self.left);
        let split = split(&coarse, &self.course.best.positions, self.stage.options.kernel_neighbors, count);
        (self.fluid, self.course) = self.stage.descend(split, self.left);
        None
    }

    fn progress(&self) -> (&[Progress], usize) {
        (&self.course.trace.history, self.stage.options.steps)
    }

    fn snapshot(&self, to: Vec<u8>) -> Result<Vec<u8>, String> {
        encode(
            &Snapshot {
                left: self.left,
                reports: self.reports.iter().map(|r| r.clone().with_name(())).collect(),
                fluid: self.fluid.snapshot(),
                course: self.course.kept(),
            },
            to,
        )
    }

    fn finish(self: Box<Self>, stop: StopReason) -> Relaxed<D> {
        let Self { stage, mut course, mut reports, left, .. } = *self;
        reports.push(course.report(stage.name, stop));
        let mut positions = course.best.positions;
        // Cut short: split at once, since the run is for the full number.
        for left in (0..left).rev() {
            let coarse = stage.coarse_target(left + 1);
            let count = coarse_count(D, stage.target.count, left);
            positions = split(&coarse, &positions, stage.options.kernel_neighbors, count);
        }
        Relaxed { particles: positions.into(), reports, notes: Vec::new() }
    }
}

/// What the relaxation of one number of particles remembers beside the fluid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Course<const D: usize> {
    step: usize,
    best: Best<D>,
    clock: StopClock,
    /// Time and epsilon of the last stop.
    last_stop: (f64, f64),
    trace: Trace,
}

impl<const D: usize> Course<D> {
    fn new<R: Real>(fluid: &Fluid<'_, D, R>, clock: StopClock) -> Self {
        let epsilon = fluid.fitted.epsilon;
        let best = Best { epsilon, iteration: 0, positions: fluid.state.positions().clone() };
        let mut run = Self { step: 0, best, clock, last_stop: (0.0, epsilon), trace: Trace::new() };
        run.note(fluid, 0.0);
        run
    }

    fn note<R: Real>(&mut self, fluid: &Fluid<'_, D, R>, largest_step: f64) {
        let (iteration, epsilon) = (self.step, fluid.fitted.epsilon);
        self.trace.history.push(Progress {
            iteration,
            epsilon,
            force_error: None,
            largest_step,
            seconds: self.trace.seconds(),
        });
    }

    fn kept(&self) -> Self {
        Self { trace: self.trace.kept(), best: self.best.clone(), clock: self.clock.clone(), ..*self }
    }

    /// One step; why the relaxation of these particles ends, if it does.
    fn advance<R: Real>(
        &mut self,
        fluid: &mut Fluid<'_, D, R>,
        rate_tolerance: f64,
        outside: Option<StopReason>,
    ) -> Option<StopReason> {
        let options = fluid.options;
        if self.step == 0 && self.best.epsilon <= options.tolerance {
            return Some(StopReason::ToleranceReached);
        }
        if self.step >= options.steps {
            return Some(StopReason::IterationLimit);
        }
        if outside.is_some() {
            self.best.note(fluid.fitted.epsilon, self.step, fluid.state.positions());
            return outside;
        }
        self.step += 1;
        let largest = fluid.advance();
        self.note(fluid, largest);
        let due = self.clock.is_due(fluid.time, fluid.kinetic_energy()) || self.step == options.steps;
        let reason = due.then(|| self.stop(fluid, rate_tolerance)).flatten();
        reason.or((self.step >= options.steps).then_some(StopReason::IterationLimit))
    }

    fn report(&mut self, stage: StageName, stop: StopReason) -> StageReport {
        let seconds = self.trace.seconds();
        let history = std::mem::take(&mut self.trace.history);
        StageReport { stage, stop, best_iteration: self.best.iteration, seconds, history }
    }

    /// A stop: the mass is fitted again, particles are brought to rest, convergence is tested.
    fn stop<R: Real>(&mut self, fluid: &mut Fluid<'_, D, R>, rate_tolerance: f64) -> Option<StopReason> {
        fluid.refit_mass();
        if fluid.options.velocity_stops {
            fluid.halt();
        }
        let epsilon = fluid.fitted.epsilon;
        self.best.note(epsilon, self.step, fluid.state.positions());
        let rate = (epsilon - self.last_stop.1).abs() / (fluid.time - self.last_stop.0);
        self.last_stop = (fluid.time, epsilon);
        if epsilon <= fluid.options.tolerance {
            Some(StopReason::ToleranceReached)
        } else if rate < rate_tolerance {
            Some(StopReason::Stagnated)
        } else {
            None
        }
    }
}

/// When particles are stopped: every tau = min(tau_cross, tau_NE), growing by 1 + theta (sec. 2.3).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
