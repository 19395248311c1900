//! Joins the particles of a snapshot that is split over several files.

use crate::error::{FormatError, Result};
use crate::model::{DOUBT_KEY, FILES_KEY, LACKS_KEY, ParticleFile, RunHeader, Species};
use crate::particle_names as names;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Reads the files of a snapshot one after the other and joins them, in this order.
///
/// # Errors
/// Those of `read`; headers that differ; a column that some of the files lack.
pub(crate) fn joined(
    format: &'static str,
    members: &[PathBuf],
    mut read: impl FnMut(&Path) -> Result<ParticleFile>,
) -> Result<ParticleFile> {
    let mut whole: Option<ParticleFile> = None;
    let mut firsts: HashMap<First, &Path> = HashMap::new();
    for member in members {
        let part = read(member)?;
        for species in &part.species {
            let Some(other) = first(species).and_then(|first| firsts.insert(first, member)) else { continue };
            let problem = format!(
                "its first particle of type {} is that of '{}' as well, in its ID and place: one file stands for the other",
                species.part_type,
                other.display()
            );
            return Err(FormatError::input(member, format, "snapshot in several files", problem));
        }
        match &mut whole {
            None => whole = Some(part),
            Some(whole) => {
                append(whole, part).map_err(|(at, problem)| FormatError::input(member, format, at, problem))?
            }
        }
    }
    let (Some(mut whole), Some(first), Some(last)) = (whole, members.first(), members.last()) else {
        return Err(FormatError::input(Path::new(""), format, "snapshot in several files", "there are no files"));
    };
    whole.species.sort_by_key(|s| s.part_type);
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let files = format!("{}: {} to {}", members.len(), name(first), name(last));
    whole.header.provenance.retain(|(key, _)| key != FILES_KEY);
    whole.header.provenance.push((FILES_KEY.into(), files));
    Ok(whole)
}

/// What a file of ours was made from.
const SCENE: &str = "Scene";

/// The first particle of a type in a file: that type, and the bits of its ID and place.
type First = (u8, Vec<u64>);

/// None where there is no particle, or none has an ID.
fn first(species: &Species) -> Option<First> {
    let (ids, places) = (species.table.column(names::PARTICLE_IDS)?, species.table.column(names::COORDINATES)?);
    let place = (0..places.components).map(|k| places.values.get(k));
    (species.table.count > 0)
        .then(|| (species.part_type, std::iter::once(ids.values.get(0)).chain(place).map(f64::to_bits).collect()))
}

/// The scene that a file of ours was made from.
fn scene(header: &RunHeader) -> Option<&str> {
    header.provenance.iter().find(|(key, _)| key == SCENE).map(|(_, text)| text.as_str())
}

/// Location and problem.
type Problem = (String, String);

fn append(whole: &mut ParticleFile, part: ParticleFile) -> std::result::Result<(), Problem> {
    let (a, b) = (&whole.header, &part.header);
    let differs = |what: &str, first: String, here: String| {
        Err((
            "header".to_owned(),
            format!("{what} is {here}, but {first} in the first file; the files are of two snapshots"),
        ))
    };
    if a.dimension != b.dimension {
        return differs("the dimension", a.dimension.to_string(), b.dimension.to_string());
    }
    if a.box_size != b.box_size {
        return differs("the box", format!("{:?}", a.box_size), format!("{:?}", b.box_size));
    }
    if a.time != b.time {
        return differs("the time", a.time.to_string(), b.time.to_string());
    }
    if a.units != b.units {
        return differs("the unit system", format!("{:?}", a.units), format!("{:?}", b.units));
    }
    // Ours say in full what they were made of.
    if scene(a).zip(scene(b)).is_some_and(|(first, here)| first != here) {
        let problem = "the scene that made it is another than that of the first file; the files are of two snapshots";
        return Err(("header".to_owned(), problem.to_owned()));
    }
    for fact in part.header.provenance {
        // What could not be read may differ from file to file.
        let may_differ = ["not read", DOUBT_KEY, LACKS_KEY].contains(&fact.0.as_str());
        if may_differ && !whole.header.provenance.contains(&fact) {
            whole.header.provenance.push(fact);
        }
    }
    whole.header.layouts.extend(part.header.layouts);
    for species in part.species {
        match whole.species.iter_mut().find(|s| s.part_type == species.part_type) {
            Some(known) => append_species(known, species)?,
            None => whole.species.push(species),
        }
    }
    Ok(())
}

fn append_species(known: &mut Species, part: Species) -> std::result::Result<(), Problem> {
    let of_type = |name: &str| format!("column '{name}' of type {}", part.part_type);
    if let Some(c) = part.table.columns.iter().find(|c| known.table.column(&c.name).is_none()) {
        return Err((of_type(&c.name), "is not in the files before it; the files are of two snapshots".into()));
    }
    for column in &mut known.table.columns {
        let Some(more) = part.table.column(&column.name) else {
            return Err((of_type(&column.name), "is missing, but the files before it have it".into()));
        };
        if more.components != column.components {
            let problem =
                format!("has {} components, but {} in the files before it", more.components, column.components);
            return Err((of_type(&column.name), problem));
        }
        column.values.extend(&more.values);
    }
    known.table.count += part.table.count;
    Ok(())
}
