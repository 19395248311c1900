//! A scene placed block by block on one machine, in memory that does not grow with the number of particles. Each block is relaxed separately,
//! among those particles of other blocks that its own particles see, which are held fixed meanwhile; the blocks are processed repeatedly until no
//! seams are left. Positions are kept on disk.
//!
//! Initial positions are those of an ordinary run if they can be made block by block, otherwise those of mass bisection. The stages are WVT and the
//! density solver, as over ranks.

mod goal;
mod kept;
mod measure;
mod on_disk;
mod report;
mod surroundings;

pub use measure::{BlockFigures, SetFigures};
pub use report::{InTurnReport, Pass};

use super::checkpoint::Origin;
use super::destination::{Written, write_rows};
use super::grading::{Few, verdict_on_few};
use super::parts::Parts;
use super::remarks::Remarks;
use super::report::{MassReport, Timing};
use super::stages::Setting;
use super::streamed::{Places, Read, Streamed};
use super::variables::VariableReport;
use super::verdict::as_measured;
use super::{doubts, memory};
use crate::error::{Error, Result};
use crate::input::internal_units::Prepared;
use crate::input::units::RunUnits;
use crate::output::frame::{Factors, output_units};
use crate::relaxation::{
    Control, DensitySolver, Event, Hold, Holding, Others, SOLVER, SolverOptions, StageName, Step, StopReason, WVT, Wvt,
    part_pairs_of_block, relax_new,
};
use crate::scene::{DEFAULT_PARTICLES, OnInterrupt, Scene};
use crate::seeding::Blockwise;
use crate::target::mass_points::MassPoints;
use crate::target::{Positions, Target};
use goal::Goal;
use kept::{Block, Kept, Sweep};
use measure::Measuring;
use on_disk::OnDisk;
use report::Done;
use sph::kernel::support_over_spacing;
use sph_formats::{FormatSpec, ParticleStream};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use surroundings::Map;

const BLOCKS: Parts = Parts { how: "block by block", who: "blocks" };
/// Times that the last stage goes over all blocks at most: in the first, those about a block are what they were before.
const MOST_SWEEPS: usize = 8;
/// Particles of a block, at least: smaller ones are mostly what others see of them.
const FEWEST: usize = 1000;
/// Blocks that are seeded at once where particles of successive numbers are in any of them: their places take as much as one block at work.
const SEEDED_AT_ONCE: usize = 8;
/// Support radii on each side of a block within which others move or are held with it, fewer at edges and corners.
const ABOUT: f64 = 2.9;

/// How a run goes block by block.
#[derive(Debug, Clone, Copy)]
pub struct InTurn<'a> {
    pub blocks: usize,
    /// Where blocks are kept; a run that has been interrupted goes on from there.
    pub folder: &'a Path,
}

/// Runs a scene block by block, from inputs to the output file.
///
/// # Errors
/// Those of [`run`](super::pipeline::run); what is not done block by block; a folder that is that of another run. Nothing is left half-written.
pub fn run_in_turn(
    scene: &Scene,
    formats: &[FormatSpec],
    control: &Control<'_>,
    how: InTurn<'_>,
) -> Result<InTurnReport> {
    BLOCKS.refuse(scene)?;
    if scene.checkpoint.file.is_some() || scene.checkpoint.resume.is_some() {
        let problem = "is not kept block by block: the folder of the blocks is what a run goes on from; leave it out";
        return Err(Error::scene("checkpoint", problem));
    }
    if scene.output.on_interrupt == OnInterrupt::Write {
        let problem = "is write, but what a run block by block leaves is its folder, from which the same command goes on; leave it out";
        return Err(Error::scene("output.on_interrupt", problem));
    }
    let start = Instant::now();
    control.tell(Event::Begin(Step::Read));
    let (read, format) = BLOCKS.begin(scene, formats)?;
    let mut run =
        Run { scene, formats, format, control, units: read.units, start, timing: Vec::new(), told: read.told.clone() };
    run.lap(Step::Read, start);
    match read.dimension {
        1 => run.in_dimension::<1>(read, how),
        2 => run.in_dimension::<2>(read, how),
        _ => run.in_dimension::<3>(read, how),
    }
}

/// What becomes of the input's variables, and what is not written, and why.
type Kinds = (Vec<VariableReport>, Vec<(&'static str, &'static str)>);

/// One pass over all blocks.
#[derive(Clone, Copy)]
struct Stepping {
    stage: StageName,
    /// How many there have been with it, and before it of the same stage.
    pass: usize,
    sweep: usize,
    /// The target over the summed density in all blocks, where it is known.
    common: Option<f64>,
}

/// Particles of a block with those about it, roughly, as of an even density in a block as deep as wide.
fn held_at_once<const D: usize>((count, blocks): (usize, usize), neighbors: f64) -> usize {
    let (all, own) = (count as f64, count.div_ceil(blocks) as f64);
    let deep = 2.0 * ABOUT * support_over_spacing(D, neighbors);
    (own.powf(1.0 / D as f64) + deep).powi(D as i32).min(all) as usize
}

/// A run under way.
struct Run<'a> {
    scene: &'a Scene,
    formats: &'a [FormatSpec],
    format: &'a FormatSpec,
    control: &'a Control<'a>,
    units: RunUnits,
    start: Instant,
    timing: Vec<Timing>,
    told: Remarks,
}

impl Run<'_> {
    fn lap(&mut self, step: Step, since: Instant) {
        let (step, seconds) = (step.name(), since.elapsed().as_secs_f64());
        match self.timing.iter_mut().find(|timing| timing.step == step) {
            Some(earlier) => earlier.seconds += seconds,
            None => self.timing.push(Timing { step, seconds, epsilon: None }),
        }
    }

    fn check(&self, kept: &Kept) -> Result<()> {
        if self.control.is_interrupted() { Err(Error::InterruptedIn(kept.folder().into())) } else { Ok(()) }
    }

    fn in_dimension<const D: usize>(mut self, read: Read, how: InTurn<'_>) -> Result<InTurnReport> {
        let lap = Instant::now();
        self.control.tell(Event::Begin(Step::Interpolate));
        let count = self.scene.particles.unwrap_or(DEFAULT_PARTICLES);
        let prepared = self.prepared::<D>(read, (count, how.blocks))?;
        self.told.of_target(self.scene, &prepared, count);
        doubts::refuse_domain(self.scene, &prepared.source.domain, count)?;
        doubts::refuse_places_without_particles(&prepared.target())?;
        let target = prepared.target();
        if target.find_regions(self.scene.region_contrast).is_some() {
            let problem = "has regions that jumps or vacuum separate, in each of which particles stay, and that is not done block by block; use --ranks";
            return Err(Error::scene("input", problem));
        }
        self.lap(Step::Interpolate, lap);
        let (scene, mut plan) = BLOCKS.planned(self.scene, (&prepared, &target), how.blocks);
        let scene = &scene;
        let seeds = Blockwise::new(&target, plan.seeding, scene.seed)?;
        let mut run = Run { scene, ..self };
        memory::check_block(held_at_once::<D>((count, how.blocks), scene.kernel_neighbors(D)), &plan.stages)?;
        let mut kept = Kept::open(how.folder, Origin::new(scene, &target), how.blocks)?;
        kept.recover::<D>()?;
        let mut map = Map::new(target, scene.kernel_neighbors(D), how.blocks);
        run.seed(&seeds, (&mut kept, &mut map))?;
        let goal = Goal::new(target, &plan, (scene.kernel(), scene.kernel_neighbors(D)));
        let (passes, stop, figures) = run.relax(&goal, (&kept, &mut map))?;
        let stop = as_measured(scene, stop, figures.stated());
        let (stream, written) = run.written(&prepared, target, (&kept, stop))?;
        let (variables, left_out) = stream;
        left_out.into_iter().for_each(|(what, why)| plan.drop(what, why));
        run.told.notes.extend(match stop.is_cut() {
            true => {
                Some(format!("cut short; the same command goes on with the blocks in '{}'", kept.folder().display()))
            }
            false => kept.remove(),
        });
        run.told.of_code::<D>(scene, Some(run.format));
        let mass = run.mass(&prepared, &target)?;
        let mut verdict = verdict_on_few(&Few {
            ledger: &figures.ledger,
            mean: figures.smoothed.as_given.mean,
            of_interior: figures.refit_interior,
            epsilon: figures.stated(),
            closest_pair: figures.closest_pair,
            kernel: scene.kernel().title(),
            mass: &mass,
            atmosphere: prepared.cut,
            stop,
            tolerance: scene.tolerance,
            warnings: &run.told.warnings,
        });
        written.tell(&mut run.told.notes, &mut verdict);
        Ok(InTurnReport {
            input: scene.input_name(),
            output: scene.output.file.as_ref().map_or_else(String::new, |file| file.display().to_string()),
            format: run.format.name,
            dimension: D,
            particles: count,
            blocks: how.blocks,
            seed: scene.seed,
            kernel: scene.kernel().title(),
            kernel_neighbors: scene.kernel_neighbors(D),
            mass,
            stop,
            tolerance: scene.tolerance,
            passes,
            plan,
            variables,
            figures,
            atmosphere: prepared.cut,
            timing: run.timing,
            seconds: run.start.elapsed().as_secs_f64(),
            peak_memory: memory::peak(),
            warnings: run.told.warnings,
            verdict,
            notes: run.told.notes,
        })
    }

    fn prepared<const D: usize>(&self, read: Read, (count, blocks): (usize, usize)) -> Result<Prepared<D>> {
        if count / blocks < FEWEST {
            let problem = format!("is {count}, too few for {blocks} blocks; expected at least {}", FEWEST * blocks);
            return Err(Error::scene("particles", problem));
        }
        BLOCKS.prepared((self.scene, self.formats, self.format), (read.raw, &self.units), count)
    }

    /// Seeds all blocks that are not there yet.
    fn seed<const D: usize>(
        &mut self,
        seeds: &Blockwise<'_, D>,
        (kept, map): (&mut Kept, &mut Map<'_, D>),
    ) -> Result<()> {
        let lap = Instant::now();
        self.control.tell(Event::Begin(Step::Seed));
        let (blocks, parting) = (kept.blocks(), seeds.parting(kept.blocks())?);
        let mut counts = Vec::with_capacity(blocks);
        while counts.len() < blocks {
            self.check(kept)?;
            let block = counts.len();
            if let Some(found) = if kept.is_seeded() { Some(kept.there(block)?) } else { kept.block::<D>(block)? } {
                map.note(block, &found);
                counts.push(found.positions[0].len());
                continue;
            }
            let new = match &parting {
                Some(parting) => seeds.parted(parting, block..blocks.min(block + SEEDED_AT_ONCE))?,
                None => vec![seeds.positions(kept.share(block))?],
            };
            for (own, positions) in (block..).zip(new) {
                if kept.block::<D>(own)?.is_none() {
                    kept.put(own, &Block { passes: Vec::new(), positions }, Vec::new())?;
                }
            }
        }
        if counts.contains(&0) {
            let problem = "are so unevenly spread that a block has none of them; use fewer blocks";
            return Err(Error::scene("particles", problem));
        }
        kept.count(counts)?;
        self.lap(Step::Seed, lap);
        Ok(())
    }

    /// Relaxes all blocks as planned, and measures them: the last stage goes over them until their seams are as good as the rest.
    fn relax<const D: usize>(
        &mut self,
        goal: &Goal<'_, D>,
        (kept, map): (&Kept, &mut Map<'_, D>),
    ) -> Result<(Vec<Pass>, StopReason, BlockFigures)> {
        let mut passes = Vec::new();
        let Some((last, before)) = goal.plan.stages.split_last() else {
            return Ok((passes, StopReason::NotNeeded, self.measured(goal, (kept, map))?));
        };
        let of = |stage, pass, sweep| Stepping { stage, pass, sweep, common: None };
        let mut stop = None;
        for (i, stage) in before.iter().enumerate() {
            if stop.is_none() {
                stop = self.sweep(of(*stage, i + 1, 0), goal, (kept, map), &mut passes)?;
            }
        }
        let mut sweeps = kept.sweeps()?;
        for sweep in 0..MOST_SWEEPS {
            let pass = before.len() + sweep + 1;
            let mut figures = None;
            if stop.is_none() && sweeps.len() < sweep {
                let now = self.measured(goal, (kept, map))?;
                sweeps.push(now.sweep(map.left(pass - 1)));
                kept.put_sweeps(&sweeps)?;
                figures = Some(now);
            }
            if let Some(end) = stop.or_else(|| Sweep::end(&sweeps[..sweep], self.scene.tolerance)) {
                let figures = figures.map_or_else(|| self.measured(goal, (kept, map)), Ok)?;
                return Ok((passes, end, figures));
            }
            // In the first sweep those about a block are not what they will be; then each is as well by itself.
            let common = if sweep > 0 { map.common(pass - 1) } else { None };
            let how = Stepping { common, ..of(*last, pass, sweep) };
            stop = self.sweep(how, goal, (kept, map), &mut passes)?;
        }
        Ok((passes, stop.unwrap_or(StopReason::IterationLimit), self.measured(goal, (kept, map))?))
    }

    /// Takes all blocks through a stage that have not been through this pass yet; why to go no further, if there is a reason.
    fn sweep<const D: usize>(
        &mut self,
        how: Stepping,
        goal: &Goal<'_, D>,
        (kept, map): (&Kept, &mut Map<'_, D>),
        passes: &mut Vec<Pass>,
    ) -> Result<Option<StopReason>> {
        let start = Instant::now();
        self.control.tell(Event::Begin(Step::Relax(how.stage)));
        let (mut pass, mut count, mut stop) = (Pass::new(how.stage.name), 0.0, None);
        for block in (0..kept.blocks()).filter(|&block| map.passes(block) < how.pass).collect::<Vec<_>>() {
            stop = self.control.stop_reason();
            if stop.is_none() {
                match self.taken_through(how, goal, (kept, map), block)? {
                    Ok(done) => count += pass.take(&done),
                    Err(cut) => stop = Some(cut),
                }
            }
            if stop.is_some() {
                break;
            }
        }
        if count > 0.0 {
            (pass.before, pass.after, pass.seconds) =
                (pass.before / count, pass.after / count, start.elapsed().as_secs_f64());
            passes.push(pass);
        }
        self.lap(Step::Relax(how.stage), start);
        self.check(kept)?;
        Ok(stop)
    }

    /// Takes a block through a stage, or says what cut that short: the block stays as it was.
    fn taken_through<const D: usize>(
        &self,
        how: Stepping,
        goal: &Goal<'_, D>,
        (kept, map): (&Kept, &mut Map<'_, D>),
        block: usize,
    ) -> Result<std::result::Result<Done, StopReason>> {
        let Block { mut passes, positions } = kept.there(block)?;
        let own = positions[0].len();
        // In the first sweep those about a block are not what they will be.
        let about = map.about(kept, (block, &positions), how.sweep > 0)?;
        let (all, holds) = about.with(&positions);
        let points = goal.points_about(&all);
        let judged = |all: &Positions<D>| {
            measure::judged(self.scene, &goal.target, (all, own, about.free()), (how.common, points.as_deref()))
        };
        let was = judged(&all);
        let mut moved = match self.relaxed(goal, how, (all, &holds), points.clone()) {
            Ok(moved) => moved,
            // It would end as another; it begins anew when the run goes on.
            Err(stop) => return Ok(Err(stop)),
        };
        part_pairs_of_block(&goal.target, &mut moved, &holds);
        let is = judged(&moved);
        let is_better = is.is_better_than(&was);
        let left = if is_better { is.left } else { was.left };
        passes.push(left);
        let others = if is_better { about.moved(&moved, own) } else { Vec::new() };
        let positions = if is_better { moved.map(|x| x[..own].to_vec()) } else { positions };
        let found = Block { passes, positions };
        map.note(block, &found);
        let changed: Vec<usize> = others.iter().map(|moved| moved.block).collect();
        kept.put(block, &found, others)?;
        for other in changed {
            map.note(other, &kept.there(other)?);
        }
        Ok(Ok(Done { own, held: holds.len(), before: was.left.mean, after: left.mean, is_better }))
    }

    /// A block's particles with others about them after a stage, or what cut it short.
    fn relaxed<const D: usize>(
        &self,
        goal: &Goal<'_, D>,
        how: Stepping,
        (all, holds): (Positions<D>, &[Hold]),
        points: Option<Arc<MassPoints<D>>>,
    ) -> std::result::Result<Positions<D>, StopReason> {
        let (kernel, target, plan) = (self.scene.kernel(), goal.target, goal.plan);
        let setting = Setting::new(self.scene, target, None, self.control);
        let relaxed = match how.stage {
            WVT => {
                let wvt = Wvt { kernel, target, options: setting.wvt(plan) };
                relax_new(&Holding { wvt, others: Others::OfTarget(holds) }, all, self.control)
            }
            SOLVER => {
                let planned = setting.solver(plan);
                let options = SolverOptions { settled: planned.settled || how.sweep > 0, ..planned };
                let solver = DensitySolver::<D>::new(kernel, target, options).within(holds, how.common).seeing(points);
                relax_new(&solver, all, self.control)
            }
            _ => return Ok(all),
        };
        // It may be cut before there is no time left, where another step takes longer than that.
        let cut = relaxed.reports.iter().map(|report| report.stop).find(|stop| stop.is_cut());
        cut.or_else(|| self.control.stop_reason()).map_or(Ok(relaxed.particles.positions), Err)
    }

    /// Measures all blocks, and keeps what was summed at their particles.
    fn measured<const D: usize>(
        &mut self,
        goal: &Goal<'_, D>,
        (kept, map): (&Kept, &Map<'_, D>),
    ) -> Result<BlockFigures> {
        let lap = Instant::now();
        self.control.tell(Event::Begin(Step::Measure));
        let mut measuring = Measuring::new(self.scene, goal.target);
        for block in 0..kept.blocks() {
            self.check(kept)?;
            let own = kept.there(block)?.positions;
            let (all, _) = map.about(kept, (block, &own), false)?.with(&own);
            let points = goal.points_about(&all);
            kept.put_sums(block, &measuring.take(&all, own[0].len(), points.as_deref()))?;
        }
        let figures = measuring.figures(kept)?;
        if !figures.all.as_given.epsilon.is_finite() {
            let problem = "the summed density is beyond f64 where the target is steepest; bound it there, as by 1/max(r, 1e-6) for 1/r".into();
            return Err(Error::Numeric { stage: "measure", problem });
        }
        self.lap(Step::Measure, lap);
        Ok(figures)
    }

    /// Writes the file.
    fn written<const D: usize>(
        &mut self,
        prepared: &Prepared<D>,
        target: Target<'_, D>,
        (kept, stop): (&Kept, StopReason),
    ) -> Result<(Kinds, Written)> {
        let (scene, lap) = (self.scene, Instant::now());
        self.control.tell(Event::Begin(Step::Write));
        let places = OnDisk::new(kept);
        let of_target = (target, &places as &dyn Places<D>);
        let stream = Streamed::new(scene, (prepared, self.units), of_target, Some(self.format), format!("{stop:?}"))?;
        self.told.add(stream.told().clone());
        let Some(path) = scene.output.file.as_deref() else {
            return Err(Error::scene("output.file", "is missing (--out FILE)"));
        };
        let of = (&stream as &dyn ParticleStream, self.units.input.is_some() && D == 3);
        let written = write_rows(scene, self.formats, (self.format, path), of)?;
        self.lap(Step::Write, lap);
        Ok(((stream.variables().to_vec(), stream.left_out().to_vec()), written))
    }

    /// Of particles that all have one mass.
    fn mass<const D: usize>(&self, prepared: &Prepared<D>, target: &Target<'_, D>) -> Result<MassReport> {
        let wanted = self.scene.output.units.as_deref();
        let (units, _) = output_units(wanted, self.units.input, prepared.mass.value, D)?;
        let factors = Factors::new::<D>(self.units.input, prepared, &units);
        let known = (self.units.input.is_some() && D == 3).then_some(units.mass);
        let each = target.equal_masses(1)[0];
        Ok(MassReport::of_equal((each, target.count), &prepared.mass, (&factors, known)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As measured: of a star in 8 blocks, and of a box.
    #[test]
    fn what_is_held_at_once_is_foreseen() {
        let of = |count, blocks| held_at_once::<3>((count, blocks), 64.0) as f64;
        for (foreseen, measured) in [(of(300_000, 8), 8.7e4), (of(100_000, 4), 6.2e4)] {
            assert!((foreseen / measured - 1.0).abs() < 0.4, "{foreseen:e} {measured:e}");
        }
        assert_eq!(of(300_000, 1), 300_000.0);
    }
}
