//! The planned stages in order: seed, WVT, polish.

use crate::error::{Error, Result};
use crate::relaxation::{
    AfcOptions, AfcSnapshot, AlaricOptions, BalanceOptions, Balanced, Control, PAIRED, SolverOptions, SolverSnapshot,
    SplittingSnapshot, StageReport, Start, StopReason, TrimOptions, WvtOptions, WvtSnapshot, alaric_by_splitting_kept,
    away_from_closest_kept, balance_pressure, coarse_count, part_pairs, relax_kept, solve_density_kept, trim_masses,
};
use crate::run::checkpoint::{Checkpoints, Snapshot, StageSnapshot};
use crate::run::plan::Plan;
use crate::run::report::Timing;
use crate::scene::{OnInterrupt, Polish, Scene};
use crate::seeding::{self, Seeded};
use crate::target::{Equilibrium, Positions, Target};
use sph::kernel::{KernelName, makes_pairs, most_neighbors_without_pairs, own_count};
use std::time::Instant;

/// What relaxation comes to.
pub struct Relaxed<const D: usize> {
    pub positions: Positions<D>,
    pub stages: Vec<StageReport>,
    pub timing: Vec<Timing>,
    pub notes: Vec<String>,
    pub stop: StopReason,
}

/// Seeds and relaxes as planned, or goes on from the scene's checkpoint; stages that turn out to be unneeded are
/// dropped from the plan.
///
/// # Errors
/// A target without mass, an interrupt that is to leave nothing, or a checkpoint that cannot be used.
pub fn place<const D: usize>(
    scene: &Scene,
    plan: &mut Plan,
    target: &Target<'_, D>,
    neighbors: f64,
    control: &Control<'_>,
) -> Result<Relaxed<D>> {
    let mut checkpoints = Checkpoints::new(scene, target)?;
    let start = match &scene.checkpoint.resume {
        None => seeded(scene, plan, target, neighbors)?,
        Some(path) => checkpoints.resume(path, plan)?,
    };
    let stages = Stages { scene, target, neighbors, control };
    let mut relaxed = stages.run(plan, start, &mut checkpoints, &mut |_, _| {});
    if let Some(failure) = checkpoints.failure() {
        relaxed.notes.push(format!("the last checkpoint could not be written: {failure}"));
    }
    if relaxed.stop == StopReason::Interrupted && scene.output.on_interrupt == OnInterrupt::Discard {
        return Err(checkpoints.sealed().map_or(Error::Interrupted, |file| Error::InterruptedKept(file.into())));
    }
    if let Some(file) = checkpoints.sealed() {
        relaxed.notes.push(format!("cut short; go on with --resume '{}'", file.display()));
    }
    Ok(relaxed)
}

/// [`place`] without checkpoints, showing `watch` what the seed and each part of the plan left. Before splitting
/// these are fewer particles than the target's count. What `watch` does counts against a deadline, but not in the
/// timing.
///
/// # Errors
/// A target without mass, or an interrupt.
pub fn place_watched<const D: usize>(
    scene: &Scene,
    plan: &mut Plan,
    target: &Target<'_, D>,
    neighbors: f64,
    control: &Control<'_>,
    watch: &mut dyn FnMut(&'static str, &Positions<D>),
) -> Result<Relaxed<D>> {
    let start = seeded(scene, plan, target, neighbors)?;
    let stages = Stages { scene, target, neighbors, control };
    let relaxed = stages.run(plan, start, &mut Checkpoints::off(), watch);
    if relaxed.stop == StopReason::Interrupted { Err(Error::Interrupted) } else { Ok(relaxed) }
}

/// The seed, as many particles as splitting begins with.
fn seeded<const D: usize>(scene: &Scene, plan: &Plan, target: &Target<'_, D>, neighbors: f64) -> Result<Snapshot<D>> {
    check_neighbors::<D>(scene, plan, neighbors)?;
    let start = Instant::now();
    let coarse = target.with_count(coarse_count(D, target.count, plan.splittings));
    let Seeded { positions, notes } = seeding::seed(&coarse, plan.seeding, scene.seed)?;
    let seed_seconds = start.elapsed().as_secs_f64();
    Ok(Snapshot { notes, seed_seconds, reports: Vec::new(), stage: StageSnapshot::Seed(positions) })
}

/// What all stages need.
struct Stages<'a, const D: usize> {
    scene: &'a Scene,
    target: &'a Target<'a, D>,
    neighbors: f64,
    control: &'a Control<'a>,
}

/// What came out of the stages so far.
struct Past<'a> {
    notes: Vec<String>,
    seed_seconds: f64,
    reports: Vec<StageReport>,
    checkpoints: &'a mut Checkpoints,
}

/// What makes a snapshot of a stage one of the run.
fn keep<S, const D: usize>(
    past: &mut Past<'_>,
    wrap: fn(S) -> StageSnapshot<D>,
) -> impl FnMut(bool, &dyn Fn() -> S) + Send {
    let Past { notes, seed_seconds, reports, checkpoints } = past;
    move |stopping, snapshot| {
        checkpoints.offer(stopping, || Snapshot {
            notes: notes.clone(),
            seed_seconds: *seed_seconds,
            reports: reports.clone(),
            stage: wrap(snapshot()),
        });
    }
}

impl<const D: usize> Stages<'_, D> {
    fn run(
        &self,
        plan: &mut Plan,
        start: Snapshot<D>,
        checkpoints: &mut Checkpoints,
        watch: &mut dyn FnMut(&'static str, &Positions<D>),
    ) -> Relaxed<D> {
        let Snapshot { notes, seed_seconds, reports, stage } = start;
        let mut past = Past { notes, seed_seconds, reports, checkpoints };
        let begin = match stage {
            StageSnapshot::Seed(positions) => {
                watch("seed", &positions);
                if plan.wvt_iterations > 0 {
                    StageSnapshot::Seed(self.wvt(plan, Start::New(positions), &mut past, watch))
                } else {
                    StageSnapshot::Seed(positions)
                }
            }
            StageSnapshot::Wvt(kept) => {
                StageSnapshot::Seed(self.wvt(plan, Start::Kept(Box::new(kept)), &mut past, watch))
            }
            polish => polish,
        };
        let positions = self.polish(plan, begin, &mut past, watch);
        let Past { notes, seed_seconds, reports: stages, .. } = past;
        let seed = Timing { step: "seed", seconds: seed_seconds, epsilon: None };
        let lap = |s: &StageReport| Timing { step: s.stage, seconds: s.seconds, epsilon: s.epsilon() };
        let timing = std::iter::once(seed).chain(stages.iter().map(lap)).collect();
        let stop = stages.last().map_or(StopReason::NotNeeded, |s| s.stop);
        Relaxed { positions, stages, timing, notes, stop }
    }

    fn wvt(
        &self,
        plan: &Plan,
        start: Start<D, WvtSnapshot<D>>,
        past: &mut Past<'_>,
        watch: &mut dyn FnMut(&'static str, &Positions<D>),
    ) -> Positions<D> {
        let coarse = self.target.with_count(coarse_count(D, self.target.count, plan.splittings));
        let options = wvt_options(self.scene, plan.wvt_iterations, self.neighbors);
        let mut keep = keep(past, StageSnapshot::Wvt);
        let (mut positions, report) = relax_kept(self.scene.kernel, &coarse, start, &options, self.control, &mut keep);
        drop(keep);
        part(&coarse, &mut positions, &mut past.notes);
        watch(report.stage, &positions);
        past.reports.push(report);
        positions
    }

    /// `begin` is where WVT ended, or a snapshot of the polish.
    fn polish(
        &self,
        plan: &mut Plan,
        begin: StageSnapshot<D>,
        past: &mut Past<'_>,
        watch: &mut dyn FnMut(&'static str, &Positions<D>),
    ) -> Positions<D> {
        let stopped = past.reports.last().is_some_and(|s| {
            matches!(s.stop, StopReason::ToleranceReached | StopReason::TimeLimit | StopReason::Interrupted)
        });
        let (mut positions, reports) = match (plan.polish, begin) {
            (Polish::None, begin) => return begin.into_positions(),
            (_, StageSnapshot::Seed(positions)) if stopped && plan.splittings == 0 => {
                plan.drop("polish", "WVT met the tolerance, or time was up");
                plan.polish = Polish::None;
                return positions;
            }
            (Polish::Solver, StageSnapshot::Solver(kept)) => self.solve(plan, Start::Kept(Box::new(kept)), past),
            (Polish::Solver, begin) => self.solve(plan, Start::New(begin.into_positions()), past),
            (Polish::Afc, StageSnapshot::Afc(kept)) => self.afc(Start::Kept(Box::new(kept)), past),
            (Polish::Afc, begin) => self.afc(Start::New(begin.into_positions()), past),
            (_, StageSnapshot::Alaric(kept)) => self.alaric(plan, Start::Kept(Box::new(kept)), past),
            (_, begin) => self.alaric(plan, Start::New(begin.into_positions()), past),
        };
        part(self.target, &mut positions, &mut past.notes);
        reports.last().inspect(|last| watch(last.stage, &positions));
        past.reports.extend(reports);
        positions
    }

    fn solve(
        &self,
        plan: &Plan,
        start: Start<D, SolverSnapshot<D>>,
        past: &mut Past<'_>,
    ) -> (Positions<D>, Vec<StageReport>) {
        let options = solver_options::<D>(self.scene, plan, self.neighbors);
        if makes_pairs(self.scene.kernel, D, self.neighbors) {
            past.notes.push(format!(
                "{} with {:.0} neighbors makes pairs of particles at rest: {} has brought them to rest, and the solver ended \
                 with the density alone",
                self.scene.kernel.title(),
                self.neighbors,
                KernelName::default().title()
            ));
        }
        let keep = &mut keep(past, StageSnapshot::Solver);
        let (positions, report) =
            solve_density_kept::<D, f32>(self.scene.kernel, self.target, start, &options, self.control, keep);
        (positions, vec![report])
    }

    fn afc(&self, start: Start<D, AfcSnapshot<D>>, past: &mut Past<'_>) -> (Positions<D>, Vec<StageReport>) {
        let a = &self.scene.afc;
        let tolerance = aim(self.scene);
        let options = AfcOptions { kernel_neighbors: self.neighbors, steps: a.steps, step: a.step, tolerance };
        let keep = &mut keep(past, StageSnapshot::Afc);
        let (positions, report) =
            away_from_closest_kept(self.scene.kernel, self.target, start, &options, self.control, keep);
        (positions, vec![report])
    }

    fn alaric(
        &self,
        plan: &Plan,
        start: Start<D, SplittingSnapshot<D>>,
        past: &mut Past<'_>,
    ) -> (Positions<D>, Vec<StageReport>) {
        let mut options = alaric_options(self.scene, self.neighbors);
        if plan.polish == Polish::DampedRelaxation {
            options = AlaricOptions { velocity_stops: false, viscosity: true, ..options };
        }
        let (kernel, splittings) = (self.scene.kernel, plan.splittings);
        let keep = &mut keep(past, StageSnapshot::Alaric);
        alaric_by_splitting_kept::<D, f32>(kernel, self.target, start, splittings, &options, self.control, keep)
    }
}

/// n_i V H^d of a particle counts its own kernel at least; no support radius has fewer neighbors than that. In balance,
/// the forces of a kernel that makes pairs do so.
fn check_neighbors<const D: usize>(scene: &Scene, plan: &Plan, neighbors: f64) -> Result<()> {
    let (own, title) = (own_count(scene.kernel, D), scene.kernel.title());
    if !(neighbors > own) {
        let problem = format!(
            "is {neighbors}, but {title} counts a particle itself as {own:.1} in {D}-D; expected more than that"
        );
        return Err(Error::scene("neighbors", problem));
    }
    match most_neighbors_without_pairs(scene.kernel, D) {
        Some(most) if neighbors > most && plan.balance > 0 => Err(Error::scene(
            "balance",
            format!(
                "would end in pairs of particles, since the forces of {title} with {neighbors:.0} neighbors vanish there; \
                 expected at most {most:.1} neighbors, or one of Wendland's kernels"
            ),
        )),
        _ => Ok(()),
    }
}

/// Moves what a stage left paired apart, and says so.
fn part<const D: usize>(target: &Target<'_, D>, positions: &mut Positions<D>, notes: &mut Vec<String>) {
    let paired = part_pairs(target, positions, PAIRED);
    if paired > 0 {
        notes.push(format!(
            "{paired} particles were within {PAIRED} spacings of another and were moved apart: the density changes there by more than N particles resolve"
        ));
    }
}

/// Masses of the placed particles, trimmed where the scene asks for it.
///
/// # Errors
/// An interrupt that is to leave nothing.
pub fn masses<const D: usize>(
    scene: &Scene,
    plan: &mut Plan,
    target: &Target<'_, D>,
    relaxed: &mut Relaxed<D>,
    neighbors: f64,
    control: &Control<'_>,
) -> Result<Vec<f64>> {
    let mut masses = target.masses(&relaxed.positions);
    let Some(largest_change) = scene.trim_masses else {
        plan.drop("mass trimming", "trim_masses is not set: masses are what the target says");
        return Ok(masses);
    };
    let options =
        TrimOptions { kernel_neighbors: neighbors, largest_change, iterations: TRIM_ITERATIONS, tolerance: aim(scene) };
    let report = trim_masses(scene.kernel, target, &relaxed.positions, &mut masses, &options, control);
    relaxed.timing.push(Timing { step: report.stage, seconds: report.seconds, epsilon: report.epsilon() });
    if report.stop == StopReason::Interrupted {
        if scene.output.on_interrupt == OnInterrupt::Discard {
            return Err(Error::Interrupted);
        }
        relaxed.stop = report.stop;
    }
    relaxed.stages.push(report);
    Ok(masses)
}

/// Moves the placed particles into balance where the scene asks for it; returns their internal energies.
///
/// # Errors
/// An interrupt.
pub fn balance<const D: usize>(
    (scene, plan): (&Scene, &Plan),
    target: &Target<'_, D>,
    equilibrium: &dyn Equilibrium<D>,
    kernel_neighbors: f64,
    relaxed: &mut Relaxed<D>,
    control: &Control<'_>,
) -> Result<Vec<f64>> {
    let options = BalanceOptions { kernel_neighbors, evaluations: plan.balance };
    let positions = std::mem::replace(&mut relaxed.positions, std::array::from_fn(|_| Vec::new()));
    let balanced = balance_pressure::<D, f32>(scene.kernel, target, equilibrium, positions, &options, control);
    let Balanced { positions, internal_energy, factor, wanted_factor, report } = balanced;
    if report.stop == StopReason::Interrupted {
        if scene.output.on_interrupt == OnInterrupt::Discard {
            return Err(Error::Interrupted);
        }
        relaxed.stop = report.stop;
    }
    relaxed.positions = positions;
    relaxed.notes.push(if factor == wanted_factor {
        format!("internal energies are the target's times {factor:.4}: with it the pressure force holds gravity")
    } else {
        format!(
            "the pressure would have to be {wanted_factor:.3} times the target's to hold gravity; it is left as it is, \
             and what comes out is a body that settles: check the input's pressure, units and balance.constant"
        )
    });
    relaxed.timing.push(Timing { step: report.stage, seconds: report.seconds, epsilon: report.epsilon() });
    relaxed.stages.push(report);
    Ok(internal_energy)
}

/// Enough for rounding; each costs a density pass in double precision.
const TRIM_ITERATIONS: usize = 60;

/// Epsilon at which stages stop that do not measure it themselves. They watch it at the target's own support radii; as
/// measured in the end, at solved ones, it is up to a sixth larger.
fn aim(scene: &Scene) -> f64 {
    0.8 * scene.tolerance.unwrap_or(0.0)
}

fn wvt_options(scene: &Scene, iterations: usize, kernel_neighbors: f64) -> WvtOptions {
    let w = &scene.wvt;
    WvtOptions {
        weight: w.weight,
        bias: w.bias,
        iterations,
        step: w.step,
        final_step: w.final_step,
        kernel_neighbors,
        tolerance: aim(scene),
    }
}

fn solver_options<const D: usize>(scene: &Scene, plan: &Plan, kernel_neighbors: f64) -> SolverOptions {
    let default = SolverOptions::new(D);
    let quietness = scene.solver.quietness.or(scene.tolerance.map(SolverOptions::quietness_for));
    SolverOptions {
        kernel_neighbors,
        evaluations: plan.evaluations,
        quietness: quietness.unwrap_or(default.quietness),
        tolerance: scene.tolerance.unwrap_or(default.tolerance),
        settled: plan.wvt_iterations == 0 && plan.seeding.is_in_order(),
    }
}

fn alaric_options(scene: &Scene, kernel_neighbors: f64) -> AlaricOptions {
    let a = &scene.alaric;
    AlaricOptions {
        kernel_neighbors,
        friction: a.friction,
        viscosity: a.viscosity,
        velocity_stops: a.velocity_stops,
        growth: a.growth,
        hold_unresolved: a.hold_unresolved,
        grad_h: a.grad_h,
        courant: a.courant,
        steps: a.steps,
        tolerance: aim(scene),
        rate_tolerance: a.rate_tolerance,
    }
}
