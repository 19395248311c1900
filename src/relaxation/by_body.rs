//! A stage that relaxes the bodies of a target one after the other, each by itself.
//!
//! Nothing that a body lacks or has too much of can come from, or go to, another; and what lies between them, were it
//! vacuum, costs nothing.

use super::report::{Progress, StageName, StageReport, StopReason};
use super::snapshot::{decode, encode};
use super::stage::{Particles, Relaxed, Running, Stage};
use crate::target::{Positions, Regions, Selected, Target, at};
use serde::{Deserialize, Serialize};

/// Particles that a body has at least for them to be relaxed.
const LEAST: usize = 3;

/// One stage for each body; none for those with too few particles.
pub struct ByBody<'a, const D: usize> {
    name: StageName,
    target: Target<'a, D>,
    stages: Vec<Option<Box<dyn Stage<D> + 'a>>>,
}

impl<'a, const D: usize> ByBody<'a, D> {
    /// `make` makes the stage of a body's target. `None` where `target` has no regions.
    pub fn new(
        name: StageName,
        target: Target<'a, D>,
        make: impl Fn(Target<'a, D>) -> Box<dyn Stage<D> + 'a>,
    ) -> Option<Self> {
        let regions = target.regions()?;
        let counts = regions.counts(target.count);
        let stage = |body: usize| {
            let of = Selected::Body(body);
            let count = regions.selected(of).map(|region| counts[region]).sum();
            (count >= LEAST).then(|| make(target.selected(regions, of, count)))
        };
        let stages = (0..regions.bodies()).map(stage).collect();
        Some(Self { name, target, stages })
    }

    fn divided(&self, particles: &Particles<D>) -> Vec<Particles<D>> {
        let mut members = vec![Vec::new(); self.stages.len()];
        for i in 0..particles.len() {
            let body = |r: &Regions<'_, D>| r.of(&at(&particles.positions, i)).map(|region| r.body_of(region));
            members[self.target.regions().and_then(body).unwrap_or(0)].push(i);
        }
        let values = |of: &Option<Vec<f64>>, m: &[usize]| of.as_ref().map(|v| m.iter().map(|&i| v[i]).collect());
        let part = |m: &Vec<usize>| Particles {
            positions: particles.positions.each_ref().map(|x| m.iter().map(|&i| x[i]).collect()),
            masses: values(&particles.masses, m),
            internal_energy: values(&particles.internal_energy, m),
        };
        members.iter().map(part).collect()
    }
}

impl<const D: usize> Stage<D> for ByBody<'_, D> {
    fn name(&self) -> StageName {
        self.name
    }

    fn begin(&self, particles: Particles<D>) -> Box<dyn Running<D> + '_> {
        let mut waiting = self.divided(&particles);
        waiting.reverse();
        let state = State { waiting, ..State::default() };
        Box::new(Run { stage: self, state, inner: None })
    }

    fn resume(&self, kept: &[u8]) -> Result<Box<dyn Running<D> + '_>, String> {
        let (state, inner): (State<D>, Option<Vec<u8>>) = decode(kept)?;
        let regions = self.stages.len();
        if state.done.len() + state.waiting.len() + usize::from(inner.is_some()) != regions {
            return Err(format!("is of another number of regions than {regions}"));
        }
        let stage = self.stages.get(state.done.len()).and_then(Option::as_ref);
        let inner = match (inner, stage) {
            (None, _) => None,
            (Some(bytes), Some(stage)) => Some(stage.resume(&bytes)?),
            (Some(_), None) => return Err("is of a region that this run does not relax".into()),
        };
        Ok(Box::new(Run { stage: self, state, inner }))
    }
}

/// What is there beside the region that is being relaxed.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct State<const D: usize> {
    done: Vec<Particles<D>>,
    /// The next last.
    waiting: Vec<Particles<D>>,
    reports: Vec<StageReport<String>>,
    notes: Vec<String>,
    /// Of all regions so far; that of the one at work in front of what it has told.
    history: Vec<Progress>,
    /// Where the region at work began in the history.
    began: usize,
}

struct Run<'a, const D: usize> {
    stage: &'a ByBody<'a, D>,
    state: State<D>,
    inner: Option<Box<dyn Running<D> + 'a>>,
}

impl<const D: usize> Run<'_, D> {
    /// Takes up what the region at work has told since.
    fn follow(&mut self) {
        let Some(inner) = &self.inner else { return };
        let (told, _) = inner.progress();
        let State { history, began, .. } = &mut self.state;
        let before = began.checked_sub(1).map(|last| history[last]);
        let (iteration, seconds) = before.map_or((0, 0.0), |p| (p.iteration + 1, p.seconds));
        for p in &told[history.len() - *began..] {
            history.push(Progress { iteration: p.iteration + iteration, seconds: p.seconds + seconds, ..*p });
        }
    }

    /// Ends the region at work.
    fn end(&mut self, stop: StopReason) {
        let Some(inner) = self.inner.take() else { return };
        let relaxed = inner.finish(stop);
        self.state.done.push(relaxed.particles);
        self.state.notes.extend(relaxed.notes);
        self.state.reports.extend(relaxed.reports.into_iter().map(|r| r.with_name(self.stage.name.name.to_owned())));
        self.state.began = self.state.history.len();
    }
}

impl<const D: usize> Running<D> for Run<'_, D> {
    fn advance(&mut self, outside: Option<StopReason>) -> Option<StopReason> {
        if self.inner.is_none() && outside.is_none() {
            let particles = self.state.waiting.pop()?;
            match &self.stage.stages[self.state.done.len()] {
                Some(stage) if !particles.is_empty() => self.inner = Some(stage.begin(particles)),
                _ => self.state.done.push(particles),
            }
        }
        if let Some(inner) = &mut self.inner {
            let stop = inner.advance(outside);
            self.follow();
            if let Some(stop) = stop {
                self.end(stop);
            }
        }
        let worst = |reports: &[StageReport<String>]| {
            let stops = reports.iter().map(|r| r.stop);
            stops
                .max_by_key(|stop| (stop.is_cut(), *stop != StopReason::ToleranceReached))
                .unwrap_or(StopReason::NotNeeded)
        };
        let ends = self.inner.is_none() && self.state.waiting.is_empty();
        outside.or_else(|| ends.then(|| worst(&self.state.reports)))
    }

    fn progress(&self) -> (&[Progress], usize) {
        let ahead = self.inner.as_ref().map_or(0, |inner| inner.progress().1);
        let told = self.state.began.checked_sub(1).map_or(0, |last| self.state.history[last].iteration + 1);
        (&self.state.history, told + ahead * (1 + self.state.waiting.len()))
    }

    fn snapshot(&self, to: Vec<u8>) -> Result<Vec<u8>, String> {
        let inner = self.inner.as_ref().map(|inner| inner.snapshot(Vec::new())).transpose()?;
        encode(&(&self.state, inner), to)
    }

    fn finish(mut self: Box<Self>, stop: StopReason) -> Relaxed<D> {
        self.end(stop);
        let Self { state: State { mut done, waiting, reports, notes, mut history, .. }, stage, .. } = *self;
        let relaxed: Vec<f64> = done.iter().filter(|p| p.len() >= LEAST).map(|p| p.len() as f64).collect();
        done.extend(waiting.into_iter().rev());
        // The mean over regions, as epsilon is one over particles.
        let total: f64 = relaxed.iter().sum();
        let epsilon = reports.iter().zip(&relaxed).filter_map(|(r, n)| Some(r.epsilon()? * n / total)).sum();
        let seconds = reports.iter().map(|r| r.seconds).sum();
        let last = history.last().map_or(0, |p| p.iteration + 1);
        if !reports.is_empty() {
            history.push(Progress { iteration: last, epsilon, force_error: None, largest_step: 0.0, seconds });
        }
        let report = StageReport { stage: stage.name, stop, best_iteration: last, seconds, history };
        let mut notes = notes;
        notes.dedup();
        Relaxed { particles: joined(&done), reports: vec![report], notes }
    }
}

fn joined<const D: usize>(parts: &[Particles<D>]) -> Particles<D> {
    let positions: Positions<D> =
        std::array::from_fn(|k| parts.iter().flat_map(|p| p.positions[k].iter().copied()).collect());
    let all = |of: &dyn Fn(&Particles<D>) -> Option<&Vec<f64>>| -> Option<Vec<f64>> {
        parts.iter().map(of).collect::<Option<Vec<_>>>().map(|v| v.into_iter().flatten().copied().collect())
    };
    Particles { positions, masses: all(&|p| p.masses.as_ref()), internal_energy: all(&|p| p.internal_energy.as_ref()) }
}
