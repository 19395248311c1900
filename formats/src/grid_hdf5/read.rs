//! Which code's file it is, and what both come to.

use super::{SPEC, athena, pluto};
use crate::common::hdf5_read::Reader;
use crate::common::wanted::wanted;
use crate::error::{FormatError, Result};
use crate::model::{Coordinates, Geometry, GridAxis, Location, RawField, Values, Variable};
use crate::registry::{FieldRequest, FileContent};
use std::path::Path;

/// Names of the density, in the order of trust.
pub const DENSITY_NAMES: [&str; 3] = ["rho", "dens", "density"];

/// A grid as both codes have it.
pub struct Mesh {
    pub geometry: Geometry,
    pub location: Location,
    /// Names of all variables.
    pub names: Vec<String>,
    pub metadata: Vec<(String, String)>,
    pub notes: Vec<String>,
}

/// Reads a grid.
///
/// # Errors
/// [`FormatError::Input`] where the file is neither code's or contradicts itself, [`FormatError::Unsupported`] for refined
/// and curvilinear grids, [`FormatError::Limit`], [`FormatError::Io`].
pub fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let file = Reader::open(path, SPEC.name)?;
    let (groups, datasets) = (file.groups()?, file.datasets("/")?);
    let has = |name: &str| datasets.iter().any(|d| d == name);
    let (mesh, variables, density) = if has("LogicalLocations") {
        let blocks = athena::Blocks::open(&file, path)?;
        let mesh = blocks.mesh()?;
        let (names, density) = chosen(&file, &mesh.names, request)?;
        let variables = names.iter().map(|name| blocks.variable(name)).collect::<Result<Vec<_>>>()?;
        (mesh, variables, density)
    } else if groups.iter().any(|g| g == "node_coords") {
        let step = pluto::Step::open(&file, path, &groups)?;
        let mesh = step.mesh()?;
        let (names, density) = chosen(&file, &mesh.names, request)?;
        let variables = names.iter().map(|name| step.variable(name)).collect::<Result<Vec<_>>>()?;
        (mesh, variables, density)
    } else if groups.iter().any(|g| g == "level_0") {
        return Err(unsupported(path, "a refined grid in Chombo's layout; resample it to one level first"));
    } else if has("bounding box") && has("refine level") {
        return Err(unsupported(
            path,
            "FLASH's tree of blocks; resample it to one level first, as yt's covering_grid does",
        ));
    } else {
        return Err(file.input(
            "group '/'",
            "there are neither LogicalLocations (Athena++) nor node_coords (PLUTO); name another format with --format",
        ));
    };
    Ok(FileContent::Field(RawField {
        path: path.into(),
        format: SPEC.name,
        geometry: mesh.geometry,
        variables: variables
            .into_iter()
            .map(|(name, values)| Variable {
                name,
                description: None,
                unit: None,
                location: mesh.location,
                components: 1,
                values,
            })
            .collect(),
        density,
        metadata: mesh.metadata,
        notes: mesh.notes,
    }))
}

pub fn unsupported(path: &Path, what: impl Into<String>) -> FormatError {
    FormatError::Unsupported { path: path.into(), format: SPEC.name, what: what.into() }
}

/// The variables to read, and which is the density.
fn chosen(file: &Reader, names: &[String], request: &FieldRequest) -> Result<(Vec<String>, Option<String>)> {
    wanted(names, request, &DENSITY_NAMES).map_err(|(location, problem)| file.input(location, problem))
}

/// A Cartesian grid over the faces of its cells; axes of one cell are left out.
pub fn grid(path: &Path, faces: Vec<Vec<f64>>) -> Result<Geometry> {
    let middle = |w: &[f64]| 0.5 * (w[0] + w[1]);
    let axes: Vec<GridAxis> = faces
        .into_iter()
        .zip(["x", "y", "z"])
        .filter(|(faces, _)| faces.len() > 2)
        .map(|(faces, name)| GridAxis {
            name: name.into(),
            nodes: faces.windows(2).map(middle).collect(),
            unit: None,
            bounds: Some(faces),
        })
        .collect();
    if axes.is_empty() {
        return Err(unsupported(path, "a single cell, in which nothing can be placed"));
    }
    Ok(Geometry::Grid { coordinates: Coordinates::Cartesian, axes })
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
