//! `sph-prep compare`: the same scene through several methods.

use super::args::CompareArgs;
use super::progress::Progress;
use super::written::listed;
use crate::compare::{self, Compared, Request, VARIATIONS};
use crate::error::Result;
use crate::relaxation::{Control, Event};
use crate::scene::Scene;
use sph_formats::FormatSpec;
use std::sync::atomic::AtomicBool;

/// Compares, writes the files, and returns what to print.
///
/// # Errors
/// Those of [`compare::compare`] and [`compare::write`].
pub fn run(args: &CompareArgs, formats: &[FormatSpec], interrupted: &AtomicBool) -> Result<String> {
    let mut scene = args.scene.as_deref().map_or_else(|| Ok(Scene::default()), Scene::load)?;
    if let Some(input) = &args.input {
        scene.input.file = Some(input.clone());
        scene.input.expression = None;
        scene.input.profile = None;
    }
    compare::check(&scene)?;
    let methods = Compared::parse_list(&args.methods)?;
    let counts = compare::numbers(&scene, &args.particles)?;
    compare::probe(&args.output)?;
    let progress = Progress::new(args.quiet);
    let observer = |event: Event| progress.update(event);
    let control = Control { deadline: None, interrupted, observer: &observer };
    let request = Request { scene: &scene, methods: &methods, counts: &counts };
    let result = compare::compare(&request, formats, &control);
    progress.finish();
    let comparison = result?;
    compare::write(&comparison, &args.output)?;
    let files = listed(&compare::FILES.map(|name| args.output.join(name)));
    let figures = if cfg!(feature = "plots") { "" } else { "; this build draws no figures (feature 'plots')" };
    Ok(if args.quiet { String::new() } else { format!("{}wrote {files}{figures}\n", comparison.text()) })
}

/// The variations, as lines for `sph-prep methods`.
pub fn table() -> String {
    let mut out = String::from("\nto compare (sph-prep compare --methods NAME or NAME:SEEDING, ...)\n");
    for v in VARIATIONS {
        out += &format!("{:<23} {}\n  {}\n", v.name, v.summary, v.reference);
    }
    out
}
