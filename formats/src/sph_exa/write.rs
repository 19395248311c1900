//! Writes one step from which SPH-EXA starts.

use super::schema::{self, CONSTANTS, EXPONENTS, FLAVOR, Factor, MUI, PARTS, Part, STEP, SUPPORT};
use crate::common::facts;
use crate::common::flavor::{Component, Job, Planned, Storage};
use crate::common::hdf5::{Dataset, Group, Writer};
use crate::common::snapshot::OWN_GROUP;
use crate::error::Result;
use crate::model::{GRAVITY_KEY, ParticleFile, SOFTENING_OVER_SPACING, Species};
use crate::particle_names as names;
use crate::registry::WriteOptions;
use crate::units::{GRAVITATIONAL_CONSTANT_CGS, UnitDimension, UnitSystem};
use std::path::Path;

/// The first time step over that of the Courant condition; the code lets it grow by a tenth each step.
const CAUTION: f64 = 0.1;
/// Courant number that the code takes by default.
const COURANT: f64 = 0.2;

/// The code's kernel, and the most neighbors that it makes room for over those that it aims at, by default.
const KERNEL: &str = "sinc^6";
const MOST_NEIGHBORS: f64 = 1.5;

/// Writes `particles` to `path`.
///
/// # Errors
/// [`crate::FormatError::Output`] where SPH-EXA could not read them, [`crate::FormatError::Io`].
pub fn write(path: &Path, particles: &ParticleFile, options: WriteOptions) -> Result<()> {
    let job = Job { flavor: &FLAVOR, path, header: &particles.header, options, first_row: 0 };
    job.only_in_3d()?;
    if let Some(other) = particles.species.iter().find(|s| s.part_type != 0 && s.table.count > 0) {
        return Err(job.refuse(format!(
            "there are particles of type {}, but SPH-EXA has gas only; leave them out (`convert --types 0`)",
            other.part_type
        )));
    }
    let plan = job.plan(particles)?;
    let gas = particles.species.iter().zip(&plan).find(|(s, _)| s.part_type == 0 && s.table.count > 0);
    let Some((gas, planned)) = gas else {
        return Err(job.refuse("there are no gas particles, without which SPH-EXA has nothing to do"));
    };
    let edges = box_edges(&job)?;
    let writer = Writer::create(path)?;
    let step = writer.group(&format!("{STEP}0"))?;
    let dt = first_step(&job, gas, edges);
    write_attributes(&job, &step, gas, edges, dt)?;
    for part in PARTS {
        if let Some(column) = planned.iter().find(|p| p.name == part.from) {
            write_part(&job, &step, gas.table.count, column, part, dt)?;
        }
    }
    let level = options.compression;
    for (name, value) in CONSTANTS.iter().filter(|c| planned.iter().all(|p| p.name != c.0)) {
        step.dataset(name, gas.table.count, 1, level, |range, out: &mut Vec<f32>| {
            out.resize(range.len(), *value as f32);
            Ok(())
        })?;
    }
    write_others(&job, &step, gas, planned)?;
    let own = writer.group(OWN_GROUP)?;
    for (key, value) in facts::texts(job.header) {
        own.text(&key, &value)?;
    }
    writer.close()
}

/// The box's three edges: SPH-EXA takes any.
fn box_edges(job: &Job) -> Result<[f64; 3]> {
    let edges = job.box_size()?;
    let edge = |i: usize| edges.get(i).or(edges.first()).copied().unwrap_or(0.0);
    Ok(std::array::from_fn(edge))
}

/// From the smallest smoothing length and the fastest signal of all particles.
fn first_step(job: &Job, gas: &Species, edges: [f64; 3]) -> f64 {
    let column = |name: &str| gas.table.column(name).map(|c| &c.values);
    let extreme = |name: &str, pick: fn(f64, f64) -> f64, start: f64| {
        column(name).map_or(start, |v| (0..v.len()).map(|i| v.get(i)).fold(start, pick))
    };
    let h = extreme(names::SUPPORT_RADIUS, f64::min, edges[0]) / SUPPORT;
    let energy = extreme(names::INTERNAL_ENERGY, f64::max, 0.0);
    let flow = column(names::VELOCITIES).map_or(0.0, |v| (0..v.len()).map(|i| v.get(i).abs()).fold(0.0, f64::max));
    let gamma = job.header.adiabatic_index();
    let signal = (gamma * (gamma - 1.0) * energy).sqrt() + flow * (job.header.dimension as f64).sqrt();
    CAUTION * COURANT * h / signal
}

fn write_attributes(job: &Job, step: &Group, gas: &Species, edges: [f64; 3], dt: f64) -> Result<()> {
    let header = job.header;
    let corner = header.box_corner.unwrap_or_default();
    let limits: Vec<f64> = corner.iter().zip(edges).flat_map(|(c, edge)| [*c, c + edge]).collect();
    step.numbers("box", &limits)?;
    step.numbers("boundaryType", &header.periodic.map(i8::from))?;
    step.numbers("iteration", &[1u64])?;
    step.numbers("numParticlesGlobal", &[gas.table.count as u64])?;
    step.numbers("time", &[header.time])?;
    step.numbers("minDt", &[dt])?;
    step.numbers("minDt_m1", &[dt])?;
    let unit = header.units.to_cgs(UnitDimension::new(3, -1, -2, 0));
    // Pure numbers that attract each other have a constant of their own.
    let own = header.provenance.iter().find(|(key, _)| key == GRAVITY_KEY).and_then(|(_, value)| value.parse().ok());
    let constant = own.filter(|_| header.units == UnitSystem::CODE).unwrap_or(GRAVITATIONAL_CONSTANT_CGS / unit);
    let gravity = if header.periodic.contains(&true) { 0.0 } else { constant };
    step.numbers("gravConstant", &[gravity])?;
    let spacing = gas.table.smallest_spacing(3).filter(|s| gravity > 0.0 && s.is_finite() && *s > 0.0);
    if let Some(spacing) = spacing {
        // The code's own default is a number in whatever units.
        step.numbers("eps", &[SOFTENING_OVER_SPACING * spacing])?;
    }
    if header.kernel == KERNEL {
        let neighbors = header.kernel_neighbors.round();
        step.numbers("ng0", &[neighbors as u32])?;
        step.numbers("ngmax", &[(MOST_NEIGHBORS * neighbors) as u32])?;
    }
    step.numbers("gamma", &[header.adiabatic_index()])?;
    step.numbers("muiConst", &[MUI as f32])
}

fn write_part(job: &Job, step: &Group, count: usize, column: &Planned, part: &Part, dt: f64) -> Result<()> {
    let factor = match part.factor {
        Factor::One => 1.0,
        Factor::Half => 1.0 / SUPPORT,
        Factor::Step => dt,
        Factor::Temperature => 1.0 / schema::heat_capacity(job.header.adiabatic_index(), MUI),
    };
    let component = Component { index: part.component, factor, shift: 0.0, may_vanish: part.factor == Factor::Step };
    let (name, level) = (part.name, job.options.compression);
    let dataset = if part.double || job.options.double_precision {
        step.dataset(name, count, 1, level, |range, out| job.component_doubles(column, component, range, out))?
    } else {
        step.dataset(name, count, 1, level, |range, out| job.component_singles(column, component, range, out))?
    };
    let dimension = match part.factor {
        Factor::One | Factor::Half => column.dimension,
        Factor::Step => UnitDimension::LENGTH,
        Factor::Temperature => UnitDimension::TEMPERATURE,
    };
    dataset.numbers(EXPONENTS, &exponents(dimension))
}

/// The ids, and columns under their own names.
fn write_others(job: &Job, step: &Group, gas: &Species, planned: &[Planned]) -> Result<()> {
    let (count, level) = (gas.table.count, job.options.compression);
    let taken = |name: &str| PARTS.iter().any(|p| p.name == name);
    for column in planned.iter().filter(|p| !PARTS.iter().any(|part| part.from == p.name)) {
        let name = column.name.as_str();
        if taken(name) {
            return Err(job.refuse(format!("column '{name}' has the name of one of SPH-EXA's own; rename it")));
        }
        let dataset: Dataset = match column.storage {
            Storage::Id => step.dataset(name, count, 1, level, |range, out| job.ids(column, range, 1, out))?,
            Storage::Int => {
                step.dataset(name, count, column.components, level, |range, out| job.ints(column, range, out))?
            }
            _ if job.options.double_precision => {
                step.dataset(name, count, column.components, level, |range, out| job.doubles(column, range, out))?
            }
            _ => step.dataset(name, count, column.components, level, |range, out| job.singles(column, range, out))?,
        };
        dataset.numbers(EXPONENTS, &exponents(column.dimension))?;
    }
    Ok(())
}

/// Exponents of length, mass, time and temperature.
fn exponents(d: UnitDimension) -> [i32; 4] {
    [d.length, d.mass, d.time, d.temperature].map(i32::from)
}
