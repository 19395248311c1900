//! Glasses: irregular arrangements of uniform spacing without preferred directions, in two kinds that differ in the force that moves the points
//! of a uniform periodic box.
//!
//! `glass` relaxes bisected and jittered points by the short-range repulsion of the weighted Voronoi tessellation
//! ([`crate::relaxation`]), which evens out the summed density over a kernel's reach; on scales beyond, the bisection
//! is even from the start. `gravitational-glass` lets random points repel each other by the long-range force of
//! gravity ([`super::gravity`]).
//!
//! In a box the glass is made for exactly N points, or, above a limit, for a tile that repeats along the axes;
//! points in excess are left out, evenly spread. Other regions are cut out of repeated tiles.

use super::gravity::repel;
use super::lattice::{Fit, UnitCell};
use super::seeded::{Seeded, to_positions};
use super::symmetry::{Symmetry, fills_box};
use super::{bisection, random, stretch};
use crate::error::Result;
use crate::field::ScalarField;
use crate::relaxation::{Control, Wvt, WvtOptions, relax_new};
use crate::target::{Positions, Target, at};
use sph::domain::{Axis, Domain, Region};
use sph::kernel::KernelName;

/// What the points of a tile repel each other by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Repulsion {
    /// Within the reach of a kernel.
    Short,
    /// Gravity, reversed.
    Gravity,
}

impl Repulsion {
    /// Points of a tile, at most: relaxation takes a second or two.
    fn most_in_tile(self) -> usize {
        match self {
            Self::Short => 8192,
            Self::Gravity => 2048,
        }
    }
}

/// Points of the tile that regions are cut from, at least: a smaller one would show its repetition.
const LEAST_IN_TILE: usize = 512;
/// Fewer points than this have no neighbors to relax against.
const LEAST_RELAXED: usize = 32;
const ITERATIONS: usize = 60;

/// The density of the tile.
struct One(f64);

impl<const D: usize> ScalarField<D> for One {
    fn value(&self, _: &[f64; D]) -> f64 {
        self.0
    }
}

pub(super) fn place<const D: usize>(
    target: &Target<'_, D>,
    symmetry: &Symmetry<D>,
    repulsion: Repulsion,
    seed: u64,
) -> Result<Seeded<D>> {
    if !fills_box(target.domain) {
        let count = target.count.clamp(LEAST_IN_TILE, repulsion.most_in_tile());
        let edge = (count as f64).powf(1.0 / D as f64);
        let tile = UnitCell { edges: [edge; D], sites: relaxed_sites(&[1.0; D], count, repulsion, seed)? };
        return stretch::place(target, symmetry, &tile);
    }
    let extent = target.domain.extent();
    let cells = tiles(&extent, target.count, repulsion.most_in_tile());
    let number: usize = cells.iter().product();
    let per_tile = target.count.div_ceil(number);
    let shape = sph::array(|k| extent[k] / cells[k] as f64);
    let edge = (per_tile as f64 / shape.iter().product::<f64>()).powf(1.0 / D as f64);
    let tile = UnitCell { edges: shape.map(|s| s * edge), sites: relaxed_sites(&shape, per_tile, repulsion, seed)? };
    let fit = Fit { cells, distortion: 1.0, free: 0 };
    let points = tile.fill(&target.domain.lo, &extent, &fit, target.count);
    let mut notes = Vec::new();
    if number > 1 {
        let left_out = per_tile * number - target.count;
        notes.push(format!(
            "the glass repeats a tile of {per_tile} points {number} times; {left_out} points are left out"
        ));
    }
    Ok(Seeded { positions: to_positions(&stretch::map(target, symmetry, points)), notes })
}

/// Repetitions along each axis: the longest edge of the tile is halved until the tile is small enough.
fn tiles<const D: usize>(extent: &[f64; D], count: usize, most: usize) -> [usize; D] {
    let mut cells = [1; D];
    while count.div_ceil(cells.iter().product()) > most {
        let edge = |k: usize| extent[k] / cells[k] as f64;
        let longest = (0..D).fold(0, |best, k| if edge(k) > edge(best) { k } else { best });
        cells[longest] += 1;
    }
    cells
}

/// Relaxed points of a periodic box of this shape, as fractions of its edges.
fn relaxed_sites<const D: usize>(
    shape: &[f64; D],
    count: usize,
    repulsion: Repulsion,
    seed: u64,
) -> Result<Vec<[f64; D]>> {
    let domain = Domain::new([0.0; D], *shape, [Axis::Periodic; D], Region::Box)?;
    let density = One(1.0 / domain.volume());
    let target = Target::of_equal_masses(&domain, &density, count, 1.0);
    let positions = match repulsion {
        Repulsion::Short => short_range(&target, seed)?,
        Repulsion::Gravity => gravitational(&target, seed)?,
    };
    let fraction = |x: f64, edge: f64| (x / edge).clamp(0.0, 1.0 - f64::EPSILON);
    Ok((0..count).map(|i| at(&positions, i)).map(|x| sph::array(|k| fraction(x[k], shape[k]))).collect())
}

fn short_range<const D: usize>(target: &Target<'_, D>, seed: u64) -> Result<Positions<D>> {
    let positions = bisection::place(target, seed)?;
    if target.count < LEAST_RELAXED {
        return Ok(positions);
    }
    let options = WvtOptions { iterations: ITERATIONS, ..WvtOptions::new(D) };
    let stage = Wvt { kernel: KernelName::WendlandC4, target: *target, options };
    Ok(relax_new(&stage, positions, &Control::default()).particles.positions)
}

fn gravitational<const D: usize>(target: &Target<'_, D>, seed: u64) -> Result<Positions<D>> {
    let start = random::place(target, seed)?;
    let spacing = target.domain.mean_spacing(target.count);
    let edges = target.domain.extent().map(|e| e / spacing);
    let mut points: Vec<[f64; D]> = (0..target.count).map(|i| at(&start, i).map(|v| v / spacing)).collect();
    repel(&edges, &mut points);
    Ok(to_positions(&points).map(|axis| axis.into_iter().map(|v| v * spacing).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_glasses_are_tiled_along_their_longest_edges() {
        assert_eq!(tiles(&[1.0, 1.0, 1.0], 800, 800), [1, 1, 1]);
        assert_eq!(tiles(&[4.0, 1.0, 1.0], 3200, 800), [4, 1, 1]);
        assert!(1_000_000_usize.div_ceil(tiles(&[1.0; 3], 1_000_000, 800).iter().product()) <= 800);
    }
}
