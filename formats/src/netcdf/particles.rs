//! Particles as variables over one dimension.
//!
//! | object                     | content                                                                          |
//! |----------------------------|----------------------------------------------------------------------------------|
//! | dimension `particle`       | one element per particle; vectors other than those below also have `component_<n>` |
//! | x, y, z                    | positions, f64, with attributes `axis` and `units`                               |
//! | vx, vy, vz                 | velocities, with `units`                                                         |
//! | others                     | under their names, f32 (or f64), integers i32 or i64, with `units` where they have one |
//! | global attributes          | `Conventions`, `featureType` = `point`, and the header's facts as texts: dimension, box_size, periodic, units_in_cgs, time, kernel, kernel_neighbors, and `provenance <key>` |
//!
//! Files are classic (CDF-2), or CDF-5 where an integer needs 64 bits or a variable 4 GiB; neither is compressed. Any
//! file whose positions and masses lie on one dimension is read as particles, unless a density is requested by name.

use super::axes;
use super::decode;
use super::file::{File, metadata};
use super::schema::NAME;
use crate::common::assemble::{self, Named};
use crate::common::facts::{Facts, texts};
use crate::common::flatten::{Flat, flatten};
use crate::common::netcdf_classic::{Attribute, ClassicFile, Data};
use crate::error::{FormatError, Result};
use crate::model::{ParticleFile, Values};
use crate::particle_names as names;
use crate::registry::WriteOptions;
use crate::units::Unit;
use netcdf_reader::NcVariable;
use std::path::Path;

const PARTICLE: &str = "particle";
/// Most components that a particle's row may have.
const MAX_COMPONENTS: u64 = 64;

/// The dimension that particles lie on, if the file holds any.
pub fn dimension(file: &File) -> Result<Option<String>> {
    let variables = file.variables()?;
    let on = |v: &NcVariable, dimension: &str| v.dimensions().first().is_some_and(|d| d.name == dimension);
    let single = |v: &&NcVariable| v.ndim() == 1 && decode::is_numeric(v.dtype()) && !v.is_coordinate_variable();
    for mass in variables.iter().filter(single).filter(|v| names::standard(v.name()) == Some(names::MASSES)) {
        let Some(dimension) = mass.dimensions().first().map(|d| d.name.as_str()) else { continue };
        let beside = variables.iter().filter(|v| on(v, dimension) && !v.is_coordinate_variable()).map(|v| v.name());
        if assemble::are_particles(beside) {
            return Ok(Some(dimension.to_owned()));
        }
    }
    Ok(None)
}

/// Reads the particles on `dimension`.
///
/// # Errors
/// [`FormatError::Input`] where variables contradict each other or are damaged, [`FormatError::Limit`].
pub fn read(file: &File, dimension: &str) -> Result<ParticleFile> {
    let attributes = metadata(file);
    let mut facts = Facts::new(attributes.iter().map(|(k, v)| (k.as_str(), v.as_str())));
    let mut arrays = Vec::new();
    let mut count = 0;
    for variable in file.variables()? {
        let components = match variable.dimensions() {
            [own] if own.name == dimension => Some(1),
            [own, other] if own.name == dimension => Some(other.size).filter(|n| (1..=MAX_COMPONENTS).contains(n)),
            _ => None,
        };
        let (Some(components), true) = (components, decode::is_numeric(variable.dtype())) else {
            let why = format!("variable '{}': not a column of numbers of the particles", variable.name());
            facts.provenance.push(("not read".into(), why));
            continue;
        };
        let values = match decode::integers(file, variable)? {
            Some(values) => Values::I64(values),
            None => decode::read(file, variable, &vec![None; variable.ndim()])?.values,
        };
        count = values.len() / components as usize;
        let unit = axes::text(variable, "units").as_deref().and_then(Unit::parse);
        arrays.push(Named { name: variable.name().to_owned(), components: components as usize, values, unit });
    }
    assemble::particles(count, arrays, facts).map_err(|(location, problem)| file.input(&location, problem))
}

/// A variable in the making.
struct Made {
    name: String,
    components: usize,
    numbers: Numbers,
    attributes: Vec<(&'static str, Attribute)>,
}

enum Numbers {
    Single(Vec<f32>),
    Double(Vec<f64>),
    Int(Vec<i32>),
    Long(Vec<i64>),
}

/// Writes particles as a classic file.
///
/// # Errors
/// [`FormatError::Output`] where there are no particles or names that the format does not have, [`FormatError::Io`].
pub fn write(path: &Path, particles: &ParticleFile, options: WriteOptions) -> Result<()> {
    let refuse = |problem: String| FormatError::Output { path: path.into(), format: NAME, problem };
    let (count, columns) = flatten(particles).map_err(refuse)?;
    if count == 0 {
        return Err(refuse("there are no particles, and a dimension of NetCDF has at least one element".into()));
    }
    let units = &particles.header.units;
    let mut made = Vec::new();
    for column in &columns {
        let symbol = units.symbol(column.dimension);
        let numbers = stored(column, options.double_precision);
        made.extend(variables(column, numbers, &symbol));
    }
    let mut file = ClassicFile::new();
    file.attribute("Conventions", "CF-1.11");
    file.attribute("featureType", "point");
    for (key, value) in texts(&particles.header) {
        file.attribute(&key.replace('/', "_"), value.as_str());
    }
    let rows = file.dimension(PARTICLE, count);
    let mut widths = Vec::new();
    for variable in &made {
        let mut dimensions = vec![rows];
        if variable.components > 1 {
            let known = widths.iter().find(|(n, _)| *n == variable.components).map(|(_, id)| *id);
            dimensions.push(known.unwrap_or_else(|| {
                let id = file.dimension(&format!("component_{}", variable.components), variable.components);
                widths.push((variable.components, id));
                id
            }));
        }
        let data = match &variable.numbers {
            Numbers::Single(v) => Data::F32(v),
            Numbers::Double(v) => Data::F64(v),
            Numbers::Int(v) => Data::I32(v),
            Numbers::Long(v) => Data::I64(v),
        };
        file.variable(&variable.name, &dimensions, data, &variable.attributes);
    }
    file.write(path)
}

/// A column's numbers as they are stored.
fn stored(column: &Flat, double: bool) -> Numbers {
    if column.integers {
        let narrow: Option<Vec<i32>> = column.whole().map(|n| i32::try_from(n).ok()).collect();
        narrow.map_or_else(|| Numbers::Long(column.whole().collect()), Numbers::Int)
    } else if column.wants_double(double) {
        Numbers::Double(column.floats().collect())
    } else {
        Numbers::Single(column.floats().map(|x| x as f32).collect())
    }
}

/// Positions and velocities by component, everything else as it is.
fn variables(column: &Flat, numbers: Numbers, symbol: &str) -> Vec<Made> {
    let units = || (!symbol.is_empty()).then(|| ("units", Attribute::from(symbol)));
    let prefix = match column.name.as_str() {
        names::COORDINATES if column.components <= 3 => "",
        names::VELOCITIES if column.components <= 3 => "v",
        name => {
            let name = name.replace('/', "_");
            let attributes = units().into_iter().collect();
            return vec![Made { name, components: column.components, numbers, attributes }];
        }
    };
    let axis = |(i, axis): (usize, &str)| {
        let mut attributes: Vec<_> = units().into_iter().collect();
        if prefix.is_empty() {
            attributes.push(("axis", Attribute::from(axis.to_uppercase().as_str())));
        }
        let numbers = numbers.component(i, column.components);
        Made { name: format!("{prefix}{axis}"), components: 1, numbers, attributes }
    };
    ["x", "y", "z"].into_iter().take(column.components).enumerate().map(axis).collect()
}

impl Numbers {
    fn component(&self, index: usize, components: usize) -> Self {
        fn every<T: Copy>(v: &[T], index: usize, components: usize) -> Vec<T> {
            v.iter().skip(index).step_by(components).copied().collect()
        }
        match self {
            Self::Single(v) => Self::Single(every(v, index, components)),
            Self::Double(v) => Self::Double(every(v, index, components)),
            Self::Int(v) => Self::Int(every(v, index, components)),
            Self::Long(v) => Self::Long(every(v, index, components)),
        }
    }
}
