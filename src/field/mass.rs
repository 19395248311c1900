//! Total mass of any field within any domain.

use super::bvh::Aabb;
use super::chords::chord_integral;
use super::cubature::integrate_unit_box;
use super::piecewise::{Chart, integrate_pieces};
use super::quadrature::rule;
use super::{MassEstimate, ScalarField};
use crate::error::{Error, Result};
use sph::domain::{Domain, Region};
use sph::geometry::unit_ball_volume;
use std::f64::consts::TAU;

/// Evaluations after which an unfinished estimate is returned with the error that it has.
const MAX_EVALUATIONS: usize = 6_000_000;
/// Evaluations that a field of parts is first tried with, and those that its integral by parts takes at most.
const QUICK_EVALUATIONS: usize = 300_000;
const MAX_PART_EVALUATIONS: usize = 20_000_000;
/// Chords of a hull that its integral takes at most.
const MAX_CHORDS: usize = 60_000;
/// Pieces whose masses are less well known are of no use.
const PIECE_TOLERANCE: f64 = 1e-4;

/// Integral of `field` over `domain`: the interpolant's own where it has one, else adaptive cubature to the
/// relative `tolerance`, across the discontinuities and kinks that the field knows of. With discontinuities that it does
/// not know of, or thousands of them, it may end above the tolerance; the error says so.
///
/// Balls and shells are integrated along radius and angles, so that their surface is no discontinuity;
/// that of a hull is one.
///
/// # Errors
/// No mass, or one beyond the range of double precision.
pub fn total_mass<const D: usize>(
    field: &dyn ScalarField<D>,
    domain: &Domain<D>,
    tolerance: f64,
) -> Result<MassEstimate> {
    let mass = field.integral(domain).unwrap_or_else(|| sampled(field, domain, tolerance));
    check_mass("density", mass)
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

/// Part of the difference of two results that the error of the better one may be.
const LITTLE: f64 = 0.01;

/// By plain cubature where that is enough, else part by part where the field knows them, else as plain cubature leaves it.
fn sampled<const D: usize>(field: &dyn ScalarField<D>, domain: &Domain<D>, tolerance: f64) -> MassEstimate {
    let plain = |evaluations| by_cubature(field, domain, tolerance, evaluations);
    let Some(chart) = Chart::new(field, domain).filter(|_| field.has_parts()) else {
        return plain(MAX_EVALUATIONS);
    };
    let is_enough = |m: &MassEstimate| m.error <= tolerance * m.value;
    let better = |a: MassEstimate, b: MassEstimate| if b.error < a.error { b } else { a };
    let quick = plain(QUICK_EVALUATIONS);
    // A thin layer may lie between the points of a rule, which then agrees with itself.
    if is_enough(&quick) && !field.is_piecewise() {
        return quick;
    }
    let by_parts = integrate_pieces(&chart, tolerance, MAX_PART_EVALUATIONS).total;
    if is_enough(&by_parts) {
        return by_parts;
    }
    let plain = better(quick, plain(MAX_EVALUATIONS));
    let apart = (plain.value - by_parts.value).abs();
    // A rule that has not met a part at all is sure of itself.
    if field.is_piecewise() && apart > plain.error && by_parts.error < LITTLE * apart {
        return by_parts;
    }
    let best = better(by_parts, plain);
    MassEstimate { error: best.error.max(apart - by_parts.error), ..best }
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
    let is_known = found.total.error <= tolerance.max(PIECE_TOLERANCE) * found.total.value;
    is_known.then(|| found.pieces.into_iter().filter(|p| p.1.value > 0.0).collect())
}

fn by_cubature<const D: usize>(
    field: &dyn ScalarField<D>,
    domain: &Domain<D>,
    tolerance: f64,
    evaluations: usize,
) -> MassEstimate {
    let (lo, extent) = (domain.lo, domain.extent());
    let place = |u: &[f64; D]| -> [f64; D] { std::array::from_fn(|k| lo[k] + u[k] * extent[k]) };
    let integrate = |f: &(dyn Fn(&[f64; D]) -> f64 + Sync)| integrate_unit_box(f, tolerance, evaluations);
    let (mean, volume) = match &domain.region {
        Region::Box => (integrate(&|u| field.value(&place(u))), extent.iter().product::<f64>()),
        Region::Hull(hull, _) => {
            let bounds = Aabb { lo: domain.lo, hi: domain.hi };
            if let Some(mass) =
                chord_integral(hull.as_ref(), &bounds, MAX_CHORDS, &|x, chord| along_chord(field, x, &bounds, chord))
            {
                return mass;
            }
            let inside = |u: &[f64; D]| {
                let x = place(u);
                if hull.contains(&x) { field.value(&x) } else { 0.0 }
            };
            (integrate(&inside), extent.iter().product())
        }
        Region::Cylinder { center, axis, inner_radius, radius, .. } => {
            let inner = inner_radius / radius;
            let tubes = |u: &[f64; D]| {
                let q = inner + u[0] * (1.0 - inner);
                let (sin, cos) = (TAU * u[1]).sin_cos();
                let mut around = [cos, sin].into_iter();
                let x = std::array::from_fn(|k| match k == *axis {
                    true => lo[k] + u[D - 1] * extent[k],
                    false => center[k] + q * radius * around.next().unwrap_or(0.0),
                });
                // The share of the volume between q and q + dq.
                field.value(&x) * 2.0 * q * (1.0 - inner)
            };
            (integrate(&tubes), unit_ball_volume(2) * radius.powi(2) * extent[*axis])
        }
        Region::Ball { center, inner_radius, radius, .. } => {
            let inner = inner_radius / radius;
            let shells = |u: &[f64; D]| {
                let q = inner + u[0] * (1.0 - inner);
                // Mean over the sphere of radius q, times d q^(d-1) (1 - inner) dV/V.
                sphere_value(field, center, q * radius, u) * D as f64 * q.powi(D as i32 - 1) * (1.0 - inner)
            };
            (integrate(&shells), unit_ball_volume(D) * radius.powi(D as i32))
        }
    };
    MassEstimate { value: mean.value * volume, error: mean.error * volume }
}

/// Integral of a field along a chord: Gauss-Legendre, in halves while these change it.
fn along_chord<const D: usize>(field: &dyn ScalarField<D>, x: &[f64; D], bounds: &Aabb<D>, chord: [f64; 2]) -> f64 {
    let axis = bounds.longest();
    let at = |t: f64| {
        let mut y = *x;
        y[axis] = t;
        field.value(&y)
    };
    let gauss = |a: f64, b: f64| (b - a) * rule(9).iter().map(|&(t, w)| w * at(a + t * (b - a))).sum::<f64>();
    let mut open = vec![(chord[0], chord[1], gauss(chord[0], chord[1]), 0)];
    let mut sum = 0.0;
    while let Some((a, b, whole, level)) = open.pop() {
        let middle = 0.5 * (a + b);
        let halves = [gauss(a, middle), gauss(middle, b)];
        if level >= MAX_HALVINGS || (halves[0] + halves[1] - whole).abs() <= ALONG * whole.abs() {
            sum += halves[0] + halves[1];
        } else {
            open.push((middle, b, halves[1], level + 1));
            open.push((a, middle, halves[0], level + 1));
        }
    }
    sum
}

/// Relative change by which the integral along a chord counts as known, and halvings of it, at most.
const ALONG: f64 = 1e-10;
const MAX_HALVINGS: usize = 24;

/// Value at distance `r` from `center` in the direction of `u[1..]`; in one dimension the mean of both sides.
fn sphere_value<const D: usize>(field: &dyn ScalarField<D>, center: &[f64; D], r: f64, u: &[f64; D]) -> f64 {
    let at = |direction: [f64; 3]| field.value(&std::array::from_fn(|k| center[k] + r * direction[k]));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::AnalyticField;
    use sph::domain::{Axis, Wall};
    use std::f64::consts::PI;

    fn mass<const D: usize>(text: &str, domain: &Domain<D>) -> MassEstimate {
        let field = AnalyticField::new("density", text, [0.0; D]).unwrap();
        total_mass(&field, domain, 1e-9).unwrap()
    }

    fn bounds_true_error(e: MassEstimate, expected: f64, relative: f64) {
        assert!((e.value - expected).abs() <= e.error, "{e:?} {expected}");
        assert!(e.error <= relative * expected, "{e:?} {expected}");
    }

    #[test]
    fn closed_forms_are_met_within_the_stated_error() {
        let ball = Domain::ball([0.0; 3], 1.0, Wall::Open).unwrap();
        bounds_true_error(mass("2", &ball), 8.0 / 3.0 * PI, 1e-9);
        bounds_true_error(mass("if(r > 0, sin(pi*r)/(pi*r), 1)", &ball), 4.0 / PI, 1e-8);
        bounds_true_error(mass("1/r^2", &ball), 4.0 * PI, 1e-9);
        let wide = Domain::ball([0.0; 3], 8.0, Wall::Open).unwrap();
        bounds_true_error(mass("exp(-r^2)", &wide), PI.powf(1.5), 1e-8);
        let disc = Domain::ball([0.0; 2], 2.0, Wall::Open).unwrap();
        bounds_true_error(mass("1 + x^2", &disc), 4.0 * PI + PI * 4.0, 1e-8);
        let line = Domain::ball([1.0], 2.0, Wall::Open).unwrap();
        bounds_true_error(mass("x + 5", &line), 24.0, 1e-9);
        let tube = Domain::cylinder([1.0, 0.0, 2.0], 1, [1.0, 3.0], 4.0, (Wall::Open, Axis::Periodic)).unwrap();
        // About its own axis the mean of (x - 1)^2 + (z - 2)^2 is 5, and that of y^2 is 4/3.
        bounds_true_error(mass("(x - 1)^2 + (z - 2)^2 + y^2", &tube), 32.0 * PI * (5.0 + 4.0 / 3.0), 1e-8);
        let cube = Domain::new([0.0; 3], [2.0, 1.0, 3.0], [Axis::Periodic; 3], Region::Box).unwrap();
        bounds_true_error(mass("1 + 0.5*sin(pi*x)*y + z^2", &cube), 6.0 + 18.0, 1e-8);
    }

    #[test]
    fn discontinuities_are_bounded_by_their_error() {
        let ball = Domain::ball([0.0; 3], 1.0, Wall::Open).unwrap();
        // A discontinuity in the radius is aligned with the integration: refined to nothing.
        let expected = 4.0 / 3.0 * PI * (1.0 + 9.0 * 0.546_f64.powi(3));
        bounds_true_error(mass("if(r < 0.546, 10, 1)", &ball), expected, 1e-9);
        let cube = Domain::new([-1.0; 3], [1.0; 3], [Axis::OPEN; 3], Region::Box).unwrap();
        bounds_true_error(mass("r < 0.8", &cube), 4.0 / 3.0 * PI * 0.512, 1e-8);
    }

    /// Plain rules do not meet it, and are sure of what they have.
    #[test]
    fn a_small_dense_shell_is_not_missed() {
        let cube = Domain::new([0.0; 3], [1.0; 3], [Axis::Periodic; 3], Region::Box).unwrap();
        let r = "sqrt((x - 0.25)^2 + (y - 0.7)^2 + (z - 0.31)^2)";
        for (inner, outer) in [(0.03_f64, 0.036_f64), (0.02, 0.03)] {
            let text = format!("if(({r} >= {inner})*({r} < {outer}), 4, 1e-10)");
            let field = AnalyticField::new("density", &text, [0.0; 3]).unwrap();
            // Less than can be had, so that all rules are tried.
            let e = total_mass(&field, &cube, 1e-13).unwrap();
            let volume = 4.0 / 3.0 * PI * (outer.powi(3) - inner.powi(3));
            bounds_true_error(e, 4.0 * volume + 1e-10 * (1.0 - volume), 1e-5);
        }
    }

    #[test]
    fn extreme_values_neither_overflow_nor_vanish() {
        for unit in ["1e300", "1e-300"] {
            let disc = Domain::ball([0.0; 2], 1.0, Wall::Open).unwrap();
            let e = mass(&format!("{unit}*(1 + r)"), &disc);
            let expected = unit.parse::<f64>().unwrap() * PI * 5.0 / 3.0;
            assert!((e.value / expected - 1.0).abs() < 1e-9 && e.error / expected < 1e-8, "{e:?}");
        }
        let field = AnalyticField::new("density", "1e300", [0.0; 3]).unwrap();
        let huge = Domain::ball([0.0; 3], 1e10, Wall::Open).unwrap();
        assert!(total_mass(&field, &huge, 1e-6).unwrap_err().to_string().contains("range"));
        let nothing = AnalyticField::new("density", "0*x", [0.0; 3]).unwrap();
        assert!(total_mass(&nothing, &huge, 1e-6).unwrap_err().to_string().contains("nothing to place"));
    }

    #[test]
    fn a_spherical_shell_leaves_its_hole_out() {
        let mut shell = Domain::ball([0.5; 3], 2.0, Wall::Open).unwrap();
        if let Region::Ball { inner_radius, .. } = &mut shell.region {
            *inner_radius = 1.0;
        }
        bounds_true_error(mass("3", &shell), 3.0 * 4.0 / 3.0 * PI * 7.0, 1e-9);
    }
}
