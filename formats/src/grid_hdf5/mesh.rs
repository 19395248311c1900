//! The representation of a grid that both codes share, and how its parts are built.

use super::schema::NAME;
use crate::error::{FormatError, Result};
use crate::model::{Coordinates, Geometry, GridAxis, Location, Values};
use crate::units::UnitSystem;
use std::path::Path;

/// A grid, its values not yet read.
pub struct Mesh {
    pub geometry: Geometry,
    pub location: Location,
    /// Names of all variables.
    pub names: Vec<String>,
    pub metadata: Vec<(String, String)>,
    /// In which the numbers are, where the file or its code says so.
    pub units: Option<UnitSystem>,
    pub notes: Vec<String>,
}

pub fn unsupported(path: &Path, what: impl Into<String>) -> FormatError {
    FormatError::Unsupported { path: path.into(), format: NAME, what: what.into() }
}

/// A grid over the faces of its cells; Cartesian axes of one cell are left out.
pub fn grid(path: &Path, coordinates: Coordinates, faces: Vec<Vec<f64>>) -> Result<Geometry> {
    let names = match coordinates {
        Coordinates::Spherical => ["r", "theta", "phi"],
        Coordinates::Polar => ["R", "phi", "z"],
        Coordinates::Cylindrical => ["R", "z", "phi"],
        Coordinates::Cartesian | Coordinates::Geographic => ["x", "y", "z"],
    };
    if faces.iter().all(|faces| faces.len() <= 2) {
        return Err(unsupported(path, "a single cell, in which nothing can be placed"));
    }
    let middle = |w: &[f64]| 0.5 * (w[0] + w[1]);
    let axes: Vec<GridAxis> = faces
        .into_iter()
        .zip(names)
        .filter(|(faces, _)| faces.len() > 2 || coordinates.is_curvilinear())
        .map(|(faces, name)| GridAxis {
            name: name.into(),
            nodes: faces.windows(2).map(middle).collect(),
            unit: None,
            bounds: Some(faces),
        })
        .collect();
    Ok(Geometry::Grid { coordinates, axes })
}

/// The values at `sources`, in this order.
pub fn gathered(values: &Values, sources: impl Iterator<Item = usize>) -> Values {
    fn take<T: Copy>(v: &[T], sources: impl Iterator<Item = usize>) -> Vec<T> {
        sources.filter_map(|i| v.get(i).copied()).collect()
    }
    match values {
        Values::F32(v) => Values::F32(take(v, sources)),
        Values::F64(v) => Values::F64(take(v, sources)),
        Values::I64(v) => Values::I64(take(v, sources)),
    }
}
