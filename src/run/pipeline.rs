//! The steps from a scene to a file: input -> source -> target -> seeding -> relaxation -> carried fields -> measures -> particle file. The only
//! place where the run-time dimension becomes a type.

use super::carving::{Carving, Obstacles};
use super::certifying::{self, Motion};
use super::checkpoint::{refuse_interrupted, remove_checkpoint};
use super::destination::{
    Destination, intended_format, refuse_box, refuse_cold, refuse_other_types, refuse_what_the_format_cannot_hold,
};
use super::drawings::{Drawing, is_drawn, is_picture};
use super::duration::{self, Cost, Expected};
use super::forecast::{self, Forecast};
use super::grading::verdict as verdict_on;
use super::plan::{Held, Plan};
use super::refining::{Refining, refines_a_snapshot};
use super::remarks::Remarks;
use super::report::{MassReport, Report, SnapshotReport, Timing};
use super::stages::{self, Placed, Setting};
use super::verdict::as_measured;
use super::{doubts, dust, layer, memory, settling, turning};
use crate::error::{Error, Result};
use crate::input::collisionless;
use crate::input::displacement::{Displaced, Displacement};
use crate::input::hydrostatics::{Doubt, Hydrostatics};
use crate::input::ingest::{self, RawInput};
use crate::input::internal_units::Prepared;
use crate::input::stated_units;
use crate::input::surroundings;
use crate::input::units::RunUnits;
#[cfg(feature = "plots")]
use crate::metrics::Detail;
use crate::metrics::{Measured, Outcome, Thermodynamics};
use crate::output::conservation::TOTALS;
#[cfg(feature = "plots")]
use crate::output::frame::Frame;
use crate::output::frame::{Factors, output_units};
use crate::output::kept::is_double;
use crate::output::origin;
use crate::output::parameters::Physics;
use crate::output::particle_file::{MOVED, Made, Making, RawColumns, particle_file};
use crate::output::walls::Walls;
#[cfg(feature = "plots")]
use crate::page::{Seen, Side};
use crate::relaxation::{BALANCE, CERTIFICATE, Control, Event, Particles, Step};
use crate::scene::{DEFAULT_PARTICLES, Scene, name_of};
use crate::target::{Equilibrium, Positions};
use sph::domain::Domain;
#[cfg(feature = "plots")]
use sph::domain::Region;
use sph::kernel::KernelName;
use sph_formats::common::particle_names as names;
use sph_formats::{FormatSpec, ParticleFile, Species, UnitSystem};
use std::time::Instant;

/// Places the particles of a scene. They are in the output's units, in the box of the output; nothing is written.
///
/// The scene's output file may be missing. Where it, its format or a target code is stated, what the format cannot hold is refused
/// before the work.
///
/// # Errors
/// Any of [`Error`].
pub fn place(scene: &Scene, formats: &[FormatSpec], control: &Control<'_>) -> Result<(ParticleFile, Report)> {
    refuse_dust(scene, formats)?;
    let code = settling::code_of(scene, intended_format(scene, formats)?)?;
    let Done::Placed(placed) = done(scene, formats, control, (false, None))? else { return Err(Error::Interrupted) };
    let (mut file, mut report) = *placed;
    let format = intended_format(scene, formats)?.map(|f| f.name);
    let units = scene.output.units.clone().or_else(|| name_of(file.header.units).map(str::to_owned));
    if let Some(alone) = scene.of_dust(report.particles, format, units)? {
        let (own, of_dust) = place(&alone, formats, control).map_err(dust::in_dust)?;
        report.notes.extend(dust::join(&mut file, own));
        report
            .notes
            .push(format!("its density is {:.2} % off on average", 100.0 * of_dust.density_error.stated().mean));
        report.warnings.extend(of_dust.warnings.iter().map(|warning| format!("dust: {warning}")));
    }
    if let Some(settled) = settling::settle(scene, code.as_ref(), &mut file, control)? {
        report.add_settling(settled);
        report.verdict = verdict_on(&report);
    }
    Ok((file, report))
}

/// Refuses dust that cannot be placed, before the gas is.
fn refuse_dust(scene: &Scene, formats: &[FormatSpec]) -> Result<()> {
    if scene.dust.is_none() {
        return Ok(());
    }
    scene.validate()?;
    let format = intended_format(scene, formats)?.map(|f| f.name);
    let gas = scene.particles.unwrap_or(DEFAULT_PARTICLES);
    let Some(alone) = scene.of_dust(gas, format, scene.output.units.clone())? else { return Ok(()) };
    done(&alone, formats, &Control::default(), (true, None)).map(|_| ()).map_err(dust::in_dust)
}

/// A medium in a box, less what bodies take of it.
///
/// # Errors
/// Those of [`place`].
pub(super) fn place_around(
    scene: &Scene,
    formats: &[FormatSpec],
    control: &Control<'_>,
    around: &Obstacles,
) -> Result<(ParticleFile, Report)> {
    match done(scene, formats, control, (false, Some(around)))? {
        Done::Placed(placed) => Ok(*placed),
        Done::Foreseen(_) => Err(Error::Interrupted),
    }
}

/// What [`run`] would do: all that it does before it places particles, with what the stages will take.
///
/// # Errors
/// Those of [`run`] up to there.
pub fn forecast(scene: &Scene, formats: &[FormatSpec], control: &Control<'_>) -> Result<Forecast> {
    if scene.output.file.is_some() {
        Destination::new(scene, formats)?.refuse_overwriting_inputs(scene)?;
    }
    settling::code_of(scene, intended_format(scene, formats)?)?;
    match done(scene, formats, control, (true, None))? {
        Done::Foreseen(forecast) => Ok(*forecast),
        Done::Placed(_) => Err(Error::Interrupted),
    }
}

/// What came of a run.
enum Done {
    Placed(Box<(ParticleFile, Report)>),
    Foreseen(Box<Forecast>),
}

fn done(
    scene: &Scene,
    formats: &[FormatSpec],
    control: &Control<'_>,
    (is_dry, around): (bool, Option<&Obstacles>),
) -> Result<Done> {
    scene.validate()?;
    if !scene.bodies.is_empty() {
        return Err(Error::scene("bodies", "are several; place_bodies places them, and run_bodies writes the file"));
    }
    let format = intended_format(scene, formats)?;
    let start = Instant::now();
    control.tell(Event::Begin(Step::Read));
    let raw = ingest::read(scene, formats)?;
    let (input, told) = Remarks::of_input(stated_units::units(scene, &raw)?, &raw);
    let units = RunUnits::new(scene, input)?;
    scene.check_units(&units.to_input())?;
    let dimension = ingest::dimension(scene, &raw)?;
    if let Some(format) = format {
        refuse_what_the_format_cannot_hold(scene, format, dimension)?;
        refuse_cold(scene, format, &raw)?;
    }
    let mut run = Run {
        scene,
        formats,
        format,
        control,
        units,
        start,
        timing: Vec::new(),
        expected: Vec::new(),
        told,
        is_dry,
        around,
        own_units: None,
    };
    run.lap(Step::Read, start, None);
    run.check()?;
    match dimension {
        1 => run.in_dimension::<1>(raw),
        2 => run.in_dimension::<2>(raw),
        _ => run.in_dimension::<3>(raw),
    }
}

/// Runs a scene from input to output file: [`place`], and writing what it returns.
///
/// # Errors
/// Any of [`Error`]; nothing is left half-written.
pub fn run(scene: &Scene, formats: &[FormatSpec], control: &Control<'_>) -> Result<Report> {
    run_as(scene, formats, control, "")
}

/// [`run`], with the command for a page of the run.
///
/// # Errors
/// Those of [`run`].
pub fn run_as(scene: &Scene, formats: &[FormatSpec], control: &Control<'_>, command: &str) -> Result<Report> {
    let destination = Destination::new(scene, formats)?;
    destination.refuse_overwriting_inputs(scene)?;
    let start = Instant::now();
    let (file, mut report) = place(scene, formats, control)?;
    let lap = Instant::now();
    control.tell(Event::Begin(Step::Write));
    let mut written = scene.clone();
    // What stays of a snapshot stays to the bit.
    written.output.double_precision |= refines_a_snapshot(scene, &report) && is_double(&file);
    let mut physics = Physics::of(scene, report.mass.total_cgs.is_some());
    physics.in_field |= report.in_field;
    physics.of_snapshot = report.snapshot.is_some();
    let written = destination.write(&written, formats, (&file, &Drawing::of(&report)), physics)?;
    written.tell(&mut report.notes, &mut report.verdict);
    report.timing.push(Timing { step: Step::Write.name(), seconds: lap.elapsed().as_secs_f64(), epsilon: None });
    report.notes.extend(remove_checkpoint(scene, report.stop));
    report.seconds = start.elapsed().as_secs_f64();
    report.peak_memory = memory::peak();
    report.write_page(scene, &file, command)?;
    Ok(report)
}

/// A run under way.
struct Run<'a> {
    scene: &'a Scene,
    formats: &'a [FormatSpec],
    format: Option<&'a FormatSpec>,
    control: &'a Control<'a>,
    units: RunUnits,
    start: Instant,
    timing: Vec<Timing>,
    expected: Vec<Expected>,
    told: Remarks,
    /// Whether to end before particles are placed.
    is_dry: bool,
    /// Bodies that take their place of what is placed.
    around: Option<&'a Obstacles>,
    /// Of the output, where these are settled.
    own_units: Option<UnitSystem>,
}

impl Run<'_> {
    fn lap(&mut self, step: Step, since: Instant, epsilon: Option<f64>) {
        self.timing.push(Timing { step: step.name(), seconds: since.elapsed().as_secs_f64(), epsilon });
    }

    /// Ends a run that is interrupted between two steps, unless what there is is to be written: one body of several is placed as well as
    /// it can be then.
    fn check(&self) -> Result<()> {
        match self.is_dry && self.control.is_interrupted() {
            true => Err(Error::Interrupted),
            false => refuse_interrupted(self.scene, self.control),
        }
    }

    fn in_dimension<const D: usize>(mut self, mut raw: RawInput) -> Result<Done> {
        let lap = Instant::now();
        self.control.tell(Event::Begin(Step::Interpolate));
        let mut refining = Refining::<D>::new(self.scene, &mut raw, &self.units)?;
        self.own_units = refining.as_ref().map(Refining::units);
        let count = refining.as_ref().map_or(self.scene.particles.unwrap_or(DEFAULT_PARTICLES), Refining::count);
        let mut prepared = Prepared::<D>::new(self.scene, self.formats, (raw, &self.units), count)?;
        self.told.notes.extend(surroundings::attach(self.scene, self.formats, &mut prepared, &self.units)?);
        let others: &[Species] = prepared.of_snapshot.as_ref().map_or(&[], |s| s.others.as_slice());
        refuse_other_types(self.format, others)?;
        collisionless::refuse_taken_type(self.scene, others)?;
        let around = self.around.map(|o| Carving::new(o, &prepared, &self.units, self.formats)).transpose()?;
        let count = around.as_ref().map_or(count, Carving::whole);
        doubts::refuse_places_without_particles(&prepared.target())?;
        let regions = prepared.target().find_regions(self.scene.region_contrast);
        let target = prepared.target().with_regions(regions.as_ref());
        self.told.of_regions(regions.as_ref(), count);
        let target = refining.as_ref().map_or(target, |r| r.target(target));
        let target = around.as_ref().map_or(target, |a| a.target(target));
        self.lap(Step::Interpolate, lap, None);
        let (hydrostatics, unsure) = match self.scene.collisionless {
            None => Hydrostatics::new(self.scene, &prepared, &self.units)?,
            Some(_) => (None, Some(Doubt::Unasked(NO_GAS.to_owned()))),
        };
        let own = hydrostatics.as_ref().is_some_and(|h| h.own_center().is_some());
        let excluded = || self.scene.excludes_balance().filter(|_| own).map(Doubt::Unasked);
        let held = Held::of(unsure.or_else(excluded), own);
        let neighbors = self.scene.kernel_neighbors(D);
        certifying::refuse_certificate(self.scene, (&target, hydrostatics.is_some()), &held, (count, neighbors))?;
        let mut plan = Plan::new(self.scene, &target, prepared.source.radial.is_some(), &held);
        refining.iter().for_each(|r| r.change(&mut plan, self.scene));
        if let Some(h) = hydrostatics.as_ref().filter(|_| plan.stages.contains(&BALANCE)) {
            self.told.notes.extend(h.notes());
        }
        memory::check(count, &plan.stages)?;
        let cost = Cost {
            kernel_neighbors: neighbors,
            slowness: if self.is_dry { forecast::slowness::<D>(self.scene.kernel(), neighbors) } else { 1.0 },
            target: duration::of_target(&target),
        };
        self.expected = duration::expected(&plan, self.scene, count, &cost, rayon::current_num_threads());
        let beside = duration::beside(count, &cost, rayon::current_num_threads());
        for Expected { step, seconds } in self.expected.iter().chain(&beside) {
            self.control.tell(Event::Expect { step, seconds: *seconds });
        }
        doubts::refuse_domain(self.scene, &prepared.source.domain, count)?;
        self.told.of_target(self.scene, &prepared, count);
        self.told.warnings.extend(refining.as_ref().and_then(Refining::doubt));
        let walls = Walls::new(self.scene, self.formats, &prepared, &self.units.to_input())?;
        self.told.warnings.extend(walls.as_ref().and_then(|w| w.doubt(&prepared.source.domain)));
        self.told.warnings.extend(walls.as_ref().and_then(|w| w.unknown_to(self.scene.code())));
        refuse_box(self.scene, self.format, (&prepared, walls.as_ref()), &self.units.to_input())?;
        let displacement = Displacement::new(self.scene, &prepared, &self.units.to_input())?;
        self.told.notes.extend(displacement.iter().flat_map(|d| d.notes().iter().cloned()));
        self.check()?;
        if self.is_dry {
            return Ok(Done::Foreseen(Box::new(self.foreseen(&prepared, plan, (count, cost.slowness)))));
        }
        let equilibrium = hydrostatics.as_ref().map(|h| h as &dyn Equilibrium<D>);
        let setting = Setting::new(self.scene, target, equilibrium, self.control);
        let placed = match (&mut refining, &around) {
            (Some(refining), _) => refining.place(&setting, &plan, prepared.length)?,
            (None, Some(around)) => around.place(&setting, &mut plan)?,
            (None, None) => stages::place(&setting, &mut plan)?,
        };
        let in_field = plan.stages.contains(&BALANCE) && hydrostatics.as_ref().is_some_and(Hydrostatics::is_in_field);
        let (places, scene) = (refining.as_ref().map(|_| placed.particles.positions.clone()), self.scene);
        let (mut file, mut report) = self.measure(
            &setting,
            (&prepared, walls.as_ref(), displacement.as_ref()),
            hydrostatics.as_ref(),
            placed,
            plan,
        )?;
        report.in_field = in_field;
        if let Some((refining, places)) = refining.zip(places) {
            report.notes.retain(|note| !note.starts_with(MOVED) && !note.starts_with(TOTALS));
            refining.rewrite(scene, &prepared, &places, (&mut file, &mut report))?;
            report.verdict = refining.verdict(&report);
        }
        Ok(Done::Placed(Box::new((file, report))))
    }

    fn foreseen<const D: usize>(self, prepared: &Prepared<D>, plan: Plan, (count, slowness): (usize, f64)) -> Forecast {
        Forecast {
            input: self.scene.input_name(),
            dimension: D,
            particles: count,
            mass: prepared.mass.value,
            seeding: plan.seeding,
            stages: Forecast::stages(&plan, &self.expected, count),
            left_out: plan.left_out,
            slowness,
            seconds_so_far: self.start.elapsed().as_secs_f64(),
            memory: memory::total(),
            beside: memory::beside(&prepared.target()),
            warnings: self.told.warnings,
            notes: self.told.notes,
        }
    }

    fn measure<const D: usize>(
        mut self,
        setting: &Setting<'_, D>,
        (prepared, walls, displacement): (&Prepared<D>, Option<&Walls<D>>, Option<&Displacement<D>>),
        hydrostatics: Option<&Hydrostatics<'_, D>>,
        placed: Placed<D>,
        mut plan: Plan,
    ) -> Result<(ParticleFile, Report)> {
        let Placed { particles, stages, timing, notes, stop } = placed;
        let Particles { mut positions, masses, internal_energy } = particles;
        self.timing.extend(timing);
        self.told.notes.extend(notes);
        let lap = Instant::now();
        self.control.tell(Event::Begin(Step::Measure));
        let (kernel, neighbors) = (self.scene.kernel(), self.scene.kernel_neighbors(D));
        let thermodynamics =
            hydrostatics.map(|h| Thermodynamics { equilibrium: h, internal_energy: internal_energy.as_deref() });
        let target = &setting.target;
        let masses = masses.unwrap_or_else(|| target.masses(&positions));
        certifying::center_on_core(hydrostatics, &mut positions, &masses);
        let by = (target, setting.ledger());
        let particles = (&positions, masses);
        let (outcome, detail) = match is_drawn(self.scene) {
            true => {
                let found = Outcome::with_detail(kernel, by, particles, neighbors, thermodynamics.as_ref());
                (found.0, Some(found.1))
            }
            false => (Outcome::new(kernel, by, particles, neighbors, thermodynamics.as_ref()), None),
        };
        #[cfg(not(feature = "plots"))]
        drop(detail);
        let Outcome {
            masses,
            support,
            density,
            target_density,
            density_error,
            ledger,
            noise,
            neighbors: near,
            order,
            balance,
        } = outcome;
        if !density_error.all.epsilon.is_finite() {
            return Err(Error::Numeric {
                stage: "measure",
                problem: format!(
                    "the summed density of {} particles is beyond f64 where the target is steepest; bound the density there, as by 1/max(r, 1e-6) for 1/r",
                    target.count
                ),
            });
        }
        self.lap(Step::Measure, lap, Some(density_error.all_refitted.epsilon));
        let stop = as_measured(self.scene, stop, density_error.stated().epsilon);
        self.told.of_code::<D>(self.scene, self.format);
        let is_solid = hydrostatics.is_some_and(|h| h.materials().is_some());
        self.told.notes.extend(self.scene.code().filter(|_| is_solid).and_then(|code| code.pairing_of_solids(D)));
        let is_at_rest = plan.stages.contains(&BALANCE) && !is_solid;
        self.told.notes.extend(self.scene.code().filter(|_| is_at_rest).and_then(|code| code.nearly_pairing(D)));
        let (units, note) = match self.own_units {
            Some(units) => (units, None),
            None => output_units(self.scene.output.units.as_deref(), self.units.input, prepared.mass.value, D)?,
        };
        self.told.notes.extend(note);
        let factors = Factors::new::<D>(self.units.input, prepared, &units);
        let known = (self.units.input.is_some() && D == 3).then_some(units.mass);
        let mass = MassReport::new(&masses, &target.masses(&positions), &prepared.mass, (&factors, known));
        self.told.warnings.extend(doubts::after(target, &positions));
        self.told.warnings.extend(doubts::unrefined(prepared.refinement.as_ref(), &positions));
        let mut displaced = self.displaced(target.domain, displacement, &positions, &mut plan)?;
        if displaced.is_none() {
            displaced = layer::stretched(self.scene, prepared, target, (&positions, &masses, &support));
            self.told.notes.extend(displaced.iter().map(|d| d.note.clone()));
        }
        let (support, density) = match &displaced {
            None => (support, density),
            Some(d) => sums((kernel, neighbors), target.domain, &d.positions, (&masses, &support)),
        };
        let energy = self.scene.certify_at_once().and_then(|_| internal_energy.clone());
        let is_stated = internal_energy.is_none() && self.scene.states_balanced_energies();
        let stated = hydrostatics.filter(|_| is_stated).map(|h| h.energies(&positions));
        self.told.notes.extend(stated.as_ref().map(|_| ENERGIES_AS_STATED.to_owned()));
        let internal_energy = internal_energy.or(stated);
        let balanced = internal_energy.zip(hydrostatics).map(|(u, h)| (u, h.specific_energy));
        let drawn = collisionless::velocities(self.scene, prepared, (&positions, &masses), &self.units)?;
        self.told.notes.extend(drawn.iter().flat_map(|d| d.notes.iter().cloned()));
        self.told.warnings.extend(drawn.iter().flat_map(|d| d.warnings.iter().cloned()));
        let raw = RawColumns {
            drawn: drawn.as_ref(),
            positions: &positions,
            masses,
            support,
            density,
            target_density,
            balanced,
            displaced: displaced.as_ref(),
        };
        let requires = self.format.map_or(&[][..], |f| f.capabilities.requires);
        let making = Making {
            kernel: kernel.title(),
            kernel_neighbors: neighbors,
            stop: format!("{stop:?}"),
            requires_energy: requires.contains(&names::INTERNAL_ENERGY),
            units_known: self.units.input.is_some(),
            conversion: self.units.to_output(&units),
            origin: origin::wanted(self.scene, self.format, origin::closed_and_open(&prepared.source.domain)),
        };
        let Made { file, notes, warnings, left_out, conserved } =
            particle_file(self.scene, prepared, raw, (units, &factors), walls, &making)?;
        let lap = Instant::now();
        let made = (&file.species[0].table, &units, self.units.input.is_some());
        let spin = turning::own_spin(self.scene, &making.conversion)?;
        let motion = Motion::of(hydrostatics, (target, &positions), made, spin);
        let (moves, support) = motion.as_ref().map_or((None, None), |m| (m.over_support, Some(m.support)));
        let radius = prepared.surface().map(|radius| radius * factors.length);
        let turns = radius.zip(hydrostatics.and_then(|h| h.own_center())).map(|(radius, _)| {
            turning::of_scene(self.scene, (&file, radius), (&making.conversion, self.units.input.is_some()))
        });
        let certificate = certifying::certificate(setting, hydrostatics, (&positions, energy.as_deref()), motion);
        certificate.iter().for_each(|_| self.lap(Step::Relax(CERTIFICATE), lap, None));
        self.check()?;
        #[cfg(feature = "plots")]
        let seen = detail.map(|detail| self.seen(detail, prepared, (&factors, file.header.box_corner)));
        self.told.notes.extend(notes);
        self.told.warnings.extend(warnings);
        left_out.into_iter().for_each(|(what, why)| plan.drop(what, why));
        if self.scene.collisionless.is_some() {
            plan.drop("pressure, temperature and internal energy", NO_GAS);
        }
        let variables = self.told.of_file(prepared, &file, self.format);
        let output = self.scene.output.file.as_ref();
        let mut report = Report {
            input: self.scene.input_name(),
            output: output.map_or_else(String::new, |file| file.display().to_string()),
            format: self.format.map_or(if is_picture(self.scene) { "picture" } else { "" }, |f| f.name),
            dimension: D,
            particles: target.count,
            seed: self.scene.seed,
            kernel: kernel.title(),
            mass,
            stop,
            tolerance: self.scene.tolerance,
            density_error,
            ledger,
            noise,
            order,
            balance,
            certificate,
            motion: moves,
            support,
            turning: turns.transpose()?.flatten(),
            settled: None,
            renewed: None,
            neighbors: near,
            stages,
            expected: self.expected,
            timing: self.timing,
            seconds: self.start.elapsed().as_secs_f64(),
            peak_memory: memory::peak(),
            plan,
            variables,
            radius,
            in_field: false,
            atmosphere: prepared.cut,
            snapshot: prepared.of_snapshot.as_ref().map(|s| SnapshotReport::new(s, &file.species[0].table, conserved)),
            verdict: Vec::new(),
            warnings: self.told.warnings,
            notes: self.told.notes,
            #[cfg(feature = "plots")]
            seen,
        };
        report.verdict = verdict_on(&report);
        Ok((file, report))
    }

    /// The particles where a displacement takes them.
    fn displaced<const D: usize>(
        &mut self,
        domain: &Domain<D>,
        displacement: Option<&Displacement<D>>,
        positions: &Positions<D>,
        plan: &mut Plan,
    ) -> Result<Option<Displaced<D>>> {
        let Some(displacement) = displacement else { return Ok(None) };
        let discards = self.scene.discards_interrupted();
        let displaced = displacement.displaced(domain, positions, &|| discards && self.control.is_interrupted())?;
        self.told.notes.push(displaced.note.clone());
        plan.drop("relaxation after the displacement", "it would undo the displacement");
        Ok(Some(displaced))
    }

    /// What pictures show, in the output's units and in its box.
    #[cfg(feature = "plots")]
    fn seen<const D: usize>(
        &self,
        detail: Detail,
        prepared: &Prepared<D>,
        (factors, corner): (&Factors, Option<[f64; 3]>),
    ) -> Seen {
        let domain = &prepared.source.domain;
        let frame = Frame::new(domain, self.scene.output.box_factor);
        let center = frame.coordinates(&prepared.source.center().map(|x| vec![x]), factors.length);
        let is_radial = prepared.source.radial.is_some() || !matches!(domain.region, Region::Box);
        let corner = corner.unwrap_or_default();
        let filled = sph::array(|k| corner[k] + center.get(k).copied().unwrap_or(0.0));
        Seen {
            detail: detail.scaled(factors.length, factors.density),
            side: if is_radial { Side::Radius(filled) } else { Side::Axis },
            has_units: self.units.input.is_some(),
        }
    }
}

/// The note where energies come from no balance.
const ENERGIES_AS_STATED: &str = "internal energies are those of balance.equation_of_state at the target's density";

/// Why what is of gas is left out.
const NO_GAS: &str = "the particles are collisionless";

/// Support radii and densities at other places; `guess` are support radii to start from.
fn sums<const D: usize>(
    (kernel, neighbors): (KernelName, f64),
    domain: &Domain<D>,
    positions: &Positions<D>,
    (masses, guess): (&[f64], &[f64]),
) -> (Vec<f64>, Vec<f64>) {
    let measured = Measured::new(kernel, domain, positions, masses, guess, neighbors);
    measured.support.iter().zip(&measured.sums).map(|(&h, s)| (h, s.weighted)).unzip()
}
