//! Reads any VTK file into particles or a raw field.

use super::dataset::field;
use super::schema::NAME;
use super::{legacy, particles, xml};
use crate::error::{FormatError, Result};
use crate::registry::{FieldRequest, FileContent};
use std::path::Path;

pub(super) fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let bytes = std::fs::read(path).map_err(|e| FormatError::io(path, "read", e))?;
    if bytes.is_empty() {
        return Err(FormatError::input(path, NAME, "file", "is empty"));
    }
    let dataset = if bytes.starts_with(b"#") { legacy::read(path, &bytes)? } else { xml::read(path, &bytes)? };
    if particles::are_particles(&dataset) {
        return particles::particles(path, dataset, &bytes).map(FileContent::Particles);
    }
    drop(bytes);
    field(path, dataset, request).map(FileContent::Field)
}
