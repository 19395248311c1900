//! The columns that a flavor of particle file requires, for any container: one table of [`Rule`]s, from which every dataset is planned and
//! checked before anything is written.

use crate::capabilities::halvings;
#[cfg(any(feature = "hdf5-layer", feature = "phantom"))]
use crate::common::number::int;
use crate::common::number::{Number, id, root, single};
pub use crate::common::rule::{Need, Rule, Source, Storage};
use crate::error::{FormatError, Result};
use crate::magnetic::MagneticUnit;
use crate::model::{Column, ParticleFile, ParticleTable, RunHeader, Species, Values};
use crate::particle_names as names;
use crate::registry::WriteOptions;
use crate::units::UnitDimension;
use std::ops::Range;
use std::path::Path;

/// Particle types of GADGET-style files.
pub const TYPES: usize = 6;

/// Support radius over SWIFT's smoothing length for the cubic spline in 1, 2 and 3 dimensions (Dehnen & Aly 2012,
/// table 1; SWIFT's `kernel_gamma`).
pub const CUBIC_SPLINE_SUPPORT: [f64; 3] = [1.732_051, 1.778_002, 1.825_742];
/// SWIFT's smoothing length over the mean spacing (`SPH:resolution_eta`; 48 neighbors with the cubic spline in 3-D).
pub const CUBIC_SPLINE_ETA: f64 = 1.2348;

/// How a file says the edges of a box other than cubic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoxSize {
    /// BoxSize has three elements.
    Edges,
    /// BoxSize is the first edge, and the code is built for the others over it (`BOX_LONG_Y`, `LONG_Y`); all are kept beside.
    First,
    /// BoxSize is the longest edge, and the code is built for others that are halves of it, halves of these, and so on (`LONG_X_BITS`); all are
    /// kept beside.
    Halves,
    /// Not at all.
    None,
}

/// One flavor of the layout.
#[derive(Debug, Clone, Copy)]
pub struct Flavor {
    pub format: &'static str,
    pub rules: &'static [Rule],
    /// Numbers that the code wants in the header besides those of every flavor.
    pub header: &'static [(&'static str, f64)],
    pub box_size: BoxSize,
    /// Whether coordinates must lie in the box, periodic or not.
    pub inside_box: bool,
    /// Whether columns beyond the rules become datasets of their own names; else they are left out.
    pub extra_columns: bool,
    /// Whether columns of their own may be 64-bit integers.
    pub long_columns: bool,
    /// Whether numbers of particles past 32 bits stand in NumPart_Total as 64-bit numbers, as GADGET-4 reads them, instead of
    /// with their high words in NumPart_Total_HighWord.
    pub wide_totals: bool,
    /// Whether units are also stated as GADGET's parameters have them, for pynbody and yt.
    pub unit_parameters: bool,
    /// What a magnetic field is in.
    pub magnetic: MagneticUnit,
    /// Columns of the placement that the flavor has no use for.
    pub dropped: &'static [&'static str],
    /// Names of datasets that are made of parts of columns.
    pub taken: &'static [&'static str],
}

/// One component of a column on its way into a dataset of its own.
#[cfg(any(feature = "phantom", feature = "sph-exa"))]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Component {
    pub(crate) index: usize,
    pub(crate) factor: f64,
    /// Added before the factor.
    pub(crate) shift: f64,
    /// Values that f32 rounds to zero are no loss.
    pub(crate) may_vanish: bool,
}

/// What every step needs to know.
#[cfg_attr(not(any(feature = "hdf5-layer", feature = "phantom")), allow(dead_code))]
pub(crate) struct Job<'a> {
    pub(crate) flavor: &'a Flavor,
    pub(crate) path: &'a Path,
    pub(crate) header: &'a RunHeader,
    pub(crate) options: WriteOptions,
    /// Number of the first row of a table, for messages: tables may be parts of larger ones.
    pub(crate) first_row: usize,
}

/// A dataset with its source found.
#[cfg_attr(not(any(feature = "hdf5-layer", feature = "phantom")), allow(dead_code))]
pub(crate) struct Planned<'a> {
    pub(crate) name: String,
    pub(crate) storage: Storage,
    pub(crate) components: usize,
    pub(crate) dimension: UnitDimension,
    pub(crate) numbers: Numbers<'a>,
    /// NaN and values lost in f32 are errors.
    pub(crate) strict: bool,
    /// Zero and less are errors: SWIFT and GIZMO hang or lose particles over them, far from the cause.
    pub(crate) positive: bool,
}

pub(crate) enum Numbers<'a> {
    Column(&'a Column),
    Scaled { column: &'a Column, factor: f64 },
    Zeros,
    Count,
    Spacing { masses: &'a Column, density: &'a Column, eta: f64, dimension: usize },
}

impl<'a> Job<'a> {
    /// Refuses all but three dimensions, for codes that have no others.
    #[cfg(any(feature = "phantom", feature = "sph-exa"))]
    pub(crate) fn only_in_3d(&self) -> Result<()> {
        match self.header.dimension {
            3 => Ok(()),
            d => Err(self.refuse(format!("the particles are in {d} dimensions, but the code runs in 3 only"))),
        }
    }

    pub(crate) fn refuse(&self, problem: impl Into<String>) -> FormatError {
        FormatError::Output { path: self.path.into(), format: self.flavor.format, problem: problem.into() }
    }

    /// Finds the source of every dataset, before anything is written.
    pub(crate) fn plan(&self, particles: &'a ParticleFile) -> Result<Vec<Vec<Planned<'a>>>> {
        if !(1..=3).contains(&self.header.dimension) {
            return Err(self.refuse(format!("dimension {} is not 1, 2 or 3", self.header.dimension)));
        }
        self.plan_of(particles.species.iter())
    }

    /// [`Self::plan`] of some of the species.
    pub(crate) fn plan_of(&self, all: impl Iterator<Item = &'a Species>) -> Result<Vec<Vec<Planned<'a>>>> {
        let mut seen = [false; TYPES];
        let mut plan = Vec::new();
        for species in all {
            match seen.get_mut(usize::from(species.part_type)) {
                Some(s) if !*s => *s = true,
                Some(_) => {
                    return Err(self.refuse(format!("particle type {} comes twice", species.part_type)));
                }
                None => {
                    return Err(self.refuse(format!("particle type {} is not one of 0 to 5", species.part_type)));
                }
            }
            plan.push(self.plan_species(species)?);
        }
        Ok(plan)
    }

    /// The datasets of a species.
    pub(crate) fn plan_species(&self, species: &'a Species) -> Result<Vec<Planned<'a>>> {
        for column in &species.table.columns {
            self.check_column(species, column)?;
        }
        let mut planned = Vec::new();
        for rule in self.flavor.rules {
            planned.extend(self.plan_rule(species, rule)?);
        }
        for column in species.table.columns.iter().filter(|_| self.flavor.extra_columns) {
            let mut name = column.name.replace('/', "_");
            let used = self.flavor.rules.iter().any(|r| r.source.column() == Some(column.name.as_str()));
            if used || self.flavor.dropped.contains(&column.name.as_str()) {
                continue;
            }
            let is_taken = |name: &str| self.flavor.taken.contains(&name) || planned.iter().any(|p| p.name == name);
            if is_taken(&name) {
                name = names::apart(&name);
            }
            if name.is_empty() || name == "." || planned.iter().any(|p| p.name == name) {
                return Err(self.refuse(format!("column '{}' cannot be a dataset of its own; rename it", column.name)));
            }
            planned.push(self.plan_column(name, column));
        }
        Ok(planned)
    }

    /// The dataset of this name of a species of which only the columns that it needs are there.
    #[cfg(feature = "hdf5-layer")]
    pub(crate) fn plan_one(&self, species: &'a Species, name: &str) -> Result<Planned<'a>> {
        for column in &species.table.columns {
            self.check_column(species, column)?;
        }
        let planned = match self.flavor.rules.iter().find(|rule| rule.name == name) {
            Some(rule) => self.plan_rule(species, rule)?,
            None => {
                let column = species.table.columns.iter().find(|c| c.name.replace('/', "_") == name);
                column.map(|column| self.plan_column(name.to_owned(), column))
            }
        };
        planned.ok_or_else(|| self.refuse(format!("there is no column for '{name}' in all rows")))
    }

    /// Whether a dataset is a column of its own.
    #[cfg(feature = "hdf5-layer")]
    pub(crate) fn has_no_rule(&self, name: &str) -> bool {
        self.flavor.rules.iter().all(|rule| rule.name != name)
    }

    fn plan_rule(&self, species: &'a Species, rule: &Rule) -> Result<Option<Planned<'a>>> {
        let is_needed = rule.need != Need::Optional;
        let planned = self.find(species, rule)?.map(|numbers| Planned {
            name: rule.name.to_owned(),
            storage: rule.storage,
            components: rule.components,
            dimension: self.dimension_of(&numbers, rule),
            numbers,
            strict: is_needed,
            positive: is_needed && rule.storage == Storage::Float && rule.components == 1,
        });
        match planned.as_ref().and_then(|planned| Some((planned, self.vanishing(planned)?))) {
            Some((planned, most)) => Err(self.refuse(format!(
                "column '{}' is {most:e} at most, too little for f32; choose units in which it is nearer to 1, or double precision",
                planned.name
            ))),
            None => Ok(planned),
        }
    }

    /// The largest of a column's values where all of them are too small for f32, in which they are to be. What is next to nothing beside the rest may
    /// become 0.
    fn vanishing(&self, planned: &Planned) -> Option<f64> {
        let (column, factor) = match &planned.numbers {
            Numbers::Column(column) => (*column, 1.0),
            Numbers::Scaled { column, factor } => (*column, *factor),
            _ => return None,
        };
        let is_single = planned.storage == Storage::Float && planned.components == 1 && !self.options.double_precision;
        let (low, high, _) = if is_single { column.values.range() } else { return None };
        let most = factor.abs() * low.abs().max(high.abs());
        (most > 0.0 && most < f64::from(f32::MIN_POSITIVE)).then_some(most)
    }

    fn plan_column(&self, name: String, column: &'a Column) -> Planned<'a> {
        Planned {
            name,
            storage: self.own_storage(column),
            components: column.components,
            dimension: self.own_dimension(column),
            numbers: self.numbers(column),
            strict: false,
            positive: false,
        }
    }

    /// The numbers of a column, in the units in which the flavor has them.
    fn numbers(&self, column: &'a Column) -> Numbers<'a> {
        let factor = self.flavor.magnetic.factor(&self.header.units);
        match column.name == names::MAGNETIC_FIELD && factor != 1.0 {
            true => Numbers::Scaled { column, factor },
            false => Numbers::Column(column),
        }
    }

    /// What a column is in the units of the header; magnetic fields in units of their own are pure numbers there.
    fn own_dimension(&self, column: &Column) -> UnitDimension {
        let is_own = column.name == names::MAGNETIC_FIELD && self.flavor.magnetic != MagneticUnit::HeavisideLorentz;
        if is_own { UnitDimension::NONE } else { column.dimension }
    }

    /// How a column is stored for which there is no rule.
    fn own_storage(&self, column: &Column) -> Storage {
        let short = |v: &[i64]| v.iter().all(|&x| i32::try_from(x).is_ok());
        match &column.values {
            Values::I64(v) if self.flavor.long_columns && !short(v) => Storage::Long,
            Values::I64(_) => Storage::Int,
            _ => Storage::Float,
        }
    }

    fn check_column(&self, species: &Species, column: &Column) -> Result<()> {
        let expected = species.table.count.checked_mul(column.components);
        if column.components == 0 || expected != Some(column.values.len()) {
            return Err(self.refuse(format!(
                "column '{}' has {} values for {} particles with {} components",
                column.name,
                column.values.len(),
                species.table.count,
                column.components
            )));
        }
        Ok(())
    }

    fn find(&self, species: &'a Species, rule: &Rule) -> Result<Option<Numbers<'a>>> {
        let table = &species.table;
        let needed = rule.need == Need::All || (rule.need == Need::Gas && species.part_type == 0);
        let found = match rule.source {
            Source::Column(name) => table.column(name).map(|column| self.numbers(column)),
            Source::ColumnOrZeros(name) => Some(table.column(name).map_or(Numbers::Zeros, Numbers::Column)),
            Source::ColumnOrCount(name) => Some(table.column(name).map_or(Numbers::Count, Numbers::Column)),
            Source::Spacing { eta } => self.spacing(table, eta),
        };
        if let Some(Numbers::Column(column)) = &found
            && column.components > rule.components
        {
            return Err(self.refuse(format!(
                "column '{}' has {} components, expected at most {}",
                column.name, column.components, rule.components
            )));
        }
        if found.is_none() && needed {
            return Err(self.refuse(format!("particles of type {}: {}", species.part_type, missing(rule))));
        }
        Ok(found)
    }

    fn spacing(&self, table: &'a ParticleTable, eta: f64) -> Option<Numbers<'a>> {
        let d = self.header.dimension;
        if let Some((masses, density)) = table.column(names::MASSES).zip(table.column(names::DENSITY)) {
            return Some(Numbers::Spacing { masses, density, eta, dimension: d });
        }
        let column = table.column(names::SUPPORT_RADIUS)?;
        Some(Numbers::Scaled { column, factor: eta * spacing_over_support(d, self.header.kernel_neighbors) })
    }

    /// The stated dimension of the numbers, else what the rule says.
    fn dimension_of(&self, numbers: &Numbers, rule: &Rule) -> UnitDimension {
        match numbers {
            Numbers::Column(column) if column.dimension != UnitDimension::NONE => self.own_dimension(column),
            _ => rule.unit.dimension(self.header.dimension),
        }
    }

    /// One element where the axes in use are equal; else one per axis, the unused ones as long as the longest.
    pub(crate) fn box_size(&self) -> Result<Vec<f64>> {
        let used = &self.header.box_size[..self.header.dimension];
        if let Some(edge) = used.iter().find(|&&l| !(l.is_finite() && l > 0.0)) {
            return Err(self.refuse(format!(
                "the box has an edge of {edge}, expected positive lengths; a scene has domain.box, and convert has --box"
            )));
        }
        let largest = used.iter().copied().fold(0.0, f64::max);
        if used.iter().all(|&l| l == largest) {
            return Ok(vec![largest]);
        }
        match self.flavor.box_size {
            BoxSize::Edges => {
                let mut edges = vec![largest; 3];
                edges[..used.len()].copy_from_slice(used);
                Ok(edges)
            }
            BoxSize::First => Ok(vec![used[0]]),
            BoxSize::Halves if halvings(used).is_some() => Ok(vec![largest]),
            BoxSize::Halves => Err(self.refuse(format!(
                "the edges of the box are {used:?}, but GADGET-4 has boxes whose edges are the longest one over 1, 2, 4 and so on (LONG_X_BITS); write swift \
                 instead, or use such a box"
            ))),
            BoxSize::None => Err(self.refuse(format!(
                "a box of {used:?} is not cubic, which GADGET-4 cannot read; write swift instead, or use a box with equal edges"
            ))),
        }
    }

    /// Appends particle numbers, which start at `first_id` where there is no such column.
    pub(crate) fn ids(&self, planned: &Planned, range: Range<usize>, first_id: u64, out: &mut Vec<u64>) -> Result<()> {
        if let Numbers::Count = planned.numbers {
            out.extend(range.map(|i| first_id + i as u64));
            return Ok(());
        }
        self.fill(planned, range, 0..planned.components, first_id, out, |x, i| id(x).ok_or(i))
    }

    #[cfg(any(feature = "hdf5-layer", feature = "phantom"))]
    pub(crate) fn ints(&self, planned: &Planned, range: Range<usize>, out: &mut Vec<i32>) -> Result<()> {
        self.fill(planned, range, 0..planned.components, 0, out, |x, i| int(x).ok_or(i))
    }

    #[cfg(feature = "hdf5-layer")]
    pub(crate) fn longs(&self, planned: &Planned, range: Range<usize>, out: &mut Vec<i64>) -> Result<()> {
        self.fill(planned, range, 0..planned.components, 0, out, |x, i| x.whole().ok_or(i))
    }

    #[cfg(any(feature = "hdf5-layer", feature = "gadget-binary"))]
    pub(crate) fn doubles(&self, planned: &Planned, range: Range<usize>, out: &mut Vec<f64>) -> Result<()> {
        if let Some(rows) = planned.rows(&range).filter(|rows| self.all_fit(planned, rows)) {
            out.extend_from_slice(rows);
            return Ok(());
        }
        self.fill(planned, range, 0..planned.components, 0, out, |x, i| self.double(planned, x.float(), i))
    }

    #[cfg(any(feature = "hdf5-layer", feature = "gadget-binary"))]
    pub(crate) fn singles(&self, planned: &Planned, range: Range<usize>, out: &mut Vec<f32>) -> Result<()> {
        if let Some(rows) = planned.rows(&range).filter(|rows| self.all_fit(planned, rows)) {
            // Without a branch, so that many are converted at once.
            let least = planned.least();
            let lost = |x: &f64| (*x as f32).is_infinite() | (((*x as f32).abs() < least) & (*x != 0.0));
            if !rows.iter().fold(false, |any, x| any | lost(x)) {
                out.extend(rows.iter().map(|x| *x as f32));
                return Ok(());
            }
        }
        let limits = (planned.strict, planned.least());
        self.fill(planned, range, 0..planned.components, 0, out, |x, i| single(limits, x.float()).ok_or(i))
    }

    /// Whether no check of [`Self::fill`] would refuse any of the rows; false where each has to be looked at.
    #[cfg(any(feature = "hdf5-layer", feature = "gadget-binary"))]
    fn all_fit(&self, planned: &Planned, rows: &[f64]) -> bool {
        let inside = self.flavor.inside_box && planned.name == names::COORDINATES;
        let least = if planned.positive { f64::MIN_POSITIVE } else { f64::MIN };
        // Of each component, the first value that is no longer allowed follows the last.
        let limits: [(f64, f64); 3] = std::array::from_fn(|axis| match inside && axis < self.header.dimension {
            true => self.within(axis),
            false => (least, f64::INFINITY),
        });
        let within = |x: f64, (low, high): (f64, f64)| (x >= low) & (x < high);
        match planned.components {
            3 => {
                let (triples, _) = rows.as_chunks::<3>();
                let fits = |t: &[f64; 3]| within(t[0], limits[0]) & within(t[1], limits[1]) & within(t[2], limits[2]);
                triples.iter().fold(true, |all, t| all & fits(t))
            }
            _ => !inside && rows.iter().fold(true, |all, x| all & within(*x, limits[0])),
        }
    }

    /// Appends `factor` times the numbers of one component in f64.
    #[cfg(any(feature = "phantom", feature = "sph-exa"))]
    pub(crate) fn component_doubles(
        &self,
        planned: &Planned,
        part: Component,
        range: Range<usize>,
        out: &mut Vec<f64>,
    ) -> Result<()> {
        let scaled = |x: Number, i| self.double(planned, x.float(), i).map(|x| part.factor * (x + part.shift));
        self.fill(planned, range, part.index..part.index + 1, 0, out, scaled)
    }

    /// Appends `factor` times the numbers of one component in f32.
    #[cfg(any(feature = "phantom", feature = "sph-exa"))]
    pub(crate) fn component_singles(
        &self,
        planned: &Planned,
        part: Component,
        range: Range<usize>,
        out: &mut Vec<f32>,
    ) -> Result<()> {
        let limits = (planned.strict && !part.may_vanish, planned.least());
        let scaled = |x: Number, i| single(limits, part.factor * (x.float() + part.shift)).ok_or(i);
        self.fill(planned, range, part.index..part.index + 1, 0, out, scaled)
    }

    /// Appends the numbers of some particles; `convert` returns the index where one does not fit.
    fn fill<T>(
        &self,
        planned: &Planned,
        range: Range<usize>,
        components: Range<usize>,
        first_id: u64,
        out: &mut Vec<T>,
        convert: impl Fn(Number, usize) -> std::result::Result<T, usize>,
    ) -> Result<()> {
        for i in range {
            for c in components.clone() {
                let x = planned.numbers.get(i, c, first_id);
                if planned.positive && x.float() <= 0.0 {
                    return Err(self.refuse(unfit(planned, self.first_row + i, x)));
                }
                let stored = convert(x, c).map_err(|_| self.refuse(unfit(planned, self.first_row + i, x)))?;
                out.push(stored);
            }
        }
        Ok(())
    }

    /// The box along an axis.
    fn within(&self, axis: usize) -> (f64, f64) {
        let along = |numbers: &[f64; 3]| numbers.get(axis).copied().unwrap_or(0.0);
        let corner = self.header.box_corner.as_ref().map_or(0.0, along);
        (corner, corner + along(&self.header.box_size))
    }

    /// A number of a dataset in f64; coordinates must also lie in the box where the flavor says so.
    fn double(&self, planned: &Planned, x: f64, axis: usize) -> std::result::Result<f64, usize> {
        let used = axis < self.header.dimension;
        let (low, high) = self.within(axis);
        let outside = self.flavor.inside_box && planned.name == names::COORDINATES && used && !(low..high).contains(&x);
        if outside || (planned.strict && !x.is_finite()) {
            return Err(axis);
        }
        Ok(x)
    }
}

/// Mean spacing over support radius for so many neighbors V_d n H^d; those of SWIFT's cubic spline where they are not known.
pub(crate) fn spacing_over_support(d: usize, neighbors: f64) -> f64 {
    let axis = d.clamp(1, 3) - 1;
    let ball = [2.0, std::f64::consts::PI, 4.0 / 3.0 * std::f64::consts::PI][axis];
    if neighbors.is_finite() && neighbors > 0.0 {
        (ball / neighbors).powf(1.0 / d as f64)
    } else {
        1.0 / (CUBIC_SPLINE_SUPPORT[axis] * CUBIC_SPLINE_ETA)
    }
}

fn missing(rule: &Rule) -> String {
    match rule.source {
        Source::Spacing { .. } => format!(
            "{} needs the columns {} and {}, or {}; a point mass needs accretion_radius or softening_radius",
            rule.name,
            names::MASSES,
            names::DENSITY,
            names::SUPPORT_RADIUS
        ),
        Source::Column(names::INTERNAL_ENERGY) => format!(
            "there is no column {}, which is compulsory for gas; the input is to have it, or a scene, with thermal.internal_energy (and \
             input.keep_particles for particles that stay as they are)",
            names::INTERNAL_ENERGY
        ),
        source => format!("there is no column {}, which is compulsory", source.column().unwrap_or(rule.name)),
    }
}

fn unfit(planned: &Planned, i: usize, x: Number) -> String {
    let expected = match planned.storage {
        Storage::Id => "a whole number from 0 on",
        Storage::Int => "a whole number of 32 bits",
        Storage::Long => "a whole number of 64 bits",
        _ if planned.name == names::COORDINATES => "a finite position within the box, its upper faces excluded",
        _ if planned.positive && x.float() <= 0.0 => "a positive value",
        _ if x.float().is_finite() => {
            "a value within f32's range (1e-38 to 3e38); choose units in which it is nearer to 1, or double precision"
        }
        _ => "a finite value",
    };
    format!("column '{}' of particle {i} is {:e}, expected {expected}", planned.name, x.float())
}

#[cfg_attr(not(any(feature = "hdf5-layer", feature = "phantom")), allow(dead_code))]
impl Planned<'_> {
    /// What is smaller, but not 0, is lost in f32: masses and the like need all of their digits.
    fn least(&self) -> f32 {
        if self.positive { f32::MIN_POSITIVE } else { f32::from_bits(1) }
    }
}

#[cfg(feature = "hdf5-layer")]
impl<'a> Planned<'a> {
    /// The columns from which the numbers come.
    pub(crate) fn columns(&self) -> Vec<&'a str> {
        match &self.numbers {
            Numbers::Column(column) | Numbers::Scaled { column, .. } => vec![&column.name],
            Numbers::Spacing { masses, density, .. } => vec![&masses.name, &density.name],
            Numbers::Zeros | Numbers::Count => Vec::new(),
        }
    }
}

#[cfg(any(feature = "hdf5-layer", feature = "gadget-binary"))]
impl Planned<'_> {
    /// The rows as they lie in a column of f64 that has all components of the dataset.
    fn rows(&self, range: &Range<usize>) -> Option<&[f64]> {
        match &self.numbers {
            Numbers::Column(Column { components, values: Values::F64(v), .. }) if *components == self.components => {
                v.get(range.start * components..range.end * components)
            }
            _ => None,
        }
    }
}

impl Numbers<'_> {
    fn get(&self, i: usize, component: usize, first_id: u64) -> Number {
        match self {
            Self::Scaled { column, .. } if component >= column.components => Number::Float(0.0),
            Self::Scaled { column, factor } => {
                Number::Float(factor * column.values.get(i * column.components + component))
            }
            Self::Column(c) if component >= c.components => match c.values {
                Values::I64(_) => Number::Int(0),
                _ => Number::Float(0.0),
            },
            Self::Column(c) => match &c.values {
                Values::I64(v) => Number::Int(v[i * c.components + component]),
                values => Number::Float(values.get(i * c.components + component)),
            },
            Self::Zeros => Number::Float(0.0),
            Self::Count => Number::Int((first_id + i as u64) as i64),
            Self::Spacing { masses, density, eta, dimension } => {
                let volume = masses.values.get(i) / density.values.get(i);
                Number::Float(eta * root(volume, *dimension))
            }
        }
    }
}
