//! Writes AREPO initial conditions.

use super::schema::FLAVOR;
use crate::common::snapshot;
use crate::error::Result;
use crate::model::ParticleFile;
use crate::registry::WriteOptions;
use std::path::Path;

/// Writes `particles` to `path`.
///
/// # Errors
/// [`crate::FormatError::Output`] where AREPO could not read them, [`crate::FormatError::Io`].
pub fn write(path: &Path, particles: &ParticleFile, options: WriteOptions) -> Result<()> {
    snapshot::write(&FLAVOR, path, particles, options)
}
