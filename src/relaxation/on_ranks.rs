//! Stages over several ranks, of which each has a part of the particles and keeps it.

use super::acceptance::part;
use super::control::{Control, Event, Step};
use super::report::{StageName, StageReport, StopReason};
use super::stage::{Particles, Relaxed, Running, Stage, relax_new};
use crate::metrics::{Aim, Quality};
use crate::target::{Positions, Target};
use sph::exchange::{Exchange, Traffic};
use std::time::Instant;

/// A stage that can do with the particles of one rank and what it sees of the others'.
pub trait OverRanks<const D: usize>: Stage<D> {
    /// Begins with the particles of this rank; all ranks begin and advance together.
    fn begin_among<'s>(&'s self, particles: Particles<D>, exchange: &'s dyn Exchange) -> Box<dyn Running<D> + 's>;
}

/// Such a stage over ranks.
pub struct OnRanks<'a, S> {
    pub stage: S,
    pub exchange: &'a dyn Exchange,
}

impl<const D: usize, S: OverRanks<D>> Stage<D> for OnRanks<'_, S> {
    fn name(&self) -> StageName {
        self.stage.name()
    }

    fn begin(&self, particles: Particles<D>) -> Box<dyn Running<D> + '_> {
        self.stage.begin_among(particles, self.exchange)
    }

    fn resume(&self, _: &[u8]) -> Result<Box<dyn Running<D> + '_>, String> {
        Err("is of particles over several ranks, and is not kept; start without it".into())
    }
}

/// What any rank has as a reason to stop, which all have to stop for.
pub(super) fn agreed(exchange: &dyn Exchange, outside: Option<StopReason>) -> Option<StopReason> {
    if exchange.is_alone() {
        return outside;
    }
    let reasons = [StopReason::TimeLimit, StopReason::Interrupted];
    let own = outside.map_or(0, |own| 1 + reasons.iter().position(|r| *r == own).unwrap_or(1));
    let all = exchange.max(own as f64) as usize;
    all.checked_sub(1).and_then(|i| reasons.get(i).copied())
}

/// Measurements that a deadline leaves time for: that of a result, and those of the run's end, which take twice as long.
const MEASUREMENTS: u32 = 3;

/// Measures what stages make of particles that are over several ranks, and lets no stage end worse than it began.
pub struct JudgeAmong<'a, const D: usize> {
    pub exchange: &'a dyn Exchange,
    pub target: Target<'a, D>,
    /// Measures this rank's particles together with those of the others.
    pub measure: &'a dyn Fn(&Positions<D>) -> Quality,
    /// Of what was accepted last.
    accepted: Option<Quality>,
}

impl<'a, const D: usize> JudgeAmong<'a, D> {
    pub fn new(
        exchange: &'a dyn Exchange,
        target: Target<'a, D>,
        measure: &'a dyn Fn(&Positions<D>) -> Quality,
    ) -> Self {
        Self { exchange, target, measure, accepted: None }
    }

    /// Runs a stage whose result counts only if it is no worse than `positions`, as under
    /// [`Accepted`](super::acceptance::Accepted), and what this rank has sent in it. All ranks call it together.
    pub fn relax(
        &mut self,
        stage: &OnRanks<'_, impl OverRanks<D>>,
        positions: Positions<D>,
        control: &Control<'_>,
    ) -> (Relaxed<D>, Traffic) {
        let name = stage.name();
        let start = Instant::now();
        let earlier = self.accepted.take().unwrap_or_else(|| (self.measure)(&positions));
        let mut control = *control;
        let kept = MEASUREMENTS * start.elapsed();
        control.deadline = control.deadline.map(|deadline| deadline.checked_sub(kept).unwrap_or(deadline));
        if agreed(self.exchange, control.stop_reason()) == Some(StopReason::TimeLimit) {
            self.accepted = Some(earlier);
            let report = StageReport::not_begun(name, StopReason::TimeLimit);
            let relaxed = Relaxed { particles: positions.into(), reports: vec![report], notes: Vec::new() };
            return (relaxed, Traffic::default());
        }
        control.tell(Event::Begin(Step::Relax(name)));
        let (before, sent_before) = (positions.clone(), self.exchange.traffic());
        let mut relaxed = relax_new(stage, positions, &control);
        let sent = self.exchange.traffic().since(sent_before);
        relaxed.notes.extend(part(self.exchange, &self.target, &mut relaxed.particles.positions));
        let met = relaxed.report().stop == StopReason::ToleranceReached;
        let now = (self.measure)(&relaxed.particles.positions);
        let loss = now.loss_against(&earlier, if met { Aim::DensityMet } else { Aim::Density });
        self.accepted = Some(if loss.is_some() { earlier } else { now });
        if let Some(loss) = loss {
            relaxed.refuse(name, &loss, before.into());
        }
        (relaxed, sent)
    }
}
