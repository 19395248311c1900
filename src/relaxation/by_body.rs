//! A stage that relaxes the bodies of a target separately, one after the other.
//!
//! Nothing that a body lacks or has too much of can come from, or go to, another; and what lies between them, were it
//! vacuum, costs nothing.
//!
//! Over several ranks those that have particles of a body relax it together, and others go on with theirs.

use super::on_ranks::{OverRanks, agreed_stop, note_on_traffic};
use super::report::{Progress, StageName, StageReport, StopReason};
use super::snapshot::{decode, encode};
use super::stage::{Particles, Relaxed, Running, Stage};
use crate::target::{Regions, Selected, Target, at};
use serde::{Deserialize, Serialize};
use sph::exchange::{Alone, Exchange, Group, Traffic};
use std::sync::OnceLock;

/// Particles that a body has at least for them to be relaxed.
const LEAST: usize = 3;

/// One stage for each body; none for those with too few particles.
pub struct ByBody<'a, const D: usize, S> {
    name: StageName,
    target: Target<'a, D>,
    stages: Vec<Option<S>>,
    exchange: &'a dyn Exchange,
    /// Known once there are particles.
    turns: OnceLock<Vec<Turn<'a>>>,
}

/// A body, and the ranks that relax it.
struct Turn<'a> {
    body: usize,
    /// Where there are others.
    group: Option<Group<'a>>,
}

impl Turn<'_> {
    fn exchange(&self) -> &dyn Exchange {
        self.group.as_ref().map_or(&Alone, |group| group)
    }
}

impl<'a, const D: usize, S: OverRanks<D>> ByBody<'a, D, S> {
    /// `make` makes the stage of a body's target, particles of which are over the ranks of `exchange`. `None` where `target` has no regions.
    pub fn new(
        name: StageName,
        target: Target<'a, D>,
        exchange: &'a dyn Exchange,
        make: impl Fn(Target<'a, D>) -> S,
    ) -> Option<Self> {
        let regions = target.regions()?;
        let counts = regions.counts(target.count);
        let stage = |body: usize| {
            let of = Selected::Body(body);
            let count = regions.selected(of).map(|region| counts[region]).sum();
            (count >= LEAST).then(|| make(target.selected(regions, of, count)))
        };
        let stages = (0..regions.bodies()).map(stage).collect();
        Some(Self { name, target, stages, exchange, turns: OnceLock::new() })
    }

    /// The bodies in the order in which this rank relaxes them, where it has so many particles of each: those of several ranks come first.
    fn turns(&self, own: &[usize]) -> &[Turn<'a>] {
        self.turns.get_or_init(|| {
            let (exchange, bodies) = (self.exchange, self.stages.len());
            if exchange.is_alone() {
                return (0..bodies).map(|body| Turn { body, group: None }).collect();
            }
            let all = exchange.all(&own.iter().map(|n| *n as f64).collect::<Vec<f64>>());
            let members = |body: usize| (0..all.len()).filter(|rank| all[*rank][body] > 0.0).collect::<Vec<usize>>();
            let members: Vec<Vec<usize>> = (0..bodies).map(members).collect();
            let rounds = rounds(&members);
            let mut order: Vec<usize> = (0..bodies).collect();
            order.sort_by_key(|&body| (rounds[body].unwrap_or(usize::MAX), body));
            let turn = |body: usize| {
                let group = rounds[body].and_then(|_| Group::new(exchange, members[body].clone()));
                Turn { body, group }
            };
            order.into_iter().map(turn).collect()
        })
    }

    fn divided(&self, particles: &Particles<D>) -> Vec<Particles<D>> {
        let mut members = vec![Vec::new(); self.stages.len()];
        for i in 0..particles.len() {
            let body = |r: &Regions<'_, D>| r.of(&at(&particles.positions, i)).map(|region| r.body_of(region));
            members[self.target.regions().and_then(body).unwrap_or(0)].push(i);
        }
        members.iter().map(|m| particles.rows(m.iter().copied())).collect()
    }
}

/// The round in which each body that several ranks have is relaxed: bodies that share a rank are in different rounds, so that none waits for more
/// than it has to.
fn rounds(members: &[Vec<usize>]) -> Vec<Option<usize>> {
    let mut taken: Vec<(usize, usize)> = Vec::new();
    let round = |of: &Vec<usize>| {
        if of.len() < 2 {
            return None;
        }
        let is_free = |round: &usize| of.iter().all(|rank| !taken.contains(&(*rank, *round)));
        let round = (0..).find(is_free)?;
        taken.extend(of.iter().map(|rank| (*rank, round)));
        Some(round)
    };
    members.iter().map(round).collect()
}

impl<const D: usize, S: OverRanks<D>> Stage<D> for ByBody<'_, D, S> {
    fn name(&self) -> StageName {
        self.name
    }

    fn begin(&self, particles: Particles<D>) -> Box<dyn Running<D> + '_> {
        let before = self.exchange.traffic();
        let mut parts: Vec<Option<Particles<D>>> = self.divided(&particles).into_iter().map(Some).collect();
        let own: Vec<usize> = parts.iter().flatten().map(Particles::len).collect();
        let turns = self.turns(&own);
        let waiting = turns.iter().rev().filter_map(|turn| parts[turn.body].take()).collect();
        let state = State { waiting, ..State::default() };
        Box::new(Run { stage: self, turns, state, inner: None, before })
    }

    fn resume(&self, kept: &[u8]) -> Result<Box<dyn Running<D> + '_>, String> {
        let (state, inner): (State<D>, Option<Vec<u8>>) = decode(kept)?;
        let regions = self.stages.len();
        if state.done.len() + state.waiting.len() + usize::from(inner.is_some()) != regions {
            return Err(format!("is of another number of regions than {regions}"));
        }
        let turns = self.turns(&vec![0; regions]);
        let stage = turns.get(state.done.len()).and_then(|turn| self.stages[turn.body].as_ref());
        let inner = match (inner, stage) {
            (None, _) => None,
            (Some(bytes), Some(stage)) => Some(stage.resume(&bytes)?),
            (Some(_), None) => return Err("is of a region that this run does not relax".into()),
        };
        Ok(Box::new(Run { stage: self, turns, state, inner, before: Traffic::default() }))
    }

    fn goes_in_step(&self) -> bool {
        self.exchange.is_alone()
    }

    /// One rank alone makes snapshots.
    fn left(&self, kept: &[u8]) -> Result<Particles<D>, String> {
        let (state, inner): (State<D>, Option<Vec<u8>>) = decode(kept)?;
        let State { mut done, waiting, .. } = state;
        if let Some(bytes) = inner {
            let stage = self.stages.get(done.len()).and_then(Option::as_ref);
            let stage = stage.ok_or("is of a region that this run does not relax")?;
            done.push(stage.left_by_a_rank(&bytes)?);
        }
        done.extend(waiting.into_iter().rev());
        Ok(Particles::joined(done))
    }
}

/// What is there beside the region that is being relaxed.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct State<const D: usize> {
    /// In the order of turns.
    done: Vec<Particles<D>>,
    /// The next last.
    waiting: Vec<Particles<D>>,
    /// Of the turns that were taken, with their numbers.
    reports: Vec<(usize, StageReport<String>)>,
    notes: Vec<String>,
    /// Of all regions so far; that of the one at work in front of what it has told.
    history: Vec<Progress>,
    /// Where the region at work began in the history.
    began: usize,
}

struct Run<'s, 'a, const D: usize, S> {
    stage: &'s ByBody<'a, D, S>,
    turns: &'s [Turn<'a>],
    state: State<D>,
    inner: Option<Box<dyn Running<D> + 's>>,
    /// What had been sent before it.
    before: Traffic,
}

impl<const D: usize, S: OverRanks<D>> Run<'_, '_, D, S> {
    /// Takes up what the region at work has told since.
    fn follow(&mut self) {
        let Some(inner) = &self.inner else { return };
        let (told, _) = inner.progress();
        let State { history, began, .. } = &mut self.state;
        let before = began.checked_sub(1).map(|last| history[last]);
        history.extend(told[history.len() - *began..].iter().map(|p| after(before, p)));
    }

    /// Begins with the next region, if all ranks that have particles of it do.
    fn begin(&mut self, outside: Option<StopReason>) {
        let turn = &self.turns[self.state.done.len()];
        let Some(particles) = self.state.waiting.pop() else { return };
        match &self.stage.stages[turn.body] {
            Some(stage) if !particles.is_empty() => match agreed_stop(turn.exchange(), outside) {
                None => self.inner = Some(stage.begin_among(particles, turn.exchange())),
                Some(stop) => {
                    let report = StageReport::not_begun(self.stage.name.name.to_owned(), stop);
                    self.state.reports.push((self.state.done.len(), report));
                    self.state.done.push(particles);
                }
            },
            _ => self.state.done.push(particles),
        }
    }

    /// Ends the region at work.
    fn end(&mut self, stop: StopReason) {
        let Some(inner) = self.inner.take() else { return };
        let relaxed = inner.finish(stop);
        let turn = self.state.done.len();
        self.state.done.push(relaxed.particles);
        self.state.notes.extend(relaxed.notes);
        let named = |r: StageReport| (turn, r.with_name(self.stage.name.name.to_owned()));
        self.state.reports.extend(relaxed.reports.into_iter().map(named));
        self.state.began = self.state.history.len();
    }

    /// What each body came to, with its number of particles, in their order and on all ranks.
    fn each(&self) -> Vec<Told> {
        let led = self.state.reports.iter().filter_map(|(turn, report)| {
            let exchange = self.turns[*turn].exchange();
            let particles = exchange.count(self.state.done[*turn].len());
            let body = self.turns[*turn].body;
            (exchange.rank() == 0).then(|| Told { body, particles, report: report.clone() })
        });
        let exchange = self.stage.exchange;
        let led: Vec<Told> = led.collect();
        if exchange.is_alone() {
            return led;
        }
        let packed: Vec<f64> = led.iter().flat_map(Told::packed).collect();
        let mut all: Vec<Told> = exchange.all(&packed).iter().flat_map(|p| Told::unpacked(p)).collect();
        all.sort_by_key(|told| told.body);
        all
    }

    /// Why the stage ends, after what each body ended for.
    fn worst(stops: impl Iterator<Item = StopReason>) -> StopReason {
        stops.max_by_key(|stop| (stop.is_cut(), *stop != StopReason::ToleranceReached)).unwrap_or(StopReason::NotNeeded)
    }
}

/// The progress of a stage that goes on where another ended `before` it.
fn after(before: Option<Progress>, p: &Progress) -> Progress {
    let (iteration, seconds) = before.map_or((0, 0.0), |p| (p.iteration + 1, p.seconds));
    Progress { iteration: p.iteration + iteration, seconds: p.seconds + seconds, ..*p }
}

impl<const D: usize, S: OverRanks<D>> Running<D> for Run<'_, '_, D, S> {
    fn advance(&mut self, outside: Option<StopReason>) -> Option<StopReason> {
        if self.inner.is_none() && outside.is_none() {
            if self.state.waiting.is_empty() {
                return Some(StopReason::NotNeeded);
            }
            self.begin(None);
        }
        if let Some(inner) = &mut self.inner {
            let stop = inner.advance(outside);
            self.follow();
            if let Some(stop) = stop {
                self.end(stop);
            }
        }
        let ends = self.inner.is_none() && self.state.waiting.is_empty();
        outside.or_else(|| ends.then(|| Self::worst(self.state.reports.iter().map(|(_, r)| r.stop))))
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
        // Others that have particles of those regions hear of it when they come to them.
        while !self.state.waiting.is_empty() {
            self.begin(Some(stop));
        }
        let each = self.each();
        let steps = self.stage.stages.iter().flatten().next().map_or((0, ""), |stage| stage.steps(&self.state.history));
        let Self { state: State { done, mut notes, .. }, stage, turns, before, .. } = *self;
        let begun: Vec<&Told> = each.iter().filter(|told| !told.report.history.is_empty()).collect();
        let mut history: Vec<Progress> = Vec::new();
        for told in &begun {
            let before = history.last().copied();
            history.extend(told.report.history.iter().map(|p| after(before, p)));
        }
        // The mean over regions, as epsilon is one over particles.
        let total: f64 = begun.iter().map(|told| told.particles as f64).sum();
        let epsilon = begun.iter().filter_map(|t| Some(t.report.epsilon()? * t.particles as f64 / total)).sum();
        let seconds = begun.iter().map(|told| told.report.seconds).sum();
        let last = history.last().map_or(0, |p| p.iteration + 1);
        if !begun.is_empty() {
            history.push(Progress { iteration: last, epsilon, force_error: None, largest_step: 0.0, seconds });
        }
        let stop = match agreed_stop(stage.exchange, stop.is_cut().then_some(stop)) {
            Some(cut) => cut,
            None if stage.exchange.is_alone() => stop,
            None => Self::worst(each.iter().map(|told| told.report.stop)),
        };
        let report = StageReport { stage: stage.name, stop, best_iteration: last, seconds, history };
        notes.dedup();
        notes.extend(note_on_traffic(stage.exchange, before, steps));
        Relaxed { particles: Particles::joined(in_order(turns, done)), reports: vec![report], notes }
    }
}

/// What a body came to.
struct Told {
    body: usize,
    particles: usize,
    report: StageReport<String>,
}

/// Numbers for one body in front of its history, and for one entry of it.
const HEAD: usize = 6;
const ENTRY: usize = 4;

impl Told {
    fn packed(&self) -> Vec<f64> {
        let Self { body, particles, report: StageReport { stop, best_iteration, history, seconds, .. } } = self;
        let stop = StopReason::ALL.iter().position(|s| s == stop).unwrap_or(StopReason::ALL.len() - 1);
        let numbers = [*body, *particles, stop, *best_iteration, history.len()].map(|n| n as f64);
        let entry = |p: &Progress| [p.iteration as f64, p.epsilon, p.largest_step, p.seconds];
        numbers.into_iter().chain([*seconds]).chain(history.iter().flat_map(entry)).collect()
    }

    fn unpacked(mut numbers: &[f64]) -> Vec<Self> {
        let mut all = Vec::new();
        while numbers.len() >= HEAD {
            let (head, rest) = numbers.split_at(HEAD);
            let (history, rest) = rest.split_at(ENTRY * head[4] as usize);
            let entry = |p: &[f64]| Progress {
                iteration: p[0] as usize,
                epsilon: p[1],
                force_error: None,
                largest_step: p[2],
                seconds: p[3],
            };
            let report = StageReport {
                stage: String::new(),
                stop: StopReason::ALL[head[2] as usize],
                best_iteration: head[3] as usize,
                seconds: head[5],
                history: history.chunks_exact(ENTRY).map(entry).collect(),
            };
            all.push(Self { body: head[0] as usize, particles: head[1] as usize, report });
            numbers = rest;
        }
        all
    }
}

/// The particles of each body, in the order of bodies.
fn in_order<const D: usize>(turns: &[Turn<'_>], done: Vec<Particles<D>>) -> Vec<Particles<D>> {
    let mut parts: Vec<(usize, Particles<D>)> = turns.iter().map(|turn| turn.body).zip(done).collect();
    parts.sort_by_key(|(body, _)| *body);
    parts.into_iter().map(|(_, particles)| particles).collect()
}
