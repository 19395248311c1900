//! Parameter files with which a code starts and runs an initial condition as it is.

mod arepo;
mod doubts;
mod facts;
mod gadget4;
mod gizmo;
mod phantom;
mod pysph;
mod sph_exa;
mod swift;

use crate::codes::TargetCode;
use crate::error::{Error, Result};
pub(crate) use facts::Physics;
use facts::{Facts, WRITTEN_BY, prefix, stem};
use sph_formats::ParticleFile;
use std::path::{Path, PathBuf};

/// What is beside the particles.
#[derive(Debug)]
pub(crate) struct Beside {
    /// Each with its text: none is written.
    pub files: Vec<(PathBuf, String)>,
    /// What the code will not make of the file as the scene means it.
    pub doubts: Vec<String>,
}

/// Where the files are to be, beside `path`; none for codes whose sheet knows none.
pub(crate) fn places(code: TargetCode, path: &Path) -> Vec<PathBuf> {
    let stem = stem(path);
    let names = match code.sheet.name {
        "swift" => vec![format!("{stem}.yml")],
        "gadget4" | "arepo" => vec![format!("{stem}.param"), format!("{stem}.Config.sh")],
        "gizmo" => vec![format!("{stem}.params"), format!("{stem}.Config.sh")],
        "phantom" => vec![format!("{}.in", prefix(&stem))],
        "pysph" => vec![format!("{stem}.py")],
        "sph-exa" => vec![format!("{stem}.sh")],
        _ => Vec::new(),
    };
    names.into_iter().map(|name| path.with_file_name(name)).collect()
}

/// Before the work: a file that is there already, and that was not written here, is somebody's scene or setup.
///
/// # Errors
/// Its name.
pub(crate) fn refuse_overwriting(code: TargetCode, path: &Path) -> Result<()> {
    let is_foreign = |place: &&PathBuf| {
        let first = std::fs::read(place).ok().map(|bytes| bytes.split(|b| *b == b'\n').next().map(<[u8]>::to_vec));
        first.is_some_and(|line| !String::from_utf8_lossy(&line.unwrap_or_default()).contains(WRITTEN_BY))
    };
    match places(code, path).iter().find(is_foreign) {
        None => Ok(()),
        Some(place) => Err(Error::scene(
            "output.parameters",
            format!("would replace '{}', which was not {WRITTEN_BY}; move it, or name another output", place.display()),
        )),
    }
}

/// The files beside `path`, and what there is to be said of them.
///
/// # Errors
/// A file without gas.
pub(crate) fn beside(code: TargetCode, path: &Path, file: &ParticleFile, physics: Physics) -> Result<Beside> {
    let mut facts = Facts::new(code, path, file, physics)?;
    facts.doubts = doubts::doubts(&facts);
    let texts = match code.sheet.name {
        "swift" => vec![facts.swift()],
        "gadget4" => vec![facts.gadget4(), facts.gadget4_config()],
        "arepo" => vec![facts.arepo(), facts.arepo_config()],
        "gizmo" => vec![facts.gizmo(), facts.gizmo_config()],
        "phantom" => vec![facts.phantom()],
        "pysph" => vec![facts.pysph()],
        "sph-exa" => vec![facts.sph_exa()],
        _ => Vec::new(),
    };
    Ok(Beside { files: places(code, path).into_iter().zip(texts).collect(), doubts: facts.doubts })
}
