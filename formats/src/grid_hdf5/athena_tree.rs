//! Athena++ with static or adaptive refinement: the location of each block.

use super::tree::{Leaf, MOST_LEVELS, Tree};
use crate::common::hdf5_read::Reader;
use crate::error::Result;
use crate::model::Values;

/// Faces are stored in f32: so far may they be from where even steps have them, relative to the largest coordinate and to a cell.
const SAME: f64 = 1e-6;
const OF_A_CELL: f64 = 1e-3;

/// The blocks of a file whose finest ones are of `max_level`, in a grid of `root` cells and blocks of `block`.
///
/// # Errors
/// Levels and places that cannot be, and faces that are missing or not even.
pub fn open(file: &Reader, max_level: f64, root: [usize; 3], block: [usize; 3]) -> Result<Tree> {
    let levels = numbers(file, "Levels", None)?;
    let count = levels.len();
    if !(max_level.fract() == 0.0 && (1.0..f64::from(MOST_LEVELS)).contains(&max_level)) {
        let problem = format!("is {max_level}, expected a whole number from 0 to {}", MOST_LEVELS - 1);
        return Err(file.input("attribute 'MaxLevel'", problem));
    }
    let places = numbers(file, "LogicalLocations", Some([count, 3]))?;
    let Some(dimension) = (0..3).rev().find(|&k| root[k] > 1).map(|k| k + 1) else {
        return Err(file.input("attribute 'RootGridSize'", "is one cell, expected several where blocks are refined"));
    };
    if (0..3).any(|k| !root[k].is_multiple_of(block[k])) || (0..dimension).any(|k| root[k] == 1) {
        let problem = format!("is {root:?}, which blocks of {block:?} cells do not fill");
        return Err(file.input("attribute 'RootGridSize'", problem));
    }
    let roots: [u64; 3] = std::array::from_fn(|k| (root[k] / block[k]) as u64);
    let mut leaves = Vec::with_capacity(count);
    for number in 0..count {
        let level = levels.get(number);
        if !(0.0..=max_level).contains(&level) {
            let problem = format!("block {number} is of level {level}, expected 0 to {max_level}");
            return Err(file.input("dataset 'Levels'", problem));
        }
        let level = level as u8;
        let at: [f64; 3] = std::array::from_fn(|k| places.get(3 * number + k));
        let most: [u64; 3] = std::array::from_fn(|k| if k < dimension { roots[k] << level } else { 1 });
        if !(0..3).all(|k| at[k] >= 0.0 && at[k] < most[k] as f64) {
            let problem = format!("block {number} of level {level} is at {at:?}, expected less than {most:?}");
            return Err(file.input("dataset 'LogicalLocations'", problem));
        }
        leaves.push(Leaf { number, level, place: at.map(|x| x as u64) });
    }
    let mut tree = Tree {
        ends: [[0.0, 1.0]; 3],
        is_periodic: [false; 3],
        unit: None,
        roots,
        cells: block.map(|n| n as u64),
        dimension,
        levels: max_level as u8 + 1,
        leaves,
    };
    for axis in 0..dimension {
        tree.ends[axis] = ends(file, &tree, axis)?;
    }
    Ok(tree)
}

/// A dataset of numbers, of one row per block.
fn numbers(file: &Reader, name: &str, expected: Option<[usize; 2]>) -> Result<Values> {
    let wrong = |problem: String| file.input(format!("dataset '{name}'"), problem);
    let Some((shape, values)) = file.array(name)? else { return Err(wrong("has no numbers".into())) };
    match expected {
        None if shape.len() == 1 && !values.is_empty() => Ok(values),
        Some(expected) if shape == expected => Ok(values),
        None => Err(wrong(format!("has shape {shape:?}, expected (blocks)"))),
        Some(expected) => Err(wrong(format!("has shape {shape:?}, expected {expected:?} by the blocks' levels"))),
    }
}

/// Both ends of the box along an axis, where all faces are in even steps between them.
fn ends(file: &Reader, tree: &Tree, axis: usize) -> Result<[f64; 2]> {
    let name = format!("x{}f", axis + 1);
    let n = tree.cells[axis] as usize;
    let faces = numbers(file, &name, Some([tree.leaves.len(), n + 1]))?;
    let (lo, hi, bad) = faces.range();
    let location = format!("dataset '{name}'");
    if bad > 0 || lo >= hi {
        let problem = format!("has {bad} faces that are not finite, and others from {lo:e} to {hi:e}");
        return Err(file.input(location, problem));
    }
    for (row, leaf) in tree.leaves.iter().enumerate() {
        let cells = tree.roots[axis] as f64 * n as f64 * 2.0_f64.powi(leaf.level.into());
        let slack = SAME * lo.abs().max(hi.abs()) + OF_A_CELL * (hi - lo) / cells;
        for i in 0..=n {
            let expected = lo + (hi - lo) * ((leaf.place[axis] * n as u64 + i as u64) as f64 / cells);
            let face = faces.get(row * (n + 1) + i);
            if (face - expected).abs() > slack {
                let problem = format!(
                    "block {} has its face {i} at {face:e}, expected {expected:e} by its place; refined grids are read where all steps of a \
                     level are even (a ratio x{}rat of 1)",
                    leaf.number,
                    axis + 1
                );
                return Err(file.input(location, problem));
            }
        }
    }
    Ok([lo, hi])
}
