//! Blocks of particles on disk: one file with the positions of each block, replaced as a whole, and one with the measures of the block.
//!
//! A file says how many passes its block has been through. Blocks are gone through in one order, so that what any of them has met of the others
//! follows from that, and a run goes on from its folder to the same bytes as without a break.
//!
//! Particles of other blocks that have moved with a block are in files of their own, one for each two blocks, until those come to their turn: they count
//! where they are later than the file of the block that they are of, and their own block's file is there.

use crate::error::{Error, Result};
use crate::relaxation::StopReason;
use crate::run::checkpoint::Origin;
use crate::run::checkpoint_file::{self, payload, unreadable};
use crate::run::gathered::share_of;
use crate::target::Positions;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sph_formats::FormatError;
use std::fs::{File, TryLockError};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The first bytes of each file.
const MARK: &[u8; 8] = b"SPHPREPU";
/// Locked by the run that uses the folder.
const LOCK: &str = "lock";

/// What a pass has left of a block, among those about it as they were then.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Left {
    /// The target over the summed density where it is resolved, added up, and over how many particles.
    pub ratio: [f64; 2],
    /// Mean deviation there, see [`Sums::mean_error`].
    pub mean: f64,
}

/// Places of a block's particles, in internal units.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Block<const D: usize> {
    /// What each pass has left.
    pub passes: Vec<Left>,
    #[serde(with = "crate::relaxation::axes")]
    pub positions: Positions<D>,
}

/// Particles of a block that have moved with another.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Moved<const D: usize> {
    /// Which they are of.
    pub block: usize,
    pub places: Vec<usize>,
    #[serde(with = "crate::relaxation::axes")]
    pub positions: Positions<D>,
}

/// What was measured at a block's particles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Sums {
    pub support: Vec<f64>,
    pub density: Vec<f64>,
    /// What the target has there, what particles aim at where that is another density, else empty, and the target as the kernel sees it.
    pub target: Vec<f64>,
    pub aim: Vec<f64>,
    pub smoothed: Vec<f64>,
    /// Whether a particle can have that.
    pub interior: Vec<bool>,
    /// Whether it sees particles of another block.
    pub seam: Vec<bool>,
}

/// What was measured after a sweep of the last stage over all blocks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Sweep {
    /// Mean deviation in the interior, or of all particles where there is none, the mass re-fitted; of all from the smoothed target where they
    /// aim at that.
    pub mean: f64,
    /// The same as each block was left by the sweep, before those about it were.
    pub left: f64,
    /// See [`BlockFigures::seams`](super::BlockFigures::seams).
    pub seams: Option<[f64; 2]>,
    /// See [`BlockFigures::stated`](super::BlockFigures::stated).
    pub epsilon: f64,
}

/// Deviation near seams over that elsewhere with which they are as good as the rest; the same of all particles now over what each block was left
/// with; and what a sweep has to leave of the deviation of all, or near seams, for another to be worth its time.
const AS_GOOD: f64 = 1.03;
const AS_LEFT: f64 = 1.1;
const GAIN: f64 = 0.8;

impl Sweep {
    /// Why there is to be no other after these, if there is none; what is asked for is an epsilon below `tolerance`, or all that seams cost.
    pub fn end(sweeps: &[Self], tolerance: Option<f64>) -> Option<StopReason> {
        let (last, before) = sweeps.split_last()?;
        if tolerance.is_some_and(|tolerance| last.epsilon <= tolerance) {
            return Some(StopReason::ToleranceReached);
        }
        let Some([near, rest]) = last.seams else { return Some(StopReason::Stagnated) };
        let is_done = tolerance.is_none() && near <= AS_GOOD * rest && last.mean <= AS_LEFT * last.left;
        let gains = |before: &Self| {
            let there = before.seams.map_or(f64::INFINITY, |seams| seams[0]);
            last.mean < GAIN * before.mean || near < GAIN * there
        };
        let goes_on = !is_done && before.last().is_none_or(gains);
        (!goes_on).then_some(StopReason::Stagnated)
    }
}

/// The folder with all blocks.
pub(super) struct Kept {
    folder: PathBuf,
    particles: usize,
    blocks: usize,
    /// The number of each block's first particle, and that of all; none until all blocks have been seeded.
    first: Vec<usize>,
    /// The run has made the folder.
    is_own: bool,
    /// Held as long as the run goes on.
    lock: File,
}

impl Kept {
    /// The folder of a run, made where there is none; what an earlier run has left in it is gone on from.
    ///
    /// # Errors
    /// A folder that cannot be made, or is that of another run.
    pub fn open(folder: &Path, origin: Origin, blocks: usize) -> Result<Self> {
        let bad = |e| FormatError::io(folder, "make the folder", e);
        let is_new = !folder.exists();
        std::fs::create_dir_all(folder).map_err(bad)?;
        let mut kept = Self {
            lock: locked(folder)?,
            folder: folder.into(),
            particles: origin.particles,
            blocks,
            first: Vec::new(),
            is_own: is_new,
        };
        let head = kept.folder.join("scene");
        if head.exists() {
            let (earlier, parts, is_own): (Origin, usize, bool) = kept.read(&head)?;
            kept.is_own = is_own;
            let differs = |problem: String| Error::Checkpoint { path: folder.into(), problem };
            origin.compare(&earlier).map_err(|problem| differs(of_folder(&problem)))?;
            if parts != blocks {
                return Err(differs(format!(
                    "is of a run in {parts} blocks, this one is in {blocks}; remove the folder to begin anew"
                )));
            }
        } else {
            kept.write(&head, &(origin, blocks, is_new))?;
        }
        Ok(kept)
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    pub fn blocks(&self) -> usize {
        self.blocks
    }

    /// The numbers of the particles that a block is seeded with where it has its even share of them.
    pub fn share(&self, block: usize) -> Range<usize> {
        share_of(self.particles, block, self.blocks)
    }

    /// Takes note of how many particles each block has.
    ///
    /// # Errors
    /// Other numbers than the run's.
    pub fn count(&mut self, counts: Vec<usize>) -> Result<()> {
        let running = |sum: &mut usize, count| {
            *sum += count;
            Some(*sum)
        };
        self.first = std::iter::once(0).chain(counts.into_iter().scan(0, running)).collect();
        if self.first.last() == Some(&self.particles) {
            return if self.is_seeded() { Ok(()) } else { self.write(&self.seeded(), &self.first) };
        }
        let problem = format!("holds another number of particles than {}; remove the folder", self.particles);
        Err(Error::Checkpoint { path: self.folder.clone(), problem })
    }

    /// Whether all blocks have been there: one that is not there now has been lost.
    pub fn is_seeded(&self) -> bool {
        self.seeded().exists()
    }

    /// The numbers of a block's particles.
    pub fn own(&self, block: usize) -> Range<usize> {
        self.first[block]..self.first[block + 1]
    }

    /// Which block has a particle.
    pub fn block_of(&self, number: usize) -> usize {
        self.first.partition_point(|&first| first <= number).saturating_sub(1).min(self.blocks - 1)
    }

    /// None of a block that is not there yet.
    ///
    /// # Errors
    /// A file that is damaged.
    pub fn block<const D: usize>(&self, block: usize) -> Result<Option<Block<D>>> {
        let Some(mut found) = self.alone::<D>(block)? else { return Ok(None) };
        let (turn, mut later) = (self.turn(block, &found), Vec::new());
        for path in (0..self.blocks).map(|by| self.moved(by, block)).filter(|path| path.exists()) {
            let (when, moved): (usize, Moved<D>) = self.read(&path)?;
            later.push((when, moved));
        }
        later.retain(|(when, _)| *when > turn);
        later.sort_by_key(|(when, _)| *when);
        for (_, Moved { places, positions, .. }) in &later {
            for (x, moved) in found.positions.iter_mut().zip(positions) {
                for (&place, v) in places.iter().zip(moved) {
                    match x.get_mut(place) {
                        Some(x) => *x = *v,
                        None => return Err(self.damaged(block)),
                    }
                }
            }
        }
        match found.positions.iter().flatten().all(|v| v.is_finite()) {
            true => Ok(Some(found)),
            false => Err(self.damaged(block)),
        }
    }

    fn damaged(&self, block: usize) -> Error {
        let problem = "holds particles that are not finite, or another number of them; remove the folder".into();
        Error::Checkpoint { path: self.places(block), problem }
    }

    /// When a block's file was written: a number that grows with each block in each pass.
    fn turn<const D: usize>(&self, block: usize, found: &Block<D>) -> usize {
        found.passes.len() * self.blocks + block
    }

    /// Removes what has moved with blocks whose own files were not written any more.
    ///
    /// # Errors
    /// A file that is damaged, or cannot be removed.
    pub fn recover<const D: usize>(&self) -> Result<()> {
        for by in 0..self.blocks {
            let paths: Vec<PathBuf> =
                (0..self.blocks).map(|of| self.moved(by, of)).filter(|path| path.exists()).collect();
            if paths.is_empty() {
                continue;
            }
            let turn = self.alone::<D>(by)?.map_or(0, |found| self.turn(by, &found));
            for path in paths {
                if self.read::<(usize, Moved<D>)>(&path)?.0 > turn {
                    std::fs::remove_file(&path).map_err(|e| FormatError::io(&path, "remove", e))?;
                }
            }
        }
        Ok(())
    }

    /// A block as its own file has it.
    fn alone<const D: usize>(&self, block: usize) -> Result<Option<Block<D>>> {
        let path = self.places(block);
        if !path.exists() {
            return Ok(None);
        }
        let found: Block<D> = self.read(&path)?;
        let count = if self.first.is_empty() { found.positions[0].len() } else { self.own(block).len() };
        let is_sound = found.positions.iter().all(|x| x.len() == count);
        if is_sound { Ok(Some(found)) } else { Err(self.damaged(block)) }
    }

    /// A block that has been seeded.
    ///
    /// # Errors
    /// A file that is damaged, or no longer there.
    pub fn there<const D: usize>(&self, block: usize) -> Result<Block<D>> {
        let gone = || Error::Checkpoint {
            path: self.folder.clone(),
            problem: format!("lacks block {block}, which existed before; remove the folder to start again"),
        };
        self.block(block)?.ok_or_else(gone)
    }

    /// Keeps a block, and what of others has moved with it.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn put<const D: usize>(&self, block: usize, found: &Block<D>, moved: Vec<Moved<D>>) -> Result<()> {
        for moved in moved {
            self.write(&self.moved(block, moved.block), &(self.turn(block, found), &moved))?;
        }
        self.write(&self.places(block), found)
    }

    /// # Errors
    /// A file that is damaged, or not there.
    pub fn sums(&self, block: usize) -> Result<Sums> {
        self.read(&self.measured(block))
    }

    /// # Errors
    /// A file that cannot be written.
    pub fn put_sums(&self, block: usize, sums: &Sums) -> Result<()> {
        self.write(&self.measured(block), sums)
    }

    /// All sweeps so far after which was measured.
    ///
    /// # Errors
    /// A file that is damaged.
    pub fn sweeps(&self) -> Result<Vec<Sweep>> {
        let path = self.folder.join("sweeps");
        if path.exists() { self.read(&path) } else { Ok(Vec::new()) }
    }

    /// # Errors
    /// A file that cannot be written.
    pub fn put_sweeps(&self, sweeps: &[Sweep]) -> Result<()> {
        self.write(&self.folder.join("sweeps"), &sweeps)
    }

    /// Removes the files, and the folder if the run has made it; a note where that fails.
    pub fn remove(&self) -> Option<String> {
        let files = (0..self.blocks).flat_map(|b| [self.places(b), self.measured(b)]);
        let pairs = (0..self.blocks).flat_map(|by| (0..self.blocks).map(move |of| self.moved(by, of)));
        // On some systems a file cannot be removed while it is locked; others have no locks.
        self.lock.unlock().ok();
        let lock = self.folder.join(LOCK);
        let some = pairs.chain([self.folder.join("sweeps"), lock]).filter(|path| path.exists());
        let removed =
            files.chain(some).chain([self.seeded(), self.folder.join("scene")]).try_for_each(std::fs::remove_file);
        let removed = removed.and_then(|()| if self.is_own { std::fs::remove_dir(&self.folder) } else { Ok(()) });
        let error = removed.err()?;
        Some(format!("the folder '{}' is no longer needed but cannot be removed: {error}", self.folder.display()))
    }

    fn seeded(&self) -> PathBuf {
        self.folder.join("seeded")
    }

    fn places(&self, block: usize) -> PathBuf {
        self.folder.join(format!("block.{block}"))
    }

    /// What of a block has moved with another.
    fn moved(&self, by: usize, of: usize) -> PathBuf {
        self.folder.join(format!("moved.{by}.{of}"))
    }

    fn measured(&self, block: usize) -> PathBuf {
        self.folder.join(format!("sums.{block}"))
    }

    fn write(&self, path: &Path, value: &impl Serialize) -> Result<()> {
        checkpoint_file::write(path, MARK, |to| postcard::to_extend(value, to).map_err(|e| e.to_string())).map(|_| ())
    }

    fn read<T: DeserializeOwned>(&self, path: &Path) -> Result<T> {
        let bytes = checkpoint_file::read(path, &[MARK]).map_err(|e| FormatError::io(path, "read the block", e))?;
        let problem = |problem: String| Error::Checkpoint { path: path.into(), problem };
        if !bytes.starts_with(MARK) {
            return Err(problem(format!("is no block of particles; remove the folder '{}'", self.folder.display())));
        }
        let read = payload(&bytes, MARK).and_then(|bytes| postcard::from_bytes(bytes).map_err(|e| unreadable(&e)));
        read.map_err(|text| problem(of_folder(&text)))
    }
}

/// What is said of a checkpoint, of one that a folder is.
fn of_folder(problem: &str) -> String {
    problem.replace("start without it", "remove the folder to begin anew")
}

/// A lock on the folder, which no other run may use meanwhile. Where the system has no locks, nothing tells.
///
/// # Errors
/// A folder that is in use, or in which nothing can be made.
fn locked(folder: &Path) -> Result<File> {
    let path = folder.join(LOCK);
    let file = File::create(&path).map_err(|e| FormatError::io(&path, "lock the folder", e))?;
    if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
        let problem = "is in use by another run; wait for it, or give another folder with --blocks".into();
        return Err(Error::Checkpoint { path: folder.into(), problem });
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps_go_on_while_seams_are_worse_and_gain() {
        let sweep = |mean, [near, rest]: [f64; 2]| Sweep { mean, left: 2e-3, seams: Some([near, rest]), epsilon: mean };
        let end = |sweeps: &[Sweep]| Sweep::end(sweeps, None);
        let stagnated = Some(StopReason::Stagnated);
        assert_eq!(end(&[]), None);
        assert_eq!(end(&[sweep(2e-3, [3e-3, 1.5e-3])]), None);
        assert_eq!(end(&[sweep(2e-3, [2e-3, 2e-3])]), stagnated);
        assert_eq!(end(&[sweep(4e-3, [4e-3, 4e-3])]), None);
        assert_eq!(end(&[Sweep { seams: None, ..sweep(4e-3, [1.0, 1.0]) }]), stagnated);
        assert_eq!(end(&[sweep(2e-3, [3e-3, 1.5e-3]), sweep(1.4e-3, [2e-3, 1e-3])]), None);
        assert_eq!(end(&[sweep(2e-3, [3e-3, 1.5e-3]), sweep(1.9e-3, [3e-3, 1.4e-3])]), stagnated);
        // With a tolerance until it is reached, or nothing is gained any more.
        let even = sweep(2e-3, [2e-3, 2e-3]);
        assert_eq!(Sweep::end(&[even], Some(3e-3)), Some(StopReason::ToleranceReached));
        assert_eq!(Sweep::end(&[even], Some(1e-3)), None);
        assert_eq!(Sweep::end(&[even, sweep(1.9e-3, [1.9e-3, 1.9e-3])], Some(1e-3)), stagnated);
    }
}
