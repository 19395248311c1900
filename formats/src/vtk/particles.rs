//! Points with masses are read as particles.
//!
//! What the header says, and the unit of each array, stands in comments of XML files (`<!-- sph-prep key: value -->`); legacy
//! files have no place for it.
//! There, axes on which all particles are at 0 and at rest count as unused.

use super::dataset::{DataArray, Dataset, Shape};
use super::schema::NAME;
use crate::common::assemble::{self, Named};
use crate::common::facts::{Facts, escaped, texts, unescaped};
use crate::error::{FormatError, Result};
use crate::model::{Column, ParticleFile, RunHeader, Values};
use crate::particle_names as names;
use crate::units::Unit;
use std::path::Path;

const OPEN: &str = "<!-- sph-prep ";
/// Before the name of an array, whose unit it is.
const UNIT: &str = "unit ";
/// Before the name of a vector, which has so many of the three components that VTK asks for.
const COMPONENTS: &str = "components ";
const CLOSE: &str = " -->";
/// Comments are looked for in this many bytes.
const HEAD: usize = 1 << 20;
/// Last of VTK's cell types that are points: vertex and poly-vertex.
const LAST_POINT_TYPE: u8 = 2;

/// A header and the units of columns as comments, one per fact.
pub(super) fn comments(header: &RunHeader, columns: &[Column]) -> impl Iterator<Item = String> {
    let unit = |c: &Column| {
        let symbol = header.units.symbol(c.dimension);
        (!symbol.is_empty()).then(|| (format!("{UNIT}{}", c.name), symbol))
    };
    let units: Vec<_> = columns.iter().filter_map(unit).collect();
    let is_padded = |c: &&Column| c.components == 2 && c.name != names::COORDINATES;
    let padded: Vec<_> = columns
        .iter()
        .filter(is_padded)
        .map(|c| (format!("{COMPONENTS}{}", c.name), c.components.to_string()))
        .collect();
    texts(header).into_iter().chain(units).chain(padded).map(|(key, value)| {
        let value = escaped(&value);
        // Two hyphens would end the comment for a strict reader.
        let value = if value.contains("--") || value.ends_with('-') { value.replace('-', "\\-") } else { value };
        format!("{OPEN}{}: {value}{CLOSE}", key.replace("--", "-"))
    })
}

/// Whether a dataset is bare points with masses.
pub(super) fn are_particles(dataset: &Dataset) -> bool {
    let points =
        matches!(&dataset.shape, Shape::Cells { cells, .. } if cells.types.iter().all(|t| *t <= LAST_POINT_TYPE));
    let coordinates = std::iter::once(names::COORDINATES);
    points && assemble::are_particles(coordinates.chain(dataset.point_data.iter().map(|a| a.name.as_str())))
}

/// # Errors
/// [`FormatError::Input`] where arrays contradict each other.
pub(super) fn particles(path: &Path, dataset: Dataset, bytes: &[u8]) -> Result<ParticleFile> {
    let Dataset { shape, point_data, .. } = dataset;
    let Shape::Cells { points, .. } = shape else {
        return Err(FormatError::input(path, NAME, "points", "there are none"));
    };
    let head = String::from_utf8_lossy(bytes.get(..HEAD.min(bytes.len())).unwrap_or_default());
    let found: Vec<(&str, String)> = head
        .split(OPEN)
        .skip(1)
        .filter_map(|rest| rest.split_once(CLOSE)?.0.split_once(": "))
        .map(|(key, value)| (key, unescaped(value)))
        .collect();
    let mut facts = Facts::new(found.iter().map(|(k, v)| (*k, v.as_str())));
    facts.dimension = facts.dimension.or_else(|| Some(used_axes(&points, &point_data)));
    let count = points.len();
    let values = Values::F64(points.into_iter().flatten().collect());
    let mut named = vec![Named { name: names::COORDINATES.into(), components: 3, values, unit: None }];
    let columns = point_data.into_iter().filter(|a| names::standard(&a.name) != Some(names::COORDINATES));
    let stated = |prefix: &str, name: &str| {
        found.iter().find(|(key, _)| key.strip_prefix(prefix) == Some(name)).map(|(_, v)| v.as_str())
    };
    named.extend(columns.map(|a| {
        let unit = stated(UNIT, &a.name).and_then(Unit::parse);
        let is_padded = a.components == 3 && stated(COMPONENTS, &a.name) == Some("2");
        let (components, values) = if is_padded { (2, first_two(&a.values)) } else { (a.components, a.values) };
        Named { name: a.name, components, values, unit }
    }));
    assemble::particles(count, named, facts).map_err(|(at, problem)| FormatError::input(path, NAME, at, problem))
}

/// The first two of each three.
fn first_two(values: &Values) -> Values {
    fn of<T: Copy>(values: &[T]) -> Vec<T> {
        values.chunks(3).flat_map(|row| &row[..2.min(row.len())]).copied().collect()
    }
    match values {
        Values::F32(v) => Values::F32(of(v)),
        Values::F64(v) => Values::F64(of(v)),
        Values::I64(v) => Values::I64(of(v)),
    }
}

fn used_axes(points: &[[f64; 3]], arrays: &[DataArray]) -> usize {
    let still = |axis: usize| {
        let at_zero = points.iter().all(|p| p.get(axis) == Some(&0.0));
        let vectors = arrays.iter().filter(|a| a.components == 3);
        let mut components = vectors.flat_map(|a| (axis..a.values.len()).step_by(3).map(|i| a.values.get(i)));
        at_zero && components.all(|v| v == 0.0)
    };
    match (still(1), still(2)) {
        (_, false) => 3,
        (false, true) => 2,
        (true, true) => 1,
    }
}
