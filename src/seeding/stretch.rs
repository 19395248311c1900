//! Stretching: a uniform pattern is mapped to the target by mass coordinates.
//!
//! A point keeps the fraction of the mass that lies before it: along each axis of a box where the target is a
//! product of functions of the coordinates (ALARIC eq. 27), along the radius of a ball where it is a function of
//! that (ALARIC eq. 26; Herant 1994; Rosswog et al. 2009; Diehl et al. 2015, sec. 3.2.2), along radius and axis of a
//! cylinder where it is a product of functions of both, by Newton's method on the enclosed mass. Densities come out
//! right to the order of the pattern; the pattern itself is sheared, which in
//! two and three dimensions makes its spacings uneven where the stretch varies much.

use super::cumulative::Cumulative;
use super::lattice::UnitCell;
use super::pattern::{self, Pattern};
use super::seeded::{Seeded, to_positions};
use super::symmetry::{self, Symmetry};
use crate::error::Result;
use crate::target::Target;
use sph::geometry::distance;
use sph::parallel;

/// Fills the domain with a pattern and maps it to the target.
pub(super) fn place<const D: usize>(
    target: &Target<'_, D>,
    symmetry: &Symmetry<D>,
    pattern: &dyn Pattern<D>,
) -> Result<Seeded<D>> {
    let points = pattern::cut(target, pattern)?;
    Ok(Seeded { positions: to_positions(&map(target, symmetry, points)), notes: Vec::new() })
}

/// The same for a lattice, which in a box is fitted to it rather than cut.
pub(super) fn place_lattice<const D: usize>(
    target: &Target<'_, D>,
    symmetry: &Symmetry<D>,
    cell: &UnitCell<D>,
) -> Result<Seeded<D>> {
    if !symmetry::fills_box(target.domain) {
        return place(target, symmetry, cell);
    }
    let extent = target.domain.extent();
    let fit = cell.fit(&extent, target.count);
    let points = cell.fill(&target.domain.lo, &extent, &fit, target.count);
    let notes = fit.note(cell.sites.len(), target.count).into_iter().collect();
    Ok(Seeded { positions: to_positions(&map(target, symmetry, points)), notes })
}

/// Moves points of uniform density to the target.
pub(super) fn map<const D: usize>(
    target: &Target<'_, D>,
    symmetry: &Symmetry<D>,
    mut points: Vec<[f64; D]>,
) -> Vec<[f64; D]> {
    match symmetry {
        Symmetry::Uniform => {}
        Symmetry::Separable { through } => {
            let domain = target.domain;
            for k in 0..D {
                let (lo, hi) = (domain.lo[k], domain.hi[k]);
                let mass = Cumulative::new(|x| symmetry::along(target, through, k, x), lo, hi);
                parallel::update(&mut points, |_, x| x[k] = mass.inverse((x[k] - lo) / (hi - lo)).clamp(lo, hi));
            }
        }
        Symmetry::Cylindrical { round, axis, through } => {
            let (lo, hi) = (target.domain.lo[*axis], target.domain.hi[*axis]);
            let (middle, height) = (round.distance(through), through[*axis]);
            let tubes = Cumulative::new(
                |r| r * symmetry::ring_mean(target, round, r, height),
                round.inner_radius,
                round.radius,
            );
            let layers = Cumulative::new(|z| symmetry::ring_mean(target, round, middle, z), lo, hi);
            let area = |r: f64| r * r - round.inner_radius.powi(2);
            parallel::update(&mut points, |_, x| {
                x[*axis] = layers.inverse((x[*axis] - lo) / (hi - lo)).clamp(lo, hi);
                let r = round.distance(x);
                if r > 0.0 {
                    let mapped = tubes.inverse(area(r) / area(round.radius)).min(round.radius * (1.0 - 1e-12));
                    *x = round.scaled(x, mapped / r);
                }
            });
        }
        Symmetry::Radial { center, inner, outer } => {
            let shells =
                Cumulative::new(|r| r.powi(D as i32 - 1) * symmetry::spherical_mean(target, center, r), *inner, *outer);
            let volume = |r: f64| r.powi(D as i32) - inner.powi(D as i32);
            parallel::update(&mut points, |_, x| {
                let r = distance(center, x);
                if r > 0.0 {
                    // Rounding must not carry a point beyond the surface.
                    let mapped = shells.inverse(volume(r) / volume(*outer)).min(outer * (1.0 - 1e-12));
                    *x = std::array::from_fn(|k| center[k] + (x[k] - center[k]) * (mapped / r));
                }
            });
        }
    }
    points
}
