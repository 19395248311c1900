//! Reads the last step of an SPH-EXA file: initial conditions and outputs.

use super::schema::{CONSTANTS, EXPONENTS, FLAVOR, GAMMA, MUI, PARTS, STEP, SUPPORT, heat_capacity};
use crate::common::assemble::{self, Named};
use crate::common::facts::Facts;
use crate::common::hdf5_read::{Attributes, Reader, Shape};
use crate::common::snapshot::OWN_GROUP;
use crate::error::Result;
use crate::model::{ADIABATIC_INDEX_KEY, DOUBT_KEY, LACKS_KEY, ParticleFile, Values, adiabatic_fact};
use crate::particle_names as names;
use crate::registry::{FieldRequest, FileContent};
use crate::units::UnitDimension;
use std::path::Path;

/// More columns than this in one dataset are not a particle's components.
const MAX_COMPONENTS: usize = 64;
/// Columns of a restart that follow from velocities.
const DISPLACEMENTS: [&str; 3] = ["x_m1", "y_m1", "z_m1"];

/// Reads all particles of `path`.
///
/// # Errors
/// [`crate::FormatError::Input`] where the file is damaged or has no step, [`crate::FormatError::Limit`],
/// [`crate::FormatError::Io`].
pub fn read(path: &Path, _request: &FieldRequest) -> Result<FileContent> {
    let file = Reader::open(path, FLAVOR.format)?;
    let group = last_step(&file)?;
    let attributes = file.group_attributes(&group)?;
    let mut facts = own_facts(&file)?;
    let mut datasets = read_datasets(&file, &group)?;
    let count = match datasets.iter().find(|d| d.0 == "x") {
        Some((_, Some((shape, _)))) if shape.columns == 1 => shape.rows,
        _ => return Err(file.input(format!("dataset '{group}/x'"), "it is not a list of numbers, one per particle")),
    };
    check_lengths(&file, &group, &datasets, count, attributes.number("numParticlesGlobal"))?;
    facts.provenance.extend(temperatures(&mut datasets, &attributes));
    let mut arrays = Vec::new();
    let mut exponents = Vec::new();
    for (name, content) in datasets.drain(..) {
        let path = format!("{group}/{name}");
        match content {
            Some((shape, values)) if shape.rows == count && (1..=MAX_COMPONENTS).contains(&shape.columns) => {
                // The dataset's own unit, which is another where the name is.
                exponents.push((name.clone(), file.dataset_attributes(&path)?.numbers(EXPONENTS)));
                let (name, values) = meaning(&name, values, &attributes);
                arrays.push(Named { name, components: shape.columns, values, unit: None });
            }
            _ => facts
                .provenance
                .push(("not read".into(), format!("{path}: not a column of numbers for {count} particles"))),
        }
    }
    let corner = read_box(&file, &group, &attributes, &mut facts)?;
    facts.dimension = Some(3);
    facts.time = attributes.number("time").filter(|t| t.is_finite()).or(facts.time);
    // Our own files have it among the texts, too.
    facts.provenance.retain(|(key, _)| key != ADIABATIC_INDEX_KEY);
    facts.provenance.extend(attributes.number("gamma").and_then(adiabatic_fact));
    let mut particles = assemble::particles(count, arrays, facts)
        .map_err(|(location, problem)| file.input(format!("group '{group}', {location}"), problem))?;
    shift(&mut particles, corner);
    for column in particles.species.iter_mut().flat_map(|s| &mut s.table.columns) {
        let stated = exponents.iter().find(|(name, _)| *name == column.name).and_then(|(_, e)| e.as_deref());
        if let Some(dimension) = stated.and_then(dimension) {
            column.dimension = dimension;
        }
    }
    Ok(FileContent::Particles(particles))
}

/// The step of the largest number.
fn last_step(file: &Reader) -> Result<String> {
    let number = |name: &String| name.strip_prefix(STEP)?.parse::<u64>().ok();
    let last = file.groups()?.into_iter().filter(|g| number(g).is_some()).max_by_key(number);
    last.ok_or_else(|| {
        file.input("group '/'", "there is no group Step#0, expected an SPH-EXA file; name another format with --format")
    })
}

/// A dataset's name and its content; `None` where it is no table of numbers.
type Dataset = (String, Option<(Shape, Values)>);

/// Leaves the temperatures out that follow from energies; says where they do not, or where there are none, from which the code starts.
fn temperatures(datasets: &mut Vec<Dataset>, attributes: &Attributes) -> Option<(String, String)> {
    if !datasets.iter().any(|(name, _)| name == "u") {
        return None;
    }
    let Some(place) = datasets.iter().position(|(name, _)| name == "temp") else {
        return Some((LACKS_KEY.into(), "the dataset temp, which u does not stand for".into()));
    };
    let (_, t) = datasets.remove(place).1?;
    let (_, u) = datasets.iter().find(|(name, _)| name == "u")?.1.as_ref()?;
    let capacity = capacity(attributes);
    let differs = |i: &usize| !((capacity * t.get(*i) - u.get(*i)).abs() <= SAME * u.get(*i).abs());
    let i = (0..u.len().min(t.len())).find(differs)?;
    let text = format!(
        "u of particle {i} is {}, but its temp is {}, from which the code starts and which gives {}; read is u",
        u.get(i),
        t.get(i),
        capacity * t.get(i)
    );
    Some((DOUBT_KEY.into(), text))
}

/// Energies and temperatures in single precision are the same that differ by less.
const SAME: f64 = 1e-4;

/// Energy per temperature, as the step's attributes say.
fn capacity(attributes: &Attributes) -> f64 {
    let known = |key: &str, default: f64| attributes.number(key).filter(|x| x.is_finite()).unwrap_or(default);
    heat_capacity(known("gamma", GAMMA), known("muiConst", MUI))
}

/// The datasets of a step that do not follow from others.
fn read_datasets(file: &Reader, group: &str) -> Result<Vec<Dataset>> {
    let mut names = file.datasets(group)?;
    names.retain(|name| !DISPLACEMENTS.contains(&name.as_str()));
    let read = |name: String| file.numbers(&format!("{group}/{name}")).map(|content| (name, content));
    let mut datasets: Vec<_> = names.into_iter().map(read).collect::<Result<_>>()?;
    // Columns that our writer fills in say nothing.
    let filled = |name: &str, v: &Values| {
        let value = CONSTANTS.iter().find(|c| c.0 == name).map(|c| f64::from(c.1 as f32));
        value.is_some_and(|x| v.range() == (x, x, 0))
    };
    datasets.retain(|(name, content)| !content.as_ref().is_some_and(|(_, v)| filled(name, v)));
    Ok(datasets)
}

/// The code's own columns are as long as there are particles, and positions have all three components.
fn check_lengths(file: &Reader, group: &str, datasets: &[Dataset], count: usize, stated: Option<f64>) -> Result<()> {
    if let Some(n) = stated.filter(|n| *n != count as f64) {
        let problem = format!("it has {count} rows, but attribute numParticlesGlobal counts {n} particles");
        return Err(file.input(format!("dataset '{group}/x'"), problem));
    }
    for part in PARTS {
        let location = || format!("dataset '{group}/{}'", part.name);
        match datasets.iter().find(|d| d.0 == part.name) {
            Some((_, Some((shape, _)))) if shape.rows == count && shape.columns == 1 => {}
            Some(_) => {
                return Err(file.input(location(), format!("it is not a list of {count} numbers, one per particle")));
            }
            None if part.from == names::COORDINATES => return Err(file.input(location(), "it is missing")),
            None => {}
        }
    }
    Ok(())
}

fn own_facts(file: &Reader) -> Result<Facts> {
    let own = file.group_attributes(OWN_GROUP)?;
    let texts: Vec<(String, String)> =
        own.names().filter_map(|name| Some((name.to_owned(), own.text(name)?))).collect();
    Ok(Facts::new(texts.iter().map(|(k, v)| (k.as_str(), v.as_str()))))
}

/// What a dataset is here.
fn meaning(name: &str, values: Values, attributes: &Attributes) -> (String, Values) {
    let times = |factor: f64| match &values {
        // Doubling is exact in the file's own precision.
        Values::F32(v) if factor == SUPPORT => Values::F32(v.iter().map(|x| SUPPORT as f32 * x).collect()),
        v => Values::F64((0..v.len()).map(|i| factor * v.get(i)).collect()),
    };
    match name {
        "h" => (names::SUPPORT_RADIUS.into(), times(SUPPORT)),
        "m" => (names::MASSES.into(), values),
        "temp" => (names::INTERNAL_ENERGY.into(), times(capacity(attributes))),
        "p" => (names::PRESSURE.into(), values),
        name => (name.into(), values),
    }
}

/// Sets edges and periodic axes; returns the box's corner.
fn read_box(file: &Reader, group: &str, attributes: &Attributes, facts: &mut Facts) -> Result<[f64; 3]> {
    let Some(limits) = attributes.numbers("box") else { return Ok([0.0; 3]) };
    let limits: [f64; 6] = limits.try_into().map_err(|v: Vec<f64>| {
        file.input(format!("group '{group}'"), format!("attribute box has {} numbers, expected 6", v.len()))
    })?;
    let [x, x_end, y, y_end, z, z_end] = limits;
    let edges = [x_end - x, y_end - y, z_end - z];
    if let Some(edge) = edges.iter().find(|l| !(l.is_finite() && **l >= 0.0)) {
        return Err(file.input(format!("group '{group}'"), format!("its box has an edge of {edge}, expected a length")));
    }
    facts.box_size = Some(edges);
    facts.box_corner = None;
    let boundaries = attributes.numbers("boundaryType").unwrap_or_default();
    facts.periodic = Some(std::array::from_fn(|i| boundaries.get(i) == Some(&1.0)));
    let corner = [x, y, z];
    if corner != [0.0; 3] {
        facts.provenance.push(("shifted".into(), format!("the corner of the box from {corner:?} to the origin")));
    }
    Ok(corner)
}

fn shift(particles: &mut ParticleFile, corner: [f64; 3]) {
    if corner == [0.0; 3] {
        return;
    }
    for column in particles.species.iter_mut().flat_map(|s| &mut s.table.columns) {
        if column.name == names::COORDINATES {
            let d = column.components;
            let moved = |i: usize| column.values.get(i) - corner.get(i % d).copied().unwrap_or(0.0);
            column.values = Values::F64((0..column.values.len()).map(moved).collect());
        }
    }
}

fn dimension(exponents: &[f64]) -> Option<UnitDimension> {
    let [length, mass, time, temperature] = *exponents else { return None };
    let whole = exponents.iter().all(|x| x.fract() == 0.0 && x.abs() <= 127.0);
    whole.then(|| UnitDimension::new(length as i8, mass as i8, time as i8, temperature as i8))
}
