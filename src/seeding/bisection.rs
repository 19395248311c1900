//! Mass bisection: the domain is cut again and again, each side with its share of the particles and the same
//! share of the mass, until every part has one particle, which goes to the part's center of mass.
//!
//! O(N log N). Parts refine their cells as they shrink, so memory stays a small multiple of the output.

use super::kronecker;
use super::seeded::to_positions;
use crate::error::Result;
use crate::random::{Purpose, keyed};
use crate::target::cells::{Cell, Cut, Rule, cut, partition, refine};
use crate::target::{Positions, Target};
use rand::RngExt;
use sph::geometry::distance;
use sph::parallel;

/// Cells of a part with `n` particles, at least: enough for the cut to fall right, no more than the part needs.
fn least_cells(n: usize, rule: Rule) -> usize {
    let per_particle = match rule {
        Rule::Midpoint => 24,
        Rule::Gauss => 8,
    };
    (per_particle * n).min(MOST_CELLS)
}

const MOST_CELLS: usize = 1 << 14;
/// Parts above this many particles go on in parallel.
const PARALLEL: usize = 512;

/// One position per particle, jittered.
///
/// # Errors
/// A target without mass in its domain.
pub(super) fn place<const D: usize>(target: &Target<'_, D>, seed: u64) -> Result<Positions<D>> {
    let mut points = vec![[0.0; D]; target.count];
    bisect(target, partition(target, target.cell_rule())?, &mut points);
    Ok(to_positions(&jittered(target, &points, seed)))
}

/// Jitter as a fraction of the local spacing. Bisection of a symmetric target gives a lattice, an unstable
/// equilibrium that relaxation leaves late and unevenly; a tenth of the spacing is enough to leave it at once.
const JITTER: f64 = 0.1;

fn jittered<const D: usize>(target: &Target<'_, D>, points: &[[f64; D]], seed: u64) -> Vec<[f64; D]> {
    parallel::map(points.len(), |i| {
        let x = points[i];
        let spacing = target.spacing(target.number_density(&x));
        let mut rng = keyed(seed, Purpose::SeedJitter, i as u64);
        let mut y = x.map(|v| v + JITTER * spacing * (2.0 * rng.random::<f64>() - 1.0));
        target.domain.wrap(&mut y);
        if target.admits(&y) { y } else { x }
    })
}

fn bisect<const D: usize>(target: &Target<'_, D>, mut cells: Vec<Cell<D>>, out: &mut [[f64; D]]) {
    let n = out.len();
    if n == 0 {
        return;
    }
    refine(target, &mut cells, least_cells(n, target.cell_rule()), target.cell_rule());
    if n == 1 {
        out[0] = representative(target, &cells);
        return;
    }
    let left_count = n / 2;
    let Cut { left, right, .. } = cut(cells, left_count as f64 / n as f64);
    let (left_out, right_out) = out.split_at_mut(left_count);
    if n > PARALLEL {
        parallel::join(|| bisect(target, left, left_out), || bisect(target, right, right_out));
    } else {
        bisect(target, left, left_out);
        bisect(target, right, right_out);
    }
}

/// Center of mass, or, where that lies outside (a part that bends around a hole), a point in the heaviest cell whose
/// middle is inside, or one nearby.
pub(super) fn representative<const D: usize>(target: &Target<'_, D>, cells: &[Cell<D>]) -> [f64; D] {
    let total: f64 = cells.iter().map(|c| c.mass).sum();
    let mean = std::array::from_fn(|k| cells.iter().map(|c| c.mass / total * c.center()[k]).sum());
    if target.admits(&mean) {
        return mean;
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

/// The place nearest to `mean` among samples of the box about `cells`, then of ever larger ones: where a thin layer
/// cuts cells in two, their middles may all lie beside it.
fn nearby<const D: usize>(target: &Target<'_, D>, cells: &[Cell<D>], mean: &[f64; D]) -> Option<[f64; D]> {
    let domain = target.domain;
    let lo: [f64; D] = std::array::from_fn(|k| cells.iter().map(|c| c.lo[k]).fold(f64::INFINITY, f64::min));
    let hi: [f64; D] = std::array::from_fn(|k| cells.iter().map(|c| c.hi[k]).fold(f64::NEG_INFINITY, f64::max));
    let generator = kronecker::generator::<D>();
    (0..WIDENINGS).find_map(|widening| {
        let wider = 0.5 * f64::from((1 << widening) - 1);
        let sample = |i: usize| -> [f64; D] {
            let u = kronecker::point(&generator, i);
            std::array::from_fn(|k| {
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
