//! Runs over several ranks: `--ranks`, or processes that `mpirun` or `srun` has started.

use super::args::RunArgs;
use super::interrupt::Interrupts;
use super::progress::Progress;
use super::rank_args::PlanArgs;
use crate::error::{Error, Result};
use crate::relaxation::{Control, Event};
use crate::run::rank_forecast::forecast_on_ranks;
use crate::run::ranks::run_on_ranks;
use crate::run::report::Report;
use crate::scene::Scene;
use sph::exchange::{Exchange, together};
use sph_formats::FORMATS;
use std::time::Instant;

/// What one rank comes to.
pub struct Ended {
    /// Whether it is the one that prints.
    pub is_first: bool,
    pub report: Result<Report>,
}

/// Runs the scene over ranks where the arguments or a launcher ask for it; none where they do not.
///
/// # Errors
/// Ranks that cannot be started, or one that ended.
pub fn run(args: &RunArgs, scene: &Scene, deadline: Option<Instant>) -> Result<Option<Ended>> {
    if let Some(ranks) = args.ranks {
        let threads = args.threads.unwrap_or_else(rayon::current_num_threads);
        let interrupts = Interrupts::of_run(scene);
        let work = |exchange: &dyn Exchange| on_rank(args, scene, deadline, &interrupts, exchange);
        let ended =
            together(ranks, threads / ranks, work).map_err(|problem| Error::Numeric { stage: "ranks", problem })?;
        return Ok(ended.into_iter().next());
    }
    launched(args, scene, deadline)
}

#[cfg(feature = "mpi")]
fn launched(args: &RunArgs, scene: &Scene, deadline: Option<Instant>) -> Result<Option<Ended>> {
    if !crate::processes::is_launched() {
        return Ok(None);
    }
    if args.in_turn.is_some() {
        let problem =
            "goes block by block in one process, but a launcher has started several; start one, or leave it out";
        return Err(Error::scene("in-turn", problem));
    }
    let interrupts = Interrupts::of_run(scene);
    let work = |exchange: &dyn Exchange| on_rank(args, scene, deadline, &interrupts, exchange);
    crate::processes::over_processes(work).map(Some).map_err(|problem| Error::Numeric { stage: "ranks", problem })
}

/// How many processes a launcher has started, where they are several.
fn processes() -> Option<usize> {
    let size = |name: &str| std::env::var(name).ok()?.parse::<usize>().ok();
    ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MV2_COMM_WORLD_SIZE"]
        .into_iter()
        .find_map(|name| size(name).filter(|n| *n > 1))
}

/// Refuses to do in each of several processes what is the work of one: all would write the same file.
///
/// # Errors
/// Several processes.
pub fn refuse_processes() -> Result<()> {
    processes().map_or(Ok(()), |count| {
        let problem = format!(
            "this program is one of {count} that mpirun or srun has started, each of which would do the same work: start one; only scenes are placed over several"
        );
        Err(Error::scene("ranks", problem))
    })
}

/// Processes that know nothing of each other would all do the same work, and write the same file.
#[cfg(not(feature = "mpi"))]
fn launched(_: &RunArgs, _: &Scene, _: Option<Instant>) -> Result<Option<Ended>> {
    match processes() {
        None => Ok(None),
        Some(ranks) => {
            let problem = format!(
                "this program is one of {ranks} that mpirun or srun has started, but it is built without MPI: build it with `--features mpi`, or start one, \
                 with `--ranks {ranks}` for ranks within a process"
            );
            Err(Error::scene("ranks", problem))
        }
    }
}

fn on_rank(
    args: &RunArgs,
    scene: &Scene,
    deadline: Option<Instant>,
    interrupts: &Interrupts,
    exchange: &dyn Exchange,
) -> Ended {
    let is_first = exchange.rank() == 0;
    let progress = Progress::new(args.quiet || !is_first);
    let observer = |event: Event| {
        interrupts.note(event);
        progress.update(event);
    };
    let control = Control { deadline, interrupted: interrupts.requested(), observer: &observer };
    let report = run_on_ranks(scene, FORMATS, &control, exchange);
    progress.finish();
    Ended { is_first, report }
}

/// What a run over ranks would take, as text.
///
/// # Errors
/// What such a run would refuse.
pub fn plan(args: &PlanArgs) -> Result<String> {
    let mut scene = Scene::load(&args.scene)?;
    scene.particles = args.particles.or(scene.particles);
    let threads = args.threads.unwrap_or_else(rayon::current_num_threads).max(1);
    let forecast = forecast_on_ranks(&scene, FORMATS, (args.ranks as usize, threads))?;
    Ok(if args.json { forecast.json() } else { forecast.text() })
}
