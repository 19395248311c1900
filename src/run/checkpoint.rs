//! Checkpoints: the state from which a run continues after an interrupt, a kill or its time limit.
//!
//! A file holds, behind a mark, a version and a checksum, the scene that it belongs to, a fingerprint of the
//! target, what came out so far, and the state of the stage under way, as [`postcard`] writes them: floating-point numbers bit by bit.
//! It is replaced as a whole, so that whenever the run ends there is the last one or none. Several ranks have a file each, see
//! `checkpoint_parts`.

use super::checkpoint_file::{self, payload, unreadable};
use super::checkpoint_parts::{self, Family, Pieces};
use super::fingerprint::Hash;
use super::gathered::agreed;
use crate::error::{Error, Result};
use crate::relaxation::{Control, Particles, Snapshot, StageName, StageReport, StopReason};
use crate::scene::{CheckpointInput, Scene};
use crate::target::Target;
use serde::{Deserialize, Serialize};
use sph::exchange::{Alone, Exchange};
use sph_formats::FormatError;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The first bytes of a checkpoint.
const MARK: &[u8; 8] = b"SPHPREPC";

/// Removes the checkpoint of a run that has come to its end; a note where that fails.
pub(super) fn remove_checkpoint(scene: &Scene, stop: StopReason) -> Option<String> {
    let file = scene.checkpoint.file.as_deref().filter(|f| f.is_file() && !stop.is_cut())?;
    let error = checkpoint_parts::remove(file).err()?;
    Some(format!("the checkpoint '{}' is no longer needed but cannot be removed: {error}", file.display()))
}

/// What a run ends with that is interrupted where it has no state of its own to keep, unless its particles are to be written then: with the checkpoint
/// of what came before, where there is one.
///
/// # Errors
/// The end.
pub(super) fn refuse_interrupted(scene: &Scene, control: &Control<'_>) -> Result<()> {
    if !(control.is_interrupted() && scene.discards_interrupted()) {
        return Ok(());
    }
    Err(left_by(scene).map_or(Error::Interrupted, |file| Error::InterruptedKept(file.into())))
}

/// The scene's checkpoint, where there is one that may belong to it. It is not looked at as a whole, which takes seconds where particles are many; of
/// several ranks' the scene is not known.
pub(crate) fn left_by(scene: &Scene) -> Option<&Path> {
    let file = scene.checkpoint.file.as_deref()?;
    let beginning = |mark| checkpoint_file::beginning(file, mark, MOST_OF_ORIGIN);
    let is_own = |bytes: Vec<u8>| {
        let origin = postcard::take_from_bytes::<Origin>(&bytes);
        origin.is_ok_and(|(origin, _)| origin.scene == Origin::relevant(scene).to_yaml())
    };
    let is_its = beginning(MARK).is_some_and(is_own) || beginning(checkpoint_parts::MARK).is_some();
    is_its.then_some(file)
}

/// Bytes that what a checkpoint belongs to takes at most: most are the scene's.
const MOST_OF_ORIGIN: u64 = 1 << 24;

/// What a checkpoint belongs to.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Origin {
    version: String,
    dimension: usize,
    pub(super) particles: usize,
    /// The scene without what has no influence on the result.
    scene: String,
    /// The wanted number density at many places: the input's content, whatever its path.
    target: u64,
}

/// What is known of a run beside its particles.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Meta {
    /// What seeding and stages had to say, and the seconds of the seeding.
    pub notes: Vec<String>,
    pub seed_seconds: f64,
    /// Of the stages before.
    pub reports: Vec<StageReport<String>>,
    /// The stage to go on with, in the plan, and its name.
    pub stage: usize,
    pub name: String,
    /// Whether the stage has begun: its own snapshot follows, else the particles that it begins with.
    pub begun: bool,
}

/// What a run goes on from.
pub enum Kept<'k, const D: usize> {
    /// The particles before a stage.
    Between(Particles<D>),
    /// The snapshot of a stage under way.
    Within(&'k [u8]),
}

/// Writes checkpoints when they are due. All ranks call what writes together, while a stage goes in step.
pub struct Checkpoints<'a> {
    exchange: &'a dyn Exchange,
    /// The last that several ranks have written, until another is in its place.
    family: Family,
    file: Option<PathBuf>,
    interval: Duration,
    last: Instant,
    origin: Origin,
    /// Nothing that follows an early end may replace the state that goes on from it.
    sealed: bool,
    /// It holds what the last stage left.
    finished: bool,
    /// Why the last one could not be written.
    failure: Option<String>,
}

impl<'a> Checkpoints<'a> {
    /// As the scene says.
    ///
    /// # Errors
    /// A file that could not be written.
    pub fn new<const D: usize>(exchange: &'a dyn Exchange, scene: &Scene, target: &Target<'_, D>) -> Result<Self> {
        let CheckpointInput { file, minutes, resume } = &scene.checkpoint;
        let probe = file.as_deref().map_or(Ok(()), sph_formats::output::probe);
        agreed(exchange, probe.map_err(Error::from))?;
        let family = file.as_deref().map_or_else(Family::default, |file| Family::of(exchange, file));
        let origin = if file.is_some() || resume.is_some() { Origin::new(scene, target) } else { Origin::default() };
        let interval = Duration::try_from_secs_f64(60.0 * minutes).unwrap_or(Duration::MAX);
        Ok(Self { exchange, family, file: file.clone(), interval, origin, ..Self::off() })
    }

    /// Writes none.
    pub fn off() -> Self {
        Self {
            exchange: &Alone,
            family: Family::default(),
            file: None,
            interval: Duration::MAX,
            last: Instant::now(),
            origin: Origin::default(),
            sealed: false,
            finished: false,
            failure: None,
        }
    }

    /// Writes the state of a stage under way, if it is time for it or the stage is `stopping`. A checkpoint that cannot be
    /// written is no reason to end a run.
    pub fn offer(&mut self, stopping: bool, meta: &Meta, state: Snapshot<'_>) {
        if self.sealed || self.file.is_none() {
            return;
        }
        let stopping = self.exchange.any(stopping);
        if stopping || self.exchange.any(self.last.elapsed() >= self.interval) {
            self.write(meta, state);
            self.sealed = stopping;
        }
    }

    /// Writes what comes before a stage that does not offer its state.
    pub fn begin<const D: usize>(&mut self, meta: &Meta, particles: &Particles<D>) {
        if !self.sealed {
            self.write(meta, &|to| postcard::to_extend(particles, to).map_err(|e| e.to_string()));
        }
    }

    /// Writes what the last stage left, so that measuring and writing can be repeated.
    pub fn finish<const D: usize>(&mut self, meta: &Meta, particles: &Particles<D>) {
        if !self.sealed {
            self.finished = true;
            self.write(meta, &|to| postcard::to_extend(particles, to).map_err(|e| e.to_string()));
        }
    }

    /// Writes what comes before a stage for which there is no time.
    pub fn leave<const D: usize>(&mut self, meta: &Meta, particles: &Particles<D>) {
        self.finish(meta, particles);
        self.sealed = true;
    }

    fn write(&mut self, meta: &Meta, state: Snapshot<'_>) {
        let Some(file) = self.file.as_deref() else { return };
        let make = |path: &Path| {
            checkpoint_file::write(path, MARK, |bytes| {
                let bytes = postcard::to_extend(&self.origin, bytes).map_err(|e| e.to_string())?;
                state(postcard::to_extend(meta, bytes).map_err(|e| e.to_string())?)
            })
        };
        let written = match self.exchange.is_alone() {
            true => make(file).map(|_| self.family.clear(file)).map_err(|e| e.to_string()),
            false => self.family.replace(self.exchange, file, make),
        };
        self.failure = written.err();
        self.last = Instant::now();
    }

    /// What a run ends with that an interrupt is to leave no particles of.
    pub fn interrupted(&self) -> Error {
        let file = self.file.as_ref().filter(|_| self.sealed || self.finished);
        match (file, &self.failure) {
            (None, _) => Error::Interrupted,
            (Some(file), None) => Error::InterruptedKept(file.clone()),
            (Some(file), Some(problem)) => {
                let earlier = if file.is_file() { "; that of before is there to --resume" } else { "" };
                Error::InterruptedUnkept(format!("{problem}{earlier}"))
            }
        }
    }

    /// The file of the state that an early end left.
    pub fn sealed(&self) -> Option<&Path> {
        self.file.as_deref().filter(|_| self.sealed && self.failure.is_none())
    }

    pub fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    /// The bytes that this rank goes on from.
    ///
    /// # Errors
    /// A file that cannot be read, or a part of it.
    pub(super) fn read(&self, path: &Path) -> Result<Pieces> {
        let bytes = checkpoint_file::read(path, &[MARK, checkpoint_parts::MARK])
            .map_err(|e| FormatError::io(path, "read the checkpoint", e))?;
        if bytes.starts_with(checkpoint_parts::MARK) {
            return Pieces::of_family((path, &bytes), self.exchange, self.origin.particles)
                .map_err(|problem| Error::Checkpoint { path: path.into(), problem });
        }
        Ok(Pieces::of_one(bytes, self.exchange, self.origin.particles))
    }

    /// The state to go on from in a run of these `stages`.
    ///
    /// # Errors
    /// What is no checkpoint, is damaged, or belongs to another run.
    pub fn open<'k, const D: usize>(
        &self,
        bytes: &'k [u8],
        stages: &[StageName],
    ) -> std::result::Result<(Meta, Kept<'k, D>), String> {
        let payload = payload(bytes, MARK)?;
        let (origin, rest) = postcard::take_from_bytes::<Origin>(payload).map_err(|e| unreadable(&e))?;
        self.origin.compare(&origin)?;
        let (meta, state) = postcard::take_from_bytes::<Meta>(rest).map_err(|e| unreadable(&e))?;
        let known = match stages.get(meta.stage) {
            Some(stage) => stage.name == meta.name,
            None => meta.stage == stages.len() && !meta.begun,
        };
        if !known {
            return Err("is of a stage that this run does not have; start without it".into());
        }
        if meta.begun {
            return Ok((meta, Kept::Within(state)));
        }
        let particles: Particles<D> = postcard::from_bytes(state).map_err(|e| unreadable(&e))?;
        let finite = |values: &[f64]| values.len() == particles.len() && values.iter().all(|v| v.is_finite());
        let sound = particles.positions.iter().all(|x| finite(x))
            && [&particles.masses, &particles.internal_energy].into_iter().flatten().all(|v| finite(v))
            && (meta.stage < stages.len() || !self.exchange.is_alone() || particles.len() == self.origin.particles);
        if !sound {
            return Err("contains particles that are not finite, or a different number of particles; start without \
                        it"
            .into());
        }
        Ok((meta, Kept::Between(particles)))
    }
}

/// Places at which the target is compared.
const PROBES: u32 = 4096;

impl Origin {
    pub(super) fn new<const D: usize>(scene: &Scene, target: &Target<'_, D>) -> Self {
        let domain = target.domain;
        let mut hash = Hash::default();
        for i in 1..=PROBES {
            // A sequence that fills the box evenly: multiples of irrational numbers.
            let x: [f64; D] = sph::array(|k| {
                let share = (f64::from(i)
                    * [0.618_033_988_749_894_9, 0.414_213_562_373_095, 0.732_050_807_568_877_2][k])
                    .fract();
                domain.lo[k] + share * (domain.hi[k] - domain.lo[k])
            });
            if domain.contains(&x) {
                hash.add(&target.number_density(&x).to_bits().to_le_bytes());
            }
        }
        (0..D).for_each(|k| hash.add(&(domain.hi[k] - domain.lo[k]).to_bits().to_le_bytes()));
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            dimension: D,
            particles: target.count,
            scene: Self::relevant(scene).to_yaml(),
            target: hash.0,
        }
    }

    /// The scene without files, whose content the target's fingerprint covers, and without what only says when
    /// to stop and what to do then.
    fn relevant(scene: &Scene) -> Scene {
        let mut scene = Scene { output: Default::default(), checkpoint: Default::default(), ..scene.clone() };
        scene.input.file = None;
        scene.time_limit = None;
        if let Some(resolution) = &mut scene.resolution {
            resolution.file = None;
        }
        scene
    }

    /// # Errors
    /// The first thing in which `kept` is another run.
    pub(super) fn compare(&self, kept: &Self) -> std::result::Result<(), String> {
        let belongs = |what: &str, there: &str, here: &str| {
            Err(format!("belongs to another run: its {what} is '{there}', this one's '{here}'; start without it"))
        };
        if kept.version != self.version {
            return belongs("version of sph-prep", &kept.version, &self.version);
        }
        for (what, there, here) in
            [("dimension", kept.dimension, self.dimension), ("number of particles", kept.particles, self.particles)]
        {
            if there != here {
                return belongs(what, &there.to_string(), &here.to_string());
            }
        }
        if kept.scene != self.scene {
            let (mut there, mut here) = (kept.scene.lines(), self.scene.lines());
            loop {
                let (a, b) = (there.next(), here.next());
                if a != b || a.is_none() {
                    return belongs("scene's line", a.unwrap_or("").trim(), b.unwrap_or("").trim());
                }
            }
        }
        if kept.target != self.target {
            return Err("belongs to another run: the input's density has changed since; start without it".into());
        }
        Ok(())
    }
}

/// Refuses a place for checkpoints at which there is a file of another kind: it would be replaced, and removed in the end.
///
/// # Errors
/// Of what is there.
pub(crate) fn refuse_other_content(path: &Path) -> Result<()> {
    let marks: [&[u8; 8]; 2] = [MARK, checkpoint_parts::MARK];
    let Ok(beginning) = checkpoint_file::read(path, &[]) else { return Ok(()) };
    if beginning.is_empty() || marks.iter().any(|mark| beginning.starts_with(*mark)) {
        return Ok(());
    }
    let problem =
        format!("'{}' is there already and is no checkpoint: it would be lost; name another file", path.display());
    Err(Error::scene("checkpoint.file", problem))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::OnInterrupt;
    use std::sync::atomic::AtomicBool;

    /// An interrupt where nothing is kept leaves no output, unless it is to; it names the checkpoint of what came before.
    #[test]
    fn interrupts_leave_no_output_unless_they_are_to() {
        let folder = tempfile::tempdir().unwrap();
        let (pressed, mut scene) = (AtomicBool::new(false), Scene::default());
        let control = Control { interrupted: &pressed, ..Control::default() };
        assert!(refuse_interrupted(&scene, &control).is_ok());
        pressed.store(true, std::sync::atomic::Ordering::Relaxed);
        assert!(matches!(refuse_interrupted(&scene, &control), Err(Error::Interrupted)));
        let file = folder.path().join("a.checkpoint");
        scene.checkpoint.file = Some(file.clone());
        assert!(matches!(refuse_interrupted(&scene, &control), Err(Error::Interrupted)));
        std::fs::write(&file, "kept").unwrap();
        assert!(matches!(refuse_interrupted(&scene, &control), Err(Error::Interrupted)));
        let of = |scene: &Scene| Origin { scene: Origin::relevant(scene).to_yaml(), ..Origin::default() };
        let write = |scene: &Scene| {
            let make = |to| postcard::to_extend(&of(scene), to).map_err(|e| e.to_string());
            checkpoint_file::write(&file, MARK, make).unwrap()
        };
        write(&scene);
        assert!(matches!(refuse_interrupted(&scene, &control), Err(Error::InterruptedKept(kept)) if kept == file));
        write(&Scene { seed: 7, ..scene.clone() });
        assert!(matches!(refuse_interrupted(&scene, &control), Err(Error::Interrupted)), "that of another run");
        scene.output.on_interrupt = OnInterrupt::Write;
        assert!(refuse_interrupted(&scene, &control).is_ok());
    }
}
