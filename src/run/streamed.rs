//! Particles of a target that are generated while they are written: positions by particle number, everything else from the target.
//!
//! Where nothing has been summed `Density` is the target's at each place, `SupportRadius` the one that belongs to it.

use super::destination::doubts_of_code;
use super::doubts;
use super::remarks::Remarks;
use super::variables::VariableReport;
use crate::error::{Error, Result};
use crate::input::ingest::{self, RawInput};
use crate::input::internal_units::Prepared;
use crate::input::stated_units;
use crate::input::totals::Totals;
use crate::input::units::RunUnits;
use crate::output::frame::{Factors, output_units};
use crate::output::origin;
use crate::output::others::Others;
use crate::output::particle_file::{Made, Making, RawColumns, particle_file};
use crate::scene::{AfcInput, AlaricInput, OriginInput, OriginName, Polish, Scene, SolverInput, WvtInput};
use crate::target::{Positions, Target, at};
use sph::domain::Axis;
use sph::kernel::support_over_spacing;
use sph::parallel;
use sph_formats::common::particle_names as names;
use sph_formats::stream::{TYPES, runs};
use sph_formats::{Column, FormatError, FormatSpec, ParticleStream, ParticleTable, RunHeader, UnitSystem, Values};
use std::ops::Range;
use std::path::PathBuf;

/// Where the particles of a target lie, by their numbers, in internal units.
pub(crate) trait Places<const D: usize>: Sync {
    /// # Errors
    /// Places that cannot be found.
    fn positions(&self, numbers: Range<usize>) -> Result<Positions<D>>;

    /// Support radii and densities that were summed there, if any were.
    ///
    /// # Errors
    /// Sums that cannot be found.
    fn sums(&self, _numbers: Range<usize>) -> Result<Option<(Vec<f64>, Vec<f64>)>> {
        Ok(None)
    }
}

/// A scene read for streaming.
pub(crate) struct Read {
    pub raw: RawInput,
    pub units: RunUnits,
    pub dimension: usize,
    pub told: Remarks,
}

impl Read {
    /// # Errors
    /// What the reader says; a scene with parts that cannot be streamed.
    pub(crate) fn new(scene: &Scene, formats: &[FormatSpec]) -> Result<Self> {
        // How many there may be is for one process to hold, not for blocks of them.
        Scene { particles: None, ..scene.clone() }.validate()?;
        let lacks = |key: &str| Err(Error::scene(key, "cannot be made block by block; leave it out"));
        if !scene.bodies.is_empty() {
            return lacks("bodies");
        }
        if scene.walls.is_some() {
            return lacks("walls");
        }
        if scene.collisionless.is_some() {
            return lacks("collisionless");
        }
        if scene.dust.is_some() {
            return lacks("dust");
        }
        if !scene.gravity_of.is_empty() {
            return lacks("gravity_of");
        }
        if scene.displacement.is_some() {
            return lacks("displacement");
        }
        if scene.has_own_resolution() {
            return lacks(if scene.refine.is_some() { "refine" } else { "resolution" });
        }
        if scene.input.core.is_some() {
            return lacks("input.core");
        }
        if scene.input.others.is_some() {
            return lacks("input.others");
        }
        if scene.output.origin == Some(OriginInput::Named(OriginName::CenterOfMass)) {
            return lacks("output.origin: center-of-mass");
        }
        let raw = ingest::read(scene, formats)?;
        let dimension = ingest::dimension(scene, &raw)?;
        let (input, told) = Remarks::of_input(stated_units::units(scene, &raw)?, &raw);
        let units = RunUnits::new(scene, input)?;
        Ok(Self { raw, units, dimension, told })
    }
}

/// The source. What a snapshot has in all cannot be given to particles of which only some are known at a time.
///
/// # Errors
/// Those of [`Prepared::new`].
pub(crate) fn prepare<const D: usize>(
    scene: &Scene,
    formats: &[FormatSpec],
    from: (RawInput, &RunUnits),
    count: usize,
) -> Result<Prepared<D>> {
    let mut prepared = Prepared::<D>::new(scene, formats, from, count)?;
    if let Some(snapshot) = &mut prepared.of_snapshot {
        snapshot.totals = Totals::default();
        let note =
            "momentum, angular momentum and energy are those of the snapshot's fields, not brought to its totals";
        prepared.notes.push(note.into());
    }
    Ok(prepared)
}

/// What the scene asks for that is not done to particles which are made block by block without being relaxed; how many there are of them may be
/// `given` by something else.
fn undone(scene: &Scene, given: bool) -> Option<String> {
    let asked = [
        (given && scene.particles.is_some(), "particles"),
        (given && scene.seeding.is_some(), "seeding"),
        (given && scene.region_contrast.is_some(), "region_contrast"),
        (scene.polish.is_some_and(|polish| polish != Polish::None), "polish"),
        (scene.wvt != WvtInput::default(), "wvt"),
        (scene.solver != SolverInput::default(), "solver"),
        (scene.alaric != AlaricInput::default(), "alaric"),
        (scene.afc != AfcInput::default(), "afc"),
        (scene.tolerance.is_some(), "tolerance"),
        (scene.time_limit.is_some(), "time_limit"),
        (scene.checkpoint.file.is_some() || scene.checkpoint.resume.is_some(), "checkpoint"),
        (scene.balance.is_on(), "balance"),
        (scene.trim_masses.is_some(), "trim_masses"),
        (scene.settle.is_some(), "settle"),
        (scene.certify.is_some(), "certify"),
        (scene.order.is_some(), "order"),
        (scene.output.parameters, "output.parameters"),
        (scene.output.report.is_some(), "output.report"),
    ];
    let asked: Vec<&str> = asked.iter().filter(|a| a.0).map(|a| a.1).collect();
    (!asked.is_empty()).then(|| {
        let as_many = if given { "as many particles as the box has are placed" } else { "particles are placed" };
        format!("{as_many}, and not relaxed: what the scene says under {} changes nothing here", asked.join(", "))
    })
}

/// Places of some particles, spread evenly over their numbers.
///
/// # Errors
/// Places that cannot be found.
pub(crate) fn some_of<const D: usize>(places: &dyn Places<D>, count: usize) -> Result<Positions<D>> {
    let mut some: Positions<D> = std::array::from_fn(|_| Vec::new());
    for run in runs(count, LOOKED_AT) {
        let more = places.positions(run)?;
        some.iter_mut().zip(more).for_each(|(all, x)| all.extend(x));
    }
    Ok(some)
}

/// Particles that are looked at to know what there is to say of all.
const LOOKED_AT: usize = 4096;

/// The particles as a stream.
pub(crate) struct Streamed<'a, const D: usize> {
    scene: &'a Scene,
    prepared: &'a Prepared<D>,
    target: Target<'a, D>,
    places: &'a dyn Places<D>,
    units: (RunUnits, UnitSystem),
    factors: Factors,
    requires_energy: bool,
    stop: String,
    header: RunHeader,
    /// Whether support radii and densities were summed, and are not the target's.
    is_summed: bool,
    /// The first particle.
    first: ParticleTable,
    /// Places of all particles, where they are few.
    held: Option<Positions<D>>,
    told: Remarks,
    variables: Vec<VariableReport>,
    left_out: Vec<(&'static str, &'static str)>,
}

impl<'a, const D: usize> Streamed<'a, D> {
    /// `target` is the one of `prepared` for as many particles as there are `places`; `stop` says how they were made.
    ///
    /// # Errors
    /// What the first particle's columns say.
    pub(crate) fn new(
        scene: &'a Scene,
        (prepared, units): (&'a Prepared<D>, RunUnits),
        (target, places): (Target<'a, D>, &'a dyn Places<D>),
        format: Option<&FormatSpec>,
        stop: impl Into<String>,
    ) -> Result<Self> {
        let periodic = prepared.source.domain.axes.map(|axis| axis == Axis::Periodic);
        origin::refuse(scene, format, &periodic)?;
        origin::refuse_far(scene, &prepared.source.domain, (&units.to_input(), prepared.length))?;
        if let Some(others) = Others::of(prepared)? {
            let problem = format!(
                "is keep, but they cannot be written block by block ({}); set input.other_types: drop",
                others.list()
            );
            return Err(Error::scene("input.other_types", problem));
        }
        let (out, note) = output_units(scene.output.units.as_deref(), units.input, prepared.mass.value, D)?;
        let requires = format.map_or(&[][..], |f| f.capabilities.requires);
        let mut stream = Self {
            scene,
            prepared,
            target,
            places,
            units: (units, out),
            factors: Factors::new::<D>(units.input, prepared, &out),
            requires_energy: requires.contains(&names::INTERNAL_ENERGY),
            stop: stop.into(),
            header: RunHeader {
                dimension: D,
                box_size: [0.0; 3],
                box_corner: None,
                periodic: [false; 3],
                units: out,
                time: 0.0,
                kernel: String::new(),
                kernel_neighbors: 0.0,
                provenance: Vec::new(),
                layouts: Vec::new(),
            },
            is_summed: places.sums(0..1)?.is_some(),
            first: ParticleTable::default(),
            held: None,
            told: Remarks { notes: Vec::from_iter(note), warnings: Vec::new() },
            variables: Vec::new(),
            left_out: Vec::new(),
        };
        let some = some_of(places, target.count)?;
        stream.held = (some[0].len() == target.count).then(|| some.clone());
        let mut first = stream.made(0..1, true)?.file;
        if !stream.is_summed {
            first.header.provenance.retain(|(key, _)| key != "DensityDefinition");
            first.header.provenance.push(("DensityDefinition".into(), "the target's at each particle".into()));
        }
        stream.header = first.header;
        stream.first = first.species.into_iter().next().map(|s| s.table).unwrap_or_default();
        stream.look_at(&some, format)?;
        Ok(stream)
    }

    /// Finds what there is to say of the particles, by some of them.
    fn look_at(&mut self, some: &Positions<D>, format: Option<&FormatSpec>) -> Result<()> {
        self.told.warnings.extend(doubts::after(&self.target, some));
        let Made { file, notes, warnings, left_out, .. } = self.made_of(some, None)?;
        self.told.add(Remarks { notes, warnings });
        self.variables = self.told.of_file(self.prepared, &file, format);
        self.left_out = left_out;
        Ok(())
    }

    /// What there is to say of the particles.
    pub(crate) fn told(&self) -> &Remarks {
        &self.told
    }

    /// Says what there is to say where nothing more is done to the particles, which have been seeded, or come from the copies of a box.
    ///
    /// # Errors
    /// Rows that cannot be made.
    pub(crate) fn tell(&self, told: &mut Remarks, is_of_box: bool, format: Option<&FormatSpec>) -> Result<()> {
        told.add(self.told.clone());
        told.notes.extend(self.left_out.iter().map(|(what, why)| format!("without {what}: {why}")));
        told.notes.extend(undone(self.scene, is_of_box));
        told.of_code::<D>(self.scene, format);
        let has_units = self.units.0.input.is_some() && D == 3;
        if let Some(format) = format {
            let doubts = doubts_of_code(self.scene, format, (self, has_units))?;
            told.warnings.extend(doubts.stops);
            told.notes.extend(doubts.others);
        }
        Ok(())
    }

    /// What becomes of the input's variables.
    pub(crate) fn variables(&self) -> &[VariableReport] {
        &self.variables
    }

    /// What is not written, and why.
    pub(crate) fn left_out(&self) -> &[(&'static str, &'static str)] {
        &self.left_out
    }

    /// All columns of some particles; without `with_sums`, what was summed is not looked up, and the target's stands for it.
    fn made(&self, rows: Range<usize>, with_sums: bool) -> Result<Made> {
        let summed = if with_sums { self.places.sums(rows.clone())? } else { None };
        match &self.held {
            Some(all) => self.made_of(&all.each_ref().map(|x| x[rows.clone()].to_vec()), summed),
            None => self.made_of(&self.places.positions(rows)?, summed),
        }
    }

    /// All columns of particles at `positions`, with support radii and densities that were `summed` there, or the target's.
    fn made_of(&self, positions: &Positions<D>, summed: Option<(Vec<f64>, Vec<f64>)>) -> Result<Made> {
        let n = positions[0].len();
        let number = parallel::map(n, |i| self.target.number_density(&at(positions, i)));
        if let Some(i) = number.iter().position(|v| !(*v > 0.0)) {
            let place = at(positions, i);
            let problem =
                format!("the target is zero at {place:?} in units of the domain's size, where a particle was placed");
            return Err(Error::Numeric { stage: "seed", problem });
        }
        let neighbors = self.scene.kernel_neighbors(D);
        let ratio = support_over_spacing(D, neighbors);
        let mass = 1.0 / self.target.count as f64;
        let target_density: Vec<f64> = number.iter().map(|v| v * mass).collect();
        let (support, density) = summed.unwrap_or_else(|| {
            (number.iter().map(|&v| self.target.support(v, ratio)).collect(), target_density.clone())
        });
        let raw = RawColumns {
            drawn: None,
            positions,
            masses: vec![mass; n],
            support,
            target_density,
            density,
            balanced: None,
            displaced: None,
        };
        let (units, out) = self.units;
        let making = Making {
            kernel: self.scene.kernel().title(),
            kernel_neighbors: neighbors,
            stop: self.stop.clone(),
            requires_energy: self.requires_energy,
            units_known: units.input.is_some(),
            conversion: units.to_output(&out),
            origin: self.scene.output.origin.clone(),
        };
        particle_file(self.scene, self.prepared, raw, (out, &self.factors), None, &making)
    }

    /// Of some particles the columns that were summed, and those with one value for all: what takes no places.
    fn without_places(&self, rows: Range<usize>, with_sums: bool) -> Result<Vec<Column>> {
        let n = rows.len();
        let repeated =
            |c: &Column| Column { name: c.name.clone(), values: Values::F64(vec![c.values.get(0); n]), ..*c };
        let mut columns: Vec<Column> = self.first.columns.iter().filter(|c| is_alike(c)).map(repeated).collect();
        let Some((support, density)) = (if with_sums { self.places.sums(rows)? } else { None }) else {
            return Ok(columns);
        };
        let scaled = |values: Vec<f64>, factor: f64| Values::F64(parallel::map(n, |i| values[i] * factor));
        for (name, values) in [
            (names::SUPPORT_RADIUS, scaled(support, self.factors.length)),
            (names::DENSITY, scaled(density, self.factors.density)),
        ] {
            let of_first = self.first.columns.iter().find(|c| c.name == name);
            columns.extend(of_first.map(|c| Column { name: name.into(), values, ..*c }));
        }
        Ok(columns)
    }
}

impl<const D: usize> ParticleStream for Streamed<'_, D> {
    fn header(&self) -> &RunHeader {
        &self.header
    }

    fn counts(&self) -> [usize; TYPES] {
        sph::array(|t| if t == 0 { self.target.count } else { 0 })
    }

    fn rows(
        &self,
        _: u8,
        rows: Range<usize>,
        wanted: &dyn Fn(&str) -> bool,
    ) -> std::result::Result<ParticleTable, FormatError> {
        let (first, n) = (rows.start as i64 + 1, rows.len());
        let all_are = |kind: &dyn Fn(&Column) -> bool| self.first.columns.iter().all(|c| !wanted(&c.name) || kind(c));
        let with_sums = self.is_summed && self.first.columns.iter().any(|c| wanted(&c.name) && is_summed(c));
        let mut table = if all_are(&|c| is_alike(c) || self.is_summed && is_summed(c)) {
            let columns = self.without_places(rows, with_sums).map_err(into_format_error)?;
            ParticleTable { count: n, columns }
        } else {
            let made = self.made(rows, with_sums).map_err(into_format_error)?;
            made.file.species.into_iter().next().map(|s| s.table).unwrap_or_default()
        };
        for column in table.columns.iter_mut().filter(|c| c.name == names::PARTICLE_IDS) {
            column.values = Values::I64((first..first + table.count as i64).collect());
        }
        table.columns.retain(|c| wanted(&c.name));
        Ok(table)
    }
}

/// Whether a column has one value for all particles, or their numbers.
fn is_alike(column: &Column) -> bool {
    column.name == names::MASSES || column.name == names::PARTICLE_IDS
}

fn is_summed(column: &Column) -> bool {
    column.name == names::SUPPORT_RADIUS || column.name == names::DENSITY
}

/// What a writer passes on.
fn into_format_error(error: Error) -> FormatError {
    match error {
        Error::Format(error) => error,
        other => FormatError::Output { path: PathBuf::new(), format: "particles", problem: other.to_string() },
    }
}
