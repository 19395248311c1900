//! Checkpoints of several ranks: each rank writes a part to a file of its own, and a head file states which parts belong together.
//!
//! Parts of a new checkpoint are beside those of the last until the head, which is replaced as a whole, names them: whenever a rank dies
//! there is a whole checkpoint or none. All ranks see one folder.

use super::checkpoint_file::{self, checksum_of, payload, unreadable};
use super::gathered::share_of;
use crate::error::Result;
use serde::{Deserialize, Serialize};
use sph::exchange::Exchange;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The first bytes of a head.
pub(super) const MARK: &[u8; 8] = b"SPHPREPH";

/// Which parts belong together.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Head {
    generation: u64,
    /// Of each rank's part.
    checksums: Vec<u64>,
}

impl Head {
    /// # Errors
    /// A file that is none, or is damaged.
    fn read(path: &Path) -> std::result::Result<Self, String> {
        Self::of(&checkpoint_file::read(path, &[MARK]).map_err(|e| e.to_string())?)
    }

    fn of(bytes: &[u8]) -> std::result::Result<Self, String> {
        postcard::from_bytes(payload(bytes, MARK)?).map_err(|e| unreadable(&e))
    }

    fn write(&self, path: &Path) -> Result<u64> {
        checkpoint_file::write(path, MARK, |to| postcard::to_extend(self, to).map_err(|e| e.to_string()))
    }
}

/// Where the part of a rank is.
fn part(file: &Path, generation: u64, rank: usize) -> PathBuf {
    let mut name = file.as_os_str().to_owned();
    name.push(format!(".{generation}.{rank}"));
    name.into()
}

/// Removes parts; what is not there need not be removed.
fn remove_parts(file: &Path, generation: u64, ranks: usize) {
    (0..ranks).for_each(|rank| drop(std::fs::remove_file(part(file, generation, rank))));
}

/// Removes a checkpoint, and its parts if it has any.
///
/// # Errors
/// A file that cannot be removed.
pub(super) fn remove(file: &Path) -> std::io::Result<()> {
    let head = Head::read(file);
    std::fs::remove_file(file)?;
    head.iter().for_each(|head| remove_parts(file, head.generation, head.checksums.len()));
    Ok(())
}

/// The last whole checkpoint of several ranks.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Family {
    generation: u64,
    ranks: usize,
}

impl Family {
    /// What an earlier run has left, as the first rank sees it. All ranks call it together.
    pub(super) fn of(exchange: &dyn Exchange, file: &Path) -> Self {
        let head = Head::read(file).ok();
        let own = head.map_or([0.0; 2], |head| [head.generation as f64, head.checksums.len() as f64]);
        let first = &exchange.all(&own)[0];
        Self { generation: first[0] as u64, ranks: first[1] as usize }
    }

    /// Removes its parts, once something else is in the place of its head.
    pub(super) fn clear(&mut self, file: &Path) {
        let Self { generation, ranks } = std::mem::take(self);
        remove_parts(file, generation, ranks);
    }

    /// Writes a new checkpoint in the place of the last: `write` writes this rank's part to a path, and returns its checksum. All ranks call it
    /// together.
    ///
    /// # Errors
    /// What could not be written, on whatever rank; the last checkpoint is what it was then.
    pub(super) fn replace(
        &mut self,
        exchange: &dyn Exchange,
        file: &Path,
        write: impl FnOnce(&Path) -> Result<u64>,
    ) -> std::result::Result<(), String> {
        let new = Self { generation: self.generation.wrapping_add(1), ranks: exchange.ranks() };
        let path = part(file, new.generation, exchange.rank());
        let own = write(&path).map_err(|e| e.to_string());
        let halves = |sum: &u64| [1.0, (sum >> u32::BITS) as f64, (sum & u64::from(u32::MAX)) as f64];
        let all = exchange.all(&own.as_ref().map_or([0.0; 3], halves));
        let lost = all.iter().position(|told| told[0] == 0.0);
        let checksums = all.iter().map(|told| (told[1] as u64) << u32::BITS | told[2] as u64).collect();
        let head = match (lost, exchange.rank()) {
            (None, 0) => {
                Head { generation: new.generation, checksums }.write(file).map(|_| ()).map_err(|e| e.to_string())
            }
            _ => Ok(()),
        };
        if lost.is_some() || exchange.any(head.is_err()) {
            drop(std::fs::remove_file(path));
            own?;
            head?;
            return Err(format!("rank {} could not write its part", lost.unwrap_or(0)));
        }
        if exchange.rank() == 0 {
            remove_parts(file, self.generation, self.ranks);
        }
        *self = new;
        Ok(())
    }
}

/// What a rank goes on from: files of earlier ranks, with those of each's particles that are its own now.
pub(super) struct Pieces {
    pub(super) pieces: Vec<(Range<usize>, Vec<u8>)>,
    /// There were as many ranks, so that each goes on with what it had.
    pub(super) are_own: bool,
}

impl Pieces {
    /// Of a checkpoint that one rank has written.
    pub(super) fn of_one(bytes: Vec<u8>, exchange: &dyn Exchange, count: usize) -> Self {
        Self { pieces: vec![(share_of(count, exchange.rank(), exchange.ranks()), bytes)], are_own: exchange.is_alone() }
    }

    /// Of one that several have, with this head at `path`, where this rank is to have its share of `count` particles.
    ///
    /// # Errors
    /// A head or a part that is damaged or not there.
    pub(super) fn of_family(
        (path, head): (&Path, &[u8]),
        exchange: &dyn Exchange,
        count: usize,
    ) -> std::result::Result<Self, String> {
        let Head { generation, checksums } = Head::of(head)?;
        let (rank, ranks, earlier) = (exchange.rank(), exchange.ranks(), checksums.len());
        let own = share_of(count, rank, ranks);
        let mut pieces = Vec::new();
        for (earlier_rank, checksum) in checksums.iter().enumerate() {
            let there = share_of(count, earlier_rank, earlier);
            let both = own.start.max(there.start)..own.end.min(there.end);
            if both.is_empty() {
                continue;
            }
            let path = part(path, generation, earlier_rank);
            let said = |problem: String| format!("has a part '{}' that {problem}; start without it", path.display());
            let bytes = std::fs::read(&path).map_err(|e| said(format!("cannot be read ({e})")))?;
            if checksum_of(&bytes) != Some(*checksum) {
                return Err(said("belongs to another checkpoint".into()));
            }
            pieces.push((both.start - there.start..both.end - there.start, bytes));
        }
        Ok(Self { pieces, are_own: earlier == ranks })
    }
}
