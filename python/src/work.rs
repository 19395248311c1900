//! Long work in a thread of its own, so that Python's signals are heard: Ctrl-C ends it at once.

use pyo3::prelude::*;
use sph_prep::Control;
use sph_prep::relaxation::Event;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::time::{Duration, Instant};

/// How often Python's signals are looked at.
const TICK: Duration = Duration::from_millis(50);

/// Runs `work` without Python's lock until it ends, or a signal or an exception of `progress` asks for its end: then work goes on
/// behind the scenes to the end of its step, and nothing is waited for. `limit` is in seconds.
///
/// # Errors
/// An exception of a signal's handler (`KeyboardInterrupt`), or of `progress`.
pub fn watched<T: Send + 'static>(
    py: Python<'_>,
    limit: Option<f64>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&Control<'_>) -> T + Send + 'static,
) -> PyResult<T> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let deadline = limit.and_then(|s| Instant::now().checked_add(Duration::try_from_secs_f64(s).ok()?));
    let flag = Arc::clone(&interrupted);
    let finished = py.detach(move || -> PyResult<std::thread::Result<T>> {
        let (events, heard) = mpsc::channel::<String>();
        let worker = std::thread::spawn(move || {
            let events = Mutex::new(events);
            let observer = |event: Event| {
                if let Ok(sender) = events.lock() {
                    // Nobody listens any more once Python has raised an exception.
                    let _ = sender.send(describe(event));
                }
            };
            work(&Control { deadline, interrupted: &flag, observer: &observer })
        });
        while !worker.is_finished() {
            std::thread::sleep(TICK);
            let last = heard.try_iter().last();
            let called = Python::attach(|py| {
                py.check_signals()?;
                match (&progress, last) {
                    (Some(call), Some(text)) => call.call1(py, (text,)).map(|_| ()),
                    _ => Ok(()),
                }
            });
            if let Err(error) = called {
                interrupted.store(true, Ordering::Relaxed);
                return Err(error);
            }
        }
        Ok(worker.join())
    })?;
    finished.map_err(|panic| std::panic::resume_unwind(panic))
}

/// One line.
fn describe(event: Event) -> String {
    match event {
        Event::Expect { step, seconds } => format!("{step}: some {seconds:.0} s expected"),
        Event::Begin(step) => step.name().to_owned(),
        Event::Iteration { stage, iteration, last, epsilon } => {
            format!("{} {iteration}/{last}, {epsilon:.2e}", stage.name)
        }
    }
}
