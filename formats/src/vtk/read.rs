//! Reads any VTK file into particles or a raw field.

use super::dataset::field;
use super::schema::NAME;
use super::{ghosts, legacy, particles, pieces, xml};
use crate::error::{FormatError, Result};
use crate::registry::{FieldRequest, FileContent};
use std::path::Path;

pub(super) fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let bytes = std::fs::read(path).map_err(|e| FormatError::io(path, "read", e))?;
    if bytes.is_empty() {
        return Err(FormatError::input(path, NAME, "file", "is empty"));
    }
    if let Some(pieces) = pieces::listed(path, &bytes).transpose() {
        drop(bytes);
        return pieces::particles(path, &pieces?, |piece| read_one(piece, request)).map(FileContent::Particles);
    }
    match (content(path, bytes, request)?, pieces::list_of(path)) {
        // One of several files stands for all of them.
        (FileContent::Particles(_), Some(list)) => read(&list, request),
        (FileContent::Field(mut field), Some(list)) => {
            field
                .notes
                .push(format!("it is one of the pieces that '{}' lists; the others are not read", list.display()));
            Ok(FileContent::Field(field))
        }
        (content, None) => Ok(content),
    }
}

/// Reads a file that lists no others.
fn read_one(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let bytes = std::fs::read(path).map_err(|e| FormatError::io(path, "read", e))?;
    if pieces::listed(path, &bytes)?.is_some() {
        let problem = "it is a list itself; expected a file with particles";
        return Err(FormatError::input(path, NAME, "list of pieces", problem));
    }
    content(path, bytes, request)
}

fn content(path: &Path, bytes: Vec<u8>, request: &FieldRequest) -> Result<FileContent> {
    let dataset = if bytes.starts_with(b"#") { legacy::read(path, &bytes)? } else { xml::read(path, &bytes)? };
    if particles::are_particles(&dataset) {
        return particles::particles(path, dataset, &bytes).map(FileContent::Particles);
    }
    drop(bytes);
    let mut notes = Vec::new();
    let mut field = field(path, ghosts::left_out(path, dataset, &mut notes)?, request)?;
    field.notes.extend(notes);
    Ok(FileContent::Field(field))
}
