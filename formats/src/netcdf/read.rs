//! Finds the density and its axes in a NetCDF file, and reads every variable on the same axes.

use super::axes::{self, Role};
use super::decode::{self, Order};
use super::file::{File, metadata, unit};
use super::geometry::{geometry, read_axis};
use super::particles;
use super::schema::{DENSITY_NAMES, NAME};
use crate::error::Result;
use crate::model::{Geometry, Location, RawField, Values, Variable};
use crate::nearest::did_you_mean;
use crate::registry::{FieldRequest, FileContent};
use netcdf_reader::NcVariable;
use std::path::Path;

/// Reads the density of `path` and the variables on the same axes, or particles.
///
/// # Errors
/// [`crate::FormatError::Input`] where the density, its axes or the record cannot be told, or values are damaged;
/// [`crate::FormatError::Unsupported`] where the axes span no space that particles could fill.
pub fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let file = File::open(path)?;
    if request.density.is_none()
        && let Some(dimension) = particles::dimension(&file)?
    {
        return particles::read(&file, &dimension).map(FileContent::Particles);
    }
    let mut notes = Vec::new();
    let density = find_density(&file, request, &mut notes)?;
    let layout = Layout::of(&file, density, request, &mut notes)?;
    let mut variables = Vec::new();
    for variable in wanted(&file, density, request)? {
        variables.push(layout.read(&file, variable, &mut notes)?);
    }
    Ok(FileContent::Field(RawField {
        path: path.into(),
        format: NAME,
        density: Some(density.name().to_owned()),
        metadata: metadata(&file),
        geometry: layout.geometry,
        variables,
        notes,
    }))
}

/// Numeric variables with axes in space: no coordinates, no bounds, no series in time alone.
fn candidates<'f>(file: &'f File) -> Result<Vec<&'f NcVariable>> {
    let all = file.variables()?;
    let bounds: Vec<String> =
        all.iter().flat_map(|v| [axes::text(v, "bounds"), axes::text(v, "climatology")]).flatten().collect();
    let in_space = |v: &NcVariable| v.dimensions().iter().any(|d| file.role(&d.name) != Some(Role::Time));
    Ok(all
        .iter()
        .filter(|v| decode::is_numeric(v.dtype()) && in_space(v))
        .filter(|v| !v.is_coordinate_variable() && !bounds.iter().any(|b| b == v.name()))
        .collect())
}

fn find_density<'f>(file: &'f File, request: &FieldRequest, notes: &mut Vec<String>) -> Result<&'f NcVariable> {
    let candidates = candidates(file)?;
    let list = || candidates.iter().map(|v| v.name()).collect::<Vec<_>>().join(", ");
    if let Some(name) = &request.density {
        return candidates.iter().find(|v| v.name() == name).copied().ok_or_else(|| {
            file.input(
                &format!("variable '{name}'"),
                format!(
                    "there is no such field in space; the file has {}{}",
                    list(),
                    did_you_mean(name, candidates.iter().map(|v| v.name()))
                ),
            )
        });
    }
    let by_name = |name: &&str| candidates.iter().find(|v| v.name().eq_ignore_ascii_case(name));
    if let Some(v) = DENSITY_NAMES.iter().find_map(by_name) {
        return Ok(v);
    }
    let says_density = |v: &&&NcVariable| {
        let hints = ["standard_name", "long_name", "display_name"];
        hints.iter().filter_map(|a| axes::text(v, a)).any(|t| t.to_lowercase().contains("density"))
    };
    let described: Vec<_> = candidates.iter().filter(says_density).collect();
    match (described.as_slice(), candidates.as_slice()) {
        ([one], _) => {
            notes.push(format!("took variable '{}' as the density, because its description says so", one.name()));
            Ok(one)
        }
        ([], [one]) => {
            notes.push(format!("took variable '{}' as the density, because there is no other", one.name()));
            Ok(one)
        }
        (_, []) => Err(file.input("header", nothing_in_space(file))),
        _ => Err(file.input(
            "header",
            format!("cannot tell which variable is the density; name it with --density, one of {}", list()),
        )),
    }
}

fn nothing_in_space(file: &File) -> String {
    let groups = file.nc.root_group().map(|root| root.groups.iter().map(|g| g.name.as_str()).collect::<Vec<_>>());
    let problem = "there is no numeric variable with axes in space, expected a density";
    match groups {
        Ok(names) if !names.is_empty() => {
            format!("{problem}; only the root group is read, so move the variables there from {}", names.join(", "))
        }
        _ => problem.to_owned(),
    }
}

/// The density, then the other variables on its axes.
fn wanted<'f>(file: &'f File, density: &'f NcVariable, request: &FieldRequest) -> Result<Vec<&'f NcVariable>> {
    let spatial = |v: &NcVariable| {
        let dimensions = v.dimensions().iter().map(|d| d.name.clone());
        let mut names: Vec<_> = dimensions.filter(|d| file.role(d) != Some(Role::Time)).collect();
        names.sort();
        names
    };
    let axes = spatial(density);
    let fits = |v: &NcVariable| spatial(v) == axes && v.dimensions().len() <= axes.len() + 1;
    let mut found = vec![density];
    let others = candidates(file)?.into_iter().filter(|v| v.name() != density.name());
    match &request.carry {
        None => found.extend(others.filter(|v| fits(v))),
        Some(names) => {
            let others: Vec<_> = others.collect();
            for name in names.iter().filter(|n| *n != density.name()) {
                let v = others.iter().find(|v| v.name() == name && fits(v)).ok_or_else(|| {
                    file.input(
                        &format!("variable '{name}'"),
                        format!("it cannot be carried, because it is not a field on the axes of '{}'", density.name()),
                    )
                })?;
                found.push(v);
            }
            if axes.len() == 1 {
                let is_new = |v: &&&NcVariable| !names.iter().any(|n| n == v.name());
                found.extend(others.iter().filter(is_new).filter(|v| fits(v) && request.takes_if_there(v.name())));
            }
        }
    }
    Ok(found)
}

/// The field's axes, and which part of the file is read.
struct Layout {
    geometry: Geometry,
    /// In the geometry's order, fastest first: dimension, length, and whether it runs backward.
    axes: Vec<(String, usize, bool)>,
    /// The time dimension and the record taken.
    record: Option<(String, u64)>,
}

impl Layout {
    fn of(file: &File, density: &NcVariable, request: &FieldRequest, notes: &mut Vec<String>) -> Result<Self> {
        let mut axes = Vec::new();
        let mut time = None;
        for d in density.dimensions() {
            let role = file.role(&d.name);
            let single = d.size == 1 && density.dimensions().len() > 1;
            match role {
                Some(Role::Time) if time.is_none() => time = Some((d.name.clone(), d.size)),
                None if d.is_unlimited && time.is_none() => time = Some((d.name.clone(), d.size)),
                _ if single => notes.push(format!("left out dimension '{}', which has length 1", d.name)),
                Some(role) => axes.push(read_axis(file, &d.name, role, notes)?),
                None => {
                    return Err(file.input(
                        &format!("dimension '{}'", d.name),
                        "cannot tell which axis it is; give its coordinate variable an attribute axis, standard_name or units, or name it x, y, z or r",
                    ));
                }
            }
        }
        let geometry = geometry(file, density, &mut axes, request, notes)?;
        let record = match time {
            Some((name, length)) => Some(find_record(file, &name, length, request, notes)?),
            None if request.time.is_some() => {
                return Err(file.input(
                    &format!("variable '{}'", density.name()),
                    "it has no time axis, so --time has no meaning; leave it out",
                ));
            }
            None => None,
        };
        let axes = axes.into_iter().map(|a| (a.dimension, a.grid.nodes.len(), a.backward)).collect();
        Ok(Self { geometry, axes, record })
    }

    fn read(&self, file: &File, variable: &NcVariable, notes: &mut Vec<String>) -> Result<Variable> {
        let mut fixed = Vec::new();
        for d in variable.dimensions() {
            let whole = self.axes.iter().any(|a| a.0 == d.name);
            let record = self.record.as_ref().filter(|r| r.0 == d.name).map_or(0, |r| r.1);
            if !whole && record >= d.size {
                return Err(file.input(
                    &format!("variable '{}'", variable.name()),
                    format!("dimension '{}' has no record {record}", d.name),
                ));
            }
            fixed.push((!whole).then_some(record));
        }
        let decoded = decode::read(file, variable, &fixed)?;
        let expected: usize = self.axes.iter().map(|a| a.1).product();
        if decoded.values.len() != expected {
            return Err(file.input(
                &format!("variable '{}'", variable.name()),
                format!("it has {} values, its axes say {expected}", decoded.values.len()),
            ));
        }
        if decoded.masked > 0 {
            notes.push(format!("variable '{}': {} of {expected} values are missing", variable.name(), decoded.masked));
        }
        Ok(Variable {
            name: variable.name().to_owned(),
            description: ["standard_name", "long_name", "display_name"].iter().find_map(|a| axes::text(variable, a)),
            unit: unit(file, variable, notes),
            location: Location::Node,
            components: 1,
            values: self.order(variable).apply(decoded.values),
        })
    }

    /// Each axis's stride in a variable of C order.
    fn order(&self, variable: &NcVariable) -> Order {
        let length = |name: &str| self.axes.iter().find(|a| a.0 == name).map_or(1, |a| a.1);
        let stride = |name: &str| {
            let after = variable.dimensions().iter().rev().take_while(|d| d.name != name);
            after.map(|d| length(&d.name)).product()
        };
        Order(self.axes.iter().map(|(name, n, backward)| (*n, stride(name), *backward)).collect())
    }
}

/// The record nearest to the requested time.
fn find_record(
    file: &File,
    dimension: &str,
    length: u64,
    request: &FieldRequest,
    notes: &mut Vec<String>,
) -> Result<(String, u64)> {
    let location = format!("time axis '{dimension}'");
    if length == 0 {
        return Err(file.input(&location, "it has no records"));
    }
    let coordinate = file.coordinate(dimension).filter(|v| decode::is_numeric(v.dtype()));
    let times = match coordinate {
        Some(v) => decode::read(file, v, &[None])?.values.to_f64(),
        // Without a coordinate variable, records are told apart by their number from 0.
        None if length <= 1 << 24 => (0..length).map(|i| i as f64).collect(),
        None => return Err(file.input(&location, "it has no coordinate variable")),
    };
    let units = coordinate.and_then(|v| axes::text(v, "units")).map_or(String::new(), |u| format!(" ({u})"));
    let nearest = |t: f64| {
        let distance = |i: &usize| (times[*i] - t).abs();
        (0..times.len()).filter(|i| times[*i].is_finite()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    };
    let (low, high, _) = Values::F64(times.clone()).range();
    // No farther from the first or the last than records are apart on average; one record is that of any time.
    let apart = (high - low) / times.len().saturating_sub(1).max(1) as f64;
    let is_near = |t: f64| times.len() < 2 || !(high >= low) || t >= low - apart && t <= high + apart;
    if let Some(t) = request.time.filter(|t| !is_near(*t)) {
        let problem =
            format!("it has {length} records from {low} to {high}{units}, but --time is {t}; choose one of these");
        return Err(file.input(&location, problem));
    }
    let index = match request.time {
        Some(t) => nearest(t),
        None if times.len() == 1 => Some(0),
        None => {
            return Err(file.input(
                &location,
                format!("it has {length} records from {low} to {high}{units}; choose one with --time"),
            ));
        }
    };
    let index = index.ok_or_else(|| file.input(&location, "it has no finite time"))?;
    notes.push(format!("took record {index} of {length}, at time {}{units}; records count from 0", times[index]));
    Ok((dimension.to_owned(), index as u64))
}
