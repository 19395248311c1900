//! Patterns of uniform density that fill space, and how a region is cut out of one.
//!
//! The pattern is scaled about the middle of the region until exactly N points fall inside. It lies askew in its
//! cell, so that points enter one by one as it shrinks and the scale for any N can be found.

use crate::error::{Error, Result};
use crate::target::Target;

/// Points of number density 1 that fill space.
pub(super) trait Pattern<const D: usize>: Sync {
    /// Calls `out` for every point of the pattern with `lo <= x < hi`, in a fixed order.
    fn visit(&self, lo: &[f64; D], hi: &[f64; D], out: &mut dyn FnMut([f64; D]));
}

/// Visits the repetitions of a cell's sites in `[lo, hi)`.
pub(super) fn tile<const D: usize>(
    edges: &[f64; D],
    sites: &[[f64; D]],
    lo: &[f64; D],
    hi: &[f64; D],
    out: &mut dyn FnMut([f64; D]),
) {
    let first: [i64; D] = sph::array(|k| (lo[k] / edges[k]).floor() as i64);
    let last: [i64; D] = sph::array(|k| (hi[k] / edges[k]).floor() as i64);
    let mut cell = first;
    loop {
        for site in sites {
            let x: [f64; D] = sph::array(|k| (cell[k] as f64 + site[k]) * edges[k]);
            if (0..D).all(|k| x[k] >= lo[k] && x[k] < hi[k]) {
                out(x);
            }
        }
        let Some(k) = (0..D).find(|&k| cell[k] < last[k]) else { return };
        cell[k] += 1;
        cell[..k].copy_from_slice(&first[..k]);
    }
}

/// The place of the region's middle in the pattern: no simple fraction of any cell, so that no two points are
/// equally far from it by symmetry.
const SKEW: [f64; 3] = [0.137_035_999, 0.271_828_182, 0.314_159_265];
/// Steps of the search for the scale: f64 resolves no more.
const MOST_STEPS: usize = 60;
/// Factor on the scale while a bracket is sought.
const BRACKET: f64 = 0.93;
/// The pattern is not shrunk below this fraction of the mean spacing: a region that still holds too few points has
/// less than an eighth of the volume that it states.
const LEAST_SCALE: f64 = 0.5;

/// `count` points of the pattern inside the target's domain, at the scale at which they fill it.
///
/// # Errors
/// A region in which the points cannot be found.
pub(super) fn cut<const D: usize>(target: &Target<'_, D>, pattern: &dyn Pattern<D>) -> Result<Vec<[f64; D]>> {
    let count = target.count;
    let mean = target.domain.mean_spacing(count);
    let (mut coarse, mut fine) = (None, None);
    let mut scale = mean;
    let mut points = Vec::new();
    for _ in 0..2 * MOST_STEPS {
        points = inside(target, pattern, scale);
        if points.len() == count {
            return Ok(points);
        }
        if points.len() > count {
            fine = Some(scale);
        } else {
            coarse = Some(scale);
        }
        scale = match (fine, coarse) {
            (Some(a), Some(b)) if b - a > 1e-15 * a => 0.5 * (a + b),
            (Some(_), Some(_)) => break,
            (Some(a), None) => a / BRACKET,
            (None, Some(b)) if b > LEAST_SCALE * mean => b * BRACKET,
            _ => return Err(unfilled(count)),
        };
    }
    if points.len() < count {
        points = fine.map(|s| inside(target, pattern, s)).unwrap_or_default();
    }
    let found = points.len();
    if found < count {
        return Err(unfilled(count));
    }
    // Points that enter together: some are left out, evenly over the order of visits.
    Ok((0..count).map(|i| points[i * found / count]).collect())
}

/// Half the diagonal of the finest cut that [`cut`] may ask for, in the pattern's spacings, at most.
pub(super) fn reach<const D: usize>(target: &Target<'_, D>) -> f64 {
    let mean = target.domain.mean_spacing(target.count);
    let diagonal = target.domain.extent().iter().map(|e| e * e).sum::<f64>().sqrt();
    0.5 * diagonal / (LEAST_SCALE * BRACKET * mean)
}

fn unfilled(count: usize) -> Error {
    Error::Numeric {
        stage: "seed",
        problem: format!(
            "the domain has no room for {count} points of the pattern: its volume is overstated or it is too thin; use seeding: mass-bisection"
        ),
    }
}

fn inside<const D: usize>(target: &Target<'_, D>, pattern: &dyn Pattern<D>, scale: f64) -> Vec<[f64; D]> {
    let domain = target.domain;
    let middle: [f64; D] = sph::array(|k| 0.5 * (domain.lo[k] + domain.hi[k]));
    let half: [f64; D] = sph::array(|k| 0.5 * (domain.hi[k] - domain.lo[k]) / scale);
    let (lo, hi) = (sph::array(|k| SKEW[k] - half[k]), sph::array(|k| SKEW[k] + half[k]));
    let mut points = Vec::new();
    pattern.visit(&lo, &hi, &mut |p| {
        let x: [f64; D] = sph::array(|k| middle[k] + scale * (p[k] - SKEW[k]));
        // Not what rounding has put beyond a seam, where it may be the image of another.
        if domain.contains(&x) && domain.wrapped(&x) == x {
            points.push(x);
        }
    });
    points
}
