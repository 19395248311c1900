//! Particles of a target that are generated while they are written: positions by particle number, everything else from the target.
//!
//! Where nothing has been summed `Density` is the target's at each place, `SupportRadius` the one that belongs to it.

use crate::error::{Error, Result};
use crate::input::ingest::{self, RawInput};
use crate::input::internal_units::Prepared;
use crate::input::stated_units;
use crate::input::units::RunUnits;
use crate::output::frame::{Factors, output_units};
use crate::output::origin;
use crate::output::others::Others;
use crate::output::particle_file::{Making, RawColumns, particle_file};
use crate::scene::{OriginInput, OriginName, Polish, Scene};
use crate::target::{Positions, Target, at};
use sph::domain::Axis;
use sph::kernel::support_over_spacing;
use sph::parallel;
use sph_formats::common::particle_names as names;
use sph_formats::stream::TYPES;
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
        let units = RunUnits::new(scene, stated_units::units(scene, &raw)?.input)?;
        Ok(Self { raw, units, dimension })
    }
}

/// What the scene asks for that is not done to particles which are made block by block without being relaxed.
pub(crate) fn undone(scene: &Scene) -> Option<String> {
    let asked = [
        (scene.polish.is_some_and(|polish| polish != Polish::None), "polish"),
        (scene.tolerance.is_some(), "tolerance"),
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
        format!("particles are placed and not relaxed: {} of the scene changes nothing here", asked.join(", "))
    })
}

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
    notes: Vec<String>,
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
            notes: Vec::from_iter(note),
        };
        let mut made = stream.made(0..1, true)?;
        if !stream.is_summed {
            made.file.header.provenance.retain(|(key, _)| key != "DensityDefinition");
            made.file.header.provenance.push(("DensityDefinition".into(), "the target's at each particle".into()));
        }
        stream.header = made.file.header;
        stream.first = made.file.species.into_iter().next().map(|s| s.table).unwrap_or_default();
        stream.notes.extend(prepared.notes.iter().cloned().chain(made.notes));
        Ok(stream)
    }

    /// The columns of the first particle.
    pub(crate) fn first(&self) -> &ParticleTable {
        &self.first
    }

    /// What there is to say of the particles.
    pub(crate) fn notes(&self) -> &[String] {
        &self.notes
    }

    /// All columns of some particles; without `with_sums`, what was summed is not looked up, and the target's stands for it.
    fn made(&self, rows: Range<usize>, with_sums: bool) -> Result<crate::output::particle_file::Made> {
        let summed = if with_sums { self.places.sums(rows.clone())? } else { None };
        let positions = self.places.positions(rows)?;
        let n = positions[0].len();
        let number = parallel::map(n, |i| self.target.number_density(&at(&positions, i)));
        if let Some(i) = number.iter().position(|v| !(*v > 0.0)) {
            let place = at(&positions, i);
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
            positions: &positions,
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
