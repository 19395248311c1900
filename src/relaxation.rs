//! The planned stages in order: seed, WVT, polish.

use crate::error::{Error, Result};
use crate::kernel::{Kernel, evaluate, unit_ball_volume};
use crate::placement::{
    AlaricOptions, Control, PAIRED, SolverOptions, StageReport, StopReason, TrimOptions, WvtOptions,
    alaric_by_splitting, coarse_count, part_pairs, relax, solve_density, trim_masses,
};
use crate::plan::Plan;
use crate::report::Timing;
use crate::scene::{Polish, Scene};
use crate::seeding::{self, Seeded};
use crate::target::{Positions, Target};
use crate::with_kernel;
use std::time::Instant;

/// What relaxation comes to.
pub struct Relaxed<const D: usize> {
    pub positions: Positions<D>,
    pub stages: Vec<StageReport>,
    pub timing: Vec<Timing>,
    pub notes: Vec<String>,
    pub stop: StopReason,
}

/// Seeds and relaxes as planned; stages that turn out to be unneeded are dropped from the plan.
///
/// # Errors
/// A target without mass, or an interrupt.
pub fn place<const D: usize>(
    scene: &Scene,
    plan: &mut Plan,
    target: &Target<'_, D>,
    neighbors: f64,
    control: &Control<'_>,
) -> Result<Relaxed<D>> {
    place_watched(scene, plan, target, neighbors, control, &mut |_, _| {})
}

/// [`place`], showing `watch` what the seed and each part of the plan left. Before splitting these are fewer
/// particles than the target's count. What `watch` does counts against a deadline, but not in the timing.
///
/// # Errors
/// As [`place`].
pub fn place_watched<const D: usize>(
    scene: &Scene,
    plan: &mut Plan,
    target: &Target<'_, D>,
    neighbors: f64,
    control: &Control<'_>,
    watch: &mut dyn FnMut(&'static str, &Positions<D>),
) -> Result<Relaxed<D>> {
    check_neighbors::<D>(scene, neighbors)?;
    let start = Instant::now();
    let coarse = target.with_count(coarse_count(D, target.count, plan.splittings));
    let Seeded { mut positions, mut notes } = seeding::seed(&coarse, scene.seeding, scene.seed)?;
    let mut timing = vec![Timing { step: "seed", seconds: start.elapsed().as_secs_f64(), epsilon: None }];
    watch("seed", &positions);
    let mut stages = Vec::new();
    if plan.wvt_iterations > 0 {
        let options = wvt_options(scene, plan.wvt_iterations, neighbors);
        let (relaxed, report) = relax(scene.kernel, &coarse, positions, &options, control);
        positions = relaxed;
        part(&coarse, &mut positions, &mut notes);
        watch(report.stage, &positions);
        stages.push(report);
    }
    let stopped = stages.last().is_some_and(|s: &StageReport| {
        matches!(s.stop, StopReason::ToleranceReached | StopReason::TimeLimit | StopReason::Interrupted)
    });
    match plan.polish {
        Polish::None => {}
        _ if stopped && plan.splittings == 0 => {
            plan.drop("polish", "WVT met the tolerance, or time was up");
            plan.polish = Polish::None;
        }
        Polish::Solver => {
            let options = solver_options(scene, plan.evaluations, neighbors);
            let (solved, report) = solve_density::<D, f32>(scene.kernel, target, positions, &options, control);
            positions = solved;
            part(target, &mut positions, &mut notes);
            watch(report.stage, &positions);
            stages.push(report);
        }
        Polish::Alaric => {
            let options = alaric_options(scene, neighbors);
            let (relaxed, reports) =
                alaric_by_splitting::<D, f32>(scene.kernel, target, positions, plan.splittings, &options, control);
            positions = relaxed;
            part(target, &mut positions, &mut notes);
            watch("alaric", &positions);
            stages.extend(reports);
        }
    }
    timing.extend(stages.iter().map(|s| Timing { step: s.stage, seconds: s.seconds, epsilon: s.epsilon() }));
    let stop = stages.last().map_or(StopReason::NotNeeded, |s| s.stop);
    if stop == StopReason::Interrupted {
        return Err(Error::Interrupted);
    }
    Ok(Relaxed { positions, stages, timing, notes, stop })
}

/// n_i V H^d of a particle counts its own kernel at least; no support radius has fewer neighbors than that.
fn check_neighbors<const D: usize>(scene: &Scene, neighbors: f64) -> Result<()> {
    let own = with_kernel!(scene.kernel, kernel => own_count::<_, D>(kernel));
    if neighbors > own {
        return Ok(());
    }
    let problem = format!(
        "is {neighbors}, but {} counts a particle itself as {own:.1} in {D}-D; expected more than that",
        scene.kernel.title()
    );
    Err(Error::scene("neighbors", problem))
}

/// V_d W(0) at unit support.
fn own_count<K: Kernel, const D: usize>(kernel: K) -> f64 {
    K::SIGMA[D - 1] * evaluate::<K, D>(kernel, 0.0).0 * unit_ball_volume(D)
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
pub fn masses<const D: usize>(
    scene: &Scene,
    plan: &mut Plan,
    target: &Target<'_, D>,
    relaxed: &mut Relaxed<D>,
    neighbors: f64,
    control: &Control<'_>,
) -> Vec<f64> {
    let mut masses = target.masses(&relaxed.positions);
    let Some(largest_change) = scene.trim_masses else {
        plan.drop("mass trimming", "trim_masses is not set: masses are what the target says");
        return masses;
    };
    let options = TrimOptions {
        kernel_neighbors: neighbors,
        largest_change,
        iterations: TRIM_ITERATIONS,
        tolerance: scene.tolerance.unwrap_or(0.0),
    };
    let report = trim_masses(scene.kernel, target, &relaxed.positions, &mut masses, &options, control);
    relaxed.timing.push(Timing { step: report.stage, seconds: report.seconds, epsilon: report.epsilon() });
    relaxed.stages.push(report);
    masses
}

/// Enough for rounding; each costs a density pass in double precision.
const TRIM_ITERATIONS: usize = 60;

fn wvt_options(scene: &Scene, iterations: usize, kernel_neighbors: f64) -> WvtOptions {
    let w = &scene.wvt;
    WvtOptions {
        weight: w.weight,
        bias: w.bias,
        iterations,
        step: w.step,
        final_step: w.final_step,
        kernel_neighbors,
        tolerance: scene.tolerance.unwrap_or(0.0),
    }
}

fn solver_options(scene: &Scene, evaluations: usize, kernel_neighbors: f64) -> SolverOptions {
    SolverOptions {
        kernel_neighbors,
        evaluations,
        quietness: scene.solver.quietness,
        tolerance: scene.tolerance.unwrap_or(0.0),
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
        grad_h: a.grad_h,
        courant: a.courant,
        steps: a.steps,
        tolerance: scene.tolerance.unwrap_or(0.0),
        rate_tolerance: a.rate_tolerance,
    }
}
