//! Particle files that commands are given, and what they must not replace.

use crate::error::{Error, Result};
use crate::run::destination::replaces;
use sph_formats::{FieldRequest, FileContent, FormatSpec, ParticleFile, would_be_lost};
use std::path::Path;

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

/// Refuses an output, given under `key`, that is an input or a piece of one.
///
/// # Errors
/// That it would be replaced.
pub fn refuse_itself(key: &str, output: &Path, input: &Path) -> Result<()> {
    if would_be_lost(input, output) {
        return Err(Error::scene(key, format!("{}; name another", replaces(input, output))));
    }
    Ok(())
}
