//! Images of a result, if the scene asks for them: as the output itself, or on a page. Builds without the feature `plots` refuse them before the
//! run starts.

use super::report::Report;
use crate::error::{Error, Result};
use crate::scene::Scene;
use sph_formats::ParticleFile;
use std::path::Path;

/// Extension of an output that is a picture.
const PICTURE: &str = "png";

/// Whether the output is a picture of the particles in place of them.
pub fn is_picture(scene: &Scene) -> bool {
    let extension = scene.output.file.as_deref().and_then(|f| f.extension());
    scene.output.format.is_none() && extension.is_some_and(|e| e.eq_ignore_ascii_case(PICTURE))
}

/// Whether anything of the result is drawn.
pub fn is_drawn(scene: &Scene) -> bool {
    is_picture(scene) || scene.output.report.is_some()
}

/// Refuses what this build cannot draw.
///
/// # Errors
/// A picture or a page, without the feature `plots`.
pub fn refuse(scene: &Scene) -> Result<()> {
    let key = match (is_picture(scene), scene.output.report.is_some()) {
        _ if cfg!(feature = "plots") => return Ok(()),
        (true, _) => "output.file",
        (_, true) => "output.report",
        _ => return Ok(()),
    };
    Err(Error::scene(key, "asks for pictures, but this build draws none; build it with the feature 'plots'"))
}

/// What pictures of a result need beside its file.
#[derive(Debug, Clone, Default)]
pub struct Drawing {
    #[cfg(feature = "plots")]
    seen: Option<crate::page::Seen>,
}

#[cfg(feature = "plots")]
impl Drawing {
    /// Of a run.
    pub fn of(report: &Report) -> Self {
        Self { seen: report.seen.clone() }
    }

    /// What a page shows.
    ///
    /// # Errors
    /// Values that cannot be drawn.
    pub fn portrait(self, file: &ParticleFile) -> Result<crate::page::Portrait> {
        crate::page::Portrait::new(file, self.seen)
    }

    /// Writes the picture, whole or not at all.
    ///
    /// # Errors
    /// [`sph_formats::FormatError::Io`].
    pub fn write_picture(&self, file: &ParticleFile, path: &Path) -> Result<()> {
        let bytes = crate::page::picture(&self.clone().portrait(file)?)?;
        crate::page::write(path, &bytes)
    }
}

#[cfg(not(feature = "plots"))]
impl Drawing {
    /// Of a run.
    pub fn of(_: &Report) -> Self {
        Self {}
    }

    /// Nothing, since [`refuse`] was asked before.
    ///
    /// # Errors
    /// None.
    pub fn write_picture(&self, _: &ParticleFile, _: &Path) -> Result<()> {
        Ok(())
    }
}
