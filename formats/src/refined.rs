//! Cells of several sizes: blocks of equal cells, each of a level of refinement, which together fill a box.
//!
//! Every place is a whole number of cells of its level, so that the faces of neighbors of different levels are the same numbers
//! and nothing lies between two blocks or in both.

use crate::units::Unit;

/// Where a grid contradicts itself, and how.
type Contradiction = (String, String);

/// Cells along an axis that are told apart: places are exact in f64, and all cells are counted in 128 bits.
const MOST_CELLS: u64 = 1 << 42;
/// So many blocks are compared pair by pair.
const FEW: usize = 8;

/// One axis of a refined grid.
#[derive(Debug, Clone, PartialEq)]
pub struct RefinedAxis {
    pub name: String,
    /// Both ends of the box.
    pub lo: f64,
    pub hi: f64,
    /// Cells of level 0 between them.
    pub cells: u64,
    /// Whether the file says that the box repeats along it.
    pub is_periodic: bool,
}

/// Equal cells of one level, none of which is refined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RefinedBlock {
    /// The file's own number, for messages.
    pub number: usize,
    pub level: u8,
    /// The first cell along each axis, counted in cells of this level from the lower end of the box; 0 along axes that the grid
    /// does not have.
    pub first: [u64; 3],
    /// Cells along each axis, 1 along those that the grid does not have.
    pub cells: [u64; 3],
}

impl RefinedBlock {
    /// All its cells; the largest number where there are more.
    pub fn count(&self) -> u64 {
        self.cells.iter().fold(1, |n, &c| n.saturating_mul(c))
    }
}

/// Blocks that fill a box without gaps and overlaps. Variables have one value per cell, block after block, the first axis fastest
/// within each.
#[derive(Debug, Clone, PartialEq)]
pub struct RefinedGrid {
    /// One to three axes.
    pub axes: Vec<RefinedAxis>,
    /// Of the ends of the axes.
    pub unit: Option<Unit>,
    /// How many cells of each level fill one of level 0 along an axis; the first is 1.
    pub ratios: Vec<u64>,
    pub blocks: Vec<RefinedBlock>,
}

/// A part of the box, in cells of the finest level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Part {
    lo: [u64; 3],
    hi: [u64; 3],
}

impl Part {
    fn volume(&self) -> u128 {
        (0..3).map(|k| u128::from(self.hi[k].saturating_sub(self.lo[k]))).product()
    }

    fn within(&self, other: &Self) -> Self {
        Self {
            lo: std::array::from_fn(|k| self.lo[k].max(other.lo[k])),
            hi: std::array::from_fn(|k| self.hi[k].min(other.hi[k])),
        }
    }

    /// Both sides of a plane across an axis.
    fn halves(self, axis: usize, at: u64) -> [Self; 2] {
        let (mut left, mut right) = (self, self);
        (left.hi[axis], right.lo[axis]) = (at, at);
        [left, right]
    }
}

impl RefinedGrid {
    pub fn dimension(&self) -> usize {
        self.axes.len()
    }

    /// All cells.
    pub fn cell_count(&self) -> usize {
        let all = self.blocks.iter().fold(0_u64, |n, b| n.saturating_add(b.count()));
        usize::try_from(all).unwrap_or(usize::MAX)
    }

    /// Cells of a level between both ends of an axis.
    pub fn cells_along(&self, axis: usize, level: u8) -> u64 {
        self.axes[axis].cells * self.ratios[usize::from(level)]
    }

    /// The position of the lower face of cell `i` of a level: the same number for the same face at every level.
    pub fn face(&self, axis: usize, level: u8, i: u64) -> f64 {
        let RefinedAxis { lo, hi, .. } = self.axes[axis];
        let cells = self.cells_along(axis, level);
        if i == cells { hi } else { lo + (hi - lo) * (i as f64 / cells as f64) }
    }

    /// Blocks and cells of each level.
    pub fn levels(&self) -> Vec<[u64; 2]> {
        let mut levels = vec![[0; 2]; self.ratios.len()];
        for block in &self.blocks {
            if let Some([blocks, cells]) = levels.get_mut(usize::from(block.level)) {
                *blocks += 1;
                *cells = block.count().saturating_add(*cells);
            }
        }
        levels
    }

    /// Levels of which no cell is a leaf, in words; `None` where there are none.
    pub fn absent_levels(&self) -> Option<String> {
        let levels = self.levels();
        let absent = levels.iter().enumerate().filter(|(_, [blocks, _])| *blocks == 0);
        let absent: Vec<String> = absent.map(|(level, _)| level.to_string()).collect();
        (!absent.is_empty()).then(|| format!("no cell of level {} is left unrefined or was read", absent.join(", ")))
    }

    /// The block and the place within it, along each axis, of a value.
    pub fn place(&self, value: usize) -> Option<(&RefinedBlock, [u64; 3])> {
        let mut rest = value as u64;
        for block in &self.blocks {
            if rest < block.count() {
                let [nx, ny, _] = block.cells;
                return Some((block, [rest % nx, rest / nx % ny, rest / nx / ny]));
            }
            rest -= block.count();
        }
        None
    }

    /// Checks axes and levels, and that the blocks fill the box, each place once.
    ///
    /// # Errors
    /// Location and problem of the first contradiction: a block's number where it is a block's.
    pub fn validate(&self) -> Result<(), Contradiction> {
        let wrong = |location: &str, problem: String| Err((location.to_owned(), problem));
        if !(1..=3).contains(&self.axes.len()) {
            return wrong("grid", format!("has {} axes, expected 1 to 3", self.axes.len()));
        }
        for axis in &self.axes {
            let is_ordered = axis.lo.is_finite() && axis.hi.is_finite() && axis.lo < axis.hi;
            if !is_ordered || !(axis.hi - axis.lo).is_finite() || axis.cells == 0 {
                let problem = format!(
                    "has {} cells from {:e} to {:e}, expected one or more between ascending finite ends",
                    axis.cells, axis.lo, axis.hi
                );
                return Err((format!("axis '{}'", axis.name), problem));
            }
            let finest = self.ratios.last().and_then(|r| r.checked_mul(axis.cells));
            if finest.is_none_or(|n| n > MOST_CELLS) {
                let problem = format!(
                    "has {} cells at level 0 and {:?} times as many at the finest, more than places can tell apart",
                    axis.cells,
                    self.ratios.last()
                );
                return Err((format!("axis '{}'", axis.name), problem));
            }
        }
        let is_multiple = |w: &[u64]| w[0] > 0 && w[1] > w[0] && w[1].is_multiple_of(w[0]);
        let is_counted = self.ratios.first() == Some(&1) && self.ratios.len() <= usize::from(u8::MAX);
        if !is_counted || !self.ratios.windows(2).all(is_multiple) {
            return wrong("levels", format!("refine by {:?}, expected ascending multiples from 1 on", self.ratios));
        }
        self.boxes().and_then(|boxes| self.fill(&boxes))
    }

    /// The blocks in cells of the finest level.
    fn boxes(&self) -> Result<Vec<Part>, Contradiction> {
        let finest = self.ratios.last().copied().unwrap_or(1);
        let along = |b: &RefinedBlock, k: usize| -> Option<[u64; 2]> {
            if k >= self.axes.len() {
                return (b.first[k] == 0 && b.cells[k] == 1).then_some([0, 1]);
            }
            let width = finest / self.ratios.get(usize::from(b.level)).filter(|r| **r > 0)?;
            let end = b.first[k].checked_add(b.cells[k])?;
            let is_inside = b.cells[k] > 0 && end <= self.cells_along(k, b.level);
            is_inside.then(|| [b.first[k] * width, end * width])
        };
        let part = |b: &RefinedBlock| -> Result<Part, Contradiction> {
            let ends: Option<Vec<[u64; 2]>> = (0..3).map(|k| along(b, k)).collect();
            let ends = ends.ok_or_else(|| {
                let sizes: Vec<u64> = self.axes.iter().map(|axis| axis.cells).collect();
                let problem = format!(
                    "has {:?} cells from {:?} on, which are not within a box of {sizes:?} cells of level 0, refined by {:?}",
                    b.cells, b.first, self.ratios
                );
                (format!("block {} of level {}", b.number, b.level), problem)
            })?;
            Ok(Part { lo: [ends[0][0], ends[1][0], ends[2][0]], hi: [ends[0][1], ends[1][1], ends[2][1]] })
        };
        self.blocks.iter().map(part).collect()
    }

    /// Divides the box at faces of blocks until few are left in each part: none may lack volume, nor have too much.
    fn fill(&self, boxes: &[Part]) -> Result<(), Contradiction> {
        let finest = self.ratios.len() as u8 - 1;
        let along = |k: usize| if k < self.axes.len() { self.cells_along(k, finest) } else { 1 };
        let whole = Part { lo: [0; 3], hi: std::array::from_fn(along) };
        let filled = |part: &Part, own: &[u32]| -> u128 {
            own.iter().fold(0, |sum, &b| sum.saturating_add(boxes[b as usize].within(part).volume()))
        };
        let mut open: Vec<(Part, Vec<u32>)> = vec![(whole, (0..boxes.len() as u32).collect())];
        while let Some((part, own)) = open.pop() {
            let (volume, sum) = (part.volume(), filled(&part, &own));
            if own.len() <= FEW
                && let Some(pair) = overlapping(boxes, &part, &own)
            {
                return Err(self.overlap(pair));
            }
            if own.is_empty() || sum == volume && own.len() <= FEW {
                if own.is_empty() {
                    return Err(self.gap(&part));
                }
                continue;
            }
            let Some((axis, at)) = dividing_face(boxes, &part, &own) else {
                // Each of them fills the part.
                return Err(self.overlap([own[0], own[own.len() - 1]]));
            };
            let halves = part.halves(axis, at).map(|half| {
                let inside: Vec<u32> =
                    own.iter().copied().filter(|&b| boxes[b as usize].within(&half).volume() > 0).collect();
                (half, inside)
            });
            // Where there is too much or too little, it is so in one of both at least.
            let off = |(half, inside): &(Part, Vec<u32>)| match sum.cmp(&volume) {
                std::cmp::Ordering::Greater => filled(half, inside) > half.volume(),
                std::cmp::Ordering::Less => filled(half, inside) < half.volume(),
                std::cmp::Ordering::Equal => true,
            };
            open.extend(halves.into_iter().filter(off));
        }
        Ok(())
    }

    fn overlap(&self, pair: [u32; 2]) -> Contradiction {
        let [a, b] = pair.map(|i| self.blocks[i as usize]);
        let problem = format!(
            "begins at cell {:?} and overlaps block {} of level {}, which begins at cell {:?}; expected each place in one block",
            a.first, b.number, b.level, b.first
        );
        (format!("block {} of level {}", a.number, a.level), problem)
    }

    fn gap(&self, part: &Part) -> Contradiction {
        let finest = self.ratios.len() as u8 - 1;
        let ends = |k: usize| [self.face(k, finest, part.lo[k]), self.face(k, finest, part.hi[k])];
        let ends: Vec<String> = self
            .axes
            .iter()
            .enumerate()
            .map(|(k, axis)| format!("{} from {:e} to {:e}", axis.name, ends(k)[0], ends(k)[1]))
            .collect();
        ("blocks".into(), format!("are missing: none of the {} covers {}", self.blocks.len(), ends.join(", ")))
    }
}

/// Two blocks that share a place within a part.
fn overlapping(boxes: &[Part], part: &Part, own: &[u32]) -> Option<[u32; 2]> {
    own.iter().enumerate().find_map(|(i, &a)| {
        let here = boxes[a as usize].within(part);
        let other = own[i + 1..].iter().find(|&&b| boxes[b as usize].within(&here).volume() > 0)?;
        Some([a, *other])
    })
}

/// The middle one of the faces that run through a part, across the longest axis that has any.
fn dividing_face(boxes: &[Part], part: &Part, own: &[u32]) -> Option<(usize, u64)> {
    let mut axes = [0, 1, 2];
    axes.sort_by_key(|&k| std::cmp::Reverse(part.hi[k] - part.lo[k]));
    axes.into_iter().find_map(|k| {
        let faces = own.iter().flat_map(|&b| [boxes[b as usize].lo[k], boxes[b as usize].hi[k]]);
        let mut inner: Vec<u64> = faces.filter(|&f| f > part.lo[k] && f < part.hi[k]).collect();
        if inner.is_empty() {
            return None;
        }
        let middle = inner.len() / 2;
        Some((k, *inner.select_nth_unstable(middle).1))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box of 2 x 1 blocks of 4 x 3 cells, the second of them divided into four of level 1.
    fn grid() -> RefinedGrid {
        let axis = |name: &str, hi, cells| RefinedAxis { name: name.into(), lo: -1.0, hi, cells, is_periodic: false };
        let block = |number, level, x, y| RefinedBlock { number, level, first: [x, y, 0], cells: [4, 3, 1] };
        RefinedGrid {
            axes: vec![axis("x", 1.0, 8), axis("y", 2.0, 3)],
            unit: None,
            ratios: vec![1, 2],
            blocks: vec![
                block(0, 0, 0, 0),
                block(1, 1, 8, 0),
                block(2, 1, 12, 0),
                block(3, 1, 8, 3),
                block(4, 1, 12, 3),
            ],
        }
    }

    fn problem(change: impl Fn(&mut RefinedGrid)) -> String {
        let mut grid = grid();
        change(&mut grid);
        grid.validate().map_or_else(|(at, what)| format!("{at} {what}"), |()| "nothing".into())
    }

    #[test]
    fn blocks_fill_the_box_once() {
        assert_eq!(problem(|_| ()), "nothing");
        let text = problem(|g| g.blocks.retain(|b| b.number != 3));
        assert!(text.contains("are missing") && text.contains("x from 0e0 to 5e-1, y from 5e-1 to 2e0"), "{text}");
        let text = problem(|g| g.blocks[3].first = [8, 0, 0]);
        assert!(text.contains("block 1 of level 1") && text.contains("overlaps block 3"), "{text}");
        let text = problem(|g| g.blocks[4].first = [13, 3, 0]);
        assert!(text.contains("block 4 of level 1 has [4, 3, 1] cells from [13, 3, 0]"), "{text}");
        let text = problem(|g| g.blocks[0].level = 7);
        assert!(text.contains("block 0 of level 7"), "{text}");
        // A gap and an overlap of the same size.
        let text = problem(|g| g.blocks[4].first = [12, 0, 0]);
        assert!(text.contains("overlaps") || text.contains("missing"), "{text}");
        let text = problem(|g| g.blocks[0].cells = [u64::MAX, 3, 1]);
        assert!(text.contains("block 0"), "{text}");
        assert!(problem(|g| g.ratios = vec![1, 1 << 51]).contains("axis 'x'"));
        assert!(problem(|g| g.ratios = vec![2, 4]).contains("levels"));
        assert!(problem(|g| g.axes[1].hi = f64::NAN).contains("axis 'y'"));
        assert!(problem(|g| g.blocks.clear()).contains("missing"));
    }

    #[test]
    fn deep_and_uneven_trees_are_checked_whole() {
        // Toward one corner, each time one of 27 cells is divided: no halves are faces of blocks.
        let depth = 26;
        let axis = |name: &str| RefinedAxis { name: name.into(), lo: 0.0, hi: 1.0, cells: 1, is_periodic: false };
        let mut blocks = Vec::new();
        for level in 1..=depth {
            for cell in 0..27_u64 {
                if cell > 0 || level == depth {
                    let first = [cell % 3, cell / 3 % 3, cell / 9];
                    blocks.push(RefinedBlock { number: blocks.len(), level, first, cells: [1; 3] });
                }
            }
        }
        let ratios = (0..=u32::from(depth)).map(|l| 3_u64.pow(l)).collect();
        let mut grid = RefinedGrid { axes: ["x", "y", "z"].map(axis).into(), unit: None, ratios, blocks };
        assert_eq!(grid.validate(), Ok(()));
        assert_eq!(grid.absent_levels().as_deref(), Some("no cell of level 0 is left unrefined or was read"));
        let (block, at) = grid.place(26 * 3 + 4).unwrap();
        assert_eq!((block.level, block.first, at), (4, [2, 1, 0], [0; 3]));
        grid.blocks.swap_remove(400);
        assert!(grid.validate().is_err());
    }

    #[test]
    fn faces_are_the_same_at_every_level() {
        let grid = grid();
        for i in 0..=8 {
            assert_eq!(grid.face(0, 0, i), grid.face(0, 1, 2 * i));
        }
        assert_eq!((grid.face(1, 0, 0), grid.face(1, 1, 6)), (-1.0, 2.0));
        assert_eq!((grid.cell_count(), grid.levels()), (60, vec![[1, 12], [4, 48]]));
    }
}
