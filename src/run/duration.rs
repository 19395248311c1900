//! Estimates the run time of the stages of a plan before they start.
//!
//! An evaluation costs each particle a fixed time and one for each of its neighbors on a core; what is stated was measured on one
//! core of 2.9 GHz in processor time, for 5000 to 20 000 particles with 19 to 200 neighbors in 2-D and 3-D, and holds within a factor of
//! some two there. What the target's density costs beside is measured for the target itself: that of a snapshot's particles takes longer than the
//! sums. Stages that end by themselves are foreseen with all their steps, which they may not take, but for the density solver from a start in order.

use super::plan::{Plan, TRIM_ITERATIONS};
use crate::field::probes;
use crate::relaxation::{AFC, ALARIC, BALANCE, DAMPED_RELAXATION, SOLVER, StageName, Step, TRIMMING, WVT};
use crate::scene::Scene;
use crate::target::Target;
use serde::Serialize;
use std::time::Instant;

/// Seconds of an evaluation per particle, and per neighbor of each.
const PARTICLE: f64 = 5e-7;
const NEIGHBOR: f64 = 8e-9;
/// An evaluation of a balance in those of a density.
const BALANCED: f64 = 2.5;

/// A step of ALARIC, with its forces, and one of AFC, in evaluations of a density.
const ALARIC_STEP: f64 = 2.0;
const AFC_STEP: f64 = 2.0;

/// A stage and the seconds that it is expected to take.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Expected {
    pub step: &'static str,
    pub seconds: f64,
}

/// How long one particle's part of an evaluation takes on one core.
#[derive(Debug, Clone, Copy)]
pub struct Cost {
    /// Kernel neighbors of the sums.
    pub kernel_neighbors: f64,
    /// How many times slower the sums are than what was measured.
    pub slowness: f64,
    /// Seconds that the target takes at a particle.
    pub target: f64,
}

/// Places at which a target is evaluated, and for how long at most.
const SAMPLES: usize = 512;
const SECONDS: f64 = 0.02;
/// Places, at least.
const FEW: usize = 8;

/// Seconds that the value and the slope of a target take at a place on one core: the median, since one that is interrupted says nothing, of
/// those where particles are, if there are any.
pub fn of_target<const D: usize>(target: &Target<'_, D>) -> f64 {
    let begin = Instant::now();
    let [mut inside, mut outside] = [const { Vec::new() }; 2];
    for x in probes(target.domain).iter().take(SAMPLES) {
        let start = Instant::now();
        let here = target.number_density(x);
        std::hint::black_box(target.log_slope(x, here, 1e-3 * target.spacing(here).min(target.domain.size())));
        let times = if here > 0.0 { &mut inside } else { &mut outside };
        times.push(start.elapsed().as_secs_f64());
        if begin.elapsed().as_secs_f64() > SECONDS && inside.len() + outside.len() > FEW {
            break;
        }
    }
    let times = if inside.is_empty() { &mut outside } else { &mut inside };
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(0.0)
}

/// Seconds of one evaluation of so many particles.
pub fn evaluation(count: usize, kernel_neighbors: f64, threads: usize) -> f64 {
    count as f64 * (PARTICLE + NEIGHBOR * kernel_neighbors) / threads.max(1) as f64
}

/// What the stages of a plan are expected to take, at most, with so many particles and threads.
pub fn expected(plan: &Plan, scene: &Scene, count: usize, cost: &Cost, threads: usize) -> Vec<Expected> {
    let evaluation = cost.slowness * evaluation(count, cost.kernel_neighbors, threads)
        + count as f64 * cost.target / threads.max(1) as f64;
    // Each splitting begins with half of the particles.
    let splittings: f64 = (0..=plan.splittings).map(|k| 0.5_f64.powi(k as i32)).sum();
    let evaluations = |stage: &StageName| {
        Some(match *stage {
            WVT => plan.wvt_iterations as f64,
            SOLVER => foreseen_evaluations(plan, scene) as f64,
            BALANCE => BALANCED * plan.balance as f64,
            ALARIC | DAMPED_RELAXATION => ALARIC_STEP * scene.alaric.steps as f64 * splittings,
            AFC => AFC_STEP * scene.afc.steps as f64,
            TRIMMING => TRIM_ITERATIONS as f64,
            _ => return None,
        })
    };
    let of = |stage: &StageName| Some(Expected { step: stage.name, seconds: evaluations(stage)? * evaluation });
    plan.stages.iter().filter_map(of).collect()
}

/// Evaluations that the density solver is likely to make: it ends by itself, soon where it begins with particles in order.
fn foreseen_evaluations(plan: &Plan, scene: &Scene) -> usize {
    let ends_soon = plan.starts_in_order() && scene.solver.evaluations.is_none() && scene.tolerance.is_none();
    if ends_soon { plan.evaluations.min(SOLVED_IN_ORDER) } else { plan.evaluations }
}

/// Of shells and lattices, as the density solver makes them by itself.
const SOLVED_IN_ORDER: usize = 25;

/// What a run does beside its stages, in evaluations of a density: seeding (mass bisection and shells, which take longest) and the measures at its
/// end. Within a factor of two for 40 000 particles in 2-D and 3-D, as stages are.
const SEEDING: f64 = 15.0;
const MEASURES: f64 = 6.0;
/// The same of the boxes of equal mass at its end, which have more particles, and not more boxes, from [`IN_BOXES`] on.
const BOXES: f64 = 9.0;
const IN_BOXES: usize = 1 << 19;
/// Seconds per particle of writing HDF5 with some ten columns, on one core.
const WRITING: f64 = 3e-6;

/// Seconds of the measures of so many particles.
pub fn measures(count: usize, kernel_neighbors: f64, threads: usize) -> f64 {
    let evaluation = |count| evaluation(count, kernel_neighbors, threads);
    MEASURES * evaluation(count) + BOXES * evaluation(count.min(IN_BOXES))
}

/// What seeding, measuring and writing are expected to take.
pub fn beside(count: usize, cost: &Cost, threads: usize) -> [Expected; 3] {
    let evaluation = cost.slowness * evaluation(count, cost.kernel_neighbors, threads);
    [
        Expected { step: Step::Seed.name(), seconds: SEEDING * evaluation },
        Expected {
            step: Step::Measure.name(),
            seconds: cost.slowness * measures(count, cost.kernel_neighbors, threads),
        },
        Expected { step: Step::Write.name(), seconds: WRITING * count as f64 },
    ]
}

/// The sum of what is expected.
pub fn total(expected: &[Expected]) -> f64 {
    expected.iter().map(|e| e.seconds).sum()
}

/// In one digit, so that it is no promise.
pub fn rounded(seconds: f64) -> String {
    let one_digit = |value: f64| {
        let power = 10f64.powf(value.max(1e-9).log10().floor());
        (value / power).round() * power
    };
    match seconds {
        s if s < 1.0 => "under a second".into(),
        s if s < 90.0 => format!("some {:.0} s", one_digit(s)),
        s if s < 5400.0 => format!("some {:.0} min", one_digit(s / 60.0)),
        s => format!("some {:.0} h", one_digit(s / 3600.0)),
    }
}
