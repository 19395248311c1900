//! Checkpoints of several ranks: a part for each, in a file of its own, and a head that says which parts belong together.
//!
//! Parts of a new checkpoint are beside those of the last until the head, which is replaced as a whole, names them: whenever a rank dies
//! there is a whole checkpoint or none. All ranks see one folder.

use super::checkpoint_file::{checksum_of, framed, payload, unreadable};
use crate::error::Result;
use serde::{Deserialize, Serialize};
use sph::exchange::Exchange;
use sph_formats::FormatError;
use sph_formats::stream::Part;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The first bytes of a head.
pub(super) const MARK: &[u8; 8] = b"SPHPREPH";
/// The largest head that is read: of as many ranks as any machine has.
const LARGEST: u64 = 1 << 28;

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
        let file = std::fs::File::open(path).map_err(|e| e.to_string())?;
        let mut bytes = Vec::new();
        file.take(LARGEST).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
        postcard::from_bytes(payload(&bytes, MARK)?).map_err(|e| unreadable(&e))
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
            (None, 0) => write_head(file, &Head { generation: new.generation, checksums }),
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

fn write_head(file: &Path, head: &Head) -> std::result::Result<(), String> {
    let bytes = framed(MARK, |to| postcard::to_extend(head, to).map_err(|e| e.to_string()))?.0;
    let write = |temporary: &Path| {
        std::fs::write(temporary, &bytes).map_err(|e| FormatError::io(file, "write the checkpoint", e))
    };
    sph_formats::output::atomically(file, write).map_err(|e| e.to_string())
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
        Self { pieces: vec![(share(count, exchange.rank(), exchange.ranks()), bytes)], are_own: exchange.is_alone() }
    }

    /// Of one at `path` that several have, where this rank is to have its share of `count` particles.
    ///
    /// # Errors
    /// A head or a part that is damaged or not there.
    pub(super) fn of_family(path: &Path, exchange: &dyn Exchange, count: usize) -> std::result::Result<Self, String> {
        let Head { generation, checksums } = Head::read(path)?;
        let (rank, ranks, earlier) = (exchange.rank(), exchange.ranks(), checksums.len());
        let own = share(count, rank, ranks);
        let mut pieces = Vec::new();
        for (earlier_rank, checksum) in checksums.iter().enumerate() {
            let there = share(count, earlier_rank, earlier);
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

/// The particles that each of several ranks has.
fn share(count: usize, rank: usize, ranks: usize) -> Range<usize> {
    let totals = sph::array(|t| if t == 0 { count } else { 0 });
    let Part { starts, counts, .. } = Part::new(totals, rank, ranks);
    starts[0]..starts[0] + counts[0]
}
