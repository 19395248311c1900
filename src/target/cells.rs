//! The target as boxes of constant density, refined where mass is.

use super::Target;
use crate::error::{Error, Result};
use sph::domain::Domain;

/// A box with the integral of n* over it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cell<const D: usize> {
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
pub(crate) fn partition<const D: usize>(target: &Target<'_, D>) -> Result<Vec<Cell<D>>> {
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

/// Halves the heavy cells until there are `least` or none is much heavier than the rest.
pub(crate) fn refine<const D: usize>(target: &Target<'_, D>, cells: &mut Vec<Cell<D>>, least: usize) {
    for _ in 0..MAX_REFINEMENTS {
        if cells.len() >= least {
            return;
        }
        let total: f64 = cells.iter().map(|c| c.mass).sum();
        let limit = 1.5 * total / least as f64;
        let before = cells.len();
        for i in 0..before {
            if cells[i].mass > limit {
                let [left, right] = cells[i].halves(target);
                // A cell whose halves miss its mass (a spike at its center) is kept as it is.
                if left.mass + right.mass > 0.0 {
                    cells[i] = left;
                    cells.push(right);
                }
            }
        }
        cells.retain(|c| c.mass > 0.0);
        if cells.len() == before {
            return;
        }
    }
}

const MAX_REFINEMENTS: usize = 64;

/// Cells on both sides of a plane.
pub(crate) struct Cut<const D: usize> {
    pub axis: usize,
    pub plane: f64,
    pub left: Vec<Cell<D>>,
    pub right: Vec<Cell<D>>,
}

/// Splits cells by a plane across the axis along which their mass is spread most, with `fraction` of the mass on the
/// left. Cells that the plane crosses are divided.
pub(crate) fn cut<const D: usize>(cells: Vec<Cell<D>>, fraction: f64) -> Cut<D> {
    let axis = widest_axis(&cells);
    let lo = cells.iter().map(|c| c.lo[axis]).fold(f64::INFINITY, f64::min);
    let hi = cells.iter().map(|c| c.hi[axis]).fold(f64::NEG_INFINITY, f64::max);
    let plane = quantile(&cells, axis, fraction, lo, hi);
    let mut left = Vec::with_capacity(cells.len() / 2 + 8);
    let mut right = Vec::with_capacity(cells.len() / 2 + 8);
    for cell in cells {
        if cell.hi[axis] <= plane {
            left.push(cell);
        } else if cell.lo[axis] >= plane {
            right.push(cell);
        } else {
            let share = (plane - cell.lo[axis]) / (cell.hi[axis] - cell.lo[axis]);
            let (mut a, mut b) = (cell, cell);
            a.hi[axis] = plane;
            b.lo[axis] = plane;
            a.mass *= share;
            b.mass *= 1.0 - share;
            left.push(a);
            right.push(b);
        }
    }
    Cut { axis, plane, left, right }
}

/// The axis of the largest standard deviation of the mass. Of a uniform box it is the longest edge's; what a thin tail
/// covers says little about where the mass is.
fn widest_axis<const D: usize>(cells: &[Cell<D>]) -> usize {
    let total: f64 = cells.iter().map(|c| c.mass).sum();
    let variance: [f64; D] = std::array::from_fn(|k| {
        let mean = cells.iter().map(|c| c.mass * c.center()[k]).sum::<f64>() / total;
        let about = |c: &Cell<D>| (c.center()[k] - mean).powi(2) + (c.hi[k] - c.lo[k]).powi(2) / 12.0;
        cells.iter().map(|c| c.mass * about(c)).sum::<f64>() / total
    });
    // Equal but for rounding is equal.
    (0..D).fold(0, |best, k| if variance[k] > variance[best] * (1.0 + 1e-9) { k } else { best })
}

/// Where `fraction` of the mass lies to the left: Newton on the piecewise linear cumulative mass, bracketed.
fn quantile<const D: usize>(cells: &[Cell<D>], axis: usize, fraction: f64, lo: f64, hi: f64) -> f64 {
    let total: f64 = cells.iter().map(|c| c.mass).sum();
    let left = fraction * total;
    let (mut a, mut b) = (lo, hi);
    let mut x = lo + fraction * (hi - lo);
    for _ in 0..100 {
        let (mut mass, mut slope) = (0.0, 0.0);
        for c in cells {
            if c.hi[axis] <= x {
                mass += c.mass;
            } else if c.lo[axis] < x {
                let rate = c.mass / (c.hi[axis] - c.lo[axis]);
                mass += rate * (x - c.lo[axis]);
                slope += rate;
            }
        }
        if (mass - left).abs() <= 1e-12 * total {
            break;
        }
        if mass > left {
            b = x
        } else {
            a = x
        }
        if b - a <= 1e-14 * (hi - lo) {
            break;
        }
        let newton = x + (left - mass) / slope;
        x = if newton > a && newton < b { newton } else { 0.5 * (a + b) };
    }
    x
}
