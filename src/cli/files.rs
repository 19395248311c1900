//! Opens the particle files that commands receive.

use crate::error::{Error, Result};
use sph_formats::{FieldRequest, FileContent, FormatSpec, ParticleFile};
use std::path::Path;

/// The particles of a file; with `is_open`, in a box that is no boundary, whatever the file says.
///
/// # Errors
/// A file that cannot be read, or that holds a field.
pub fn particles_in(formats: &[FormatSpec], path: &Path, format: Option<&str>, is_open: bool) -> Result<ParticleFile> {
    let mut file = particles(formats, path, format)?;
    if is_open {
        file.header.periodic = [false; 3];
    }
    Ok(file)
}

/// The particles of a file.
///
/// # Errors
/// A file that cannot be read, or that holds a field.
pub fn particles(formats: &[FormatSpec], path: &Path, format: Option<&str>) -> Result<ParticleFile> {
    match sph_formats::read(formats, path, format, &FieldRequest::default())? {
        FileContent::Particles(file) => Ok(file),
        FileContent::Field(field) => Err(Error::field(
            path.display().to_string(),
            format!(
                "it holds a {} read by '{}', expected particles with masses; make particles of it with --in and --out",
                field.geometry.kind(),
                field.format
            ),
        )),
    }
}
