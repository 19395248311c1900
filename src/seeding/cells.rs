//! The target as boxes of constant density, refined where mass is.

use crate::error::{Error, Result};
use crate::target::Target;
use sph::domain::Domain;

/// A box with the integral of n* over it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell<const D: usize> {
    pub lo: [f64; D],
    pub hi: [f64; D],
    pub mass: f64,
}

impl<const D: usize> Cell<D> {
    /// The center, or, where a cell reaches across the surface of a ball or shell, a point near it inside.
    pub fn point_inside(&self, domain: &Domain<D>) -> [f64; D] {
        inside(self, domain).1
    }

    pub fn center(&self) -> [f64; D] {
        std::array::from_fn(|k| 0.5 * (self.lo[k] + self.hi[k]))
    }

    fn volume(&self) -> f64 {
        (0..D).map(|k| self.hi[k] - self.lo[k]).product()
    }

    /// Halves across the longest edge, with masses anew from the target.
    pub fn halves(&self, target: &Target<'_, D>) -> [Self; 2] {
        let axis =
            (0..D).fold(0, |best, k| if self.hi[k] - self.lo[k] > self.hi[best] - self.lo[best] { k } else { best });
        let middle = self.center()[axis];
        let (mut left, mut right) = (*self, *self);
        left.hi[axis] = middle;
        right.lo[axis] = middle;
        left.mass = midpoint_mass(&left, target);
        right.mass = midpoint_mass(&right, target);
        [left, right]
    }
}

/// Midpoint rule, with the part of the cell that lies inside a curved surface.
fn midpoint_mass<const D: usize>(cell: &Cell<D>, target: &Target<'_, D>) -> f64 {
    let (fraction, point) = inside(cell, target.domain);
    if fraction > 0.0 { fraction * cell.volume() * target.number_density(&point) } else { 0.0 }
}

/// Fraction of the cell inside the region (first order in the distance to the surface of a ball or cylinder), and a
/// point inside at which to take its density.
fn inside<const D: usize>(cell: &Cell<D>, domain: &Domain<D>) -> (f64, [f64; D]) {
    let x = cell.center();
    let Some(round) = domain.region.round() else {
        return (f64::from(u8::from(domain.contains(&x))), x);
    };
    let (r, offset) = (round.distance(&x), round.offset(&x));
    let half: f64 = if r > 0.0 {
        (0..D).map(|k| 0.5 * (cell.hi[k] - cell.lo[k]) * (offset[k] / r).abs()).sum()
    } else {
        0.5 * (cell.hi[0] - cell.lo[0])
    };
    let part = |depth: f64| (0.5 + 0.5 * depth / half).clamp(0.0, 1.0);
    let fraction = part(round.radius - r) * if round.inner_radius > 0.0 { part(r - round.inner_radius) } else { 1.0 };
    let clamped = r.max(round.inner_radius * (1.0 + 1e-9)).min(round.radius * (1.0 - 1e-9));
    let point = if r > 0.0 { round.scaled(&x, clamped / r) } else { x };
    (fraction, point)
}

/// Cells of the first, uniform division.
fn first_cells(d: usize) -> usize {
    match d {
        1 => 1 << 10,
        2 => 1 << 14,
        _ => 1 << 15,
    }
}

/// Most cells after refinement.
const MAX_CELLS: usize = 1 << 18;
/// Halvings of a cell, at most: f64 resolves no more.
const MAX_SWEEPS: usize = 120;
/// A cell is refined while midpoint and corner rule differ by more than this fraction ...
const DISAGREEMENT: f64 = 0.3;
/// ... and the larger is above this fraction of the whole.
const NEGLIGIBLE: f64 = 1e-7;

/// The whole domain, refined until no cell hides mass that its midpoint does not show.
///
/// # Errors
/// A target that is zero at the midpoints of all cells.
pub(super) fn partition<const D: usize>(target: &Target<'_, D>) -> Result<Vec<Cell<D>>> {
    let cells = refined(target);
    if cells.iter().map(|c| c.mass).sum::<f64>() > 0.0 {
        return Ok(cells);
    }
    Err(Error::Numeric { stage: "seed", problem: "the target is zero everywhere in the domain".into() })
}

fn refined<const D: usize>(target: &Target<'_, D>) -> Vec<Cell<D>> {
    let whole = Cell { lo: target.domain.lo, hi: target.domain.hi, mass: 0.0 };
    let mut cells = vec![whole];
    while cells.len() < first_cells(D) {
        cells = cells.iter().flat_map(|c| c.halves(target)).collect();
    }
    let floor = NEGLIGIBLE * target.count as f64;
    let mut pending = cells;
    let mut done = Vec::new();
    for _ in 0..MAX_SWEEPS {
        if pending.is_empty() || done.len() + 2 * pending.len() > MAX_CELLS {
            break;
        }
        let (rough, smooth): (Vec<_>, Vec<_>) = pending.into_iter().partition(|c| is_rough(c, target, floor));
        done.extend(smooth);
        pending = rough.iter().flat_map(|c| c.halves(target)).collect();
    }
    done.extend(pending);
    done
}

fn is_rough<const D: usize>(cell: &Cell<D>, target: &Target<'_, D>, floor: f64) -> bool {
    let mut corners = 0.0;
    for corner in 0..1_usize << D {
        // A hair inside, so that a shared corner is judged by both sides of a discontinuity.
        let x: [f64; D] = std::array::from_fn(|k| {
            let (a, b) = if corner >> k & 1 == 0 { (cell.lo[k], cell.hi[k]) } else { (cell.hi[k], cell.lo[k]) };
            a + 1e-6 * (b - a)
        });
        if target.domain.contains(&x) {
            corners += target.number_density(&x);
        }
    }
    let corner_mass = corners * cell.volume() / (1_usize << D) as f64;
    let larger = corner_mass.max(cell.mass);
    larger > floor && (corner_mass - cell.mass).abs() > DISAGREEMENT * larger
}
