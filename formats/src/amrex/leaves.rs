//! Which cells of each patch no finer level covers.

use super::header::Header;
use super::level::Level;
use super::scan::Cells;
use super::schema::NAME;
use crate::error::{FormatError, Result};
use std::path::Path;

/// A part of a patch that no finer one covers, in cells from the lower end of the level's box.
#[derive(Debug, Clone, Copy)]
pub struct Leaf {
    pub level: usize,
    pub patch: usize,
    pub cells: Cells,
}

/// The parts of all patches, level after level, patch after patch.
///
/// # Errors
/// A patch that is outside of its level's box or ends within a cell of the next coarser level.
pub fn leaves(path: &Path, header: &Header, levels: &[Level]) -> Result<Vec<Leaf>> {
    let mut all = Vec::new();
    let placed: Vec<Vec<Cells>> = levels
        .iter()
        .zip(&header.domains)
        .map(|(level, domain)| level.patches.iter().map(|patch| patch.cells.shifted(domain.lo)).collect())
        .collect();
    for (level, patches) in placed.iter().enumerate() {
        let covering = match placed.get(level + 1) {
            Some(finer) => {
                let by = header.ratios[level + 1] / header.ratios[level];
                Covering::new(coarsened(path, level + 1, finer, by as i64, header.dimension)?)
            }
            None => Covering::new(Vec::new()),
        };
        let sizes = header.domains[level].sizes();
        for (patch, cells) in patches.iter().enumerate() {
            if (0..3).any(|k| cells.lo[k] < 0 || cells.hi[k] > sizes[k] as i64) {
                let problem =
                    format!("has cells {:?} to {:?}, outside of the {sizes:?} of its level", cells.lo, cells.hi);
                return Err(FormatError::input(path, NAME, format!("patch {patch} of level {level}"), problem));
            }
            let mut left = vec![*cells];
            for over in covering.near(cells) {
                left = left.into_iter().flat_map(|piece| without(piece, over)).collect();
            }
            all.extend(left.into_iter().map(|cells| Leaf { level, patch, cells }));
        }
    }
    Ok(all)
}

/// The patches of a level in cells of the next coarser one.
fn coarsened(path: &Path, level: usize, patches: &[Cells], by: i64, dimension: usize) -> Result<Vec<Cells>> {
    let coarse = |(patch, cells): (usize, &Cells)| {
        let is_whole = (0..dimension).all(|k| cells.lo[k] % by == 0 && cells.hi[k] % by == 0);
        if !is_whole {
            let problem = format!(
                "has cells {:?} to {:?}, which end within a cell of the coarser level, {by} times as wide",
                cells.lo, cells.hi
            );
            return Err(FormatError::input(path, NAME, format!("patch {patch} of level {level}"), problem));
        }
        let along = |x: [i64; 3]| std::array::from_fn(|k| if k < dimension { x[k] / by } else { x[k] });
        Ok(Cells { lo: along(cells.lo), hi: along(cells.hi) })
    };
    patches.iter().enumerate().map(coarse).collect()
}

/// Boxes that cover those of a coarser level, in the order of their first cell along x.
struct Covering {
    boxes: Vec<Cells>,
    /// The longest along x.
    longest: i64,
}

impl Covering {
    fn new(mut boxes: Vec<Cells>) -> Self {
        boxes.sort_by_key(|b| b.lo);
        let longest = boxes.iter().map(|b| b.hi[0] - b.lo[0]).max().unwrap_or(0);
        Self { boxes, longest }
    }

    fn near<'a>(&'a self, cells: &'a Cells) -> impl Iterator<Item = &'a Cells> {
        let first = self.boxes.partition_point(|b| b.lo[0] + self.longest <= cells.lo[0]);
        let behind = self.boxes.partition_point(|b| b.lo[0] < cells.hi[0]);
        self.boxes.get(first..behind).unwrap_or_default().iter().filter(|b| b.within(cells).count() > 0)
    }
}

/// What is left of a box without another, in two boxes along each axis at most.
fn without(mut piece: Cells, other: &Cells) -> Vec<Cells> {
    let shared = piece.within(other);
    if shared.count() == 0 {
        return vec![piece];
    }
    let mut left = Vec::new();
    // Across z first: pieces are then long along x, in which values follow each other.
    for k in (0..3).rev() {
        if piece.lo[k] < shared.lo[k] {
            let mut below = piece;
            below.hi[k] = shared.lo[k];
            left.push(below);
        }
        if piece.hi[k] > shared.hi[k] {
            let mut above = piece;
            above.lo[k] = shared.hi[k];
            left.push(above);
        }
        (piece.lo[k], piece.hi[k]) = (shared.lo[k], shared.hi[k]);
    }
    left
}
