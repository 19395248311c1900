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

use super::fluid::{Fluid, FluidSnapshot};
use super::snapshot::{Best, Check, Keep, Start, Trace, forget};
use super::splitting::{coarse_count, split};
use super::{COINCIDENT, Control, Progress, StageReport, StopReason, part_pairs};
use crate::target::{Positions, Target};
use serde::{Deserialize, Serialize};
use sph::domain::Domain;
use sph::kernel::KernelName;
use sph::lanes::Real;

/// Parameters of the relaxation; the terms can be switched off one by one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlaricOptions {
    /// N_H = V_d n H^d.
    pub kernel_neighbors: f64,
    /// Friction chi, in inverse crossing times; 0 switches it off.
    pub friction: f64,
    /// Viscosity with evolving alpha.
    pub viscosity: bool,
    /// Setting all velocities to zero every tau.
    pub velocity_stops: bool,
    /// Growth theta of tau at each stop.
    pub growth: f64,
    /// Holds particles where no arrangement has the target's density: it changes too much over a support radius.
    pub hold_unresolved: bool,
    /// Correction of the forces for the variation of H.
    pub grad_h: bool,
    /// Time step over the time in which sound crosses the smallest support radius.
    pub courant: f64,
    pub steps: usize,
    /// Converged when epsilon is below.
    pub tolerance: f64,
    /// Converged when |d epsilon/dt| between stops is below.
    pub rate_tolerance: f64,
}

impl AlaricOptions {
    /// The paper's values (sec. 2 and 4.1) in `D` dimensions. Its chi = 2 is for a domain of size 2.
    pub fn new(d: usize) -> Self {
        Self {
            kernel_neighbors: sph::kernel::default_kernel_neighbors(d),
            friction: 4.0,
            viscosity: true,
            velocity_stops: true,
            growth: 0.1,
            hold_unresolved: false,
            grad_h: true,
            courant: 0.3,
            steps: 10_000,
            tolerance: 1e-8,
            rate_tolerance: 1e-8,
        }
    }
}

/// Relaxes `positions` and returns the state with the lowest epsilon met at a stop.
pub fn alaric<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: Positions<D>,
    options: &AlaricOptions,
    control: &Control<'_>,
) -> (Positions<D>, StageReport) {
    alaric_kept::<D, R>(kernel, target, Start::New(positions), options, control, &mut forget())
}

/// [`alaric`] from new positions or a snapshot, offering snapshots to `keep`.
pub fn alaric_kept<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    start: Start<D, AlaricSnapshot<D>>,
    options: &AlaricOptions,
    control: &Control<'_>,
    keep: Keep<'_, AlaricSnapshot<D>>,
) -> (Positions<D>, StageReport) {
    // Within the pool, where small passes need not be handed to another thread.
    rayon::scope(|_| run::<D, R>(kernel, target, start, options, control, keep))
}

fn run<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    start: Start<D, AlaricSnapshot<D>>,
    options: &AlaricOptions,
    control: &Control<'_>,
    keep: Keep<'_, AlaricSnapshot<D>>,
) -> (Positions<D>, StageReport) {
    let domain = target.domain.mirrored();
    let (mut fluid, mut run) = match start {
        Start::New(mut positions) => {
            part_pairs(target, &mut positions, COINCIDENT);
            let fluid = Fluid::<D, R>::new(kernel, target, &domain, positions, options);
            let run = Run::new(&fluid, StopClock::new(&domain, options));
            (fluid, run)
        }
        Start::Kept(snapshot) => {
            let AlaricSnapshot { fluid, run: Run { trace, step, best, clock, last_stop } } = *snapshot;
            let fluid = Fluid::resume(kernel, target, &domain, fluid, options);
            (fluid, Run { trace: trace.resumed(), step, best, clock, last_stop })
        }
    };
    let stop = run.advance(&mut fluid, control, keep);
    let report = StageReport {
        stage: "alaric",
        stop,
        best_iteration: run.best.iteration,
        seconds: run.trace.seconds(),
        history: run.trace.history,
    };
    (run.best.positions, report)
}

/// What a run remembers beside the fluid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Run<const D: usize> {
    step: usize,
    best: Best<D>,
    clock: StopClock,
    /// Time and epsilon of the last stop.
    last_stop: (f64, f64),
    trace: Trace,
}

impl<const D: usize> Run<D> {
    fn new<R: Real>(fluid: &Fluid<'_, D, R>, clock: StopClock) -> Self {
        let epsilon = fluid.fitted.epsilon;
        let best = Best { epsilon, iteration: 0, positions: fluid.state.positions.clone() };
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

    fn advance<R: Real>(
        &mut self,
        fluid: &mut Fluid<'_, D, R>,
        control: &Control<'_>,
        keep: Keep<'_, AlaricSnapshot<D>>,
    ) -> StopReason {
        let options = fluid.options;
        if self.best.epsilon <= options.tolerance {
            return StopReason::ToleranceReached;
        }
        while self.step < options.steps {
            let outside = control.stop_reason();
            keep(outside.is_some(), &|| AlaricSnapshot { fluid: fluid.snapshot(), run: self.kept() });
            if let Some(reason) = outside {
                self.best.note(fluid.fitted.epsilon, self.step, &fluid.state.positions);
                return reason;
            }
            self.step += 1;
            let largest = fluid.advance();
            self.note(fluid, largest);
            control.report("ALARIC", self.step, options.steps, fluid.fitted.epsilon);
            let due = self.clock.is_due(fluid.time, fluid.kinetic_energy()) || self.step == options.steps;
            if let Some(reason) = due.then(|| self.stop(fluid)).flatten() {
                return reason;
            }
        }
        StopReason::IterationLimit
    }

    /// A stop: the mass is fitted again, particles are brought to rest, convergence is tested.
    fn stop<R: Real>(&mut self, fluid: &mut Fluid<'_, D, R>) -> Option<StopReason> {
        fluid.refit_mass();
        if fluid.options.velocity_stops {
            fluid.halt();
        }
        let epsilon = fluid.fitted.epsilon;
        self.best.note(epsilon, self.step, &fluid.state.positions);
        let rate = (epsilon - self.last_stop.1).abs() / (fluid.time - self.last_stop.0);
        self.last_stop = (fluid.time, epsilon);
        if epsilon <= fluid.options.tolerance {
            Some(StopReason::ToleranceReached)
        } else if rate < fluid.options.rate_tolerance {
            Some(StopReason::Stagnated)
        } else {
            None
        }
    }
}

/// What goes on after an interrupt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AlaricSnapshot<const D: usize> {
    fluid: FluidSnapshot<D>,
    run: Run<D>,
}

impl<const D: usize> AlaricSnapshot<D> {
    /// # Errors
    /// What is wrong with it for `count` particles.
    pub fn check(&self, count: usize) -> Result<(), String> {
        self.fluid.check(count)?;
        Check::new(count).positions("the best positions", &self.run.best.positions).result()
    }
}

/// Looser criteria for all but the last stage of splitting: what the children disturb need not be exact.
const COARSE_RATE: f64 = 1e-4;

/// Relaxes few particles first and splits them `splittings` times, to `target.count` in the end (sec. 2.4).
/// `positions` are [`coarse_count`] particles.
pub fn alaric_by_splitting<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: Positions<D>,
    splittings: usize,
    options: &AlaricOptions,
    control: &Control<'_>,
) -> (Positions<D>, Vec<StageReport>) {
    let start = Start::New(positions);
    alaric_by_splitting_kept::<D, R>(kernel, target, start, splittings, options, control, &mut forget())
}

/// [`alaric_by_splitting`] from new positions or a snapshot, offering snapshots to `keep`.
pub fn alaric_by_splitting_kept<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    start: Start<D, SplittingSnapshot<D>>,
    splittings: usize,
    options: &AlaricOptions,
    control: &Control<'_>,
    keep: Keep<'_, SplittingSnapshot<D>>,
) -> (Positions<D>, Vec<StageReport>) {
    let (mut left, mut reports, mut from) = match start {
        Start::New(positions) => (splittings, Vec::with_capacity(splittings + 1), Start::New(positions)),
        Start::Kept(kept) => (kept.left, kept.reports, Start::Kept(Box::new(kept.stage))),
    };
    loop {
        let coarse = target.with_count(coarse_count(D, target.count, left));
        let rate_tolerance = if left > 0 { options.rate_tolerance.max(COARSE_RATE) } else { options.rate_tolerance };
        let stage = AlaricOptions { rate_tolerance, ..*options };
        let done = reports.clone();
        let mut keep_stage = |stopping: bool, snapshot: &dyn Fn() -> AlaricSnapshot<D>| {
            keep(stopping, &|| SplittingSnapshot { left, reports: done.clone(), stage: snapshot() });
        };
        let (relaxed, report) = alaric_kept::<D, R>(kernel, &coarse, from, &stage, control, &mut keep_stage);
        reports.push(report);
        if left == 0 {
            return (relaxed, reports);
        }
        left -= 1;
        from = Start::New(split(&coarse, &relaxed, options.kernel_neighbors, coarse_count(D, target.count, left)));
    }
}

/// What goes on after an interrupt.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SplittingSnapshot<const D: usize> {
    /// Splittings to come.
    left: usize,
    /// Of the stages before.
    reports: Vec<StageReport>,
    stage: AlaricSnapshot<D>,
}

impl<const D: usize> SplittingSnapshot<D> {
    /// The best positions, for a run that does not go on.
    pub fn into_positions(self) -> Positions<D> {
        self.stage.run.best.positions
    }

    /// # Errors
    /// What is wrong with it for `count` particles in the end, after `splittings`.
    pub fn check(&self, count: usize, splittings: usize) -> Result<(), String> {
        if self.left > splittings {
            return Err(format!("has {} splittings to come of {splittings}", self.left));
        }
        self.stage.check(coarse_count(D, count, self.left))
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
