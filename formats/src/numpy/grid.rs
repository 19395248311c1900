//! Finds grids among the arrays of a file, and where their values are.

use super::npy::{Array, Content, transposed};
use super::schema::NAME;
use crate::common::curvilinear::{Along, complete};
use crate::error::{FormatError, Result};
use crate::model::{Coordinates, Geometry, GridAxis, Location, RawField, Values, Variable, WITHOUT_AXES};
use crate::particle_names;
use crate::registry::{FieldRequest, FileContent};
use std::path::Path;

/// Arrays of one shape as a grid in the box from 0 to 1.
pub(super) fn grid(path: &Path, request: &FieldRequest, arrays: Vec<(String, Array)>) -> Result<FileContent> {
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
    // A grid of vectors alone.
    let vectors = || arrays.iter().find(|(_, a)| is_of_vectors(a)).filter(|_| request.density.is_none());
    let Some((name, array)) = wanted.filter(|(_, a)| fits(a)).or_else(vectors) else {
        let problem = format!(
            "expected particles (Coordinates or x, y, z, with Masses) or an array of 1 to 3 dimensions; the file has {}",
            listed.join(", ")
        );
        return Err(error(problem));
    };
    let shape = if fits(array) { array.shape.clone() } else { array.shape[..3].to_vec() };
    let candidates = arrays.iter().filter(|(n, a)| a.shape == shape && fits(a) && !is_line(n)).count();
    let density = (request.density.is_some() || is_density(name) || candidates == 1).then(|| name.clone());
    let found = axes(path, &arrays, (name, &shape))?;
    let (mut geometry, named) = (found.geometry, found.names);
    let mut notes = vec![match named.as_slice() {
        [] => "the array is a grid of equal cells, its first index along x, in the box from 0 to 1 unless another is stated"
            .to_owned(),
        some => format!("the axes are those of the arrays {}", some.join(", ")),
    }];
    notes.extend(found.notes);
    let is_inward = turn_inward(&mut geometry, &mut notes);
    let is_axis = |n: &String| named.contains(n);
    // Beside averages within shells there may be values at their faces.
    let faces = match &geometry {
        Geometry::Radial { nodes, .. } if used(&shape) != [nodes.len()] => Some(nodes.len()),
        _ => None,
    };
    let is_at_faces = |shape: &[usize]| faces.is_some_and(|faces| *shape == [faces]);
    let is_other =
        |(n, a): &&(String, Array)| components(&a.shape, &shape).is_none() && !is_axis(n) && !is_at_faces(&a.shape);
    let others: Vec<&String> = arrays.iter().filter(is_other).map(|(n, _)| n).collect();
    if !others.is_empty() {
        notes.push(format!("arrays of other shapes were left out: {others:?}"));
    }
    let mut variables = Vec::new();
    for (name, array) in arrays.into_iter().filter(|(n, _)| !is_axis(n)) {
        let at_faces = is_at_faces(&array.shape);
        let Some(components) = components(&array.shape, &shape).or(at_faces.then_some(1)) else { continue };
        let carried = request.carry.as_ref().is_none_or(|names| names.contains(&name));
        let Content::Numbers(values) = array.content else { continue };
        if !carried && density.as_ref() != Some(&name) {
            continue;
        }
        let values = if array.fortran { values } else { transposed(&values, &reversed(&array.shape)) };
        // Components, the last index, run slowest now, and are to run fastest.
        let values = match components {
            1 => values,
            n => transposed(&values, &[values.len() / n, n]),
        };
        let values = if is_inward { turned(&values, components) } else { values };
        let location = if faces.is_some() && !at_faces { Location::Cell } else { Location::Node };
        variables.push(Variable { name, description: None, unit: None, location, components, values });
    }
    Ok(FileContent::Field(RawField {
        path: path.into(),
        format: NAME,
        geometry,
        variables,
        density,
        metadata: if named.is_empty() { vec![(WITHOUT_AXES.to_owned(), String::new())] } else { Vec::new() },
        notes,
    }))
}

/// Turns radii of a profile around that run inward; whether they did.
fn turn_inward(geometry: &mut Geometry, notes: &mut Vec<String>) -> bool {
    let Geometry::Radial { nodes, .. } = geometry else { return false };
    let is_inward = nodes.first() > nodes.last();
    if is_inward {
        nodes.reverse();
        notes.push("the radii run inward; they and all values were turned around".into());
    }
    is_inward
}

/// Rows of so many components in the opposite order.
fn turned(values: &Values, components: usize) -> Values {
    fn rows<T: Copy>(values: &[T], components: usize) -> Vec<T> {
        values.chunks(components).rev().flatten().copied().collect()
    }
    match values {
        Values::F32(v) => Values::F32(rows(v, components)),
        Values::F64(v) => Values::F64(rows(v, components)),
        Values::I64(v) => Values::I64(rows(v, components)),
    }
}

/// Whether it can be nothing but vectors on a grid in space.
fn is_of_vectors(array: &Array) -> bool {
    matches!(array.shape.as_slice(), [x, y, z, 3] if x.min(y).min(z) > &1)
        && matches!(array.content, Content::Numbers(_))
}

/// Of an array on a grid of `shape`: those of a vector are along its last index. `None` for what is not on that grid.
fn components(array: &[usize], shape: &[usize]) -> Option<usize> {
    match array.strip_prefix(shape)? {
        [] => Some(1),
        [n @ (2 | 3)] => Some(*n),
        _ => None,
    }
}

/// In a grid the first axis runs fastest, which is NumPy's order in Fortran's way only.
fn reversed(shape: &[usize]) -> Vec<usize> {
    shape.iter().rev().copied().collect()
}

/// An array of one index: its name, length and values.
type Line = (String, usize, Vec<f64>);

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
    let lines: Vec<Line> = arrays.iter().filter_map(line).collect();
    let flat = shape.iter().zip(["x", "y", "z"]).filter(|(n, _)| **n > 1).map(|(_, name)| name).collect::<Vec<_>>();
    let straight: Vec<Option<usize>> = flat.iter().map(|axis| lines.iter().position(|l| l.0 == *axis)).collect();
    let turned = curved_lines(&lines, &counts);
    let Some(places) = straight.iter().copied().collect::<Option<Vec<usize>>>().or(turned) else {
        if let Some(k) = straight.iter().position(Option::is_some) {
            let problem = format!("there are positions along {} only, expected them along all axes", flat[k]);
            return Err(FormatError::input(path, NAME, "arrays", problem));
        }
        let radii = lines.iter().find(|line| counts.len() == 1 && Along::named(&line.0) == Some(Along::Radius));
        if let Some((name, length, _)) = radii {
            let problem = format!(
                "has shape [{length}], expected {0} radii of '{field}', or {1} faces",
                counts[0],
                counts[0] + 1
            );
            return Err(wrong(name, problem));
        }
        return equal_cells(&lines, &counts).map_err(|(name, n)| {
            let problem = format!(
                "has {n} ascending values, as if it were an axis of '{field}' {shape:?}; name the axes x, y, z, or r, theta, phi, or R, phi, z, or R, z, in the \
                 order of the indices, or leave the array out for equal cells from 0 to 1"
            );
            wrong(name, problem)
        });
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
    let names = axes.iter().map(|a| a.name.clone()).collect();
    let (geometry, notes) = geometry(axes).map_err(|(name, problem)| wrong(&name, problem))?;
    Ok(Axes { geometry, names, notes })
}

/// From 0 to 1.
///
/// # Errors
/// The name and length of an array that looks like the nodes or the faces of an axis.
fn equal_cells<'a>(lines: &'a [Line], counts: &[usize]) -> std::result::Result<Axes, (&'a str, usize)> {
    let fits = |(_, n, v): &&Line| {
        counts.len() > 1 && counts.iter().any(|c| n == c || *n == c + 1) && v.is_sorted_by(|a, b| a < b)
    };
    if let Some((name, n, _)) = lines.iter().find(fits) {
        return Err((name, *n));
    }
    let axes = counts.iter().zip(["x", "y", "z"]).map(|(&n, name)| axis(name, n)).collect();
    let geometry = Geometry::Grid { coordinates: Coordinates::Cartesian, axes };
    Ok(Axes { geometry, names: Vec::new(), notes: Vec::new() })
}

/// What the names of axes make, with notes.
///
/// # Errors
/// The axis and what is wrong with it.
fn geometry(mut axes: Vec<GridAxis>) -> std::result::Result<(Geometry, Vec<String>), (String, String)> {
    let along: Vec<Along> = axes.iter().filter_map(|a| Along::named(&a.name)).collect();
    match along.as_slice() {
        [Along::Radius] => {
            let GridAxis { name, nodes, bounds, .. } = axes.swap_remove(0);
            match bounds {
                None => Ok((Geometry::Radial { nodes, unit: None }, Vec::new())),
                Some(faces) => {
                    let note = format!("'{name}' has the faces of shells: values are averages within these");
                    Ok((Geometry::Radial { nodes: faces, unit: None }, vec![note]))
                }
            }
        }
        some if some.len() == axes.len() && some != [Along::Z] => {
            let (coordinates, axes, notes) = complete(some.iter().copied().zip(axes).collect())?;
            Ok((Geometry::Grid { coordinates, axes }, notes))
        }
        _ => Ok((Geometry::Grid { coordinates: Coordinates::Cartesian, axes }, Vec::new())),
    }
}

/// Arrays of other coordinates than x, y and z, one for each index, whose order is that of the indices.
fn curved_lines(lines: &[Line], counts: &[usize]) -> Option<Vec<usize>> {
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
