//! Reads archives and single arrays.

use super::grid::grid;
use super::npy::{self, Array, Content, Place, transposed};
use super::schema::{HEADER, MAGIC, NAME};
use crate::common::assemble::{self, Named};
use crate::common::facts::{Facts, unescaped};
use crate::error::{FormatError, Result};
use crate::limits::{Budget, MAX_EXPANSION};
use crate::particle_names;
use crate::registry::{FieldRequest, FileContent};
use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;
use zip::ZipArchive;

/// Most components that a particle's row may have.
const MAX_COMPONENTS: usize = 64;

pub(super) fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let file = File::open(path).map_err(|e| FormatError::io(path, "open", e))?;
    let length = file.metadata().map_err(|e| FormatError::io(path, "open", e))?.len();
    let mut file = BufReader::new(file);
    let mut magic = [0; 6];
    let is_single = file.read_exact(&mut magic).is_ok() && &magic == MAGIC;
    file.rewind().map_err(|e| FormatError::io(path, "read", e))?;
    if is_single {
        let name = request.density.as_deref().unwrap_or("density");
        let array = npy::read(&Place { path, name }, &mut file, length)?;
        return grid(path, request, vec![(name.to_owned(), array)]);
    }
    let mut arrays = archive(path, file, &Budget::new(length))?;
    let facts = match arrays.iter().position(|(name, a)| name == HEADER && matches!(a.content, Content::Text(_))) {
        Some(i) => match arrays.remove(i).1.content {
            Content::Text(text) => text,
            Content::Numbers(_) => String::new(),
        },
        None => String::new(),
    };
    if assemble::are_particles(arrays.iter().map(|(name, _)| name.as_str())) {
        return particles(path, arrays, &facts);
    }
    grid(path, request, arrays)
}

/// All arrays of an archive, by name without `.npy`.
fn archive(path: &Path, file: BufReader<File>, budget: &Budget) -> Result<Vec<(String, Array)>> {
    let damaged = |problem: String| FormatError::input(path, NAME, "archive", problem);
    let mut archive = ZipArchive::new(file)
        .map_err(|e| damaged(format!("it is no NumPy archive, or its list of contents is damaged: {e}")))?;
    let mut arrays = Vec::new();
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).map_err(|e| damaged(format!("entry {i} cannot be read: {e}")))?;
        let name = entry.name().map_err(|e| damaged(format!("entry {i} has no name: {e}")))?.into_owned();
        let Some(name) = name.strip_suffix(".npy") else { continue };
        let place = Place { path, name };
        let possible = entry.compressed_size().saturating_mul(MAX_EXPANSION).min(entry.size());
        budget.take(path, NAME, &format!("array '{name}'"), possible)?;
        let array = npy::read(&place, &mut entry, possible)?;
        // The checksum is compared at the end of an entry only.
        match entry.read(&mut [0]) {
            Ok(0) => arrays.push((name.to_owned(), array)),
            Ok(_) => return Err(place.error("has more values than its shape says")),
            Err(e) => return Err(place.error(format!("its archive is damaged: {e}"))),
        }
    }
    Ok(arrays)
}

fn particles(path: &Path, arrays: Vec<(String, Array)>, facts: &str) -> Result<FileContent> {
    let lines: Vec<(&str, String)> =
        facts.lines().filter_map(|l| l.split_once(": ")).map(|(k, v)| (k, unescaped(v))).collect();
    let mut facts = Facts::new(lines.iter().map(|(k, v)| (*k, v.as_str())));
    let unit = |name: &str| lines.iter().find(|(k, _)| k.strip_prefix("unit ") == Some(name)).map(|(_, v)| v.as_str());
    let is_position = |name: &str| {
        name.eq_ignore_ascii_case("x") || particle_names::standard(name) == Some(particle_names::COORDINATES)
    };
    let count = arrays.iter().find(|(n, _)| is_position(n)).and_then(|(_, a)| a.shape.first().copied()).unwrap_or(0);
    let mut named = Vec::new();
    for (name, array) in arrays {
        let (rows, components) = match *array.shape.as_slice() {
            [rows] => (rows, 1),
            [rows, components] => (rows, components),
            _ => (usize::MAX, 0),
        };
        match array.content {
            Content::Numbers(values) if rows == count && (1..=MAX_COMPONENTS).contains(&components) => {
                let values = if array.fortran { transposed(&values, &[rows, components]) } else { values };
                let unit = unit(&name).and_then(crate::units::Unit::parse);
                named.push(Named { name, components, values, unit });
            }
            _ => facts.provenance.push((
                "not read".into(),
                format!("array '{name}' of shape {:?}, which is not a column of {count} particles", array.shape),
            )),
        }
    }
    let file = assemble::particles(count, named, facts);
    file.map(FileContent::Particles).map_err(|(at, problem)| FormatError::input(path, NAME, at, problem))
}
