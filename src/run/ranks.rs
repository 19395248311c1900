//! A scene placed over several ranks. Each rank receives the seeded positions of a part of space, by mass bisection or on shells, moves them
//! through WVT and the density solver with the nearby particles of other ranks, and measures them in the same way; the first rank writes one
//! file, for which it fetches rows from the others.
//!
//! Seeded positions are the same for any number of ranks, to the bit. Later results differ by rounding, since sums go over trees of other
//! particles; for a given number of ranks they are the same for any number of threads, and whether ranks are processes or threads.

use super::checkpoint::remove_checkpoint;
use super::destination::{Written, write_rows};
use super::duration::{self, Cost, Expected};
use super::gathered::{Gathered, agreed, share_of};
use super::grading::verdict as verdict_on;
use super::parts::Parts;
use super::plan::Plan;
use super::remarks::Remarks;
use super::report::{MassReport, Report, Timing};
use super::stages::{Past, Placed, Setting};
use super::streamed::{Read, some_of};
use super::verdict::as_measured;
use super::{doubts, memory};
use crate::error::{Error, Result};
use crate::input::internal_units::Prepared;
use crate::input::units::RunUnits;
use crate::metrics::Outcome;
use crate::output::frame::{Factors, output_units};
use crate::output::origin;
use crate::output::particle_file::{Made, Making, RawColumns, particle_file};
use crate::relaxation::{Control, Event, Step};
use crate::scene::{DEFAULT_PARTICLES, Scene};
use crate::seeding::Blockwise;
use crate::target::Target;
use sph::exchange::Exchange;
use sph_formats::common::particle_names as names;
use sph_formats::{FormatError, FormatSpec, ParticleFile};
use std::time::Instant;

/// Particles of a rank, at least.
const FEWEST: usize = 3;

/// Runs a scene over the ranks of `exchange`, all of which call it together; the first writes the file. The report is the same on
/// all of them, but for its times and notes.
///
/// # Errors
/// Those of [`run`](super::pipeline::run); what a run over ranks does not do; [`Error::Rank`] where another rank failed. Nothing is left half-written.
pub fn run_on_ranks(
    scene: &Scene,
    formats: &[FormatSpec],
    control: &Control<'_>,
    exchange: &dyn Exchange,
) -> Result<Report> {
    agreed(exchange, refuse(scene))?;
    let start = Instant::now();
    control.tell(Event::Begin(Step::Read));
    let begun = agreed(exchange, RANKS.begin(scene, formats))?;
    let mut run = Run {
        scene,
        formats,
        control,
        exchange,
        format: begun.1,
        units: begun.0.units,
        start,
        timing: Vec::new(),
        told: begun.0.told,
    };
    run.told.notes.push(parts_of(scene, exchange));
    run.lap(Step::Read, start, None);
    let (dimension, raw) = (begun.0.dimension, begun.0.raw);
    let read = Read { raw, units: run.units, dimension, told: Remarks::default() };
    let (file, mut report) = match dimension {
        1 => run.in_dimension::<1>(read),
        2 => run.in_dimension::<2>(read),
        _ => run.in_dimension::<3>(read),
    }?;
    let lap = Instant::now();
    control.tell(Event::Begin(Step::Write));
    let has_units = report.mass.total_cgs.is_some();
    let written = write((scene, has_units), formats, begun.1, (exchange, &file))?;
    written.into_iter().for_each(|written| written.tell(&mut report.notes, &mut report.verdict));
    if exchange.rank() == 0 {
        report.notes.extend(remove_checkpoint(scene, report.stop));
    }
    report.timing.push(Timing { step: Step::Write.name(), seconds: lap.elapsed().as_secs_f64(), epsilon: None });
    report.seconds = start.elapsed().as_secs_f64();
    report.peak_memory = memory::peak();
    Ok(report)
}

/// Of which a run over ranks has a part of the particles each.
pub(super) const RANKS: Parts = Parts { how: "over several ranks", who: "several ranks" };

/// Refuses what a run over ranks does not do and a scene asks for.
pub(super) fn refuse(scene: &Scene) -> Result<()> {
    if let Some(other) = scene.seeding {
        Blockwise::<3>::refuse_others(other)?;
    }
    RANKS.refuse(scene)
}

/// Refuses fewer particles than ranks can share.
pub(super) fn refuse_few(particles: usize, ranks: usize) -> Result<()> {
    if particles < FEWEST * ranks {
        let problem = format!("is {particles}, too few for {ranks} ranks; expected at least {}", FEWEST * ranks);
        return Err(Error::scene("particles", problem));
    }
    Ok(())
}

fn parts_of(scene: &Scene, exchange: &dyn Exchange) -> String {
    let count = scene.particles.unwrap_or(DEFAULT_PARTICLES);
    let ranks = exchange.ranks();
    let here = exchange.on_this_machine();
    format!(
        "placed over {ranks} ranks, {here} of them on the first one's machine, of {} particles each at most",
        count.div_ceil(ranks)
    )
}

/// A run under way on one rank.
struct Run<'a> {
    scene: &'a Scene,
    formats: &'a [FormatSpec],
    control: &'a Control<'a>,
    exchange: &'a dyn Exchange,
    format: &'a FormatSpec,
    units: RunUnits,
    start: Instant,
    timing: Vec<Timing>,
    told: Remarks,
}

impl<'a> Run<'a> {
    fn lap(&mut self, step: Step, since: Instant, epsilon: Option<f64>) {
        self.timing.push(Timing { step: step.name(), seconds: since.elapsed().as_secs_f64(), epsilon });
    }

    /// Ends all ranks where any is interrupted between two steps.
    fn check(&self) -> Result<()> {
        let is_cut = self.exchange.any(self.control.is_interrupted());
        if is_cut { Err(Error::Interrupted) } else { Ok(()) }
    }

    fn in_dimension<const D: usize>(mut self, Read { raw, .. }: Read) -> Result<(ParticleFile, Report)> {
        let (lap, exchange, scene) = (Instant::now(), self.exchange, self.scene);
        self.control.tell(Event::Begin(Step::Interpolate));
        let count = scene.particles.unwrap_or(DEFAULT_PARTICLES);
        let prepared = agreed(exchange, self.prepared::<D>(raw, count))?;
        doubts::refuse_domain(scene, &prepared.source.domain, count)?;
        doubts::refuse_places_without_particles(&prepared.target())?;
        self.told.of_target(scene, &prepared, count);
        let regions = prepared.target().find_regions(scene.region_contrast);
        let target = prepared.target().with_regions(regions.as_ref());
        self.told.of_regions(regions.as_ref(), count);
        self.lap(Step::Interpolate, lap, None);
        let (scene, mut plan) = RANKS.planned(scene, (&prepared, &target), exchange.ranks());
        let mut run = Run { scene: &scene, ..self };
        plan.drop("parts of the force noise", "they are not measured over several ranks");
        let seeds = Blockwise::new(&target, plan.seeding, scene.seed)?;
        run.told.warnings.extend(doubts::after(&target, &agreed(exchange, some_of(&seeds, count))?));
        let here = (exchange.on_this_machine(), exchange.ranks());
        agreed(exchange, memory::check_among(count, &plan.stages, here))?;
        let expected = run.expected(&plan, &target);
        run.check()?;
        let placed = run.place(&target, &mut plan)?;
        run.measured(&prepared, target, placed, (plan, expected))
    }

    /// The source, of which ranks can make their parts by themselves.
    fn prepared<const D: usize>(&self, raw: crate::input::ingest::RawInput, count: usize) -> Result<Prepared<D>> {
        let ranks = self.exchange.ranks();
        refuse_few(count, ranks)?;
        RANKS.prepared((self.scene, self.formats, self.format), (raw, &self.units), count)
    }

    fn expected<const D: usize>(&self, plan: &Plan, target: &Target<'_, D>) -> Vec<Expected> {
        let kernel_neighbors = self.scene.kernel_neighbors(D);
        let cost = Cost { kernel_neighbors, slowness: 1.0, target: duration::of_target(target) };
        let each = target.count.div_ceil(self.exchange.ranks());
        let expected = duration::expected(plan, self.scene, each, &cost, rayon::current_num_threads());
        for Expected { step, seconds } in &expected {
            self.control.tell(Event::Expect { step, seconds: *seconds });
        }
        expected
    }

    /// Seeds, and relaxes.
    fn place<const D: usize>(&mut self, target: &Target<'_, D>, plan: &mut Plan) -> Result<Placed<D>> {
        let exchange = self.exchange;
        let shares: Vec<_> = (0..exchange.ranks()).map(|rank| share_of(target.count, rank, exchange.ranks())).collect();
        let seeds = |plan: &Plan| {
            let lap = Instant::now();
            self.control.tell(Event::Begin(Step::Seed));
            let positions = Blockwise::new(target, plan.seeding, self.scene.seed)?.dealt(exchange, &shares)?;
            Ok((Past::seeded(Vec::new(), lap.elapsed().as_secs_f64()), positions.into()))
        };
        let placed = Setting::new(self.scene, *target, None, self.control).over(exchange).place_from(plan, seeds)?;
        self.timing.extend(placed.timing.iter().cloned());
        self.told.notes.extend(placed.notes.iter().cloned());
        Ok(placed)
    }

    /// Measures, and makes this rank's part of the file.
    fn measured<const D: usize>(
        mut self,
        prepared: &Prepared<D>,
        target: Target<'_, D>,
        placed: Placed<D>,
        (mut plan, expected): (Plan, Vec<Expected>),
    ) -> Result<(ParticleFile, Report)> {
        let (exchange, scene, lap) = (self.exchange, self.scene, Instant::now());
        self.control.tell(Event::Begin(Step::Measure));
        let (kernel, neighbors) = (scene.kernel(), scene.kernel_neighbors(D));
        let Placed { particles, stages, stop, .. } = placed;
        let positions = particles.positions;
        let masses = target.equal_masses(positions[0].len());
        let asked = masses.clone();
        let setting = Setting::new(scene, target, None, self.control);
        let outcome =
            Outcome::among(exchange, kernel, (&target, setting.ledger()), (&positions, masses), neighbors, None);
        let error = outcome.density_error;
        if !error.all.epsilon.is_finite() {
            let problem =
                format!("the summed density of {} particles is beyond f64 where the target is steepest", target.count);
            return Err(Error::Numeric { stage: "measure", problem });
        }
        self.lap(Step::Measure, lap, Some(error.all_refitted.epsilon));
        if scene.discards_interrupted() {
            self.check()?;
        }
        let stop = as_measured(scene, stop, error.stated().epsilon);
        self.told.of_code::<D>(scene, Some(self.format));
        let (units, note) =
            agreed(exchange, output_units(scene.output.units.as_deref(), self.units.input, prepared.mass.value, D))?;
        self.told.notes.extend(note);
        let factors = Factors::new::<D>(self.units.input, prepared, &units);
        let known = (self.units.input.is_some() && D == 3).then_some(units.mass);
        let mass = MassReport::among(exchange, &outcome.masses, &asked, &prepared.mass, (&factors, known));
        let raw = RawColumns {
            drawn: None,
            positions: &positions,
            masses: outcome.masses,
            support: outcome.support,
            density: outcome.density,
            target_density: outcome.target_density,
            balanced: None,
            displaced: None,
        };
        let making = Making {
            kernel: kernel.title(),
            kernel_neighbors: neighbors,
            stop: format!("{stop:?}"),
            requires_energy: self.format.capabilities.requires.contains(&names::INTERNAL_ENERGY),
            units_known: self.units.input.is_some(),
            conversion: self.units.to_output(&units),
            origin: origin::wanted(scene, Some(self.format), origin::closed_and_open(&prepared.source.domain)),
        };
        let made = particle_file(scene, prepared, raw, (units, &factors), None, &making);
        let Made { file, notes, warnings, left_out, .. } = agreed(exchange, made)?;
        self.told.notes.extend(notes);
        self.told.warnings.extend(warnings);
        left_out.into_iter().for_each(|(what, why)| plan.drop(what, why));
        let variables = self.told.of_file(prepared, &file, Some(self.format));
        let mut report = Report {
            input: scene.input_name(),
            output: scene.output.file.as_ref().map_or_else(String::new, |file| file.display().to_string()),
            format: self.format.name,
            dimension: D,
            particles: target.count,
            seed: scene.seed,
            kernel: kernel.title(),
            mass,
            stop,
            tolerance: scene.tolerance,
            density_error: error,
            ledger: outcome.ledger,
            noise: outcome.noise,
            order: outcome.order,
            balance: None,
            certificate: None,
            motion: None,
            support: None,
            turning: None,
            settled: None,
            renewed: None,
            neighbors: outcome.neighbors,
            stages,
            expected,
            timing: self.timing,
            seconds: self.start.elapsed().as_secs_f64(),
            peak_memory: memory::peak(),
            plan,
            variables,
            radius: prepared.surface().map(|radius| radius * factors.length),
            in_field: false,
            atmosphere: prepared.cut,
            snapshot: None,
            verdict: Vec::new(),
            warnings: self.told.warnings,
            notes: self.told.notes,
            #[cfg(feature = "plots")]
            seen: None,
        };
        report.verdict = verdict_on(&report);
        Ok((file, report))
    }
}

/// Writes the particles of all ranks from the first, which knows what there is to say of them.
fn write(
    (scene, has_units): (&Scene, bool),
    formats: &[FormatSpec],
    format: &FormatSpec,
    (exchange, file): (&dyn Exchange, &ParticleFile),
) -> Result<Option<Written>> {
    let Some(path) = scene.output.file.as_deref() else {
        return Err(Error::scene("output.file", "is missing (--out FILE)"));
    };
    let refuse = |problem: String| Error::from(FormatError::Output { path: path.into(), format: format.name, problem });
    agreed(exchange, file.validate().map_err(|(location, problem)| refuse(format!("{location}: {problem}"))))?;
    agreed(exchange, file.meaningless().map_or(Ok(()), |problem| Err(refuse(problem))))?;
    let gathered = agreed(exchange, Gathered::new(exchange, file))?;
    let written = if exchange.rank() == 0 {
        let written = write_rows(scene, formats, (format, path), (&gathered, has_units)).map(Some);
        gathered.done();
        written
    } else {
        gathered.serve();
        Ok(None)
    };
    agreed(exchange, written)
}
