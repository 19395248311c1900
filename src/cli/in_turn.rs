//! Runs block by block: `--in-turn`.

use super::args::RunArgs;
use super::interrupt::Interrupts;
use super::progress::Progress;
use crate::error::{Error, Result};
use crate::relaxation::{Control, Event};
use crate::run::in_turn::{InTurn, InTurnReport, run_in_turn};
use crate::scene::Scene;
use sph_formats::FORMATS;
use std::time::Instant;

/// Runs the scene in so many blocks.
///
/// # Errors
/// Those of such a run.
pub fn run(args: &RunArgs, scene: &Scene, deadline: Option<Instant>, blocks: usize) -> Result<InTurnReport> {
    let Some(output) = &scene.output.file else {
        return Err(Error::scene("output.file", "is missing (--out FILE)"));
    };
    let folder = args.blocks.clone().unwrap_or_else(|| {
        let mut name = output.clone().into_os_string();
        name.push(".blocks");
        name.into()
    });
    let (interrupts, progress) = (Interrupts::of_blocks(&folder), Progress::new(args.quiet));
    let observer = |event: Event| {
        interrupts.note(event);
        progress.update(event);
    };
    let control = Control { deadline, interrupted: interrupts.requested(), observer: &observer };
    let result = run_in_turn(scene, FORMATS, &control, InTurn { blocks, folder: &folder });
    progress.finish();
    result
}
