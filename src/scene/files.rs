//! The files that a scene reads.

use super::{Input, ResolutionInput, Scene, ShapeInput};
use std::path::PathBuf;

impl Scene {
    /// All files that it reads, its bodies' among them, for a change of their paths.
    pub(crate) fn inputs_mut(&mut self) -> Vec<&mut PathBuf> {
        let mut files = of_input(&mut self.input, self.resolution.as_mut());
        files.extend(self.domain.files_mut());
        files.extend(self.fields.files_mut());
        files.extend(self.ambient.iter_mut().flat_map(|a| a.fields.files_mut()));
        files.extend(self.dust.iter_mut().flat_map(|d| d.fields.files_mut()));
        let mut attracting: Vec<_> = self.gravity_of.iter_mut().collect();
        for body in &mut self.bodies {
            attracting.extend(&mut body.gravity_of);
            files.extend(of_input(&mut body.input, body.resolution.as_mut()));
            files.extend(body.domain.files_mut());
            files.extend(body.fields.files_mut());
            files.extend(body.dust.iter_mut().flat_map(|d| d.fields.files_mut()));
        }
        while let Some(attraction) = attracting.pop() {
            files.extend(of_input(&mut attraction.input, None));
            files.extend(attraction.domain.files_mut());
            attracting.extend(&mut attraction.gravity_of);
        }
        if let Some(walls) = &mut self.walls {
            files.extend([&mut walls.around, &mut walls.without].into_iter().flatten().flat_map(ShapeInput::files_mut));
        }
        files.extend(self.displacement.as_mut().and_then(|d| d.file_mut()));
        files
    }

    /// All files that it is of: those that it reads, and its own.
    pub(crate) fn inputs(&self) -> Vec<PathBuf> {
        let files = self.clone().inputs_mut().into_iter().map(std::mem::take).collect::<Vec<_>>();
        files.into_iter().chain(self.read_from.clone()).collect()
    }
}

fn of_input<'a>(input: &'a mut Input, resolution: Option<&'a mut ResolutionInput>) -> Vec<&'a mut PathBuf> {
    let named = [Some(&mut input.file), Some(&mut input.others), resolution.map(|r| &mut r.file)];
    let named = named.into_iter().flatten().flatten();
    named.chain(input.profile.iter_mut().flat_map(|p| p.files_mut())).collect()
}
