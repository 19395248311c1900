//! Finds pieces of a field that are thinner than the cells of the search: lines through the cells hit them, while the centers of the cells hardly
//! ever do.

use super::cells::Cell;
use super::lines;
use super::matter::Matter;
use sph::parallel;
use std::collections::{BTreeMap, BTreeSet};

/// A cell with some of a thin piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct Carrier<const D: usize> {
    pub cell: usize,
    pub piece: u64,
    /// A place of the piece in it.
    pub place: [f64; D],
    /// The particles in what the piece has of it, about.
    pub mass: f64,
}

/// Part of a piece's mass that is in cells within it from which on its cells show how it is connected.
const SHOWN: f64 = 0.25;

/// The pieces of which the cells within show little. `masses` are those of all pieces, `within` what is in cells among cells of the same.
pub(super) fn pieces(masses: &[(u64, f64)], within: &BTreeMap<u64, f64>, least: f64) -> BTreeSet<u64> {
    let shown = |piece: &u64| within.get(piece).copied().unwrap_or(0.0);
    masses
        .iter()
        .filter(|(piece, mass)| *mass > least && shown(piece) < SHOWN * mass)
        .map(|(piece, _)| *piece)
        .collect()
}

/// The cells that have some of the `thin` pieces, in their order, as two lines along each axis for each other one meet them.
pub(super) fn carriers<const D: usize>(
    target: &dyn Matter<D>,
    cells: &[Cell<D>],
    thin: &BTreeSet<u64>,
) -> Vec<Carrier<D>> {
    let found = parallel::map(cells.len(), |i| in_cell(target, &cells[i], thin));
    let of_cell = |(cell, parts): (usize, Vec<Carrier<D>>)| parts.into_iter().map(move |c| Carrier { cell, ..c });
    found.into_iter().enumerate().flat_map(of_cell).collect()
}

fn in_cell<const D: usize>(target: &dyn Matter<D>, cell: &Cell<D>, thin: &BTreeSet<u64>) -> Vec<Carrier<D>> {
    let mut found: Vec<Carrier<D>> = Vec::new();
    if target.within(&cell.lo, &cell.hi).is_none_or(|within| within.is_continuous) {
        return found;
    }
    for axis in 0..D {
        let (lo, hi) = (cell.lo[axis], cell.hi[axis]);
        let area = cell.volume() / (hi - lo) / (LINES.pow(D as u32 - 1) * D) as f64;
        for x in lines::each([&cell.lo, &cell.hi], axis, LINES) {
            let Some(parts) = target.parts_along(&x, axis, [lo, hi]) else { continue };
            for part in parts.iter().filter(|part| thin.contains(&part.piece)) {
                let mut place = x;
                place[axis] = 0.5 * (part.from + part.to);
                let mass = area * (part.to - part.from) * target.number_density(&place);
                match found.iter_mut().find(|c| c.piece == part.piece) {
                    Some(carrier) => carrier.mass += mass,
                    None => found.push(Carrier { cell: 0, piece: part.piece, place, mass }),
                }
            }
        }
    }
    found
}

/// Lines for each axis across them.
const LINES: usize = 2;
