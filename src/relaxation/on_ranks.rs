//! Stages on several ranks, each of which owns part of the particles throughout.

use super::report::{Progress, StageName, StopReason};
use super::stage::{Particles, Relaxed, Running, Stage};
use sph::exchange::{Alone, Exchange, Traffic};

/// A stage that can do with the particles of one rank and what it sees of the others'.
pub trait OverRanks<const D: usize>: Stage<D> {
    /// Begins with the particles of this rank; all ranks begin and advance together.
    fn begin_among<'s>(&'s self, particles: Particles<D>, exchange: &'s dyn Exchange) -> Box<dyn Running<D> + 's>;

    /// Goes on from a snapshot of this rank, with which all ranks go on together.
    ///
    /// # Errors
    /// What is wrong with it.
    fn resume_among<'s>(&'s self, kept: &[u8], exchange: &'s dyn Exchange) -> Result<Box<dyn Running<D> + 's>, String>;

    /// The particles of a snapshot that this or another rank has made.
    ///
    /// # Errors
    /// What is wrong with it.
    fn left_by_a_rank(&self, kept: &[u8]) -> Result<Particles<D>, String> {
        Ok(self.resume_among(kept, &Alone)?.finish(StopReason::Interrupted).particles)
    }

    /// How many times it has looked at the particles in this history, and what it calls that.
    fn steps(&self, history: &[Progress]) -> (usize, &'static str);
}

/// Such a stage over ranks, with a note on what the busiest has sent to others.
pub struct OnRanks<'a, S> {
    pub stage: S,
    pub exchange: &'a dyn Exchange,
}

impl<const D: usize, S: OverRanks<D>> Stage<D> for OnRanks<'_, S> {
    fn name(&self) -> StageName {
        self.stage.name()
    }

    fn begin(&self, particles: Particles<D>) -> Box<dyn Running<D> + '_> {
        let before = self.exchange.traffic();
        Box::new(Counted { inner: self.stage.begin_among(particles, self.exchange), stage: self, before })
    }

    fn resume(&self, kept: &[u8]) -> Result<Box<dyn Running<D> + '_>, String> {
        let before = self.exchange.traffic();
        let inner = self.stage.resume_among(kept, self.exchange);
        if self.exchange.any(inner.is_err()) {
            return Err(inner.err().unwrap_or_else(|| "cannot be read by another rank; start without it".into()));
        }
        Ok(Box::new(Counted { inner: inner?, stage: self, before }))
    }

    fn left(&self, kept: &[u8]) -> Result<Particles<D>, String> {
        self.stage.left_by_a_rank(kept)
    }
}

/// A stage over ranks under way, with what this rank had sent before it.
struct Counted<'a, const D: usize, S> {
    inner: Box<dyn Running<D> + 'a>,
    stage: &'a OnRanks<'a, S>,
    before: Traffic,
}

impl<const D: usize, S: OverRanks<D>> Running<D> for Counted<'_, D, S> {
    fn advance(&mut self, outside: Option<StopReason>) -> Option<StopReason> {
        self.inner.advance(outside)
    }

    fn progress(&self) -> (&[Progress], usize) {
        self.inner.progress()
    }

    fn snapshot(&self, to: Vec<u8>) -> Result<Vec<u8>, String> {
        self.inner.snapshot(to)
    }

    fn finish(self: Box<Self>, stop: StopReason) -> Relaxed<D> {
        let Self { inner, stage: OnRanks { stage, exchange }, before } = *self;
        let steps = stage.steps(inner.progress().0);
        let mut relaxed = inner.finish(stop);
        relaxed.notes.extend(note_on_traffic(*exchange, before, steps));
        relaxed
    }
}

/// What the busiest rank has sent in each of its steps since there was so much `before`, if there are others. All ranks call it together.
pub(super) fn note_on_traffic(
    exchange: &dyn Exchange,
    before: Traffic,
    (steps, step): (usize, &'static str),
) -> Option<String> {
    if exchange.is_alone() {
        return None;
    }
    let Traffic { messages, bytes } = exchange.traffic().since(before);
    let each = |sent: u64| if steps > 0 { sent as f64 / steps as f64 } else { 0.0 };
    let [messages, bytes] = [messages, bytes].map(|sent| exchange.max(each(sent)));
    exchange.any(steps > 0).then(|| {
        format!(
            "in each {step} the busiest rank sent {messages:.0} messages and {bytes:.0} bytes to other \
                          ranks"
        )
    })
}

/// What any rank has as a reason to stop, which all have to stop for.
pub fn agreed_stop(exchange: &dyn Exchange, outside: Option<StopReason>) -> Option<StopReason> {
    if exchange.is_alone() {
        return outside;
    }
    let reasons = [StopReason::TimeLimit, StopReason::Interrupted];
    let own = outside.map_or(0, |own| 1 + reasons.iter().position(|r| *r == own).unwrap_or(1));
    let all = exchange.max(own as f64) as usize;
    all.checked_sub(1).and_then(|i| reasons.get(i).copied())
}
