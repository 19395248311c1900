//! Cells of several sizes: constant within each, or linear with limited slopes.
//!
//! Within a cell of width d about c the linear reconstruction is v + sum_k s_k (x_k - c_k), which keeps the cell's integral. The
//! slopes are those of the plane that fits the neighbors across all faces best, by squares weighted with 1/distance^2, so that a
//! linear function is met wherever its neighbors are. A neighbor is what fills the cell's mirror image in the face: part of a
//! larger cell, a cell, or the mean of smaller ones; beyond an open end there is none. Each slope is then reduced until the values
//! in the middles of its two faces are within the range of the cell and its neighbors (after Barth & Jespersen 1989,
//! AIAA-89-0366), and vanishes at an extremum. Where all neighbors have the sign of the cell, all slopes are reduced until its
//! corners have it too.
//!
//! A place is found in the tree of blocks in O(log blocks).

use super::bvh::{Aabb, Bvh};
use super::check::magnitude;
use super::grid_axis::AxisTable;
use super::quadrature::Sum;
use super::sampled::{Outside, Sampler};
use super::shapes::solve;
use super::{Interpolation, MassEstimate, Period};
use crate::error::{Error, Result};
use nalgebra::{SMatrix, SVector};
use sph::domain::{Axis, Domain, Region};
use sph::parallel;
use sph_formats::{RefinedGrid, Values};

/// Blocks whose integrals are one sum.
const CHUNK: usize = 64;

pub(crate) struct Refined<const D: usize> {
    grid: RefinedGrid,
    /// The box alone, as one cell: it wraps and clamps as the axes of grids do.
    ends: [AxisTable; D],
    tree: Bvh<D>,
    placed: Vec<Placed<D>>,
    /// By level and axis.
    rulers: Vec<[Ruler; D]>,
    is_linear: bool,
}

/// A cell and its value's number.
#[derive(Debug, Clone, Copy)]
struct Cell<const D: usize> {
    value: usize,
    center: [f64; D],
    width: [f64; D],
}

/// What fills the mirror image of a cell in one of its faces.
#[derive(Debug, Clone, Copy)]
struct Neighbor<const D: usize> {
    values: [usize; 8],
    count: usize,
    /// From the cell's center to that of the values, in widths of the cell.
    offset: [f64; D],
}

/// Both across each axis; `None` beyond open ends.
type Neighbors<const D: usize> = [[Option<Neighbor<D>>; 2]; D];

impl<const D: usize> Refined<D> {
    /// # Errors
    /// A period other than the box, an interpolation that cells of several sizes do not have, or too many blocks.
    pub(crate) fn new(
        name: &str,
        grid: RefinedGrid,
        periods: [Option<Period>; D],
        interpolation: Option<Interpolation>,
    ) -> Result<Self> {
        if interpolation == Some(Interpolation::Cubic) {
            let problem = "is cubic, which there is for grids of one level alone; leave it out (constant within cells) or choose linear";
            return Err(Error::scene("input.interpolation", problem));
        }
        if grid.dimension() != D || u32::try_from(grid.blocks.len()).is_err() {
            let problem = format!("has {} axes and {} blocks", grid.dimension(), grid.blocks.len());
            return Err(Error::field(name, problem));
        }
        let is_linear = matches!(interpolation, Some(Interpolation::Linear | Interpolation::PiecewiseLinear));
        let ends = grid.axes.iter().zip(periods).map(|(axis, period)| {
            AxisTable::cells(&axis.name, vec![axis.lo, axis.hi], vec![0.5 * axis.lo + 0.5 * axis.hi], period)
        });
        let ends: Vec<AxisTable> = ends.collect::<Result<_>>()?;
        let ends = ends.try_into().map_err(|_| Error::field(name, "has too few axes"))?;
        let mut placed = Vec::with_capacity(grid.blocks.len());
        let mut first = 0;
        for (b, block) in grid.blocks.iter().enumerate() {
            let end = |k: usize| block.first[k] + block.cells[k] == grid.cells_along(k, block.level);
            placed.push(Placed { bounds: bounds(&grid, b), ends_box: sph::array(end), first });
            first += block.count() as usize;
        }
        let ruler = |level: usize| std::array::from_fn(|k| Ruler::new(&grid, k, level as u8));
        let rulers = (0..grid.ratios.len()).map(ruler).collect();
        let tree = Bvh::new((0..grid.blocks.len() as u32).collect(), &|b| placed[b as usize].bounds);
        Ok(Self { grid, ends, tree, placed, rulers, is_linear })
    }

    /// The box of all blocks.
    pub(crate) fn domain(&self) -> Result<Domain<D>> {
        let kinds = std::array::from_fn(|k| if self.ends[k].is_periodic() { Axis::Periodic } else { Axis::OPEN });
        Ok(Domain::new(self.ends.each_ref().map(|e| e.lo), self.ends.each_ref().map(|e| e.hi), kinds, Region::Box)?)
    }

    /// The cell around `x`, which lies within the box: its block, its place there and the number of its value; of two cells that
    /// share a face, the upper one.
    fn locate(&self, x: &[f64; D]) -> Option<(usize, [u64; D], usize)> {
        self.tree.find(x, |b| {
            let Placed { bounds, ends_box, first } = &self.placed[b as usize];
            let is_below = |k: usize| x[k] < bounds.hi[k] || (ends_box[k] && x[k] == bounds.hi[k]);
            if !(0..D).all(|k| x[k] >= bounds.lo[k] && is_below(k)) {
                return None;
            }
            let block = &self.grid.blocks[b as usize];
            let (mut value, mut step, mut at) = (*first, 1, [0; D]);
            for k in 0..D {
                let last = block.first[k] + block.cells[k] - 1;
                at[k] = self.cell_along(k, block.level, x[k]).clamp(block.first[k], last) - block.first[k];
                value += step * at[k] as usize;
                step *= block.cells[k] as usize;
            }
            Some((b as usize, at, value))
        })
    }

    fn cell(&self, (b, at, value): (usize, [u64; D], usize)) -> Cell<D> {
        let block = &self.grid.blocks[b];
        let ends: [[f64; 2]; D] =
            sph::array(|k| [0, 1].map(|side| self.grid.face(k, block.level, block.first[k] + at[k] + side)));
        Cell { value, center: ends.map(|[lo, hi]| 0.5 * lo + 0.5 * hi), width: ends.map(|[lo, hi]| hi - lo) }
    }

    /// Which cell of a level a coordinate falls into, by the faces as they are rounded.
    fn cell_along(&self, axis: usize, level: u8, x: f64) -> u64 {
        let Ruler { cells, scale, slack } = self.rulers[usize::from(level)][axis];
        let along = (x - self.grid.axes[axis].lo) * scale;
        let i = (along as u64).min(cells - 1);
        let beyond = along - i as f64;
        if beyond > slack && beyond < 1.0 - slack {
            return i;
        }
        if i > 0 && x < self.grid.face(axis, level, i) {
            return i - 1;
        }
        i + u64::from(i + 1 < cells && x >= self.grid.face(axis, level, i + 1))
    }

    fn within(&self, x: &[f64; D], clamp: bool) -> Option<[f64; D]> {
        let mut inside = *x;
        for k in 0..D {
            inside[k] = self.ends[k].admit(x[k], clamp)?;
        }
        Some(inside)
    }

    /// What lies beyond a face of a cell; `None` beyond an open end.
    fn neighbor(&self, cell: &Cell<D>, axis: usize, side: f64) -> Option<Neighbor<D>> {
        let mut image = cell.center;
        image[axis] += side * cell.width[axis];
        // Across a periodic boundary the cell found lies elsewhere by a period.
        let at = |x: &[f64; D]| -> Option<(Cell<D>, [f64; D])> {
            let inside = self.within(x, false)?;
            let found = self.cell(self.locate(&inside)?);
            let center = |k: usize| x[k] + (found.center[k] - inside[k]) - cell.center[k];
            Some((found, sph::array(|k| center(k) / cell.width[k])))
        };
        let (found, offset) = at(&image)?;
        // Widths of one level differ by rounding alone, those of two by a factor.
        if (0..D).all(|k| found.width[k] > 0.75 * cell.width[k]) {
            return Some(Neighbor { values: [found.value; 8], count: 1, offset });
        }
        let count = 1 << D;
        let mut neighbor = Neighbor { values: [0; 8], count, offset: [0.0; D] };
        for corner in 0..count {
            let x = sph::array(|k| image[k] + (0.5 * (corner >> k & 1) as f64 - 0.25) * cell.width[k]);
            let (found, offset) = at(&x)?;
            neighbor.values[corner] = found.value;
            (0..D).for_each(|k| neighbor.offset[k] += offset[k] / count as f64);
        }
        Some(neighbor)
    }

    /// Those of a cell at a place in a block, most of which are in the same one.
    fn neighbors(&self, cell: &Cell<D>, (b, at): (usize, &[u64; D])) -> Neighbors<D> {
        let block = &self.grid.blocks[b];
        let mut step = 1;
        std::array::from_fn(|k| {
            let beside = [at[k] > 0, at[k] + 1 < block.cells[k]];
            let values = [cell.value.wrapping_sub(step), cell.value + step];
            step *= block.cells[k] as usize;
            std::array::from_fn(|side| {
                let way = [-1.0, 1.0][side];
                if !beside[side] {
                    return self.neighbor(cell, k, way);
                }
                let mut offset = [0.0; D];
                offset[k] = way;
                Some(Neighbor { values: [values[side]; 8], count: 1, offset })
            })
        })
    }
}

/// A block's corners, and where its values begin.
struct Placed<const D: usize> {
    bounds: Aabb<D>,
    /// Whether its upper end is that of the box.
    ends_box: [bool; D],
    first: usize,
}

/// Cells of a level along an axis.
#[derive(Debug, Clone, Copy)]
struct Ruler {
    cells: u64,
    /// How many fit into a unit of length.
    scale: f64,
    /// So near to a face, in cells, rounding may put a coordinate on its other side.
    slack: f64,
}

impl Ruler {
    fn new(grid: &RefinedGrid, axis: usize, level: u8) -> Self {
        let (of, cells) = (&grid.axes[axis], grid.cells_along(axis, level));
        let scale = cells as f64 / (of.hi - of.lo);
        // Of the coordinate itself, of the difference, of the product and of the face.
        let slack = 8.0 * f64::EPSILON * (cells as f64 + of.lo.abs().max(of.hi.abs()) * scale);
        Self { cells, scale, slack }
    }
}

fn bounds<const D: usize>(grid: &RefinedGrid, b: usize) -> Aabb<D> {
    let block = &grid.blocks[b];
    Aabb {
        lo: sph::array(|k| grid.face(k, block.level, block.first[k])),
        hi: sph::array(|k| grid.face(k, block.level, block.first[k] + block.cells[k])),
    }
}

/// Limited slopes of a quantity in a cell, whose values are `value` of their numbers.
fn slopes<const D: usize>(cell: &Cell<D>, neighbors: &Neighbors<D>, value: &dyn Fn(usize) -> f64) -> [f64; D] {
    let own = value(cell.value);
    let (mut normal, mut right) = (SMatrix::<f64, D, D>::zeros(), SVector::<f64, D>::zeros());
    let (mut least, mut most, mut keeps_sign) = (own, own, true);
    for neighbor in neighbors.iter().flatten().flatten() {
        let mean = neighbor.values[..neighbor.count].iter().map(|&i| value(i)).sum::<f64>() / neighbor.count as f64;
        (least, most) = (least.min(mean), most.max(mean));
        keeps_sign &= mean * own >= 0.0;
        let offset = SVector::<f64, D>::from(neighbor.offset);
        let weight = 1.0 / offset.norm_squared();
        normal += offset * offset.transpose() * weight;
        right += offset * (weight * (mean - own));
    }
    // Between two open ends there is nothing to tell a slope from.
    (0..D).filter(|&k| neighbors[k].iter().all(Option::is_none)).for_each(|k| normal[(k, k)] += 1.0);
    let Some(plane) = solve(normal, right) else { return [0.0; D] };
    // Changes over half a cell.
    let mut changes: [f64; D] = sph::array(|k| {
        let room = (most - own).min(own - least);
        (0.5 * plane[k]).clamp(-room, room)
    });
    let reach: f64 = changes.iter().map(|c| c.abs()).sum();
    if keeps_sign && reach > own.abs() {
        changes = changes.map(|c| c * (own.abs() / reach));
    }
    sph::array(|k| changes[k] / (0.5 * cell.width[k]))
}

/// What a box takes of the cells of a block along one axis.
struct Shares {
    /// Length within the box.
    lengths: Vec<f64>,
    /// `int (x - c) dx` over that length: 0 for a cell that the box does not cut.
    moments: Vec<f64>,
}

impl<const D: usize> Refined<D> {
    fn shares(&self, b: usize, axis: usize, [a, z]: [f64; 2]) -> Shares {
        let block = &self.grid.blocks[b];
        let ends = &self.ends[axis];
        let (period, images) = match ends.is_periodic() {
            true => {
                let period = ends.hi - ends.lo;
                (period, ((a - ends.lo) / period).floor() as i64..=((z - ends.lo) / period).floor() as i64)
            }
            false => (0.0, 0..=0),
        };
        let mut shares = Shares { lengths: Vec::new(), moments: Vec::new() };
        for i in block.first[axis]..block.first[axis] + block.cells[axis] {
            let [from, to] = [i, i + 1].map(|i| self.grid.face(axis, block.level, i));
            let (mut length, mut moment) = (0.0, 0.0);
            for image in images.clone() {
                let shift = period * image as f64;
                let [lo, hi] = [(a - shift).max(from), (z - shift).min(to)];
                if hi > lo {
                    length += hi - lo;
                    // The middle of the part less that of the cell: 0 exactly where they are the same.
                    moment += (hi - lo) * 0.5 * ((lo - from) + (hi - to));
                }
            }
            shares.lengths.push(length);
            shares.moments.push(moment);
        }
        shares
    }

    /// The integral of one block's cells, in units of `unit`.
    fn block_integral(&self, values: &Values, unit: f64, domain: &Domain<D>, b: usize) -> f64 {
        let shares: [Shares; D] = std::array::from_fn(|k| self.shares(b, k, [domain.lo[k], domain.hi[k]]));
        if shares.iter().any(|s| s.lengths.iter().all(|l| *l == 0.0)) {
            return 0.0;
        }
        let is_cut = self.is_linear && shares.iter().any(|s| s.moments.iter().any(|m| *m != 0.0));
        let counts: [usize; D] = shares.each_ref().map(|s| s.lengths.len());
        let rows = counts[1..].iter().product::<usize>();
        let mut sum = Sum::default();
        for row in 0..rows {
            let at = indices::<D>(row * counts[0], &counts);
            let area: f64 = (1..D).map(|k| shares[k].lengths[at[k]]).product();
            if area == 0.0 {
                continue;
            }
            let first = self.placed[b].first + row * counts[0];
            let lengths = shares[0].lengths.iter().enumerate();
            let own: Sum = lengths.map(|(i, length)| length * (values.get(first + i) / unit)).collect();
            sum.add(area * own.value());
            if is_cut {
                (0..counts[0]).for_each(|i| sum.add(self.cut_moment(values, unit, &shares, b, row * counts[0] + i)));
            }
        }
        sum.value()
    }

    /// What the slopes add to the integral over the part of a cell.
    fn cut_moment(&self, values: &Values, unit: f64, shares: &[Shares; D], b: usize, within: usize) -> f64 {
        let counts: [usize; D] = shares.each_ref().map(|s| s.lengths.len());
        let at = indices::<D>(within, &counts);
        let moments: [f64; D] = sph::array(|k| {
            let others = (0..D).filter(|&j| j != k).map(|j| shares[j].lengths[at[j]]).product::<f64>();
            shares[k].moments[at[k]] * others
        });
        if moments == [0.0; D] {
            return 0.0;
        }
        let place = at.map(|i| i as u64);
        let cell = self.cell((b, place, self.placed[b].first + within));
        let slopes = slopes(&cell, &self.neighbors(&cell, (b, &place)), &|i| values.get(i) / unit);
        (0..D).map(|k| slopes[k] * moments[k]).sum()
    }
}

/// Place along each axis of the first of which there are `counts`, the first axis fastest.
fn indices<const D: usize>(flat: usize, counts: &[usize; D]) -> [usize; D] {
    let mut rest = flat;
    counts.map(|n| {
        let i = rest % n;
        rest /= n;
        i
    })
}

impl<const D: usize> Sampler<D> for Refined<D> {
    fn sample(&self, values: &Values, stride: usize, x: &[f64; D], outside: Outside, out: &mut [f64]) -> bool {
        let inside = self.within(x, outside == Outside::Clamp);
        let Some((inside, found)) = inside.and_then(|inside| Some((inside, self.locate(&inside)?))) else {
            return false;
        };
        let (.., own) = found;
        out.iter_mut().enumerate().for_each(|(c, v)| *v = values.get(own * stride + c));
        if self.is_linear {
            let cell = self.cell(found);
            let neighbors = self.neighbors(&cell, (found.0, &found.1));
            for (c, v) in out.iter_mut().enumerate() {
                let slopes = slopes(&cell, &neighbors, &|i| values.get(i * stride + c));
                *v += (0..D).map(|k| slopes[k] * (inside[k] - cell.center[k])).sum::<f64>();
            }
        }
        true
    }

    fn integral(&self, values: &Values, domain: &Domain<D>) -> Option<MassEstimate> {
        if !matches!(domain.region, Region::Box) {
            return None;
        }
        let unit = magnitude(values);
        let partial = parallel::pieces(self.grid.blocks.len(), CHUNK, |blocks| {
            blocks.map(|b| self.block_integral(values, unit, domain, b)).collect::<Sum>().value()
        });
        let sum: Sum = partial.iter().copied().collect();
        let size: Sum = partial.iter().map(|v| v.abs()).collect();
        Some(MassEstimate { value: sum.value() * unit, error: 16.0 * f64::EPSILON * size.value() * unit })
    }
}

#[cfg(test)]
#[path = "refined_tests.rs"]
mod tests;
