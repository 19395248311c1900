//! Parameter files with which a code starts and runs an initial condition without changes.

mod arepo;
mod doubts;
mod dualsphysics;
mod facts;
mod gadget4;
mod gizmo;
mod phantom;
mod pysph;
mod sph_exa;
mod swift;

use crate::codes::TargetCode;
use crate::error::{Error, Result};
pub(crate) use facts::{Doubts, Physics};
use facts::{Facts, WRITTEN_BY, prefix, stem};
use sph_formats::stream::sampled;
use sph_formats::{ParticleFile, ParticleStream};
use std::path::{Path, PathBuf};

/// What is beside the particles.
#[derive(Debug)]
pub(crate) struct Beside {
    /// Each with its text: none is written.
    pub files: Vec<(PathBuf, String)>,
    /// What the code will not make of the file as the scene means it.
    pub doubts: Doubts,
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
        "dualsphysics" => vec![format!("{stem}.xml")],
        "sph-exa" => vec![format!("{stem}.sh")],
        _ => Vec::new(),
    };
    names.into_iter().map(|name| path.with_file_name(name)).collect()
}

/// Before the work: a file that is there already, and that was not written here for a file of the same name, is somebody's scene or setup. With
/// `no_clobber` none is replaced.
///
/// # Errors
/// Its name.
pub(crate) fn refuse_overwriting(code: TargetCode, path: &Path, no_clobber: bool) -> Result<()> {
    let wrong = |problem: String| Err(Error::scene("output.parameters", problem));
    let own = format!(" {} for ", facts::name(path));
    for place in places(code, path) {
        let Ok(bytes) = std::fs::read(&place) else { continue };
        let first = String::from_utf8_lossy(bytes.split(|b| *b == b'\n').next().unwrap_or_default()).into_owned();
        let place = place.display();
        if no_clobber {
            return wrong(format!("would replace '{place}', and --no-clobber is set; name another output"));
        }
        if !first.contains(WRITTEN_BY) {
            return wrong(format!(
                "would replace '{place}', which was not {WRITTEN_BY}; move it, or name another output"
            ));
        }
        if !first.contains(&own) {
            return wrong(format!(
                "would replace '{place}', which is that of another file ({}); move it, or name another output",
                first.trim_start_matches(['#', '%', ' ', '<', '!', '-'])
            ));
        }
    }
    Ok(())
}

/// The files beside `path`, which is of a `format`, and what there is to be said of them.
///
/// # Errors
/// A file without gas.
pub(crate) fn beside(
    code: TargetCode,
    (path, format): (&Path, Option<&str>),
    file: &ParticleFile,
    physics: Physics,
) -> Result<Beside> {
    let mut facts = Facts::new(code, (path, format), file, physics)?;
    facts.doubts = doubts::doubts(&facts);
    let texts = match code.sheet.name {
        "swift" => vec![facts.swift()],
        "gadget4" => vec![facts.gadget4(), facts.gadget4_config()],
        "arepo" => vec![facts.arepo(), facts.arepo_config()],
        "gizmo" => vec![facts.gizmo(), facts.gizmo_config()],
        "phantom" => vec![facts.phantom()],
        "pysph" => vec![facts.pysph()],
        "dualsphysics" => vec![facts.dualsphysics()],
        "sph-exa" => vec![facts.sph_exa()],
        _ => Vec::new(),
    };
    Ok(Beside { files: places(code, path).into_iter().zip(texts).collect(), doubts: facts.doubts })
}

/// What there is to be said of a file where no others are written beside it: what the code will not make of it as the scene means it. Nothing of one
/// without gas.
pub(crate) fn doubts_of(code: TargetCode, of: (&Path, Option<&str>), file: &ParticleFile, physics: Physics) -> Doubts {
    Facts::new(code, of, file, physics).map_or_else(|_| Doubts::default(), |facts| doubts::doubts(&facts))
}

/// Particles of a type that are enough to say the same of many that are not held at once.
const SAMPLED: usize = 4096;

/// [`doubts_of`] particles that are made while they are written, by some of them.
///
/// # Errors
/// Rows that cannot be made.
pub(crate) fn doubts_of_stream(
    code: TargetCode,
    of: (&Path, Option<&str>),
    stream: &dyn ParticleStream,
    mut physics: Physics,
) -> Result<Doubts> {
    let some = sampled(stream, SAMPLED)?;
    let [all, held] = [stream.counts(), some.counts()].map(|counts| counts[0] as f64);
    physics.stands_for = all / held.max(1.0);
    Ok(doubts_of(code, of, &some, physics))
}
