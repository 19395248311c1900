//! Independent random positions: a cell by its share of the mass, a point in it by rejection.

use super::seeded::to_positions;
use crate::error::Result;
use crate::random::{Purpose, keyed};
use crate::target::matter::Matter;
use crate::target::partition::partition;
use crate::target::{Positions, Target};
use rand::RngExt;
use sph::parallel;

/// Proposals before the cell's center is taken: reached only where a cell's mass is all but a point.
const MAX_PROPOSALS: usize = 1000;

/// # Errors
/// A target without mass in its domain.
pub(super) fn place<const D: usize>(target: &Target<'_, D>, seed: u64) -> Result<Positions<D>> {
    let cells = partition(target, target.cell_rule())?;
    let mut cumulative = Vec::with_capacity(cells.len());
    let mut total = 0.0;
    for cell in &cells {
        total += cell.mass;
        cumulative.push(total);
    }
    let points: Vec<[f64; D]> = parallel::map(target.count, |i| {
        let mut rng = keyed(seed, Purpose::RandomSeed, i as u64);
        let mut center = None;
        for _ in 0..MAX_PROPOSALS {
            let pick = rng.random::<f64>() * total;
            let cell = &cells[cumulative.partition_point(|&c| c <= pick).min(cells.len() - 1)];
            let x: [f64; D] = sph::array(|k| cell.lo[k] + rng.random::<f64>() * (cell.hi[k] - cell.lo[k]));
            if !target.admits(&x) {
                continue;
            }
            let inside = cell.point_inside(target.domain);
            if target.admits(&inside) {
                center = center.or(Some(inside));
            }
            // Cells are nearly uniform but for those that surfaces cross; twice the mean bounds what the partition left uneven.
            let even = 2.0 * cell.mass / cell.volume();
            let known = cell.across.and_then(|_| target.within(&cell.lo, &cell.hi).map(|within| within.most));
            // No bound where there is a pole as well.
            let bound = known.filter(|most| most.is_finite()).map_or(even, |most| even.max(most));
            if rng.random::<f64>() * bound <= target.number_density(&x) {
                return x;
            }
        }
        center.unwrap_or_else(|| cells[cells.len() / 2].center())
    });
    Ok(to_positions(&points))
}
