//! Reads archives and single arrays.

use super::npy::{self, Array, Content, Place};
use super::schema::{HEADER, MAGIC, NAME};
use crate::common::assemble::{self, Named};
use crate::common::curvilinear::{Along, complete};
use crate::common::facts::{Facts, unescaped};
use crate::error::{FormatError, Result};
use crate::limits::{Budget, MAX_EXPANSION};
use crate::model::{Coordinates, Geometry, GridAxis, Location, RawField, Values, Variable};
use crate::particle_names;
use crate::registry::{FieldRequest, FileContent};
use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;
use zip::ZipArchive;

/// Most components that a particle's row may have.
const MAX_COMPONENTS: usize = 64;

pub(super) fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let file = File::open(path).map_err(|e| FormatError::io(path, "open", e))?;
    let length = file.metadata().map_err(|e| FormatError::io(path, "open", e))?.len();
    let mut file = BufReader::new(file);
    let mut magic = [0; 6];
    let is_single = file.read_exact(&mut magic).is_ok() && &magic == MAGIC;
    file.rewind().map_err(|e| FormatError::io(path, "read", e))?;
    if is_single {
        let name = request.density.as_deref().unwrap_or("density");
        let array = npy::read(&Place { path, name }, &mut file, length)?;
        return grid(path, request, vec![(name.to_owned(), array)]);
    }
    let mut arrays = archive(path, file, &Budget::new(length))?;
    let facts = match arrays.iter().position(|(name, a)| name == HEADER && matches!(a.content, Content::Text(_))) {
        Some(i) => match arrays.remove(i).1.content {
            Content::Text(text) => text,
            Content::Numbers(_) => String::new(),
        },
        None => String::new(),
    };
    if assemble::are_particles(arrays.iter().map(|(name, _)| name.as_str())) {
        return particles(path, arrays, &facts);
    }
    grid(path, request, arrays)
}

/// All arrays of an archive, by name without `.npy`.
fn archive(path: &Path, file: BufReader<File>, budget: &Budget) -> Result<Vec<(String, Array)>> {
    let damaged = |problem: String| FormatError::input(path, NAME, "archive", problem);
    let mut archive = ZipArchive::new(file)
        .map_err(|e| damaged(format!("it is no NumPy archive, or its list of contents is damaged: {e}")))?;
    let mut arrays = Vec::new();
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).map_err(|e| damaged(format!("entry {i} cannot be read: {e}")))?;
        let name = entry.name().map_err(|e| damaged(format!("entry {i} has no name: {e}")))?.into_owned();
        let Some(name) = name.strip_suffix(".npy") else { continue };
        let place = Place { path, name };
        let possible = entry.compressed_size().saturating_mul(MAX_EXPANSION).min(entry.size());
        budget.take(path, NAME, &format!("array '{name}'"), possible)?;
        let array = npy::read(&place, &mut entry, possible)?;
        // The checksum is compared at the end of an entry only.
        match entry.read(&mut [0]) {
            Ok(0) => arrays.push((name.to_owned(), array)),
            Ok(_) => return Err(place.error("has more values than its shape says")),
            Err(e) => return Err(place.error(format!("its archive is damaged: {e}"))),
        }
    }
    Ok(arrays)
}

fn particles(path: &Path, arrays: Vec<(String, Array)>, facts: &str) -> Result<FileContent> {
    let lines: Vec<(&str, String)> =
        facts.lines().filter_map(|l| l.split_once(": ")).map(|(k, v)| (k, unescaped(v))).collect();
    let mut facts = Facts::new(lines.iter().map(|(k, v)| (*k, v.as_str())));
    let unit = |name: &str| lines.iter().find(|(k, _)| k.strip_prefix("unit ") == Some(name)).map(|(_, v)| v.as_str());
    let is_position = |name: &str| {
        name.eq_ignore_ascii_case("x") || particle_names::standard(name) == Some(particle_names::COORDINATES)
    };
    let count = arrays.iter().find(|(n, _)| is_position(n)).and_then(|(_, a)| a.shape.first().copied()).unwrap_or(0);
    let mut named = Vec::new();
    for (name, array) in arrays {
        let (rows, components) = match *array.shape.as_slice() {
            [rows] => (rows, 1),
            [rows, components] => (rows, components),
            _ => (usize::MAX, 0),
        };
        match array.content {
            Content::Numbers(values) if rows == count && (1..=MAX_COMPONENTS).contains(&components) => {
                let values = if array.fortran { transposed(&values, &[rows, components]) } else { values };
                let unit = unit(&name).and_then(crate::units::Unit::parse);
                named.push(Named { name, components, values, unit });
            }
            _ => facts.provenance.push((
                "not read".into(),
                format!("array '{name}' of shape {:?}, which is not a column of {count} particles", array.shape),
            )),
        }
    }
    let file = assemble::particles(count, named, facts);
    file.map(FileContent::Particles).map_err(|(at, problem)| FormatError::input(path, NAME, at, problem))
}

/// Arrays of one shape as a grid in the box from 0 to 1.
fn grid(path: &Path, request: &FieldRequest, arrays: Vec<(String, Array)>) -> Result<FileContent> {
    let listed: Vec<String> = arrays.iter().map(|(n, a)| format!("{n} {:?}", a.shape)).collect();
    let error = |problem: String| FormatError::input(path, NAME, "arrays", problem);
    let is_density = |n: &str| particle_names::standard(n) == Some(particle_names::DENSITY);
    let fits = |a: &Array| (1..=3).contains(&used(&a.shape).len()) && matches!(a.content, Content::Numbers(_));
    // Positions along an axis.
    let is_line = |n: &str| ["x", "y", "z"].contains(&n) || Along::named(n).is_some();
    let wanted = match &request.density {
        Some(name) => arrays.iter().find(|(n, _)| n == name),
        None => arrays
            .iter()
            .find(|(n, a)| is_density(n) && fits(a))
            .or_else(|| arrays.iter().find(|(n, a)| fits(a) && !is_line(n))),
    };
    let Some((name, array)) = wanted.filter(|(_, a)| fits(a)) else {
        let problem = format!(
            "expected particles (Coordinates or x, y, z, with Masses) or an array of 1 to 3 dimensions; the file has {}",
            listed.join(", ")
        );
        return Err(error(problem));
    };
    let shape = array.shape.clone();
    let candidates = arrays.iter().filter(|(n, a)| a.shape == shape && fits(a) && !is_line(n)).count();
    let density = (request.density.is_some() || is_density(name) || candidates == 1).then(|| name.clone());
    let found = axes(path, &arrays, (name, &shape))?;
    let (geometry, named) = (found.geometry, found.names);
    let mut notes = vec![match named.as_slice() {
        [] => "the array is a grid of equal cells in the box from 0 to 1, its first index along x".to_owned(),
        some => format!("the axes are those of the arrays {}", some.join(", ")),
    }];
    notes.extend(found.notes);
    let is_axis = |n: &String| named.contains(n);
    let others: Vec<&String> = arrays.iter().filter(|(n, a)| a.shape != shape && !is_axis(n)).map(|(n, _)| n).collect();
    if !others.is_empty() {
        notes.push(format!("arrays of other shapes were left out: {others:?}"));
    }
    let mut variables = Vec::new();
    for (name, array) in arrays.into_iter().filter(|(n, a)| a.shape == shape && !is_axis(n)) {
        let carried = request.carry.as_ref().is_none_or(|names| names.contains(&name));
        let Content::Numbers(values) = array.content else { continue };
        if !carried && density.as_ref() != Some(&name) {
            continue;
        }
        // In a grid the first axis runs fastest, which is NumPy's order in Fortran's way only.
        let reversed: Vec<usize> = shape.iter().rev().copied().collect();
        let values = if array.fortran { values } else { transposed(&values, &reversed) };
        variables.push(Variable {
            name,
            description: None,
            unit: None,
            location: Location::Node,
            components: 1,
            values,
        });
    }
    Ok(FileContent::Field(RawField {
        path: path.into(),
        format: NAME,
        geometry,
        variables,
        density,
        metadata: Vec::new(),
        notes,
    }))
}

/// Where the values of a grid are.
struct Axes {
    geometry: Geometry,
    /// Arrays that they come from.
    names: Vec<String>,
    notes: Vec<String>,
}

/// By the arrays `x`, `y`, `z`, or those of other coordinates, where they fit the shape of a grid; else equal cells from 0 to 1.
fn axes(path: &Path, arrays: &[(String, Array)], (field, shape): (&str, &[usize])) -> Result<Axes> {
    let counts = used(shape);
    let wrong = |name: &str, problem: String| FormatError::input(path, NAME, format!("array '{name}'"), problem);
    let line = |(name, array): &(String, Array)| match (&array.content, array.shape.as_slice()) {
        (Content::Numbers(values), [n]) if name != field => Some((name.clone(), *n, values.to_f64())),
        _ => None,
    };
    let lines: Vec<(String, usize, Vec<f64>)> = arrays.iter().filter_map(line).collect();
    let flat = shape.iter().zip(["x", "y", "z"]).filter(|(n, _)| **n > 1).map(|(_, name)| name).collect::<Vec<_>>();
    let straight: Vec<Option<usize>> = flat.iter().map(|axis| lines.iter().position(|l| l.0 == *axis)).collect();
    let turned = curved_lines(&lines, &counts);
    let Some(places) = straight.iter().copied().collect::<Option<Vec<usize>>>().or(turned) else {
        if let Some(k) = straight.iter().position(Option::is_some) {
            let problem = format!("there are positions along {} only, expected them along all axes", flat[k]);
            return Err(FormatError::input(path, NAME, "arrays", problem));
        }
        // What looks like the nodes or the faces of an axis.
        let fits = |(_, n, v): &(String, usize, Vec<f64>)| {
            counts.len() > 1 && counts.iter().any(|c| n == c || *n == c + 1) && v.is_sorted_by(|a, b| a < b)
        };
        if let Some((name, n, _)) = lines.iter().find(|l| fits(l)) {
            let problem = format!(
                "has {n} ascending values, as if it were an axis of '{field}' {shape:?}; name the axes x, y, z, or r, theta, phi, or R, phi, z, or R, z, in the \
                 order of the indices, or leave the array out for equal cells from 0 to 1"
            );
            return Err(wrong(name, problem));
        }
        let axes = counts.iter().zip(["x", "y", "z"]).map(|(&n, name)| axis(name, n)).collect();
        let geometry = Geometry::Grid { coordinates: Coordinates::Cartesian, axes };
        return Ok(Axes { geometry, names: Vec::new(), notes: Vec::new() });
    };
    let mut axes = Vec::new();
    for (&place, &n) in places.iter().zip(&counts) {
        let (name, length, values) = &lines[place];
        let (nodes, bounds) = match *length {
            l if l == n => (values.clone(), None),
            l if l == n + 1 => (values.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect(), Some(values.clone())),
            l => {
                let problem = format!("has shape [{l}], expected {n} positions or {} edges of cells", n + 1);
                return Err(wrong(name, problem));
            }
        };
        axes.push(GridAxis { name: name.clone(), nodes, unit: None, bounds });
    }
    let names: Vec<String> = axes.iter().map(|a| a.name.clone()).collect();
    let along: Vec<Along> = names.iter().filter_map(|n| Along::named(n)).collect();
    let (geometry, notes) = match along.as_slice() {
        [Along::Radius] => {
            let GridAxis { name, nodes, bounds, .. } = axes.swap_remove(0);
            if bounds.is_some() {
                let problem =
                    format!("has {} radii for {} values, expected a radius for each", nodes.len() + 1, nodes.len());
                return Err(wrong(&name, problem));
            }
            (Geometry::Radial { nodes, unit: None }, Vec::new())
        }
        some if some.len() == names.len() && some != [Along::Z] => {
            let (coordinates, axes, notes) =
                complete(some.iter().copied().zip(axes).collect()).map_err(|(name, problem)| wrong(&name, problem))?;
            (Geometry::Grid { coordinates, axes }, notes)
        }
        _ => (Geometry::Grid { coordinates: Coordinates::Cartesian, axes }, Vec::new()),
    };
    Ok(Axes { geometry, names, notes })
}

/// Arrays of other coordinates than x, y and z, one for each index, whose order is that of the indices.
fn curved_lines(lines: &[(String, usize, Vec<f64>)], counts: &[usize]) -> Option<Vec<usize>> {
    const ORDERS: [&[Along]; 6] = [
        &[Along::Radius, Along::Colatitude, Along::Azimuth],
        &[Along::Radius, Along::Azimuth, Along::Z],
        &[Along::Radius, Along::Z, Along::Azimuth],
        &[Along::Radius, Along::Colatitude],
        &[Along::Radius, Along::Azimuth],
        &[Along::Radius, Along::Z],
    ];
    let fits = |n: usize, count: usize| n == count || n == count + 1;
    let place = |along: Along, count: usize| {
        lines.iter().position(|(name, n, _)| Along::named(name) == Some(along) && fits(*n, count))
    };
    let all = |order: &[Along]| -> Option<Vec<usize>> {
        (order.len() == counts.len()).then(|| order.iter().zip(counts).map(|(a, n)| place(*a, *n)).collect())?
    };
    // In one dimension a radius.
    if counts.len() == 1 { all(&[Along::Radius]) } else { ORDERS.iter().find_map(|order| all(order)) }
}

/// The axes that span something.
fn used(shape: &[usize]) -> Vec<usize> {
    if shape.contains(&0) { Vec::new() } else { shape.iter().copied().filter(|&n| n > 1).collect() }
}

fn axis(name: &str, n: usize) -> GridAxis {
    let cell = 1.0 / n as f64;
    GridAxis {
        name: name.into(),
        nodes: (0..n).map(|i| (i as f64 + 0.5) * cell).collect(),
        unit: None,
        bounds: Some((0..=n).map(|i| i as f64 / n as f64).collect()),
    }
}

/// From the order in which the first index of `shape` runs fastest to the one in which the last does.
fn transposed(values: &Values, shape: &[usize]) -> Values {
    fn reorder<T: Copy>(v: &[T], shape: &[usize]) -> Vec<T> {
        let source = |mut flat: usize| {
            // Digits of the target index, the last fastest; strides of the source, the first fastest.
            let mut index = 0;
            let mut stride: usize = shape.iter().product();
            for &n in shape.iter().rev() {
                stride /= n.max(1);
                index += flat % n.max(1) * stride;
                flat /= n.max(1);
            }
            index
        };
        (0..v.len()).filter_map(|flat| v.get(source(flat)).copied()).collect()
    }
    match values {
        Values::F32(v) => Values::F32(reorder(v, shape)),
        Values::F64(v) => Values::F64(reorder(v, shape)),
        Values::I64(v) => Values::I64(reorder(v, shape)),
    }
}
