//! Scenes from text and to text.

use super::reference::keys;
use super::{DisplacementInput, DomainInput, ProfileInput, Scene, ShapeInput, yaml};
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
        let own = [
            Some(&mut scene.input.file),
            Some(&mut scene.input.others),
            scene.resolution.as_mut().map(|r| &mut r.file),
        ];
        let of_bodies = scene.bodies.iter_mut().flat_map(|b| {
            [Some(&mut b.input.file), Some(&mut b.input.others), b.resolution.as_mut().map(|r| &mut r.file)]
        });
        let of_others = scene.gravity_of.iter_mut().map(|a| Some(&mut a.input.file));
        let files = own.into_iter().chain(of_bodies).chain(of_others).flatten().chain([&mut scene.cache]);
        let in_folder = |file: &mut PathBuf| {
            if file.is_relative() {
                *file = folder.join(&*file);
            }
        };
        files.flatten().for_each(in_folder);
        let domains = scene.bodies.iter_mut().map(|b| &mut b.domain).chain([&mut scene.domain]);
        let domains = domains.chain(scene.gravity_of.iter_mut().map(|a| &mut a.domain));
        domains.flat_map(DomainInput::files_mut).for_each(in_folder);
        let shapes = scene.walls.iter_mut().flat_map(|w| [&mut w.around, &mut w.without]).flatten();
        shapes.flat_map(ShapeInput::files_mut).for_each(in_folder);
        let inputs = std::iter::once(&mut scene.input).chain(scene.bodies.iter_mut().map(|b| &mut b.input));
        let inputs = inputs.chain(scene.gravity_of.iter_mut().map(|a| &mut a.input));
        inputs.filter_map(|input| input.profile.as_mut()).flat_map(ProfileInput::files_mut).for_each(in_folder);
        scene.displacement.as_mut().and_then(DisplacementInput::file_mut).into_iter().for_each(in_folder);
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
