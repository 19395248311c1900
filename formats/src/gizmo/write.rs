//! Writes GIZMO initial conditions.

use super::schema::FLAVOR;
use crate::common::snapshot;
use crate::error::Result;
use crate::model::ParticleFile;
use crate::registry::WriteOptions;
use crate::stream::Piece;
use std::path::Path;

/// Writes `particles` to `path`.
///
/// # Errors
/// [`crate::FormatError::Output`] where GIZMO could not read them, [`crate::FormatError::Io`].
pub fn write(path: &Path, particles: &ParticleFile, options: WriteOptions) -> Result<()> {
    snapshot::write(&FLAVOR, path, particles, options)
}

/// Writes one of several files, or of more particles than memory holds.
///
/// # Errors
/// As [`write`], and those of the stream.
pub fn write_piece(piece: &Piece<'_>, options: WriteOptions) -> Result<()> {
    snapshot::write_piece(&FLAVOR, piece, options)
}
