//! Total mass of any field within any domain.

use super::bvh::Aabb;
use super::chords::chord_integral;
use super::cubature::{Enclosing, Seen, integrate_enclosed};
use super::patch::{ENOUGH, UNSEEN, about_pole};
use super::piecewise::{Chart, Integrand, PieceIntegrals, integrate_pieces, stretches};
use super::quadrature::rule;
use super::{Enclosure, MassEstimate, Patch, ScalarField};
use crate::error::{Error, Result};
use sph::domain::{Domain, Region};
use sph::geometry::unit_ball_volume;
use std::f64::consts::TAU;
use std::sync::atomic::{AtomicU64, Ordering};

/// Evaluations after which an unfinished estimate is returned with the error that it has.
const MAX_EVALUATIONS: usize = 6_000_000;
/// Evaluations that a field of parts is first tried with, and those that its integral by parts takes at most.
const QUICK_EVALUATIONS: usize = 300_000;
const MAX_PART_EVALUATIONS: usize = 20_000_000;
/// Chords of a hull that its integral takes at most, and evaluations that one counts for.
const MAX_CHORDS: usize = 60_000;
const CHORD_COST: usize = 100;
/// Pieces whose masses are less well known are of no use.
const PIECE_TOLERANCE: f64 = 1e-4;

/// Integral of `field` over `domain`: the interpolant's own where it has one, else adaptive cubature to the
/// relative `tolerance`, across the discontinuities and kinks that the field knows of. With discontinuities that it does
/// not know of, or thousands of them, it may end above the tolerance; the error says so.
///
/// Where the field has bounds ([`ScalarField::enclosure`]) what lies between the points of rules is looked for, and what may be hidden
/// still is part of the error. An error of 1e-6 is enough where a smaller one takes millions of evaluations.
///
/// Balls and shells are integrated along radius and angles, so that their surface is no discontinuity;
/// that of a hull is one.
///
/// # Errors
/// No mass, one beyond the range of double precision, or one that is not known at all.
pub fn total_mass<const D: usize>(
    field: &dyn ScalarField<D>,
    domain: &Domain<D>,
    tolerance: f64,
) -> Result<MassEstimate> {
    mass_and_pieces(field, domain, tolerance).map(|(mass, _)| mass)
}

/// [`total_mass`], and with it the integrals over the pieces of the field, where these were found on the way.
///
/// # Errors
/// As for [`total_mass`].
pub(crate) fn mass_and_pieces<const D: usize>(
    field: &dyn ScalarField<D>,
    domain: &Domain<D>,
    tolerance: f64,
) -> Result<(MassEstimate, Option<Vec<(u64, MassEstimate)>>)> {
    let chart = || if field.is_piecewise() { Chart::new(field, domain) } else { None };
    let (mass, pieces) = match field.integral(domain) {
        Some(known) => (known, None),
        // Discontinuities are for the rules that look for them: others agree with themselves where a thin layer lies between their points.
        None => match chart() {
            Some(chart) => {
                let found = integrate_pieces(&chart, tolerance, MAX_PART_EVALUATIONS);
                (found.total, known_pieces(found, PIECE_TOLERANCE))
            }
            None => (sampled(field, domain, tolerance), None),
        },
    };
    let mass = check_mass("density", mass)?;
    // Of pieces the error is what may be hidden between points, not what has been seen.
    if !(mass.error < mass.value) && !field.is_piecewise() {
        let problem = format!(
            "the mass within the domain cannot be found: it is {:.2e} as far as it was looked at, with an error of {:.2e}; poles as steep as 1/x in \
             1-D, r^-2 in 2-D and r^-3 in 3-D have no finite mass, and what is far finer than the domain is not seen: bound the density, as by max(r, 1e-3)",
            mass.value, mass.error
        );
        return Err(Error::field("density", problem));
    }
    Ok((mass, pieces))
}

/// # Errors
/// A mass that is not positive or not finite.
pub(crate) fn check_mass(name: &str, mass: MassEstimate) -> Result<MassEstimate> {
    if !mass.value.is_finite() {
        return Err(Error::field(
            name,
            "the mass within the domain exceeds the range of double precision; state other units".to_owned(),
        ));
    }
    if mass.value <= 0.0 {
        return Err(Error::field(
            name,
            format!("the mass within the domain is {}; there is nothing to place: check domain and units", mass.value),
        ));
    }
    Ok(mass)
}

/// The pieces of an integral that is known to `tolerance`.
fn known_pieces(found: PieceIntegrals, tolerance: f64) -> Option<Vec<(u64, MassEstimate)>> {
    let is_known = found.total.error <= tolerance * found.total.value;
    is_known.then(|| found.pieces.into_iter().filter(|p| p.1.value > 0.0).collect())
}

/// By plain cubature where that is enough, else part by part where the field knows them, else as plain cubature leaves it.
fn sampled<const D: usize>(field: &dyn ScalarField<D>, domain: &Domain<D>, tolerance: f64) -> MassEstimate {
    let plain = |evaluations| by_cubature(field, domain, tolerance, evaluations);
    let chart = Chart::new(field, domain);
    let Some(chart) = chart.as_ref().filter(|_| field.has_parts()) else {
        let plain = plain(MAX_EVALUATIONS);
        // Bounds are for cells, of which chords have none.
        let is_by_chords = matches!(domain.region, Region::Hull(..));
        return match chart.filter(|chart| is_by_chords && chart.enclosure(&[0.0; D], &[1.0; D]).is_some()) {
            Some(chart) => checked(plain, integrate_pieces(&chart, tolerance, MAX_PART_EVALUATIONS).total),
            None => plain,
        };
    };
    // The rounding of sums is no reason for another rule.
    let is_enough = |m: &MassEstimate| m.error <= 2.0 * tolerance * m.value;
    let better = |a: MassEstimate, b: MassEstimate| if b.error < a.error { b } else { a };
    let quick = plain(QUICK_EVALUATIONS);
    if is_enough(&quick) {
        return quick;
    }
    let by_parts = integrate_pieces(chart, tolerance, MAX_PART_EVALUATIONS).total;
    if is_enough(&by_parts) {
        return by_parts;
    }
    if by_parts.error <= ENOUGH * by_parts.value {
        return better(by_parts, quick);
    }
    let best = better(by_parts, better(quick, plain(MAX_EVALUATIONS)));
    MassEstimate { error: best.error.max((best.value - by_parts.value).abs() - by_parts.error), ..best }
}

/// An integral by chords that is known well enough if one by cells, by which narrow peaks are found, says the same; else that.
fn checked(by_chords: MassEstimate, by_cells: MassEstimate) -> MassEstimate {
    let agree = (by_chords.value - by_cells.value).abs() <= by_chords.error + by_cells.error;
    let is_enough = by_chords.error <= ENOUGH * by_chords.value || by_chords.error <= by_cells.error;
    if agree && is_enough { by_chords } else { by_cells }
}

/// Mass of each piece of a piecewise smooth field over `domain`, by the numbers of [`ScalarField::piece`], to the relative
/// `tolerance` of the whole or what can be had; `None` if the field has no pieces, or they are not known to 1e-4.
pub fn piece_masses<const D: usize>(
    field: &dyn ScalarField<D>,
    domain: &Domain<D>,
    tolerance: f64,
) -> Option<Vec<(u64, MassEstimate)>> {
    if !field.is_piecewise() {
        return None;
    }
    if let Some(known) = field.piece_integrals(domain) {
        return Some(known);
    }
    let found = integrate_pieces(&Chart::new(field, domain)?, tolerance, MAX_PART_EVALUATIONS);
    known_pieces(found, tolerance.max(PIECE_TOLERANCE))
}

fn by_cubature<const D: usize>(
    field: &dyn ScalarField<D>,
    domain: &Domain<D>,
    tolerance: f64,
    evaluations: usize,
) -> MassEstimate {
    let (lo, extent) = (domain.lo, domain.extent());
    let place = |u: &[f64; D]| -> [f64; D] { sph::array(|k| lo[k] + u[k] * extent[k]) };
    // Discontinuities are found part by part.
    let enclosure = |patch: &Patch<D>| field.enclosure(patch).filter(|_| !field.is_piecewise());
    let integrate = |f: &(dyn Fn(&[f64; D]) -> f64 + Sync), enclosing: Enclosing<D>| {
        integrate_enclosed(f, enclosing, tolerance, evaluations)
    };
    let (mean, volume) = match &domain.region {
        Region::Box => {
            let bounds = |a: &[f64; D], b: &[f64; D]| enclosure(&Patch::of_box(place(a), place(b)));
            (integrate(&|u| field.value(&place(u)), &bounds), extent.iter().product::<f64>())
        }
        Region::Hull(hull, _) => {
            let bounds = Aabb { lo: domain.lo, hi: domain.hi };
            let known = LargestError::default();
            let along = |x: &[f64; D], chord: [f64; 2]| known.noted(along_chord(field, x, bounds.longest(), chord));
            let chords = (evaluations / CHORD_COST).min(MAX_CHORDS);
            if let Some(mass) = chord_integral(hull.as_ref(), &bounds, chords, &along) {
                return MassEstimate { error: mass.error + known.relative() * mass.value.abs(), ..mass };
            }
            let inside = |u: &[f64; D]| {
                let x = place(u);
                if hull.contains(&x) { field.value(&x) } else { 0.0 }
            };
            (integrate(&inside, &|_, _| None), extent.iter().product())
        }
        Region::Cylinder { center, axis, inner_radius, radius, .. } => {
            let inner = inner_radius / radius;
            let tubes = |u: &[f64; D]| {
                let q = inner + u[0] * (1.0 - inner);
                let (sin, cos) = (TAU * u[1]).sin_cos();
                let mut around = [cos, sin].into_iter();
                let x = sph::array(|k| match k == *axis {
                    true => lo[k] + u[D - 1] * extent[k],
                    false => center[k] + q * radius * around.next().unwrap_or(0.0),
                });
                // The share of the volume between q and q + dq.
                field.value(&x) * 2.0 * q * (1.0 - inner)
            };
            let bounds = |a: &[f64; D], b: &[f64; D]| {
                let radii = [a[0], b[0]].map(|u| inner + u * (1.0 - inner));
                let ends = [a[D - 1], b[D - 1]].map(|u| lo[*axis] + u * extent[*axis]);
                let patch = Patch::of_tube((center, *axis), radii.map(|q| q * radius), ends, [a[1], b[1]]);
                Some(enclosure(&patch)?.times(radii.map(|q| 2.0 * q * (1.0 - inner))))
            };
            (integrate(&tubes, &bounds), unit_ball_volume(2) * radius.powi(2) * extent[*axis])
        }
        Region::Ball { center, inner_radius, radius, .. } => {
            let inner = inner_radius / radius;
            let shells = |u: &[f64; D]| {
                let q = inner + u[0] * (1.0 - inner);
                // Mean over the sphere of radius q, times d q^(d-1) (1 - inner) dV/V.
                sphere_value(field, center, q * radius, u) * D as f64 * q.powi(D as i32 - 1) * (1.0 - inner)
            };
            let bounds = |a: &[f64; D], b: &[f64; D]| {
                let radii = [a[0], b[0]].map(|u| inner + u * (1.0 - inner));
                let bounds = sphere_enclosure(&enclosure, center, radii.map(|q| q * radius), [a, b])?;
                Some(bounds.times(radii.map(|q| D as f64 * q.powi(D as i32 - 1) * (1.0 - inner))))
            };
            (integrate(&shells, &bounds), unit_ball_volume(D) * radius.powi(D as i32))
        }
    };
    MassEstimate { value: mean.value * volume, error: mean.error * volume }
}

/// Integral of a field along a chord: part by part where the field tells them.
fn along_chord<const D: usize>(field: &dyn ScalarField<D>, x: &[f64; D], axis: usize, chord: [f64; 2]) -> MassEstimate {
    let place = |t: f64| {
        let mut y = *x;
        y[axis] = t;
        y
    };
    let at = |t: f64| field.value(&place(t));
    let bounds = |a: f64, b: f64| field.enclosure(&Patch::of_box(place(a), place(b)));
    let width = chord[1] - chord[0];
    let [lo, hi] = [chord[0] + LINE_INSET * width, chord[1] - LINE_INSET * width];
    let parts =
        if field.has_parts() && width > 0.0 { stretches(&|t| field.trace(&place(t)), [lo, hi], 0.0) } else { None };
    let mut ends = vec![chord[0]];
    ends.extend(parts.iter().flat_map(|parts| parts.iter().skip(1).map(|s| s.from)));
    ends.push(chord[1]);
    let along = |ends: &[f64]| along_part(&at, &bounds, [ends[0], ends[1]]);
    ends.windows(2).map(along).fold(MassEstimate { value: 0.0, error: 0.0 }, |a, b| MassEstimate {
        value: a.value + b.value,
        error: a.error + b.error,
    })
}

/// Gauss-Legendre, in halves while these change the integral or bounds show that something may be hidden.
fn along_part(
    at: &dyn Fn(f64) -> f64,
    bounds: &dyn Fn(f64, f64) -> Option<Enclosure>,
    [from, to]: [f64; 2],
) -> MassEstimate {
    let gauss = |a: f64, b: f64| {
        let seen = Seen::default();
        let sum = rule(9).iter().map(|&(t, w)| w * seen.noted(at(a + t * (b - a)))).sum::<f64>();
        ((b - a) * sum, seen.range())
    };
    let unseen = |a: f64, b: f64, value: f64, seen: [f64; 2]| {
        let inset = LINE_INSET * (b - a);
        bounds(a + inset, b - inset).map_or(0.0, |e| e.unseen(seen, b - a, value))
    };
    let first = gauss(from, to);
    // What is little beside all of the part is no reason for more steps: next to a pole values are all rounding.
    let scale = first.0.abs();
    let mut open = vec![(from, to, first, scale, 0)];
    let (mut sum, mut error) = (0.0, 0.0);
    while let Some((a, b, (whole, _), about, level)) = open.pop() {
        let middle = 0.5 * (a + b);
        let halves = [gauss(a, middle), gauss(middle, b)];
        let both = halves[0].0 + halves[1].0;
        let step = (both - whole).abs();
        let is_last = level >= MAX_HALVINGS || !(a < middle && middle < b);
        let seen = [halves[0].1[0].min(halves[1].1[0]), halves[0].1[1].max(halves[1].1[1])];
        let hidden = unseen(a, b, both, seen);
        if is_last {
            (sum, error) = (sum + both, error + about);
        } else if step <= (ALONG * whole.abs()).max(LITTLE * scale) && hidden <= UNSEEN * scale {
            (sum, error) = (sum + both, error + step + hidden);
        } else {
            let [left, right] = [halves[0].0, halves[1].0];
            open.push((middle, b, halves[1], about_pole(whole, right, left), level + 1));
            open.push((a, middle, halves[0], about_pole(whole, left, right), level + 1));
        }
    }
    MassEstimate { value: sum, error }
}

/// Relative change by which the integral along a chord counts as known, and halvings of it, at most: to the digits that doubles have.
const ALONG: f64 = 1e-10;
/// The same beside the integral along all of a part.
const LITTLE: f64 = 1e-13;
const MAX_HALVINGS: usize = 52;
/// Distance from the ends of a line at which its inside begins, as a share of it.
const LINE_INSET: f64 = 1e-11;

/// The largest relative error of integrals along chords.
#[derive(Default)]
struct LargestError(AtomicU64);

impl LargestError {
    fn noted(&self, chord: MassEstimate) -> f64 {
        if chord.error > 0.0 && chord.value > 0.0 {
            // Positive numbers are in the order of their bits; the largest is the same in any order of the chords.
            self.0.fetch_max((chord.error / chord.value).to_bits(), Ordering::Relaxed);
        }
        chord.value
    }

    fn relative(&self) -> f64 {
        f64::from_bits(self.0.load(Ordering::Relaxed))
    }
}

/// Value at distance `r` from `center` in the direction of `u[1..]`; in one dimension the mean of both sides.
fn sphere_value<const D: usize>(field: &dyn ScalarField<D>, center: &[f64; D], r: f64, u: &[f64; D]) -> f64 {
    let at = |direction: [f64; 3]| field.value(&sph::array(|k| center[k] + r * direction[k]));
    match D {
        1 => 0.5 * at([1.0, 0.0, 0.0]) + 0.5 * at([-1.0, 0.0, 0.0]),
        2 => {
            let (sin, cos) = (TAU * u[1]).sin_cos();
            at([cos, sin, 0.0])
        }
        _ => {
            let z = 2.0 * u[1] - 1.0;
            let ring = (1.0 - z * z).max(0.0).sqrt();
            let (sin, cos) = (TAU * u[2]).sin_cos();
            at([ring * cos, ring * sin, z])
        }
    }
}

/// Bounds of [`sphere_value`] between two distances and two corners of a cell.
fn sphere_enclosure<const D: usize>(
    enclosure: &dyn Fn(&Patch<D>) -> Option<Enclosure>,
    center: &[f64; D],
    radii: [f64; 2],
    [a, b]: [&[f64; D]; 2],
) -> Option<Enclosure> {
    let of = |heights, turns| enclosure(&Patch::of_shell(*center, radii, heights, turns));
    match D {
        1 => {
            let [left, right] = [of([0.0; 2], [-1.0; 2])?, of([0.0; 2], [1.0; 2])?];
            let mean = |a: f64, b: f64| 0.5 * a + 0.5 * b;
            let is_continuous = left.is_continuous && right.is_continuous;
            Some(Enclosure::new(mean(left.least, right.least), mean(left.most, right.most), is_continuous))
        }
        2 => of([0.0; 2], [a[1], b[1]]),
        _ => of([a[1], b[1]].map(|u| 2.0 * u - 1.0), [a[2], b[2]]),
    }
}

#[cfg(test)]
#[path = "mass_tests.rs"]
mod tests;
