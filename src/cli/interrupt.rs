//! Handles interrupts (Ctrl-C), hangups and termination.
//!
//! Where nothing would be kept (while reading, seeding, measuring and writing, and in stages without a checkpoint), the
//! process ends at once: outputs appear by renaming, so that none is left half-written. A stage whose state is kept stops
//! after the iteration under way. A second signal ends the process in any case.

use super::exit::FAILURE;
use super::terminal::{clear_line, marked};
use crate::error::Error;
use crate::relaxation::{Event, Step};
use crate::run::checkpoint::left_by;
use crate::scene::{OnInterrupt, Scene};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

/// What the next signal does.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Answer {
    /// Ends the process.
    Leave,
    /// Asks the stage under way to stop.
    Stop,
    /// Nothing: the result is about to be written, as the scene asks for.
    Finish,
}

/// What a run goes on from.
enum Kept {
    /// That of the scene.
    Checkpoint(Box<Scene>),
    Blocks(PathBuf),
}

/// Signals, and what is to be done about them.
pub struct Interrupts {
    requested: AtomicBool,
    answer: AtomicU8,
    /// What may be there to go on from when the process ends.
    kept: Option<Kept>,
    on_interrupt: OnInterrupt,
}

impl Interrupts {
    /// Listens from now on, for a run of `scene`.
    pub fn of_run(scene: &Scene) -> Arc<Self> {
        let is_kept = scene.checkpoint.file.is_some();
        Self::listen(is_kept.then(|| Kept::Checkpoint(Box::new(scene.clone()))), scene.output.on_interrupt)
    }

    /// Listens from now on, for a run that keeps blocks in a folder.
    pub fn of_blocks(folder: &Path) -> Arc<Self> {
        Self::listen(Some(Kept::Blocks(folder.into())), OnInterrupt::Discard)
    }

    /// Listens from now on, for work that keeps nothing.
    pub fn of_other_work() -> Arc<Self> {
        Self::listen(None, OnInterrupt::Discard)
    }

    fn listen(kept: Option<Kept>, on_interrupt: OnInterrupt) -> Arc<Self> {
        let (requested, answer) = (AtomicBool::new(false), AtomicU8::new(Answer::Leave as u8));
        let interrupts = Arc::new(Self { requested, answer, kept, on_interrupt });
        let heard = Arc::clone(&interrupts);
        // Without a handler a signal ends the process at once, which leaves a temporary file at worst.
        let _ = ctrlc::set_handler(move || heard.signal());
        interrupts
    }

    /// Set where a stage is asked to stop.
    pub fn requested(&self) -> &AtomicBool {
        &self.requested
    }

    /// Takes note of what the run does.
    pub fn note(&self, event: Event) {
        let Event::Begin(step) = event else { return };
        let writes = self.on_interrupt == OnInterrupt::Write;
        let answer = match step {
            Step::Relax(_) if writes || self.kept.is_some() => Answer::Stop,
            Step::Measure | Step::Write if writes => Answer::Finish,
            _ => Answer::Leave,
        };
        self.answer.store(answer as u8, Ordering::Relaxed);
    }

    fn signal(&self) {
        let answer = self.answer.load(Ordering::Relaxed);
        let again = self.requested.swap(true, Ordering::Relaxed);
        if again || answer == Answer::Leave as u8 {
            self.leave();
        }
    }

    fn leave(&self) -> ! {
        sph_formats::output::remove_temporaries();
        let error = match &self.kept {
            Some(Kept::Checkpoint(scene)) => {
                left_by(scene).map_or(Error::Interrupted, |file| Error::InterruptedKept(file.into()))
            }
            Some(Kept::Blocks(folder)) if folder.is_dir() => Error::InterruptedIn(folder.clone()),
            _ => Error::Interrupted,
        };
        clear_line();
        eprintln!("{}: {error}", marked("error"));
        std::process::exit(i32::from(FAILURE));
    }
}
