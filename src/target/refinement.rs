//! Divides cells until their masses are small enough.

use super::cells::{Cell, Rule};
use super::matter::Matter;
use sph::parallel;

/// Divides the heavy cells until none has much more than one part in `least` of the mass.
pub(crate) fn refine<const D: usize>(target: &dyn Matter<D>, cells: &mut Vec<Cell<D>>, least: usize, rule: Rule) {
    let parts = |cell: &Cell<D>| {
        let pencils = if cell.has_pencils() { cell.pencils(target) } else { Vec::new() };
        match pencils.is_empty() {
            true => Parts::Halves(cell.halves_sharing(cell.longest(), target, rule)),
            false => Parts::Pencils(pencils),
        }
    };
    for _ in 0..MAX_REFINEMENTS {
        let total: f64 = cells.iter().map(|c| c.mass).sum();
        let limit = 1.5 * total / least as f64;
        let most = |cell: &Cell<D>| if cell.is_crossed_by_lines() { ALIKE * limit } else { limit };
        let heavy = (0..cells.len()).filter(|&i| cells[i].mass > most(&cells[i])).collect();
        let is_divided = divide(cells, heavy, parts);
        cells.retain(|c| c.mass > 0.0);
        if !is_divided {
            return;
        }
    }
}

const MAX_REFINEMENTS: usize = 64;
/// By how much cells may be heavier of which lines say where their mass is.
const ALIKE: f64 = 2.0;

/// Puts the halves of the `chosen` cells in their place.
pub(super) fn halve<const D: usize>(
    cells: &mut Vec<Cell<D>>,
    chosen: Vec<usize>,
    halves: impl Fn(&Cell<D>) -> [Cell<D>; 2] + Sync,
) {
    divide(cells, chosen, |cell| Parts::Halves(halves(cell)));
}

/// What a cell is divided into. Halves, of which there are millions, take no memory of their own.
enum Parts<const D: usize> {
    Halves([Cell<D>; 2]),
    Pencils(Vec<Cell<D>>),
}

impl<const D: usize> Parts<D> {
    /// None where halves miss the mass: of a spike at the center of a cell.
    fn cells(&self) -> &[Cell<D>] {
        match self {
            Self::Halves([left, right]) if !(left.mass + right.mass > 0.0) => &[],
            Self::Halves(halves) => halves,
            Self::Pencils(pencils) => pencils,
        }
    }
}

/// Puts the parts of the `chosen` cells in their place; one that has none stays as it is. Whether any had some.
fn divide<const D: usize>(
    cells: &mut Vec<Cell<D>>,
    chosen: Vec<usize>,
    parts: impl Fn(&Cell<D>) -> Parts<D> + Sync,
) -> bool {
    let whole = &*cells;
    let divided = parallel::map(chosen.len(), |i| parts(&whole[chosen[i]]));
    let mut is_divided = false;
    for (i, parts) in chosen.into_iter().zip(divided) {
        if let Some((first, rest)) = parts.cells().split_first() {
            cells[i] = *first;
            cells.extend_from_slice(rest);
            is_divided = true;
        }
    }
    is_divided
}
