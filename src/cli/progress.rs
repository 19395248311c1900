//! Progress on a terminal; nothing is shown if the output is piped or `--quiet` is given.
//!
//! Every step of a run has a line, from its second second on: a bar where its end is known or foreseen, with what is left of it.

use crate::relaxation::Event;
use crate::run::duration::rounded;
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// What a run is at.
pub struct Progress {
    shown: bool,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    phase: Option<Phase>,
    /// Of steps to come, in seconds.
    expected: Vec<(&'static str, f64)>,
    /// How many times as long as expected steps took so far.
    pace: f64,
}

/// A step with its line.
struct Phase {
    bar: ProgressBar,
    expected: Option<f64>,
    /// Bits of the epsilon of the last iteration.
    epsilon: Arc<AtomicU64>,
}

/// How often lines are drawn anew.
const TICK: Duration = Duration::from_millis(100);
/// Steps shorter than this have no line, in seconds.
const SHORT: f64 = 1.0;
/// Letters of a bar, and of the name before it.
const BAR: usize = 16;
const NAME: usize = 17;

impl Progress {
    pub fn new(quiet: bool) -> Self {
        let state = State { pace: 1.0, ..State::default() };
        Self { shown: !quiet && std::io::stderr().is_terminal(), state: Mutex::new(state) }
    }

    pub fn update(&self, event: Event) {
        if !self.shown {
            return;
        }
        let Ok(mut state) = self.state.lock() else { return };
        match event {
            Event::Expect { step, seconds } => {
                state.expected.retain(|known| known.0 != step);
                state.expected.push((step, seconds));
            }
            Event::Begin(step) => state.begin(step.name()),
            Event::Iteration { stage, iteration, last, epsilon } => {
                if state.phase.is_none() {
                    state.begin(stage.name);
                }
                let Some(phase) = &state.phase else { return };
                phase.epsilon.store(epsilon.to_bits(), Ordering::Relaxed);
                phase.bar.set_length(last as u64);
                phase.bar.set_position(iteration as u64);
            }
        }
    }

    /// A step of work that tells no events of its own, with its line.
    pub fn begin(&self, name: &'static str) {
        if let (true, Ok(mut state)) = (self.shown, self.state.lock()) {
            state.begin(name);
        }
    }

    /// How much of the step is done: so many of `all` parts.
    pub fn count(&self, done: u64, all: u64) {
        let Ok(state) = self.state.lock() else { return };
        if let Some(phase) = &state.phase {
            phase.bar.set_length(all);
            phase.bar.set_position(done.min(all));
        }
    }

    /// Takes the line away.
    pub fn finish(&self) {
        if let Ok(mut state) = self.state.lock() {
            state.end();
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}

impl State {
    fn begin(&mut self, name: &'static str) {
        self.end();
        let expected = self.expected.iter().find(|known| known.0 == name).map(|known| known.1);
        let foreseen = expected.map(|seconds| self.pace * seconds);
        let epsilon = Arc::new(AtomicU64::new(f64::NAN.to_bits()));
        let seen = Arc::clone(&epsilon);
        let drawn = move |state: &ProgressState, out: &mut dyn Write| {
            let seconds = state.elapsed().as_secs_f64();
            let steps = (state.pos(), state.len().unwrap_or(0));
            let epsilon = f64::from_bits(seen.load(Ordering::Relaxed));
            // Nothing can be done about a terminal that does not take it.
            let _ = out.write_str(&line(name, seconds, foreseen, steps, epsilon));
        };
        let style = ProgressStyle::with_template("{line}").unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::no_length().with_style(style.with_key("line", drawn));
        bar.enable_steady_tick(TICK);
        self.phase = Some(Phase { bar, expected, epsilon });
    }

    fn end(&mut self) {
        let Some(Phase { bar, expected, .. }) = self.phase.take() else { return };
        let (seconds, steps) = (bar.elapsed().as_secs_f64(), (bar.position(), bar.length().unwrap_or(0)));
        if let (Some(expected), true) = (expected, seconds > SHORT) {
            let share = if steps.1 > 0 { steps.0 as f64 / steps.1 as f64 } else { 1.0 };
            let pace = seconds / (expected * share);
            self.pace = if pace.is_finite() && pace > 0.0 { pace } else { self.pace };
        }
        bar.finish_and_clear();
    }
}

/// The line of a step that has taken so many `seconds`, of `expected` ones where these are foreseen, and has done some of its steps.
fn line(name: &str, seconds: f64, expected: Option<f64>, (done, all): (u64, u64), epsilon: f64) -> String {
    if seconds < SHORT {
        return String::new();
    }
    let (share, left) = match (done, all, expected) {
        (1.., 1.., _) => {
            let share = (done as f64 / all as f64).min(1.0);
            (Some(share), Some(seconds / share - seconds))
        }
        // What takes longer than it should ends no sooner for a bar that is full.
        (_, _, Some(expected)) if seconds < expected => (Some(seconds / expected), Some(expected - seconds)),
        _ => (None, None),
    };
    let mut out = format!("{name:<NAME$.NAME$} ");
    if let Some(share) = share {
        let full = (share * BAR as f64) as usize;
        let _ = write!(out, "[{}{}] ", "#".repeat(full.min(BAR)), "-".repeat(BAR - full.min(BAR)));
    }
    if all > 0 {
        let _ = write!(out, "{done}/{all} ");
    }
    let _ = match left {
        Some(left) => write!(out, "{} left", rounded(left)),
        None => write!(out, "{seconds:.0} s so far"),
    };
    if epsilon.is_finite() {
        let _ = write!(out, ", {epsilon:.1e}");
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_say_what_is_left_and_fit_a_terminal() {
        assert_eq!(line("seed", 0.4, Some(9.0), (0, 0), f64::NAN), "");
        let seeding = line("seed", 3.0, Some(12.0), (0, 0), f64::NAN);
        assert!(seeding.starts_with("seed  ") && seeding.contains("[####------------] some 9 s left"), "{seeding}");
        // Twice as much is to come as was done.
        let solver = line("solver", 10.0, Some(1.0), (80, 240), 2.5e-7);
        assert!(solver.contains("[#####-----------]") && solver.contains("80/240 some 20 s left, 2.5e-7"), "{solver}");
        let late = line("measure", 30.0, Some(12.0), (0, 0), f64::NAN);
        assert!(late.ends_with("30 s so far") && !late.contains('['), "{late}");
        assert!(line("read", 2.0, None, (0, 0), f64::NAN).ends_with("2 s so far"));
        for seconds in [1.0, 59.0, 5399.0, 3.6e6] {
            for steps in [(0, 0), (0, 240), (1, 100_000), (99_999, 100_000)] {
                let text = line("a step of a very long name", seconds, Some(3.6e5), steps, 1.234e-10);
                assert!(text.chars().count() < 80, "{text}");
            }
        }
    }
}
