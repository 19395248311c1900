//! Recognizes which code wrote the file, and builds a field from it.

use super::mesh::unsupported;
use super::schema::{DENSITY_NAMES, NAME};
use super::{athena, flash, pluto};
use crate::common::hdf5_read::Reader;
use crate::common::wanted::wanted;
use crate::error::Result;
use crate::model::{RawField, Variable};
use crate::registry::{FieldRequest, FileContent};
use std::path::Path;

/// Reads a grid.
///
/// # Errors
/// [`FormatError::Input`] where the file is neither code's or contradicts itself, [`FormatError::Unsupported`] for grids of
/// other kinds, [`FormatError::Limit`], [`FormatError::Io`].
pub fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let file = Reader::open(path, NAME)?;
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
        let tree = flash::Blocks::open(&file, path, datasets)?;
        let mesh = tree.mesh()?;
        let (names, density) = chosen(&file, &mesh.names, request)?;
        let variables = names.iter().map(|name| tree.variable(name)).collect::<Result<Vec<_>>>()?;
        (mesh, variables, density)
    } else {
        return Err(file.input(
            "group '/'",
            "there are neither LogicalLocations (Athena++) nor node_coords (PLUTO) nor a bounding box and refine level (FLASH); name another format with --format",
        ));
    };
    Ok(FileContent::Field(RawField {
        path: path.into(),
        format: NAME,
        geometry: mesh.geometry,
        variables: variables
            .into_iter()
            .map(|(name, values)| Variable {
                unit: mesh.units.as_ref().and_then(|system| flash::unit(system, &name)),
                name,
                description: None,
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

/// The variables to read, and which is the density.
fn chosen(file: &Reader, names: &[String], request: &FieldRequest) -> Result<(Vec<String>, Option<String>)> {
    wanted(names, request, &DENSITY_NAMES).map_err(|(location, problem)| file.input(location, problem))
}
