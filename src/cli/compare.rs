//! `sph-prep compare`: the same scene through several methods.

use super::args::CompareArgs;
use super::progress::Progress;
use crate::compare::{self, Compared, Request, VARIATIONS};
use crate::error::{Error, Result};
use crate::relaxation::{Control, Event};
use crate::scene::Scene;
use sph_formats::FormatSpec;
use std::sync::atomic::AtomicBool;

/// Numbers of particles where neither arguments nor scene have one.
const COUNTS: [usize; 2] = [1000, 10_000];

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
    if !scene.bodies.is_empty() {
        return Err(Error::scene("bodies", "cannot be compared all at once; compare the scene of one of them"));
    }
    for (key, is_given) in [("gravity_of", !scene.gravity_of.is_empty()), ("dust", scene.dust.is_some())] {
        if is_given {
            return Err(Error::scene(key, "is not part of a comparison; leave it out"));
        }
    }
    let methods = Compared::parse_list(&args.methods)?;
    let mut counts = if args.particles.is_empty() {
        scene.particles.map_or_else(|| COUNTS.to_vec(), |n| vec![n])
    } else {
        args.particles.clone()
    };
    counts.sort_unstable();
    if let Some(twice) = counts.windows(2).find(|w| w[0] == w[1]) {
        return Err(Error::scene("--particles", format!("has {} twice; name each number once", twice[0])));
    }
    compare::probe(&args.output)?;
    let progress = Progress::new(args.quiet);
    let observer = |event: Event| progress.update(event);
    let control = Control { deadline: None, interrupted, observer: &observer };
    let request = Request { scene: &scene, methods: &methods, counts: &counts };
    let result = compare::compare(&request, formats, &control);
    progress.finish();
    let comparison = result?;
    compare::write(&comparison, &args.output)?;
    let files = compare::FILES.map(|name| args.output.join(name).display().to_string()).join(", ");
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
