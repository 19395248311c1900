//! Low-discrepancy points: a Kronecker sequence in the unit cube, carried over to the target by mass.
//!
//! The domain is halved by mass, as for mass bisection, and each half takes the points whose coordinate across the
//! cut falls on its side (the inverse of the conditional distributions, coordinate by coordinate). No point is
//! rejected, so N is exact, and a uniform box keeps the sequence as it is.

use super::bisection::representative;
use super::kronecker;
use crate::error::Result;
use crate::target::cells::Cell;
use crate::target::cut::{Cut, cut};
use crate::target::partition::partition;
use crate::target::refinement::refine;
use crate::target::{Positions, Target};
use sph::parallel;

/// Cells of a part per point in it, at least.
const CELLS_PER_POINT: usize = 24;
const MOST_CELLS: usize = 1 << 14;
/// Cuts after which a part holds a single point for certain, or points that f64 cannot tell apart.
const MOST_CUTS: usize = 200;
/// Parts above this many points go on in parallel.
const PARALLEL: usize = 512;

/// A point of the sequence on its way: its number, and its coordinates within the current part.
#[derive(Clone, Copy)]
struct Traveler<const D: usize> {
    index: usize,
    u: [f64; D],
}

/// # Errors
/// A target without mass in its domain.
pub(super) fn place<const D: usize>(target: &Target<'_, D>) -> Result<Positions<D>> {
    let cells = partition(target, target.cell_rule())?;
    let generator = kronecker::generator::<D>();
    let travelers = (0..target.count).map(|index| Traveler { index, u: kronecker::point(&generator, index) }).collect();
    let mut positions: Positions<D> = std::array::from_fn(|_| vec![0.0; target.count]);
    for (index, x) in descend(target, cells, travelers, MOST_CUTS) {
        for k in 0..D {
            positions[k][index] = x[k];
        }
    }
    Ok(positions)
}

fn descend<const D: usize>(
    target: &Target<'_, D>,
    mut cells: Vec<Cell<D>>,
    travelers: Vec<Traveler<D>>,
    cuts: usize,
) -> Vec<(usize, [f64; D])> {
    let n = travelers.len();
    if n == 0 {
        return Vec::new();
    }
    refine(target, &mut cells, (CELLS_PER_POINT * n).min(MOST_CELLS), target.cell_rule());
    if n == 1 || cuts == 0 {
        return travelers.iter().map(|t| (t.index, settle(target, &cells, &t.u))).collect();
    }
    let Cut { axis, left, right, .. } = cut(cells, 0.5);
    let (mut below, mut above) = (Vec::with_capacity(n / 2 + 1), Vec::with_capacity(n / 2 + 1));
    for mut t in travelers {
        let side = if t.u[axis] < 0.5 { &mut below } else { &mut above };
        t.u[axis] = 2.0 * t.u[axis] % 1.0;
        side.push(t);
    }
    let halves = if n > PARALLEL {
        parallel::join(|| descend(target, left, below, cuts - 1), || descend(target, right, above, cuts - 1))
    } else {
        (descend(target, left, below, cuts - 1), descend(target, right, above, cuts - 1))
    };
    let (mut found, mut more) = halves;
    found.append(&mut more);
    found
}

/// The place of `u` in what the cells cover, or, where no particle may be there, their center of mass.
fn settle<const D: usize>(target: &Target<'_, D>, cells: &[Cell<D>], u: &[f64; D]) -> [f64; D] {
    let x = sph::array(|k| {
        let lo = cells.iter().fold(f64::INFINITY, |m, c| m.min(c.lo[k]));
        let hi = cells.iter().fold(f64::NEG_INFINITY, |m, c| m.max(c.hi[k]));
        lo + u[k] * (hi - lo)
    });
    if target.admits(&x) { x } else { representative(target, cells) }
}
