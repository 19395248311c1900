//! Writes the pages that scenes ask for, for runs of one body and of several.

use super::bodies_report::BodiesReport;
use super::report::Report;
use crate::error::Result;
use crate::scene::Scene;
use sph_formats::ParticleFile;

impl Report {
    /// Writes the page of a run, whole or not at all, where the scene asks for one; `command` is what was called, empty where no program
    /// was.
    ///
    /// # Errors
    /// Values that cannot be drawn, or a file that cannot be written.
    pub fn write_page(&self, scene: &Scene, file: &ParticleFile, command: &str) -> Result<()> {
        #[cfg(feature = "plots")]
        if let Some(path) = &scene.output.report {
            crate::page::write(path, super::page::page(scene, file, self, command)?.as_bytes())?;
        }
        #[cfg(not(feature = "plots"))]
        let _ = (scene, file, command);
        Ok(())
    }
}

impl BodiesReport {
    /// As [`Report::write_page`].
    ///
    /// # Errors
    /// The same.
    pub fn write_page(&self, scene: &Scene, file: &ParticleFile, command: &str) -> Result<()> {
        #[cfg(feature = "plots")]
        if let Some(path) = &scene.output.report {
            crate::page::write(path, super::page_of_bodies::page(scene, file, self, command)?.as_bytes())?;
        }
        #[cfg(not(feature = "plots"))]
        let _ = (scene, file, command);
        Ok(())
    }
}
