//! Messages between a run and its stages.

use super::report::{StageName, StopReason};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A step of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    Read,
    Interpolate,
    Seed,
    Relax(StageName),
    /// What stages are given and what they make is measured, by the measure that ends a run.
    Accept,
    Measure,
    Write,
}

impl Step {
    /// As in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Interpolate => "interpolate",
            Self::Seed => "seed",
            Self::Relax(stage) => stage.name,
            Self::Accept => "accept",
            Self::Measure => "measure",
            Self::Write => "write",
        }
    }
}

/// What an observer of a run is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// What a stage will take, roughly; told before the first begins.
    Expect { step: &'static str, seconds: f64 },
    /// A step begins.
    Begin(Step),
    /// A stage has finished an iteration of `last`; epsilon is that of [`super::Progress`].
    Iteration { stage: StageName, iteration: usize, last: usize, epsilon: f64 },
}

/// What may end a run early, and who watches it. The default neither ends nor is watched.
#[derive(Clone, Copy)]
pub struct Control<'a> {
    /// When relaxation stops with the best state so far.
    pub deadline: Option<Instant>,
    /// Set when the user interrupts: stages stop after the iteration under way, a run between its steps.
    pub interrupted: &'a AtomicBool,
    pub observer: &'a (dyn Fn(Event) + Sync),
}

static NEVER: AtomicBool = AtomicBool::new(false);

impl Default for Control<'_> {
    fn default() -> Self {
        Self { deadline: None, interrupted: &NEVER, observer: &|_| {} }
    }
}

impl Control<'_> {
    /// Tells the observer.
    pub fn tell(&self, event: Event) {
        (self.observer)(event);
    }

    pub fn is_interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }

    /// With a share of the time that is left until the deadline.
    #[must_use]
    pub fn sharing(&self, share: f64) -> Self {
        let now = Instant::now();
        let until = |deadline: Instant| now + deadline.saturating_duration_since(now).mul_f64(share.clamp(0.0, 1.0));
        Self { deadline: self.deadline.map(until), ..*self }
    }

    /// The outside reason to stop now, if there is one.
    pub fn stop_reason(&self) -> Option<StopReason> {
        self.stop_reason_within(Duration::ZERO)
    }

    /// The outside reason not to begin with what takes so long.
    pub fn stop_reason_within(&self, takes: Duration) -> Option<StopReason> {
        if self.is_interrupted() {
            Some(StopReason::Interrupted)
        } else if self.deadline.is_some_and(|t| Instant::now() + takes >= t) {
            Some(StopReason::TimeLimit)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_the_time_is_of_what_is_left() {
        let hour = Duration::from_secs(3600);
        let control = Control { deadline: Instant::now().checked_add(hour), ..Control::default() };
        let left = control.sharing(0.25).deadline.unwrap().saturating_duration_since(Instant::now());
        assert!(left <= hour / 4 && left > hour / 5, "{left:?}");
        let past = Control { deadline: Some(Instant::now()), ..control };
        assert_eq!(past.sharing(0.5).stop_reason(), Some(StopReason::TimeLimit));
        assert!(Control::default().sharing(0.5).deadline.is_none());
    }
}
