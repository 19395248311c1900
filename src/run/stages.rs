//! Runs the planned stages in order, from the seeding to the last.

use super::checkpoint::{Checkpoints, Kept, Meta};
use super::checkpoint_parts::Pieces;
use super::duration;
use super::gathered::agreed;
use super::plan::{Plan, TRIM_ITERATIONS};
use super::report::Timing;
use crate::error::{Error, Result};
use crate::metrics::{Aim, Ledger, LedgerOf, Quality};
use crate::relaxation::{
    self, AFC, ALARIC, Accepted, AfcOptions, Alaric, AlaricOptions, AwayFromClosest, BALANCE, BalanceOptions, ByBody,
    Control, DAMPED_RELAXATION, DensitySolver, Event, Holding, Judge, MassTrimming, OnRanks, Others, OverRanks,
    Particles, PressureBalance, SOLVER, SolverOptions, Stage, StageName, StageReport, Start, Step, StopReason,
    TRIMMING, TrimOptions, WVT, Wvt, WvtOptions, agreed_stop, coarse_count, given_and_own,
};
use crate::scene::Scene;
use crate::seeding::{self, Seeded, Seeding};
use crate::target::{Equilibrium, Positions, Target};
use sph::exchange::{Alone, Exchange};
use sph::kernel::{makes_pairs, own_count};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Placed particles, and how they came there.
pub struct Placed<const D: usize> {
    pub particles: Particles<D>,
    pub stages: Vec<StageReport>,
    pub timing: Vec<Timing>,
    pub notes: Vec<String>,
    pub stop: StopReason,
}

/// Net force over gravity below which codes see no less: their own gravity is no better.
const UNSEEN_FORCE: f64 = 1e-3;

/// The note where the solver leaves shells as they are.
const SHELLS_ALONE: &str =
    "the particles are on the shells of `seeding: shells`, which match the density better when they are not relaxed";

/// What all stages are made from.
pub struct Setting<'a, const D: usize> {
    pub scene: &'a Scene,
    pub target: Target<'a, D>,
    /// What a balance needs.
    pub equilibrium: Option<&'a dyn Equilibrium<D>>,
    pub control: &'a Control<'a>,
    /// Over which ranks the particles are.
    exchange: &'a dyn Exchange,
    ledger: Arc<LedgerOf<'a, D>>,
}

/// The table of stages: each with its options from the scene.
fn stage<'a, const D: usize>(name: StageName, setting: &Setting<'a, D>, plan: &Plan) -> Option<Box<dyn Stage<D> + 'a>> {
    let (kernel, target) = (setting.scene.kernel(), setting.target);
    Some(match name {
        WVT => {
            let options = setting.wvt(plan);
            setting.shared(name, coarse(&target, plan), plan, move |target| Wvt { kernel, target, options })
        }
        SOLVER => {
            let options = setting.solver(plan);
            let ledger = Arc::clone(&setting.ledger);
            let make = move |target| DensitySolver::<D>::new(kernel, target, options).knowing(Arc::clone(&ledger));
            setting.shared(name, target, plan, make)
        }
        ALARIC | DAMPED_RELAXATION => {
            Box::new(Alaric::<D>::new(name, kernel, target, setting.alaric(name), plan.splittings))
        }
        AFC => Box::new(AwayFromClosest { kernel, target, options: setting.afc() }),
        BALANCE => {
            let equilibrium = setting.equilibrium?;
            Box::new(PressureBalance { kernel, target, equilibrium, options: setting.balance(plan) })
        }
        TRIMMING => Box::new(MassTrimming { kernel, target, options: setting.trimming()? }),
        _ => return None,
    })
}

/// The target for the particles that splitting begins with.
fn coarse<'a, const D: usize>(target: &Target<'a, D>, plan: &Plan) -> Target<'a, D> {
    target.with_count(coarse_count(D, target.count, plan.splittings))
}

/// Shows what the seeding and each stage left.
pub type Watch<'a, const D: usize> = &'a mut dyn FnMut(&'static str, &Positions<D>);

/// Seeds and relaxes as planned, or goes on from the scene's checkpoint; stages that turn out to be unneeded are
/// dropped from the plan.
///
/// # Errors
/// A target without mass, an interrupt that is to leave nothing, or a checkpoint that cannot be used.
pub fn place<const D: usize>(setting: &Setting<'_, D>, plan: &mut Plan) -> Result<Placed<D>> {
    setting.place_from(plan, |plan| seeded(setting, plan))
}

/// [`place`] without checkpoints, showing `watch` what the seeding and each stage left. Before splitting these are fewer
/// particles than the target's count. What `watch` does counts against a deadline, but not in the timing.
///
/// # Errors
/// A target without mass, or an interrupt.
pub fn place_watched<const D: usize>(
    setting: &Setting<'_, D>,
    plan: &mut Plan,
    watch: Watch<'_, D>,
) -> Result<Placed<D>> {
    let (past, particles) = seeded(setting, plan)?;
    watch(Step::Seed.name(), &particles.positions);
    let placed = setting.run_new(plan, (past, particles), &mut Checkpoints::off(), watch)?;
    if placed.stop == StopReason::Interrupted { Err(Error::Interrupted) } else { Ok(placed) }
}

/// The seeding, of as many particles as splitting begins with.
fn seeded<const D: usize>(setting: &Setting<'_, D>, plan: &Plan) -> Result<(Past, Particles<D>)> {
    check_neighbors::<D>(setting.scene)?;
    setting.control.tell(Event::Begin(Step::Seed));
    let start = Instant::now();
    let Seeded { positions, notes } = seeding::seed(&coarse(&setting.target, plan), plan.seeding, setting.scene.seed)?;
    let seed_seconds = start.elapsed().as_secs_f64();
    Ok((Past::seeded(notes, seed_seconds), positions.into()))
}

/// What came out so far, beside the particles.
pub(super) struct Past {
    notes: Vec<String>,
    seed_seconds: f64,
    reports: Vec<StageReport>,
}

impl Past {
    /// Of a seeding.
    pub(super) fn seeded(notes: Vec<String>, seed_seconds: f64) -> Self {
        Self { notes, seed_seconds, reports: Vec::new() }
    }

    fn resumed(meta: Meta, stages: &[StageName]) -> std::result::Result<Self, String> {
        let named = |report: StageReport<String>| {
            let name = stages.iter().find(|s| s.name == report.stage).copied();
            let unknown = format!("reports of a stage '{}' that this run does not have", report.stage);
            name.map(|name| report.with_name(name)).ok_or(unknown)
        };
        let reports = meta.reports.into_iter().map(named).collect::<std::result::Result<_, _>>()?;
        Ok(Self { notes: meta.notes, seed_seconds: meta.seed_seconds, reports })
    }

    fn meta(&self, stage: usize, name: &str, begun: bool) -> Meta {
        let reports = self.reports.iter().map(|r| r.clone().with_name(r.stage.name.to_owned())).collect();
        let (notes, seed_seconds) = (self.notes.clone(), self.seed_seconds);
        Meta { notes, seed_seconds, reports, stage, name: name.into(), begun }
    }

    fn is_cut(&self) -> bool {
        self.reports.iter().any(|r| r.stop.is_cut())
    }

    /// Why the run ended: what cut it short, or how the last stage that aims at the density did.
    fn stop(&self) -> StopReason {
        let cut = self.reports.iter().find(|r| r.stop.is_cut());
        let last = self.reports.iter().rfind(|r| r.stage != BALANCE && r.stage != TRIMMING);
        cut.or(last).map_or(StopReason::NotNeeded, |r| r.stop)
    }
}

impl<'a, const D: usize> Setting<'a, D> {
    pub fn new(
        scene: &'a Scene,
        target: Target<'a, D>,
        equilibrium: Option<&'a dyn Equilibrium<D>>,
        control: &'a Control<'a>,
    ) -> Self {
        Self { scene, target, equilibrium, control, exchange: &Alone, ledger: Arc::new(LedgerOf::new(target)) }
    }

    /// The same where the particles are over several ranks, all of which run the stages together.
    #[must_use]
    pub fn over(self, exchange: &'a dyn Exchange) -> Self {
        Self { exchange, ..self }
    }

    /// A stage over all of a target, or over its bodies by themselves where the seeding has put the right number in each; over ranks, if there are any.
    fn shared<S: OverRanks<D> + 'a>(
        &self,
        name: StageName,
        target: Target<'a, D>,
        plan: &Plan,
        make: impl Fn(Target<'a, D>) -> S,
    ) -> Box<dyn Stage<D> + 'a> {
        if plan.seeding.goes_by_region()
            && let Some(stage) = ByBody::new(name, target, self.exchange, &make)
        {
            return Box::new(stage);
        }
        let (stage, exchange) = (make(target), self.exchange);
        if exchange.is_alone() { Box::new(stage) } else { Box::new(OnRanks { stage, exchange }) }
    }

    /// [`place`] from seeded positions, of which each of several ranks has a part.
    ///
    /// # Errors
    /// Those of [`place`], and of the seeding.
    pub(super) fn place_from(
        &self,
        plan: &mut Plan,
        seeds: impl FnOnce(&Plan) -> Result<(Past, Particles<D>)>,
    ) -> Result<Placed<D>> {
        let (scene, exchange) = (self.scene, self.exchange);
        let mut checkpoints = Checkpoints::new(exchange, scene, &self.target)?;
        let mut placed = match &scene.checkpoint.resume {
            None => {
                let (past, particles) = agreed(exchange, seeds(plan))?;
                self.run_new(plan, (past, particles), &mut checkpoints, &mut |_, _| {})?
            }
            Some(path) => {
                let refuse = |problem: String| Error::Checkpoint { path: path.clone(), problem };
                let pieces = agreed(exchange, checkpoints.read(path))?;
                let opened = self.opened(&checkpoints, &pieces, plan).map_err(refuse);
                let (meta, kept) = agreed(exchange, opened)?;
                let past = Past::resumed(meta.clone(), &plan.stages).map_err(refuse)?;
                self.run(plan, (past, meta.stage), kept, &mut checkpoints, &mut |_, _| {}).map_err(refuse)?
            }
        };
        if let Some(failure) = checkpoints.failure() {
            placed.notes.push(format!("the last checkpoint could not be written: {failure}"));
        }
        if exchange.any(self.control.is_interrupted()) && scene.discards_interrupted() {
            return Err(checkpoints.interrupted());
        }
        if let Some(file) = checkpoints.sealed() {
            placed.notes.push(format!("cut short; go on with --resume '{}'", file.display()));
        }
        Ok(placed)
    }

    /// What a run goes on from: the state of this rank if there were as many before, else its share of the particles that they had, with which the
    /// stage begins anew.
    ///
    /// # Errors
    /// What is wrong with what was kept.
    fn opened<'k>(
        &self,
        checkpoints: &Checkpoints<'_>,
        kept: &'k Pieces,
        plan: &Plan,
    ) -> std::result::Result<(Meta, Kept<'k, D>), String> {
        let mut opened = Vec::new();
        for (range, bytes) in &kept.pieces {
            opened.push((range.clone(), checkpoints.open::<D>(bytes, &plan.stages)?));
        }
        if kept.are_own {
            return opened.pop().map(|(_, own)| own).ok_or_else(|| "has no particles; start without it".into());
        }
        let (mut meta, mut parts) = (None, Vec::new());
        for (range, (of, kept)) in opened {
            let whole = match kept {
                Kept::Between(particles) => particles,
                Kept::Within(state) => {
                    let stage = stage(plan.stages[of.stage], self, plan);
                    let stage = stage.ok_or("is of a stage that this run does not have; start without it")?;
                    stage.left(given_and_own::<D>(state)?.1)?
                }
            };
            if range.end > whole.len() {
                return Err("holds another number of particles; start without it".into());
            }
            parts.push(whole.rows(range));
            meta.get_or_insert(Meta { begun: false, ..of });
        }
        let meta = meta.ok_or("has no particles; start without it")?;
        Ok((meta, Kept::Between(Particles::joined(parts))))
    }

    /// The target's masses in boxes: found once, at the first measure.
    pub fn ledger(&self) -> &Ledger<D> {
        self.ledger.get()
    }

    /// Particles that are relaxed by WVT against those that are `held`, with whether densities jump between them, in the order in which they are
    /// given.
    ///
    /// # Errors
    /// An interrupt that is to leave nothing.
    pub fn settled(&self, plan: &Plan, positions: Positions<D>, held: (&[bool], bool)) -> Result<Placed<D>> {
        let mut past = Past::seeded(Vec::new(), 0.0);
        if !plan.stages.contains(&WVT) {
            return Ok(past.placed(positions.into(), 0.0));
        }
        self.control.tell(Event::Begin(Step::Relax(WVT)));
        let wvt = Wvt { kernel: self.scene.kernel(), target: self.target, options: self.wvt(plan) };
        let others = Others::Apart { held: held.0, has_jump: held.1 };
        let relaxed = relaxation::relax_new(&Holding { wvt, others }, positions, self.control);
        past.reports.extend(relaxed.reports);
        match self.control.is_interrupted() && self.scene.discards_interrupted() {
            true => Err(Error::Interrupted),
            false => Ok(past.placed(relaxed.particles, 0.0)),
        }
    }

    /// Runs all stages.
    fn run_new(
        &self,
        plan: &mut Plan,
        (past, particles): (Past, Particles<D>),
        checkpoints: &mut Checkpoints<'_>,
        watch: Watch<'_, D>,
    ) -> Result<Placed<D>> {
        self.run(plan, (past, 0), Kept::Between(particles), checkpoints, watch)
            .map_err(|problem| Error::Numeric { stage: "relaxation", problem })
    }

    /// Runs the stages from the index on.
    ///
    /// # Errors
    /// What is wrong with a kept state.
    fn run(
        &self,
        plan: &mut Plan,
        (mut past, first): (Past, usize),
        kept: Kept<'_, D>,
        checkpoints: &mut Checkpoints<'_>,
        watch: Watch<'_, D>,
    ) -> std::result::Result<Placed<D>, String> {
        let mut start = match kept {
            Kept::Between(particles) => Start::New(particles),
            Kept::Within(bytes) => Start::Kept(bytes),
        };
        let mut dropped = Vec::new();
        let stages = plan.stages.clone();
        let measure = |particles: &Particles<D>| self.quality(particles);
        let (seeding, number) = (plan.seeding, self.scene.seed);
        let seeds = || seeding::seed(&self.target, seeding, number).ok().map(|seeded| seeded.positions.into());
        let judge = Judge::new(&measure, &seeds, self.exchange);
        let mut of_ledger = 0.0;
        for (index, &name) in stages.iter().enumerate().skip(first) {
            let resumed = matches!(start, Start::Kept(_));
            if let Some(why) = skip(name, &past, plan).filter(|_| !resumed) {
                dropped.push(name);
                plan.drop(name.title, why);
                continue;
            }
            let Some(mut stage) = stage(name, self, plan) else { continue };
            let mut control = *self.control;
            if let (Start::New(particles), Some(deadline)) = (&start, control.deadline) {
                // What measuring takes counts against the limit.
                let early = agreed_stop(self.exchange, control.stop_reason_within(self.measures(particles.len())));
                if early.is_none() {
                    // The target's masses are found but once.
                    let begin = Instant::now();
                    self.ledger();
                    of_ledger += begin.elapsed().as_secs_f64();
                    control.deadline = deadline.checked_sub(judge.look_at(particles)).or(Some(deadline));
                }
                let stop = early.or(agreed_stop(self.exchange, control.stop_reason()));
                if stop == Some(StopReason::TimeLimit) && !splits(name, plan) {
                    checkpoints.leave(&past.meta(index, name.name, false), particles);
                    past.reports.push(StageReport::not_begun(name, StopReason::TimeLimit));
                    continue;
                }
            }
            let is_solid = self.equilibrium.is_some_and(|e| e.materials().is_some());
            let aim = match name == BALANCE {
                true if is_solid => Aim::ForcesOfSolids,
                true => Aim::Forces,
                false => Aim::Density,
            };
            let in_step = stage.goes_in_step();
            if let (false, Start::New(particles)) = (in_step, &start) {
                checkpoints.begin(&past.meta(index, name.name, false), particles);
            }
            // What is kept of other stages is what they leave.
            let discards_interrupted = in_step && self.scene.discards_interrupted();
            stage = Box::new(Accepted { stage, target: self.target, judge: &judge, aim, discards_interrupted });
            self.control.tell(Event::Begin(Step::Relax(name)));
            let meta = past.meta(index, name.name, true);
            let mut keep = |stopping: bool, state: relaxation::Snapshot<'_>| {
                if in_step {
                    checkpoints.offer(stopping, &meta, state);
                }
            };
            let relaxed = relaxation::relax(&*stage, start, &control, &mut keep)?;
            let stop = relaxed.report().stop;
            if !in_step && stop.is_cut() {
                checkpoints.leave(&past.meta(index, name.name, false), &relaxed.particles);
            }
            let mut particles = relaxed.particles;
            let of_seeding = past.notes.len();
            past.notes.extend(relaxed.notes);
            if name == SOLVER
                && !stop.is_cut()
                && past.reports.is_empty()
                && let Some((shells, notes)) = self.shells_alone(plan, &judge, &particles)
            {
                (particles, plan.seeding) = (shells, Seeding::Shells);
                past.notes.splice(..of_seeding, notes);
                past.notes.push(SHELLS_ALONE.into());
            }
            watch(name.name, &particles.positions);
            past.reports.extend(relaxed.reports);
            if discards_interrupted && stop == StopReason::Interrupted {
                return Ok(past.placed(particles, of_ledger + judge.seconds()));
            }
            start = Start::New(particles);
        }
        plan.stages.retain(|s| !dropped.contains(s));
        let particles = match start {
            Start::New(particles) => particles,
            Start::Kept(_) => return Err("is of a stage that this run does not have; start without it".into()),
        };
        if !past.is_cut() {
            checkpoints.finish(&past.meta(stages.len(), "", false), &particles);
        }
        Ok(past.placed(particles, of_ledger + judge.seconds()))
    }

    /// The shells for particles that are not relaxed, with what their seeding has to say, where those that were chosen for the solver are what is left;
    /// none where these are no better.
    fn shells_alone(
        &self,
        plan: &Plan,
        judge: &Judge<'_, D>,
        left: &Particles<D>,
    ) -> Option<(Particles<D>, Vec<String>)> {
        let are_for_solver = plan.seeding == Seeding::EqualAreaShells && self.scene.seeding.is_none();
        if !(are_for_solver && judge.has_refused() && self.exchange.is_alone()) {
            return None;
        }
        let Seeded { positions, notes } = seeding::seed(&self.target, Seeding::Shells, self.scene.seed).ok()?;
        let shells = positions.into();
        judge.prefers(&shells, left).then_some((shells, notes))
    }

    /// What measuring so many particles before a stage and at the end takes, roughly.
    fn measures(&self, count: usize) -> Duration {
        let kernel_neighbors = self.scene.kernel_neighbors(D);
        let once = duration::measures(count, kernel_neighbors, rayon::current_num_threads());
        Duration::try_from_secs_f64(2.0 * once).unwrap_or_default()
    }

    fn quality(&self, particles: &Particles<D>) -> Quality {
        let (kernel, neighbors, exchange) = (self.scene.kernel(), self.scene.kernel_neighbors(D), self.exchange);
        let target = self.target.with_count(exchange.count(particles.len()));
        // Over several ranks all have the same; the target's own are of all particles.
        let equal = (!exchange.is_alone()).then(|| target.equal_masses(particles.len()));
        let masses = particles.masses.as_deref().or(equal.as_deref());
        Quality::among(exchange, kernel, (&target, self.ledger()), (&particles.positions, masses), neighbors)
    }

    pub(super) fn wvt(&self, plan: &Plan) -> WvtOptions {
        let w = &self.scene.wvt;
        WvtOptions {
            weight: w.weight,
            bias: w.bias,
            iterations: plan.wvt_iterations,
            step: w.step,
            final_step: w.final_step,
            kernel_neighbors: self.scene.kernel_neighbors(D),
            tolerance: self.aim(),
        }
    }

    pub(super) fn solver(&self, plan: &Plan) -> SolverOptions {
        let (scene, default) = (self.scene, SolverOptions::new(D));
        // A code sees forces: what it starts from without a balance should have the least noise in them.
        let for_code = (scene.target_code.is_some() && plan.balance == 0).then_some(1.0);
        let by_tolerance = scene.tolerance.map(SolverOptions::quietness_for);
        // Past the pairing instability an exact density costs a body its balance: forces of pressure miss gravity by three times as
        // much, while the density against the smoothed target gains nothing.
        let pairs = makes_pairs(scene.kernel(), D, scene.kernel_neighbors(D));
        let at_rest = (pairs && self.equilibrium.is_some()).then_some(1.0);
        let quietness = scene.solver.quietness.or(by_tolerance).or(for_code).or(at_rest);
        SolverOptions {
            kernel_neighbors: scene.kernel_neighbors(D),
            evaluations: plan.evaluations,
            quietness: quietness.unwrap_or(default.quietness),
            tolerance: scene.tolerance.unwrap_or(default.tolerance),
            // Who says how many evaluations there are to be gets them.
            least_gain: if scene.solver.evaluations.is_some() { 0.0 } else { default.least_gain },
            settled: plan.starts_in_order(),
            smoothed: plan.aims_at_mass,
        }
    }

    fn alaric(&self, name: StageName) -> AlaricOptions {
        let (a, damped) = (&self.scene.alaric, name == DAMPED_RELAXATION);
        AlaricOptions {
            kernel_neighbors: self.scene.kernel_neighbors(D),
            friction: a.friction,
            viscosity: a.viscosity || damped,
            velocity_stops: a.velocity_stops && !damped,
            growth: a.growth,
            hold_unresolved: a.hold_unresolved,
            grad_h: a.grad_h,
            courant: a.courant,
            steps: a.steps,
            tolerance: self.aim(),
            rate_tolerance: a.rate_tolerance,
        }
    }

    fn afc(&self) -> AfcOptions {
        let (a, kernel_neighbors) = (&self.scene.afc, self.scene.kernel_neighbors(D));
        AfcOptions { kernel_neighbors, steps: a.steps, step: a.step, tolerance: self.aim() }
    }

    fn balance(&self, plan: &Plan) -> BalanceOptions {
        // Who says how many evaluations there are to be gets them.
        let asked = self.scene.balance.on().is_some_and(|b| b.evaluations.is_some());
        BalanceOptions {
            kernel_neighbors: self.scene.kernel_neighbors(D),
            evaluations: plan.balance,
            enough: if asked { 0.0 } else { UNSEEN_FORCE },
        }
    }

    fn trimming(&self) -> Option<TrimOptions> {
        let kernel_neighbors = self.scene.kernel_neighbors(D);
        let (iterations, tolerance) = (TRIM_ITERATIONS, self.aim());
        self.scene.trim_masses.map(|largest_change| TrimOptions {
            kernel_neighbors,
            largest_change,
            iterations,
            tolerance,
        })
    }

    /// Epsilon at which stages stop that do not measure it themselves. They watch it at the target's own support radii; as
    /// measured in the end, at solved ones, it is up to a sixth larger.
    fn aim(&self) -> f64 {
        0.8 * self.scene.tolerance.unwrap_or(0.0)
    }
}

impl Past {
    fn placed<const D: usize>(self, particles: Particles<D>, accept_seconds: f64) -> Placed<D> {
        let stop = self.stop();
        let seed = Timing { step: Step::Seed.name(), seconds: self.seed_seconds, epsilon: None };
        let lap = |s: &StageReport| Timing { step: s.stage.name, seconds: s.seconds, epsilon: s.epsilon() };
        let accept = Timing { step: Step::Accept.name(), seconds: accept_seconds, epsilon: None };
        let accept = (accept_seconds > 0.0).then_some(accept);
        let timing = std::iter::once(seed).chain(self.reports.iter().map(lap)).chain(accept).collect();
        Placed { particles, stages: self.reports, timing, notes: self.notes, stop }
    }
}

/// Whether it begins with fewer particles than there are to be.
fn splits(name: StageName, plan: &Plan) -> bool {
    name == ALARIC && plan.splittings > 0
}

/// Why a stage is left out after what came before it. Splitting goes on in any case, to the full number of particles.
fn skip(name: StageName, past: &Past, plan: &Plan) -> Option<&'static str> {
    let splits = splits(name, plan);
    if past.is_cut() && !splits {
        return Some("time was up before it, or the run was interrupted");
    }
    let met = past.reports.last().is_some_and(|r| r.stage == WVT && r.stop == StopReason::ToleranceReached);
    let polish = name != WVT && name != BALANCE && name != TRIMMING;
    (met && polish && !splits).then_some("WVT met the tolerance")
}

/// n_i V H^d of a particle counts its own kernel at least; no support radius has fewer neighbors than that.
pub(super) fn check_neighbors<const D: usize>(scene: &Scene) -> Result<()> {
    let neighbors = scene.kernel_neighbors(D);
    let (own, title) = (own_count(scene.kernel(), D), scene.kernel().title());
    if !(neighbors > own) {
        let problem = format!(
            "is {neighbors}, but {title} counts a particle itself as {own:.1} in {D}-D; expected more than that"
        );
        return Err(Error::scene("neighbors", problem));
    }
    Ok(())
}
