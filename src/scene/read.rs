//! Reads scenes from text, and writes them as text.

use super::reference::keys;
use super::{Scene, yaml};
use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// Keys of one name that a message lists, at most.
const MOST_PLACES: usize = 3;

impl Scene {
    /// Reads a scene file. Relative paths in it are relative to its folder.
    ///
    /// # Errors
    /// [`Error::Scene`] with line and column.
    pub fn load(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path)
            .map_err(|e| Error::scene(format!("file '{}'", path.display()), format!("cannot be read: {e}")))?;
        let mut scene: Self = yaml::parse(&text, &format!("file '{}'", path.display()), &elsewhere)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let in_folder = |file: &mut PathBuf| {
            if file.is_relative() {
                *file = folder.join(&*file);
            }
        };
        scene.cache.as_mut().into_iter().for_each(in_folder);
        scene.inputs_mut().into_iter().for_each(in_folder);
        scene.read_from = Some(path.to_owned());
        Ok(scene)
    }

    /// Parses a scene.
    ///
    /// # Errors
    /// [`Error::Scene`] with line and column.
    pub fn parse(text: &str) -> Result<Self> {
        yaml::parse(text, "document", &elsewhere)
    }

    /// The scene as YAML.
    pub fn to_yaml(&self) -> String {
        serde_saphyr::to_string(self).unwrap_or_else(|e| format!("# the scene cannot be printed: {e}\n"))
    }
}

/// Where a key of this name belongs, if anywhere: the shortest paths.
fn elsewhere(name: &str) -> Vec<String> {
    let sections = keys();
    let mut paths: Vec<String> =
        sections.iter().flat_map(|k| k.all()).filter(|k| k.name() == name).map(|k| k.path.clone()).collect();
    let depth = |path: &String| path.split('.').count();
    paths.sort_by_key(depth);
    let least = paths.first().map_or(0, depth);
    paths.retain(|path| depth(path) == least);
    paths.truncate(MOST_PLACES);
    paths
}
