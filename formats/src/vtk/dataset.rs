//! The contents of a file of either syntax, and their conversion to a raw field.

use super::schema::NAME;
use crate::error::{FormatError, Result};
use crate::model::{Cells, Coordinates, Geometry, GridAxis, Location, RawField, Values, Variable};
use crate::nearest::did_you_mean;
use crate::registry::FieldRequest;
use std::path::Path;

/// One data array.
pub(super) struct DataArray {
    pub name: String,
    pub components: usize,
    pub values: Values,
}

/// The points of a dataset and how they are connected.
pub(super) enum Shape {
    /// Node positions along x, y, z, any direction.
    Axes([Vec<f64>; 3]),
    /// Curvilinear grid.
    Structured { dimensions: [usize; 3], points: Vec<[f64; 3]> },
    /// Cells in VTK's types.
    Cells { points: Vec<[f64; 3]>, cells: Cells },
}

pub(super) struct Dataset {
    pub shape: Shape,
    pub point_data: Vec<DataArray>,
    pub cell_data: Vec<DataArray>,
}

/// Turns a dataset into a field.
pub(super) fn field(path: &Path, dataset: Dataset, request: &FieldRequest) -> Result<RawField> {
    let mut notes = Vec::new();
    let Dataset { shape, point_data, cell_data } = dataset;
    let (geometry, flips) = match shape {
        Shape::Axes(axes) => grid(axes),
        Shape::Structured { dimensions, points } => (structured(path, dimensions, points)?, None),
        Shape::Cells { points, cells } => (mesh(path, points, cells)?, None),
    };
    let mut variables = Vec::new();
    for (location, arrays) in [(Location::Node, point_data), (Location::Cell, cell_data)] {
        for array in arrays {
            let places = geometry.count(location);
            // Both counts are the file's own statements: their product may be anything.
            if array.components == 0 || places.checked_mul(array.components) != Some(array.values.len()) {
                return Err(FormatError::input(
                    path,
                    NAME,
                    format!("array '{}'", array.name),
                    format!(
                        "has {} values, expected {} for each of {places} {}",
                        array.values.len(),
                        array.components,
                        if location == Location::Node { "points" } else { "cells" }
                    ),
                ));
            }
            let values = match &flips {
                Some(flips) => flips.apply(location, array.components, array.values),
                None => array.values,
            };
            variables.push(Variable {
                name: unused_name(array.name, &variables, &mut notes),
                description: None,
                unit: None,
                location,
                components: array.components,
                values,
            });
        }
    }
    let density = density(path, &variables, request, &mut notes)?;
    if let Some(carry) = &request.carry {
        variables.retain(|v| carry.contains(&v.name) || density.as_ref() == Some(&v.name));
    }
    Ok(RawField { path: path.into(), format: NAME, geometry, variables, density, metadata: Vec::new(), notes })
}

/// The name, or one made from it where point and cell data share it: it could not be chosen otherwise.
fn unused_name(name: String, variables: &[Variable], notes: &mut Vec<String>) -> String {
    let mut unused = name.clone();
    for count in 2.. {
        if variables.iter().all(|v| v.name != unused) {
            break;
        }
        unused = format!("{name}_{count}");
    }
    if unused != name {
        notes.push(format!("there are several arrays '{name}'; a later one is called '{unused}'"));
    }
    unused
}

fn density(
    path: &Path,
    variables: &[Variable],
    request: &FieldRequest,
    notes: &mut Vec<String>,
) -> Result<Option<String>> {
    let scalars: Vec<&Variable> = variables.iter().filter(|v| v.components == 1).collect();
    if let Some(name) = &request.density {
        if scalars.iter().any(|v| v.name == *name) {
            return Ok(Some(name.clone()));
        }
        let known: Vec<_> = scalars.iter().map(|v| v.name.as_str()).collect();
        return Err(FormatError::input(
            path,
            NAME,
            format!("array '{name}'"),
            format!(
                "is not a scalar of the file, which has {}{}",
                known.join(", "),
                did_you_mean(name, known.iter().copied())
            ),
        ));
    }
    const NAMES: [&str; 4] = ["density", "rho", "mass_density", "dens"];
    if let Some(v) = scalars.iter().find(|v| NAMES.contains(&v.name.to_ascii_lowercase().as_str())) {
        return Ok(Some(v.name.clone()));
    }
    if let [one] = scalars.as_slice() {
        notes.push(format!("'{}' is taken as the density, being the only scalar", one.name));
        return Ok(Some(one.name.clone()));
    }
    Ok(None)
}

/// Axes that ran downwards, with the lengths of all kept ones.
struct Flips {
    nodes: Vec<usize>,
    flipped: Vec<bool>,
}

impl Flips {
    fn apply(&self, location: Location, components: usize, values: Values) -> Values {
        if !self.flipped.contains(&true) {
            return values;
        }
        match values {
            Values::F32(v) => Values::F32(self.turn(location, components, &v)),
            Values::F64(v) => Values::F64(self.turn(location, components, &v)),
            Values::I64(v) => Values::I64(self.turn(location, components, &v)),
        }
    }

    fn turn<T: Copy>(&self, location: Location, components: usize, values: &[T]) -> Vec<T> {
        let less = usize::from(location == Location::Cell);
        let shape: Vec<usize> = self.nodes.iter().map(|n| n.saturating_sub(less).max(1)).collect();
        let count: usize = shape.iter().product();
        let mut out = Vec::with_capacity(values.len());
        for flat in 0..count {
            let (mut rest, mut from, mut stride) = (flat, 0, 1);
            for (&n, &flip) in shape.iter().zip(&self.flipped) {
                let i = rest % n;
                rest /= n;
                from += stride * if flip { n - 1 - i } else { i };
                stride *= n;
            }
            out.extend_from_slice(&values[from * components..(from + 1) * components]);
        }
        out
    }
}

/// Axes of one node are dropped, so that an image is two-dimensional.
fn grid(axes: [Vec<f64>; 3]) -> (Geometry, Option<Flips>) {
    let mut kept = Vec::new();
    let mut flips = Flips { nodes: Vec::new(), flipped: Vec::new() };
    for (mut nodes, name) in axes.into_iter().zip(["x", "y", "z"]) {
        if nodes.len() > 1 {
            let down = nodes[0] > nodes[nodes.len() - 1];
            if down {
                nodes.reverse();
            }
            flips.nodes.push(nodes.len());
            flips.flipped.push(down);
            kept.push(GridAxis { name: name.into(), nodes, unit: None, bounds: None });
        }
    }
    (Geometry::Grid { coordinates: Coordinates::Cartesian, axes: kept }, Some(flips))
}

/// A curvilinear grid as hexahedra, or quadrilaterals where one direction has a single node.
fn structured(path: &Path, dimensions: [usize; 3], points: Vec<[f64; 3]>) -> Result<Geometry> {
    let wide: Vec<usize> = (0..3).filter(|&k| dimensions[k] > 1).collect();
    let strides = [1, dimensions[0], dimensions[0] * dimensions[1]];
    let (kind, corners): (u8, Vec<usize>) = match wide.as_slice() {
        &[a, b] => (9, vec![0, strides[a], strides[a] + strides[b], strides[b]]),
        [_, _, _] => {
            let (x, y, z) = (strides[0], strides[1], strides[2]);
            (12, vec![0, x, x + y, y, z, x + z, x + y + z, y + z])
        }
        _ => {
            return Err(FormatError::Unsupported {
                path: path.into(),
                format: NAME,
                what: format!("a structured grid of {dimensions:?} points, which encloses nothing"),
            });
        }
    };
    let cells_along = dimensions.map(|n| n.saturating_sub(1).max(1));
    let mut cells = Cells { offsets: vec![0], ..Cells::default() };
    for k in 0..cells_along[2] {
        for j in 0..cells_along[1] {
            for i in 0..cells_along[0] {
                let at = i * strides[0] + j * strides[1] + k * strides[2];
                cells.connectivity.extend(corners.iter().map(|c| at + c));
                cells.offsets.push(cells.connectivity.len());
                cells.types.push(kind);
            }
        }
    }
    let dimension = if wide.len() == 2 && is_flat(&points) { 2 } else { 3 };
    if wide.len() == 2 && dimension == 3 {
        return Err(FormatError::Unsupported {
            path: path.into(),
            format: NAME,
            what: "a surface in space, which encloses nothing".into(),
        });
    }
    Ok(Geometry::Mesh { dimension, points, unit: None, cells })
}

fn is_flat(points: &[[f64; 3]]) -> bool {
    points.windows(2).all(|w| w[0][2] == w[1][2])
}

fn mesh(path: &Path, points: Vec<[f64; 3]>, mut cells: Cells) -> Result<Geometry> {
    let dimension = if is_flat(&points) { 2 } else { 3 };
    if cells.types.iter().all(|t| matches!(t, 1 | 2)) {
        return Ok(Geometry::Cloud { dimension, points, unit: None });
    }
    for (c, kind) in cells.types.iter_mut().enumerate() {
        let ends = (cells.offsets.get(c).copied(), cells.offsets.get(c + 1).copied());
        let nodes = match ends {
            (Some(a), Some(b)) => cells.connectivity.get_mut(a..b),
            _ => None,
        };
        // Pixels and voxels number their corners by axis, quadrilaterals and hexahedra around a face.
        match (*kind, nodes) {
            (8, Some(n)) if n.len() == 4 => {
                n.swap(2, 3);
                *kind = 9;
            }
            (11, Some(n)) if n.len() == 8 => {
                n.swap(2, 3);
                n.swap(6, 7);
                *kind = 12;
            }
            _ => {}
        }
    }
    let mut unknown: Vec<u8> =
        cells.types.iter().copied().filter(|t| !matches!(t, 3 | 5 | 9 | 10 | 12 | 13 | 14)).collect();
    unknown.sort_unstable();
    unknown.dedup();
    if !unknown.is_empty() {
        return Err(FormatError::Unsupported {
            path: path.into(),
            format: NAME,
            what: format!(
                "cells of VTK types {unknown:?}; known are triangles, quads, tetrahedra, hexahedra, wedges and pyramids"
            ),
        });
    }
    Ok(Geometry::Mesh { dimension, points, unit: None, cells })
}

/// Triples of coordinates.
pub(super) fn triples(values: &Values) -> Vec<[f64; 3]> {
    (0..values.len() / 3).map(|i| std::array::from_fn(|k| values.get(3 * i + k))).collect()
}
