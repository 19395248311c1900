//! Finds the cell at a position, and the neighbors of a cell.

use super::cells::Cell;
use sph::domain::{Axis, Domain};

/// Finds the cell at a place: cells come from halving the domain's box.
pub(super) struct Locator {
    nodes: Vec<Halved>,
}

#[derive(Clone, Copy)]
enum Halved {
    Cell(usize),
    At { axis: usize, middle: f64, halves: [usize; 2] },
}

impl Locator {
    pub fn new<const D: usize>(domain: &Domain<D>, cells: &[Cell<D>]) -> Self {
        let leaf = |within: &[usize]| Halved::Cell(within.first().copied().unwrap_or(0));
        let all: Vec<usize> = (0..cells.len()).collect();
        let mut nodes = vec![leaf(&all)];
        // No recursion: beside a pole halves go down to rounding.
        let mut open = vec![(0, domain.lo, domain.hi, all)];
        while let Some((place, lo, hi, within)) = open.pop() {
            // The axis that was halved is one that no cell reaches across.
            let middle = |k: usize| 0.5 * (lo[k] + hi[k]);
            let is_whole = |k: &usize| {
                let is_apart = |&i: &usize| cells[i].hi[*k] <= middle(*k) || cells[i].lo[*k] >= middle(*k);
                lo[*k] < middle(*k) && middle(*k) < hi[*k] && within.iter().all(is_apart)
            };
            let Some(axis) = (0..D).find(is_whole).filter(|_| within.len() > 1) else { continue };
            let middle = middle(axis);
            let (mut left, mut right) = (hi, lo);
            (left[axis], right[axis]) = (middle, middle);
            let (below, above): (Vec<usize>, Vec<usize>) =
                within.into_iter().partition(|&i| cells[i].center()[axis] < middle);
            let halves = [nodes.len(), nodes.len() + 1];
            nodes.extend([leaf(&below), leaf(&above)]);
            nodes[place] = Halved::At { axis, middle, halves };
            open.extend([(halves[0], lo, left, below), (halves[1], right, hi, above)]);
        }
        Self { nodes }
    }

    pub fn find<const D: usize>(&self, x: &[f64; D]) -> usize {
        let mut place = 0;
        loop {
            match self.nodes[place] {
                Halved::Cell(cell) => return cell,
                Halved::At { axis, middle, halves } => place = halves[usize::from(x[axis] >= middle)],
            }
        }
    }
}

/// The cells next to a cell, one at the middle of each face. Smaller ones find a larger one in turn.
pub(super) fn beside<const D: usize>(domain: &Domain<D>, locator: &Locator, cell: &Cell<D>) -> [[Option<u32>; 2]; D] {
    sph::array(|k| {
        [-1.0, 1.0].map(|side| {
            let way = sph::array(|c| if c == k { side } else { 0.0 });
            u32::try_from(next(domain, locator, cell, way)?).ok()
        })
    })
}

/// The cell next to a cell some way from its middle: along each axis across a face, or not at all.
pub(super) fn next<const D: usize>(
    domain: &Domain<D>,
    locator: &Locator,
    cell: &Cell<D>,
    way: [f64; D],
) -> Option<usize> {
    let center = cell.center();
    let mut x: [f64; D] = sph::array(|k| {
        let beyond = NEXT * (cell.hi[k] - cell.lo[k]);
        match way[k] {
            0.0 => center[k],
            side if side < 0.0 => cell.lo[k] - beyond,
            _ => cell.hi[k] + beyond,
        }
    });
    let is_within = |k: usize| domain.axes[k] == Axis::Periodic || x[k] > domain.lo[k] && x[k] < domain.hi[k];
    if !(0..D).all(|k| way[k] == 0.0 || is_within(k)) {
        return None;
    }
    domain.wrap(&mut x);
    Some(locator.find(&x))
}

/// To all cells about a cell: across faces, edges and corners.
pub(super) fn ways<const D: usize>() -> impl Iterator<Item = [f64; D]> {
    let way = |number: usize| sph::array(|k| (number / 3_usize.pow(k as u32) % 3) as f64 - 1.0);
    (0..3_usize.pow(D as u32)).map(way).filter(|way: &[f64; D]| way.iter().any(|w| *w != 0.0))
}

/// Where the next cell is looked for, in edges of a cell.
const NEXT: f64 = 1e-6;
