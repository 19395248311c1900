//! Stretching: a uniform pattern is mapped to the target by mass coordinates.
//!
//! A point keeps the fraction of the mass that lies before it: along each axis of a box where the target is a
//! product of functions of the coordinates (ALARIC eq. 27), along the radius of a ball where it is a function of
//! that (ALARIC eq. 26; Herant 1994; Rosswog et al. 2009; Diehl et al. 2015, sec. 3.2.2), along radius and axis of a
//! cylinder where it is a product of functions of both, by Newton's method on the enclosed mass. Densities come out
//! right to the order of the pattern; the pattern itself is sheared, which in
//! two and three dimensions makes its spacings uneven where the stretch varies much.

use super::cumulative::Cumulative;
use super::lattice::{Fit, Lattice, UnitCell};
use super::pattern::{self, Pattern};
use super::seeded::{Seeded, to_positions};
use super::sublattice::Sublattice;
use super::symmetry::{self, Symmetry};
use crate::error::Result;
use crate::target::Target;
use sph::domain::Axis;
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
    lattice: Lattice,
) -> Result<Seeded<D>> {
    let cell = lattice.cell::<D>();
    let (domain, count) = (target.domain, target.count);
    if !symmetry::fills_box(domain) {
        let mut seeded = place(target, symmetry, &cell)?;
        if domain.axes.contains(&Axis::Periodic) {
            seeded.notes.push("the lattice is cut to the region: at its periodic ends there is a seam".into());
        }
        return Ok(seeded);
    }
    let extent = domain.extent();
    let fit = cell.fit(&extent, count);
    let periodic = domain.axes.iter().all(|axis| *axis == Axis::Periodic);
    let upright = fit.is_exact(cell.sites.len(), count);
    let (points, notes) = if periodic && !(upright && fit.distortion.ln() <= SLIGHT) {
        let (askew, note) = askew(lattice, &extent, count);
        match askew {
            Some(askew) if !(upright && fit.distortion.ln() <= askew.strain) => {
                let edge = |f: f64, k: usize| domain.lo[k] + extent[k] * f;
                let fractions = askew.fractions();
                let note = note.into_iter().chain(strain_note(count, askew.strain)).collect();
                (parallel::map(count, |i| std::array::from_fn(|k| edge(fractions[i][k], k))), note)
            }
            _ => upright_points(&cell, target, &extent, &fit),
        }
    } else {
        upright_points(&cell, target, &extent, &fit)
    };
    Ok(Seeded { positions: to_positions(&map(target, symmetry, points)), notes })
}

/// A lattice whose axes are those of the box is kept if it is distorted by no more.
const SLIGHT: f64 = 0.01;

fn upright_points<const D: usize>(
    cell: &UnitCell<D>,
    target: &Target<'_, D>,
    extent: &[f64; D],
    fit: &Fit<D>,
) -> (Vec<[f64; D]>, Vec<String>) {
    let (lo, count, per_cell) = (&target.domain.lo, target.count, cell.sites.len());
    let exact = fit.is_exact(per_cell, count);
    let points = if exact { cell.fill(lo, extent, fit, count) } else { cell.columns(lo, extent, fit, count) };
    (points, fit.note(per_cell, count).into_iter().collect())
}

/// The lattice of exactly `count` points in a periodic box, and what is different about it.
fn askew<const D: usize>(lattice: Lattice, extent: &[f64; D], count: usize) -> (Option<Sublattice<D>>, Option<String>) {
    let wanted = lattice.bravais().fit(extent, count);
    if wanted.is_some() || count == 0 {
        return (wanted, None);
    }
    let note = format!(
        "hexagonal close packing has two points per cell, and {count} is odd: the layers are stacked ABCABC (cubic close packing)"
    );
    (Lattice::CubicClosePacked.bravais().fit(extent, count), Some(note))
}

fn strain_note(count: usize, strain: f64) -> Option<String> {
    /// What rounding leaves of none.
    const ROUNDING: f64 = 1e-9;
    let percent = 100.0 * strain.exp_m1();
    (strain > ROUNDING).then(|| {
        format!(
            "the lattice is turned and strained by {percent:.2} %, so that exactly {count} points fit the periodic box"
        )
    })
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
