//! Mass bisection: the domain is cut again and again, each side with its share of the particles and the same
//! share of the mass, until every part has one particle, which goes to the part's center of mass. A layer thinner than the spacing of its particles
//! is cut into columns ([`crate::target::sheets`]).
//!
//! O(N log N). Parts refine their cells as they shrink, so memory stays a small multiple of the output.

use super::beside::of_layer_or_medium;
use super::kronecker;
use super::seeded::to_positions;
use crate::error::Result;
use crate::random::{Purpose, keyed};
use crate::target::cells::{Cell, Rule};
use crate::target::cut::{Cut, cut};
use crate::target::matter::Matter;
use crate::target::partition::partition;
use crate::target::refinement::refine;
use crate::target::sheets::{cut_sheet, is_sheet};
use crate::target::{Positions, Surroundings, Target};
use rand::RngExt;
use sph::geometry::distance;
use sph::parallel;
use std::ops::Range;

/// Cells of a part with `n` particles, at least: enough for the cut to fall right, no more than the part needs.
pub(super) fn least_cells(n: usize, rule: Rule) -> usize {
    let per_particle = match rule {
        Rule::Midpoint => 24,
        Rule::Gauss | Rule::Shared => 8,
    };
    n.saturating_mul(per_particle).min(MOST_CELLS)
}

const MOST_CELLS: usize = 1 << 14;
/// Parts above this many particles go on in parallel.
const PARALLEL: usize = 512;

/// One position per particle, jittered.
///
/// # Errors
/// A target without mass in its domain.
pub(super) fn place<const D: usize>(target: &Target<'_, D>, seed: u64) -> Result<Positions<D>> {
    place_block(target, seed, 0..target.count)
}

/// The particles of some numbers alone: to the bit those that [`place`] gives them, since each cut depends on what it
/// cuts only. Parts without any of them are not entered, so that a block of B particles takes O(log N + B log B).
///
/// # Errors
/// A target without mass in its domain.
pub(super) fn place_block<const D: usize>(
    target: &Target<'_, D>,
    seed: u64,
    block: Range<usize>,
) -> Result<Positions<D>> {
    let mut points = vec![Seed::NONE; block.len()];
    bisect(target, partition(target, target.cell_rule())?, (0..target.count, &block), &mut points);
    Ok(to_positions(&jittered(target, &points, block.start, seed)))
}

/// Boxes that cover the parts whose particles are all in `block`, the largest ones.
///
/// # Errors
/// A target without mass in its domain.
pub(super) fn cover<const D: usize>(target: &Target<'_, D>, block: &Range<usize>) -> Result<Vec<[[f64; D]; 2]>> {
    let mut boxes = Vec::new();
    let mut open = vec![(partition(target, target.cell_rule())?, 0..target.count)];
    while let Some((cells, numbers)) = open.pop() {
        if overlap(&numbers, block).is_empty() {
            continue;
        }
        if block.start <= numbers.start && numbers.end <= block.end {
            boxes.push(bounds(&cells));
            continue;
        }
        let [before, behind] = halved(target, cells, &numbers);
        open.extend([behind, before]);
    }
    Ok(boxes)
}

/// The particles of some numbers, which ascend, as [`place`] gives them.
///
/// # Errors
/// A target without mass in its domain.
pub(super) fn place_each<const D: usize>(target: &Target<'_, D>, seed: u64, wanted: &[usize]) -> Result<Vec<[f64; D]>> {
    let mut found = Vec::with_capacity(wanted.len());
    let mut open = vec![(partition(target, target.cell_rule())?, 0..target.count)];
    while let Some((cells, numbers)) = open.pop() {
        let below = |end: usize| wanted.partition_point(|number| *number < end);
        let here = &wanted[below(numbers.start)..below(numbers.end)];
        if let ([one], false) | ([one, ..], true) = (here, numbers.len() == 1) {
            let mut points = [Seed::NONE];
            bisect(target, cells, (numbers, &(*one..one + 1)), &mut points);
            let seeds = jittered(target, &points, *one, seed);
            found.extend(here.iter().map(|_| seeds[0]));
        } else if !here.is_empty() {
            let [before, behind] = halved(target, cells, &numbers);
            open.extend([behind, before]);
        }
    }
    Ok(found)
}

/// The particles that are within a distance of each of some places.
///
/// # Errors
/// A target without mass in its domain.
pub(super) fn near<const D: usize>(
    target: &Target<'_, D>,
    seed: u64,
    about: &[Surroundings<D>],
) -> Result<Vec<Positions<D>>> {
    let mut found: Vec<Positions<D>> = about.iter().map(|_| std::array::from_fn(|_| Vec::new())).collect();
    let mut open = vec![(partition(target, target.cell_rule())?, 0..target.count, Vec::from_iter(0..about.len()))];
    while let Some((cells, numbers, mut asking)) = open.pop() {
        let [lo, hi] = bounds(&cells);
        // Seeded positions are moved within their parts.
        asking.retain(|&a| {
            let Surroundings { x, reach } = &about[a];
            target.domain.squared_distance_of_boxes([x, x], [&lo, &hi]) <= (JITTERED * reach).powi(2)
        });
        let n = numbers.len();
        if asking.is_empty() || n == 0 {
            continue;
        }
        if n <= SMALL {
            let mut points = vec![Seed::NONE; n];
            bisect(target, cells, (numbers.clone(), &numbers), &mut points);
            let seeds = jittered(target, &points, numbers.start, seed);
            for a in asking {
                let near = seeds.iter().filter(|y| about[a].holds(&target.domain.displacement(&about[a].x, y)));
                near.for_each(|y| (0..D).for_each(|k| found[a][k].push(y[k])));
            }
            continue;
        }
        let [(left, before), (right, behind)] = halved(target, cells, &numbers);
        open.push((right, behind, asking.clone()));
        open.push((left, before, asking));
    }
    Ok(found)
}

/// A reach, with the distance by which seeded positions may be moved in it.
const JITTERED: f64 = 1.1;
/// Particles of a part that is not looked into further.
const SMALL: usize = 16;

/// The two sides of a part's cut, with the numbers of their particles.
fn halved<const D: usize>(
    target: &Target<'_, D>,
    mut cells: Vec<Cell<D>>,
    numbers: &Range<usize>,
) -> [(Vec<Cell<D>>, Range<usize>); 2] {
    let n = numbers.len();
    refine(target, &mut cells, least_cells(n, target.cell_rule()), target.cell_rule());
    let Cut { left, right, .. } =
        cut_sheet(target, cells, n).unwrap_or_else(|cells| cut(cells, (n / 2) as f64 / n as f64));
    let middle = numbers.start + n / 2;
    [(left, numbers.start..middle), (right, middle..numbers.end)]
}

fn overlap(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    let start = a.start.max(b.start);
    start..a.end.min(b.end).max(start)
}

fn bounds<const D: usize>(cells: &[Cell<D>]) -> [[f64; D]; 2] {
    let lo = sph::array(|k| cells.iter().map(|c| c.lo[k]).fold(f64::INFINITY, f64::min));
    let hi = sph::array(|k| cells.iter().map(|c| c.hi[k]).fold(f64::NEG_INFINITY, f64::max));
    [lo, hi]
}

/// Jitter as a fraction of the local spacing. Bisection of a symmetric target gives a lattice, an unstable
/// equilibrium that relaxation leaves late and unevenly; a tenth of the spacing is enough to leave it at once.
const JITTER: f64 = 0.1;
/// Size of a part over the target's spacing at its particle below which the target changes by more than a spacing says, so that the part's
/// size counts.
const SMALL_PART: f64 = 0.5;

/// Where a particle of a part goes, and how far it may be moved from there along each axis, over [`JITTER`].
#[derive(Debug, Clone, Copy)]
struct Seed<const D: usize> {
    x: [f64; D],
    room: [f64; D],
}

impl<const D: usize> Seed<D> {
    const NONE: Self = Self { x: [0.0; D], room: [0.0; D] };

    /// Of the particle of a number.
    fn of(target: &Target<'_, D>, cells: &[Cell<D>], number: usize) -> Self {
        let is_sheet = is_sheet(target, cells);
        let centers = centers(target, cells, is_sheet);
        let x = representative_of(target, cells, &centers);
        let density = target.number_density(&x);
        let (x, density) = of_layer_or_medium(target, (cells, bounds(cells)), (&x, density), number)
            .map_or((x, density), |x| (x, target.number_density(&x)));
        let spacing = target.spacing(density);
        if is_sheet {
            // Of a layer thinner than a spacing no more than it is thick: that is how its particle's height was found.
            return Self { x, room: widths(cells, &centers).map(|width| width.min(spacing)) };
        }
        let [lo, hi] = bounds(cells);
        let volume: f64 = (0..D).map(|k| hi[k] - lo[k]).product();
        let size = volume.powf(1.0 / D as f64);
        Self { x, room: [if size < SMALL_PART * spacing { size } else { spacing }; D] }
    }
}

/// The seeds from the number `first` on, jittered.
fn jittered<const D: usize>(target: &Target<'_, D>, seeds: &[Seed<D>], first: usize, seed: u64) -> Vec<[f64; D]> {
    parallel::map(seeds.len(), |i| {
        let Seed { x, room } = seeds[i];
        let mut rng = keyed(seed, Purpose::SeedJitter, (first + i) as u64);
        let mut y = sph::array(|k| x[k] + JITTER * room[k] * (2.0 * rng.random::<f64>() - 1.0));
        target.domain.wrap(&mut y);
        if target.admits(&y) { y } else { x }
    })
}

/// Places those of the particles `numbers` of a part that are `wanted`, into `out`.
fn bisect<const D: usize>(
    target: &Target<'_, D>,
    mut cells: Vec<Cell<D>>,
    (numbers, wanted): (Range<usize>, &Range<usize>),
    out: &mut [Seed<D>],
) {
    let n = numbers.len();
    let [first, ..] = out else { return };
    if n == 1 {
        refine(target, &mut cells, least_cells(n, target.cell_rule()), target.cell_rule());
        *first = Seed::of(target, &cells, numbers.start);
        return;
    }
    let [(left, before), (right, behind)] = halved(target, cells, &numbers);
    let (left_out, right_out) = out.split_at_mut(overlap(&before, wanted).len());
    if n > PARALLEL && !left_out.is_empty() && !right_out.is_empty() {
        parallel::join(
            || bisect(target, left, (before, wanted), left_out),
            || bisect(target, right, (behind, wanted), right_out),
        );
    } else {
        bisect(target, left, (before, wanted), left_out);
        bisect(target, right, (behind, wanted), right_out);
    }
}

/// Center of mass, or, where that lies outside (a part that bends around a hole), a point in the heaviest cell whose
/// middle is inside, or one nearby.
pub(super) fn representative<const D: usize>(target: &Target<'_, D>, cells: &[Cell<D>]) -> [f64; D] {
    representative_of(target, cells, &centers(target, cells, is_sheet(target, cells)))
}

fn representative_of<const D: usize>(
    target: &Target<'_, D>,
    cells: &[Cell<D>],
    centers: &[(f64, [f64; D])],
) -> [f64; D] {
    let mean = mean(centers);
    if target.admits(&mean) {
        return mean;
    }
    if let Some(point) = on_line(target, cells, &mean) {
        return point;
    }
    let mut best: Option<(f64, [f64; D])> = None;
    for cell in cells {
        let point = cell.point_inside(target.domain);
        if best.is_none_or(|(mass, _)| cell.mass > mass) && target.admits(&point) {
            best = Some((cell.mass, point));
        }
    }
    best.map_or_else(|| nearby(target, cells, &mean).unwrap_or(mean), |(_, point)| point)
}

/// The mass of each cell of a part, and where it is.
fn centers<const D: usize>(target: &Target<'_, D>, cells: &[Cell<D>], is_sheet: bool) -> Vec<(f64, [f64; D])> {
    let mean = || cells.iter().map(|cell| cell.mass).sum::<f64>() / cells.len() as f64;
    let least = if is_sheet { NEGLIGIBLE * mean() } else { f64::INFINITY };
    let of = |cell: &Cell<D>| match cell {
        // Of what surfaces cross, what is on one side of them.
        cell if cell.is_crossed_by_lines() => (cell.mass, cell.center_of_mass(target)),
        cell if !cell.is_pencil && cell.mass > least => cell.mass_and_center(target),
        cell => (cell.mass, cell.center()),
    };
    cells.iter().map(of).collect()
}

fn mean<const D: usize>(centers: &[(f64, [f64; D])]) -> [f64; D] {
    let total: f64 = centers.iter().map(|(mass, _)| mass).sum();
    sph::array(|k| centers.iter().map(|(mass, center)| mass / total * center[k]).sum())
}

/// Widths of a part along each axis: those of a uniform one with the same moments of inertia.
fn widths<const D: usize>(cells: &[Cell<D>], centers: &[(f64, [f64; D])]) -> [f64; D] {
    let (mean, total) = (mean(centers), centers.iter().map(|(mass, _)| mass).sum::<f64>());
    let square = |k: usize, (cell, (mass, center)): (&Cell<D>, &(f64, [f64; D]))| {
        mass / total * ((center[k] - mean[k]).powi(2) + (cell.hi[k] - cell.lo[k]).powi(2) / 12.0)
    };
    sph::array(|k| (12.0 * cells.iter().zip(centers).map(|both| square(k, both)).sum::<f64>()).sqrt())
}

/// Mass of a cell, over the mean of all, below which it does not matter where in it that is: the cells of a long tail are many.
const NEGLIGIBLE: f64 = 0.01;

/// The middle of the nearest part of the target on the line through `mean` that pencils say; none where there are none, or nothing of the target
/// is there: a thin layer is beside the mean of pencils that are cut.
fn on_line<const D: usize>(target: &Target<'_, D>, cells: &[Cell<D>], mean: &[f64; D]) -> Option<[f64; D]> {
    let pencils = cells.iter().filter(|cell| cell.is_pencil);
    let axis = usize::from(pencils.max_by(|a, b| a.mass.total_cmp(&b.mass))?.across?);
    let [lo, hi] = bounds(cells);
    let parts = target.parts_along(mean, axis, [lo[axis], hi[axis]])?;
    let middles = parts.iter().map(|part| {
        let mut x = *mean;
        x[axis] = 0.5 * (part.from + part.to);
        x
    });
    let distance = |x: &[f64; D]| (x[axis] - mean[axis]).abs();
    middles.filter(|x| target.admits(x)).min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// The place nearest to `mean` among samples of the box about `cells`, then of ever larger ones: where a thin layer
/// cuts cells in two, their middles may all lie beside it.
fn nearby<const D: usize>(target: &Target<'_, D>, cells: &[Cell<D>], mean: &[f64; D]) -> Option<[f64; D]> {
    let domain = target.domain;
    let [lo, hi] = bounds(cells);
    let generator = kronecker::generator::<D>();
    (0..WIDENINGS).find_map(|widening| {
        let wider = 0.5 * f64::from((1 << widening) - 1);
        let sample = |i: usize| -> [f64; D] {
            let u = kronecker::point(&generator, i);
            sph::array(|k| {
                let (a, b) = (lo[k] - wider * (hi[k] - lo[k]), hi[k] + wider * (hi[k] - lo[k]));
                let (a, b) = (a.max(domain.lo[k]), b.min(domain.hi[k]));
                a + u[k] * (b - a)
            })
        };
        let inside = (0..SAMPLES).map(sample).filter(|x| target.admits(x));
        inside.min_by(|p, q| distance(p, mean).total_cmp(&distance(q, mean)))
    })
}

/// Points tried in a box, and how often it is doubled.
const SAMPLES: usize = 512;
const WIDENINGS: u32 = 12;
