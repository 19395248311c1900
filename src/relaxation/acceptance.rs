//! Accepts the result of a stage only if it is no worse than the state before the stage.
//!
//! Stages monitor figures that are cheap to compute, and that are misleading for some targets: contrasts within a support radius, layers
//! thinner than a spacing, vacuum. Acceptance is decided by the measure at the end of a run, over all particles.

use super::contacts::part_contacts;
use super::crowding::{CROWDED, part_crowded};
use super::pairs::{PAIRED, part_crowded_pairs};
use super::report::{Progress, StageName, StopReason};
use super::stage::{Particles, Relaxed, Running, Stage};
use crate::metrics::{Aim, Quality};
use crate::target::{Positions, Target};
use serde::Serialize;
use serde::de::DeserializeOwned;
use sph::exchange::Exchange;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Measures the particles that stages make, and remembers the figures of the last that were accepted.
pub struct Judge<'a, const D: usize> {
    measure: &'a (dyn Fn(&Particles<D>) -> Quality + Sync),
    /// Over which ranks the particles are, all of which come to the same judgement.
    exchange: &'a dyn Exchange,
    /// Seeded particles of the full number, with which particles from splitting are compared.
    seeds: &'a (dyn Fn() -> Option<Particles<D>> + Sync),
    accepted: Mutex<Option<Quality>>,
    /// What measuring once takes, and what it took in all.
    cost: Mutex<[Duration; 2]>,
    /// Whether the last result was not accepted.
    refused: AtomicBool,
}

impl<'a, const D: usize> Judge<'a, D> {
    pub fn new(
        measure: &'a (dyn Fn(&Particles<D>) -> Quality + Sync),
        seeds: &'a (dyn Fn() -> Option<Particles<D>> + Sync),
        exchange: &'a dyn Exchange,
    ) -> Self {
        let (accepted, cost) = (Mutex::new(None), Mutex::new([Duration::ZERO; 2]));
        Self { measure, exchange, seeds, accepted, cost, refused: AtomicBool::new(false) }
    }

    /// Measures what the first stage is given. Returns the time to be kept for measuring its result, and the run's: that of
    /// all particles against the smoothed target takes as long again.
    pub fn look_at(&self, particles: &Particles<D>) -> Duration {
        let mut accepted = self.accepted.lock().unwrap_or_else(PoisonError::into_inner);
        accepted.get_or_insert_with(|| self.timed(particles));
        3 * self.cost.lock().unwrap_or_else(PoisonError::into_inner)[0]
    }

    /// Whether the result of the last stage was not accepted.
    pub fn has_refused(&self) -> bool {
        self.refused.load(Ordering::Relaxed)
    }

    /// Whether other particles are no worse than those accepted last, and better in something; their figures are then those to be kept.
    pub fn prefers(&self, other: &Particles<D>, accepted: &Particles<D>) -> bool {
        self.loss(accepted, other, Aim::Density).is_none()
    }

    /// That of the particles accepted last, in spacings.
    fn closest_pair(&self) -> f64 {
        let accepted = self.accepted.lock().unwrap_or_else(PoisonError::into_inner);
        accepted.as_ref().map_or(f64::INFINITY, |quality| quality.closest_pair)
    }

    fn timed(&self, particles: &Particles<D>) -> Quality {
        let start = Instant::now();
        let quality = (self.measure)(particles);
        let mut cost = self.cost.lock().unwrap_or_else(PoisonError::into_inner);
        *cost = [start.elapsed(), cost[1] + start.elapsed()];
        quality
    }

    /// What measuring took in all.
    pub fn seconds(&self) -> f64 {
        self.cost.lock().unwrap_or_else(PoisonError::into_inner)[1].as_secs_f64()
    }

    /// The figure in which `after` is worse than `before`, if it is; otherwise the figures of `after` are kept from now on. More particles
    /// than before, from splitting, are compared with as many seeded particles, which are returned with the loss.
    fn loss(&self, before: &Particles<D>, after: &Particles<D>, aim: Aim) -> Option<(String, Option<Particles<D>>)> {
        let mut accepted = self.accepted.lock().unwrap_or_else(PoisonError::into_inner);
        let seeds = if before.len() == after.len() {
            None
        } else {
            *accepted = None;
            Some((self.seeds)().filter(|seeds| seeds.len() == after.len())?)
        };
        let before = seeds.as_ref().unwrap_or(before);
        if !self.exchange.any(before.positions != after.positions || before.masses != after.masses) {
            return None;
        }
        let earlier = accepted.take().unwrap_or_else(|| self.timed(before));
        let now = self.timed(after);
        let loss = now.loss_against(&earlier, aim);
        *accepted = Some(if loss.is_some() { earlier } else { now });
        let of = if seeds.is_some() { ", compared with seeded positions of as many particles" } else { "" };
        loss.map(|loss| (format!("{loss}{of}"), seeds))
    }
}

/// A stage under a judge.
pub struct Accepted<'a, const D: usize> {
    pub stage: Box<dyn Stage<D> + 'a>,
    pub target: Target<'a, D>,
    pub judge: &'a Judge<'a, D>,
    pub aim: Aim,
    /// Whether nobody wants what an interrupt leaves: it is not judged then, which takes longer than an iteration.
    pub discards_interrupted: bool,
}

impl<const D: usize> Stage<D> for Accepted<'_, D>
where
    Particles<D>: Serialize + DeserializeOwned,
{
    fn name(&self) -> StageName {
        self.stage.name()
    }

    fn begin(&self, particles: Particles<D>) -> Box<dyn Running<D> + '_> {
        let before = particles.clone();
        Box::new(Watched { inner: self.stage.begin(particles), before, stage: self })
    }

    fn resume(&self, kept: &[u8]) -> Result<Box<dyn Running<D> + '_>, String> {
        let (before, inner) = given_and_own(kept)?;
        Ok(Box::new(Watched { inner: self.stage.resume(inner)?, before, stage: self }))
    }
}

/// What a stage that is judged was given, and its own snapshot, of which both are kept.
///
/// # Errors
/// What is wrong with them.
pub fn given_and_own<const D: usize>(kept: &[u8]) -> Result<(Particles<D>, &[u8]), String>
where
    Particles<D>: DeserializeOwned,
{
    postcard::take_from_bytes(kept).map_err(|e| format!("its content cannot be read ({e}); start without it"))
}

/// A judged stage under way, with what it was given.
struct Watched<'a, const D: usize> {
    inner: Box<dyn Running<D> + 'a>,
    before: Particles<D>,
    stage: &'a Accepted<'a, D>,
}

impl<const D: usize> Running<D> for Watched<'_, D> {
    fn advance(&mut self, outside: Option<StopReason>) -> Option<StopReason> {
        self.inner.advance(outside)
    }

    fn progress(&self) -> (&[Progress], usize) {
        self.inner.progress()
    }

    fn snapshot(&self, to: Vec<u8>) -> Result<Vec<u8>, String> {
        self.inner.snapshot(postcard::to_extend(&self.before, to).map_err(|e| e.to_string())?)
    }

    fn finish(self: Box<Self>, stop: StopReason) -> Relaxed<D> {
        let Self { inner, before, stage } = *self;
        let mut relaxed = inner.finish(stop);
        // On all ranks the same.
        let stop = relaxed.report().stop;
        if stage.discards_interrupted && stop == StopReason::Interrupted {
            return relaxed;
        }
        let exchange = stage.judge.exchange;
        let target = stage.target.with_count(exchange.count(relaxed.particles.len()));
        relaxed.notes.extend(part(exchange, &target, &mut relaxed.particles.positions));
        let met = stage.aim == Aim::Density && stop == StopReason::ToleranceReached;
        let aim = if met { Aim::DensityMet } else { stage.aim };
        let mut loss = stage.judge.loss(&before, &relaxed.particles, aim);
        // What lies too close may be all that is wrong.
        let parts = stage.aim == Aim::Density && stop != StopReason::Interrupted;
        for part in [part_contacts as Part<D>, part_crowded] {
            if parts
                && loss.is_some()
                && let Some(parted) = stage.parted(&relaxed.particles, part)
                && stage.judge.loss(&before, &parted, aim).is_none()
            {
                (loss, relaxed.particles) = (None, parted);
            }
        }
        stage.judge.refused.store(loss.is_some(), Ordering::Relaxed);
        if let Some((loss, seeds)) = loss {
            // What else there is to say is of that result.
            relaxed.notes = vec![format!("the result of {} is not used: {loss}", stage.name().title)];
            relaxed.particles = seeds.unwrap_or(before);
            for report in &mut relaxed.reports {
                report.best_iteration = report.history.first().map_or(0, |p| p.iteration);
            }
        }
        if parts {
            stage.part(&mut relaxed.particles);
        }
        relaxed
    }
}

impl<const D: usize> Accepted<'_, D> {
    /// Parts particles on both sides of a jump, and single pairs that are closer than is good, where that costs nothing else: few of them may be
    /// all that shows a density. The particles are those that were accepted last.
    fn part(&self, particles: &mut Particles<D>) {
        let is_crowded = self.judge.closest_pair() < CROWDED;
        self.part_by(part_contacts, particles);
        if is_crowded {
            self.part_by(part_crowded, particles);
        }
    }

    fn part_by(&self, part: Part<D>, particles: &mut Particles<D>) {
        if let Some(parted) = self.parted(particles, part)
            && self.judge.loss(particles, &parted, Aim::Contacts).is_none()
        {
            *particles = parted;
        }
    }

    /// With those apart that are too close; none where none are.
    fn parted(&self, particles: &Particles<D>, part: Part<D>) -> Option<Particles<D>> {
        let (exchange, mut parted) = (self.judge.exchange, particles.clone());
        let target = self.target.with_count(exchange.count(particles.len()));
        part(exchange, &target, &mut parted.positions).then_some(parted)
    }
}

/// Parts particles; says whether any moved.
type Part<const D: usize> = fn(&dyn Exchange, &Target<'_, D>, &mut Positions<D>) -> bool;

/// Moves what a stage left paired apart; a note if there was anything.
fn part<const D: usize>(
    exchange: &dyn Exchange,
    target: &Target<'_, D>,
    positions: &mut Positions<D>,
) -> Option<String> {
    let paired = part_crowded_pairs(exchange, target, positions);
    (paired > 0).then(|| {
        format!(
            "{paired} particles were within {PAIRED} spacings of another and were moved apart: there the density \
             changes by more than this number of particles can resolve"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::ScalarField;
    use crate::metrics::Ledger;
    use crate::relaxation::{Control, Event, Start, Wvt, WvtOptions, relax};
    use sph::domain::{Axis, Domain, Region};
    use sph::exchange::Alone;
    use sph::kernel::{KernelName, default_kernel_neighbors};
    use std::sync::atomic::AtomicUsize;

    struct Uniform;

    impl ScalarField<2> for Uniform {
        fn value(&self, _: &[f64; 2]) -> f64 {
            1.0
        }
    }

    /// How often particles are measured by a stage that is interrupted in its third iteration.
    fn measures_of(discards_interrupted: bool) -> usize {
        let domain = Domain::new([0.0; 2], [1.0; 2], [Axis::Periodic; 2], Region::Box).unwrap();
        let target = Target::of_equal_masses(&domain, &Uniform, 200, 1.0);
        let (ledger, count) = (Ledger::new(&target), AtomicUsize::new(0));
        let (kernel, neighbors) = (KernelName::default(), default_kernel_neighbors(2));
        let measure = |particles: &Particles<2>| {
            count.fetch_add(1, Ordering::Relaxed);
            Quality::among(&Alone, kernel, (&target, &ledger), (&particles.positions, None), neighbors)
        };
        let judge = Judge::new(&measure, &|| None, &Alone);
        let stage = Box::new(Wvt { kernel, target, options: WvtOptions::new(2) });
        let stage = Accepted { stage, target, judge: &judge, aim: Aim::Density, discards_interrupted };
        let interrupted = AtomicBool::new(false);
        let observer = |event: Event| {
            interrupted.store(matches!(event, Event::Iteration { iteration: 3.., .. }), Ordering::Relaxed);
        };
        let control = Control { deadline: None, interrupted: &interrupted, observer: &observer };
        let places = [0.618, 0.414].map(|step| (1..=200).map(|i| (f64::from(i) * step).fract()).collect());
        let relaxed = relax(&stage, Start::New(Positions::from(places).into()), &control, &mut |_, _| {}).unwrap();
        assert_eq!(relaxed.report().stop, StopReason::Interrupted);
        count.load(Ordering::Relaxed)
    }

    #[test]
    fn what_an_interrupt_throws_away_is_not_judged() {
        assert_eq!(measures_of(true), 0);
        assert!(measures_of(false) > 0);
    }
}
