//! What the benches that make pages share.

#[path = "../made.rs"]
mod made;

use sph_prep::relaxation::Control;
use sph_prep::run::pipeline;
use sph_prep::run::report::Report;
use sph_prep::scene::Scene;
use std::path::Path;
use std::sync::atomic::AtomicBool;

static NEVER: AtomicBool = AtomicBool::new(false);

/// Of runs that nothing interrupts.
pub fn control() -> Control<'static> {
    Control { deadline: None, interrupted: &NEVER, observer: &|_| {} }
}

/// A full run into a folder that is thrown away.
pub fn run(scene: &Scene) -> Result<Report, String> {
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let mut scene = scene.clone();
    scene.output.file = Some(folder.path().join("ic.vtu"));
    scene.output.format = Some("vtk".into());
    pipeline::run(&scene, sph_formats::FORMATS, &control()).map_err(|e| e.to_string())
}

/// Writes a page, and below it when and where it was made, into the folder that SPH_PREP_RESULTS names, if it does; ends the process where that fails.
pub fn write_page(name: &str, page: &str) {
    let Some(folder) = std::env::var_os("SPH_PREP_RESULTS") else { return };
    let path = Path::new(&folder).join(name);
    let page = format!("{page}\n{}", made::line());
    if let Err(e) = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&path, page)) {
        fail(&format!("{}: {e}", path.display()));
    }
}

/// Ends the process.
pub fn fail(problem: &str) -> ! {
    eprintln!("{problem}");
    std::process::exit(1);
}
