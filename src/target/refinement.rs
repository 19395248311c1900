//! Cells divided until they are light.

use super::cells::{Cell, Rule};
use super::matter::Matter;
use sph::parallel;

/// Divides the heavy cells until none has much more than one part in `least` of the mass.
pub(crate) fn refine<const D: usize>(target: &dyn Matter<D>, cells: &mut Vec<Cell<D>>, least: usize, rule: Rule) {
    let parts = |cell: &Cell<D>| {
        let pencils = if cell.has_pencils() { cell.pencils(target) } else { Vec::new() };
        if pencils.is_empty() { known(cell.halves_sharing(cell.longest(), target, rule)) } else { pencils }
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
    divide(cells, chosen, |cell| known(halves(cell)));
}

/// Halves with some of the mass; none if they miss it: of a spike at the center of a cell.
fn known<const D: usize>(halves: [Cell<D>; 2]) -> Vec<Cell<D>> {
    if halves[0].mass + halves[1].mass > 0.0 { halves.to_vec() } else { Vec::new() }
}

/// Puts the parts of the `chosen` cells in their place; one that has none stays as it is. Whether any had some.
fn divide<const D: usize>(
    cells: &mut Vec<Cell<D>>,
    chosen: Vec<usize>,
    parts: impl Fn(&Cell<D>) -> Vec<Cell<D>> + Sync,
) -> bool {
    let whole = &*cells;
    let divided = parallel::map(chosen.len(), |i| parts(&whole[chosen[i]]));
    let mut is_divided = false;
    for (i, parts) in chosen.into_iter().zip(divided) {
        if let Some((first, rest)) = parts.split_first() {
            cells[i] = *first;
            cells.extend_from_slice(rest);
            is_divided = true;
        }
    }
    is_divided
}
