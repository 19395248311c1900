//! Blocks of particles on disk: a file for the places of each, replaced as a whole, and one for what was measured there.
//!
//! A file says how many passes its block has been through. Blocks are gone through in one order, so that what any of them has met of the others
//! follows from that, and a run goes on from its folder to the same bytes as without a break.

use crate::error::{Error, Result};
use crate::run::checkpoint::Origin;
use crate::run::checkpoint_file::{self, payload, unreadable};
use crate::run::gathered::share_of;
use crate::target::Positions;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sph_formats::FormatError;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The first bytes of each file.
const MARK: &[u8; 8] = b"SPHPREPT";

/// Places of a block's particles, in internal units.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Block<const D: usize> {
    /// After each pass, the target over the summed density where it is resolved, added up, and over how many particles.
    pub ratios: Vec<[f64; 2]>,
    #[serde(with = "crate::relaxation::axes")]
    pub positions: Positions<D>,
}

/// What was measured at a block's particles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Sums {
    pub support: Vec<f64>,
    pub density: Vec<f64>,
    /// What the target has there.
    pub target: Vec<f64>,
    /// Whether a particle can have that.
    pub interior: Vec<bool>,
    /// Whether it sees particles of another block.
    pub seam: Vec<bool>,
}

/// The folder with all blocks.
pub(super) struct Kept {
    folder: PathBuf,
    count: usize,
    blocks: usize,
    /// The run has made the folder.
    is_own: bool,
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
        let mut kept = Self { folder: folder.into(), count: origin.particles, blocks, is_own: is_new };
        let head = kept.folder.join("scene");
        if head.exists() {
            let (earlier, parts, is_own): (Origin, usize, bool) = kept.read(&head)?;
            kept.is_own = is_own;
            let differs = |problem: String| Error::Checkpoint { path: folder.into(), problem };
            origin.compare(&earlier).map_err(differs)?;
            if parts != blocks {
                return Err(differs(format!(
                    "is of a run in {parts} blocks, this one is in {blocks}; start without it"
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

    /// The numbers of a block's particles.
    pub fn own(&self, block: usize) -> Range<usize> {
        share_of(self.count, block, self.blocks)
    }

    /// Which block has a particle.
    pub fn block_of(&self, number: usize) -> usize {
        (0..self.blocks).find(|&b| self.own(b).end > number).unwrap_or(self.blocks - 1)
    }

    /// None of a block that is not there yet.
    ///
    /// # Errors
    /// A file that is damaged.
    pub fn block<const D: usize>(&self, block: usize) -> Result<Option<Block<D>>> {
        let path = self.places(block);
        if !path.exists() {
            return Ok(None);
        }
        let found: Block<D> = self.read(&path)?;
        if found.positions.iter().any(|x| x.len() != self.own(block).len() || !x.iter().all(|v| v.is_finite())) {
            let problem = "holds particles that are not finite, or another number of them; remove the folder".into();
            return Err(Error::Checkpoint { path, problem });
        }
        Ok(Some(found))
    }

    /// A block that has been seeded.
    ///
    /// # Errors
    /// A file that is damaged, or no longer there.
    pub fn there<const D: usize>(&self, block: usize) -> Result<Block<D>> {
        let gone = || Error::Checkpoint {
            path: self.folder.clone(),
            problem: format!("has no block {block}; start without it"),
        };
        self.block(block)?.ok_or_else(gone)
    }

    /// # Errors
    /// A file that cannot be written.
    pub fn put<const D: usize>(&self, block: usize, found: &Block<D>) -> Result<()> {
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

    /// Removes the files, and the folder if the run has made it; a note where that fails.
    pub fn remove(&self) -> Option<String> {
        let files = (0..self.blocks).flat_map(|b| [self.places(b), self.measured(b)]);
        let removed = files.chain([self.folder.join("scene")]).try_for_each(std::fs::remove_file);
        let removed = removed.and_then(|()| if self.is_own { std::fs::remove_dir(&self.folder) } else { Ok(()) });
        let error = removed.err()?;
        Some(format!("the folder '{}' is of no more use but cannot be removed: {error}", self.folder.display()))
    }

    fn places(&self, block: usize) -> PathBuf {
        self.folder.join(format!("block.{block}"))
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
        read.map_err(problem)
    }
}
