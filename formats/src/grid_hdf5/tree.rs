//! Trees of blocks: every block has the same number of cells, and a refined block is replaced by two blocks along each axis.

use super::mesh::unsupported;
use crate::error::{FormatError, Result};
use crate::model::Geometry;
use crate::refined::{RefinedAxis, RefinedBlock, RefinedGrid};
use crate::units::Unit;
use std::path::Path;

/// Levels that can be told apart, more than a refined grid can have.
pub const MOST_LEVELS: u8 = 42;

/// A block that is not divided.
pub struct Leaf {
    /// The file's own number.
    pub number: usize,
    /// From 0 on.
    pub level: u8,
    /// Along each axis, counted in blocks of its level.
    pub place: [u64; 3],
}

/// What is known of a tree of blocks.
pub struct Tree {
    /// Both ends of the box along each axis.
    pub ends: [[f64; 2]; 3],
    pub is_periodic: [bool; 3],
    pub unit: Option<Unit>,
    /// Blocks of level 0 that fill the box, and cells of each block, along each axis.
    pub roots: [u64; 3],
    pub cells: [u64; 3],
    /// Axes that there are, the first ones; along others there is one cell.
    pub dimension: usize,
    pub levels: u8,
    pub leaves: Vec<Leaf>,
}

impl Tree {
    /// The cells of all leaves, in their order.
    ///
    /// # Errors
    /// A single cell, in which nothing can be placed.
    pub fn grid(&self, path: &Path) -> Result<RefinedGrid> {
        let along = |k: usize, n: u64| if k < self.dimension { n } else { 1 };
        let cells: [u64; 3] = std::array::from_fn(|k| along(k, self.cells[k]));
        let block = |leaf: &Leaf| RefinedBlock {
            number: leaf.number,
            level: leaf.level,
            first: std::array::from_fn(|k| if k < self.dimension { leaf.place[k].saturating_mul(cells[k]) } else { 0 }),
            cells,
        };
        let axis = |k: usize| RefinedAxis {
            name: ["x", "y", "z"][k].into(),
            lo: self.ends[k][0],
            hi: self.ends[k][1],
            cells: self.roots[k].saturating_mul(cells[k]),
            is_periodic: self.is_periodic[k],
        };
        let grid = RefinedGrid {
            axes: (0..self.dimension).map(axis).collect(),
            unit: self.unit.clone(),
            ratios: (0..self.levels.min(MOST_LEVELS)).map(|level| 1 << level).collect(),
            blocks: self.leaves.iter().map(block).collect(),
        };
        if grid.cell_count() < 2 {
            return Err(unsupported(path, "a single cell, in which nothing can be placed"));
        }
        Ok(grid)
    }
}

/// The geometry, with notes on how many blocks and cells each level has.
///
/// # Errors
/// Blocks that overlap, lie outside or are missing.
pub fn checked(
    grid: RefinedGrid,
    code: &str,
    input: impl Fn(String, String) -> FormatError,
) -> Result<(Geometry, Vec<String>)> {
    grid.validate().map_err(|(location, problem)| input(location, problem))?;
    let levels = grid.levels().into_iter().enumerate().filter(|(_, [blocks, _])| *blocks > 0);
    let of_level = |(level, [blocks, cells]): (usize, [u64; 2])| {
        format!("{cells} cells of level {level} in {blocks} {}", if blocks == 1 { "block" } else { "blocks" })
    };
    let levels: Vec<String> = levels.map(of_level).collect();
    let mut notes = vec![format!("{code} grid of {}", levels.join(", "))];
    notes.extend(grid.absent_levels());
    Ok((Geometry::Refined(grid), notes))
}
