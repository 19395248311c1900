//! Masses of piecewise smooth expressions against closed forms.

use crate::field::mass::{piece_masses, total_mass};
use crate::field::{AnalyticField, MassEstimate, ScalarField};
use sph::domain::{Axis, Domain, Region, Wall};
use std::f64::consts::PI;

/// What callers ask for.
const TOLERANCE: f64 = 1e-10;

fn field<const D: usize>(text: &str, domain: &Domain<D>) -> AnalyticField<D> {
    AnalyticField::new("density", text, domain.center()).unwrap()
}

fn mass<const D: usize>(text: &str, domain: &Domain<D>) -> MassEstimate {
    total_mass(&field(text, domain), domain, TOLERANCE).unwrap()
}

/// The mass is known to 1e-8, and as well as it says.
fn has_mass<const D: usize>(text: &str, domain: &Domain<D>, expected: f64) {
    let found = mass(text, domain);
    assert!((found.value - expected).abs() <= found.error, "{text}: {found:?}, expected {expected}");
    assert!(found.error <= 1e-8 * expected, "{text}: {found:?}, expected {expected}");
}

fn cube<const D: usize>(half: f64) -> Domain<D> {
    Domain::new([-half; D], [half; D], [Axis::OPEN; D], Region::Box).unwrap()
}

fn unit_box<const D: usize>() -> Domain<D> {
    Domain::new([0.0; D], [1.0; D], [Axis::OPEN; D], Region::Box).unwrap()
}

fn sphere(radius: f64) -> f64 {
    4.0 / 3.0 * PI * radius.powi(3)
}

/// Volume of the unit cube below the plane `a . x = c`, by inclusion and exclusion of its corners.
fn below_plane(a: [f64; 3], c: f64) -> f64 {
    let corners = (0..8_u32).map(|corner| {
        let sum: f64 = (0..3).filter(|k| corner >> k & 1 == 1).map(|k| a[k]).sum();
        let sign = if corner.count_ones() % 2 == 0 { 1.0 } else { -1.0 };
        sign * (c - sum).max(0.0).powi(3)
    });
    corners.sum::<f64>() / (6.0 * a[0] * a[1] * a[2])
}

#[test]
fn planes_at_any_angle_are_integrated_exactly() {
    let expected = 1.0 + 99.0 * below_plane([1.0, 0.7, 0.3], 1.0);
    has_mass("if(x + 0.7*y + 0.3*z < 1, 100, 1)", &unit_box::<3>(), expected);
    let steps: f64 = (1..=12).map(|k| 1.0 - below_plane([5.0, 4.0, 3.0], f64::from(k))).sum();
    has_mass("1 + floor(5*x + 4*y + 3*z)", &unit_box::<3>(), 1.0 + steps);
    // What jumps is compared: both end where it does.
    has_mass("if(floor(x + 2*y) > 0.5, 50, 1)", &unit_box::<2>(), 37.75);
    has_mass("if(mod(x + 2*y, 1) < 0.1, 50, 1)", &unit_box::<2>(), 5.9);
    has_mass("if(x + 2*y - floor(x + 2*y) < 0.1, 50, 1)", &unit_box::<3>(), 5.9);
    has_mass("if((x < 0.3)*(y < 0.6)*(z > 0.2), 5, 1)", &unit_box::<3>(), 1.0 + 4.0 * 0.3 * 0.6 * 0.8);
    // Half of 1 + x^2 and of its mirror image.
    has_mass("step(x + y + z)*x^2 + 1", &cube::<3>(1.0), 8.0 + 8.0 / 6.0);
    // The squares of the triangle with the sides 1.
    has_mass("if(x + y < 1, x^2, 0) + 1", &unit_box::<2>(), 1.0 + 1.0 / 12.0);
    has_mass(
        "if(x < 0.123456, 2, exp(-x))",
        &unit_box::<1>(),
        2.0 * 0.123456 + (-0.123456_f64).exp() - (-1.0_f64).exp(),
    );
}

#[test]
fn curved_surfaces_are_integrated_to_their_order() {
    let inside = "(x - 0.5)^2 + (y - 0.5)^2 + (z - 0.5)^2";
    has_mass(&format!("if(sqrt({inside}) < 0.1, 1000, 1)"), &unit_box::<3>(), 1.0 + 999.0 * sphere(0.1));
    let ellipsoid = "if((x + 0.03)^2/0.1 + (y - 0.01)^2/0.04 + (z - 0.02)^2/0.02 < 1, 10, 1)";
    has_mass(ellipsoid, &cube::<3>(0.5), 1.0 + 9.0 * sphere(1.0) * (0.1_f64 * 0.04 * 0.02).sqrt());
    let turned = "if((0.8*x + 0.6*y)^2/0.1 + (0.8*y - 0.6*x)^2/0.04 + z^2/0.02 < 1, 10, 1)";
    has_mass(turned, &cube::<3>(0.5), 1.0 + 9.0 * sphere(1.0) * (0.1_f64 * 0.04 * 0.02).sqrt());
    has_mass("if((x - 0.4)^2 + (y - 0.5)^2 < 0.09, 100, 1)", &unit_box::<2>(), 1.0 + 99.0 * PI * 0.09);
    // Half of a Gaussian that ends within the box.
    let half = 0.5 * (PI / 30.0).powf(1.5);
    has_mass("exp(-30*r^2)*(x + y < 0) + 0.001", &cube::<3>(1.0), 0.008 + half);
}

#[test]
fn a_torus_in_vacuum_has_its_mass_in_every_domain() {
    let text = "if((sqrt(x^2 + y^2) - 0.6)^2 + z^2 < 0.04, 1, 1e-10)";
    let torus = 2.0 * PI * PI * 0.6 * 0.04;
    let with = |volume: f64| torus + 1e-10 * (volume - torus);
    has_mass(text, &cube::<3>(1.0), with(8.0));
    has_mass(text, &Domain::ball([0.0; 3], 1.0, Wall::Open).unwrap(), with(sphere(1.0)));
    let tube = Domain::cylinder([0.0; 3], 2, [0.0, 1.0], 2.0, (Wall::Open, Axis::OPEN)).unwrap();
    has_mass(text, &tube, with(2.0 * PI));
}

#[test]
fn balls_and_cylinders_keep_their_surfaces() {
    let ball = Domain::ball([0.0; 3], 1.0, Wall::Open).unwrap();
    let cap = |height: f64| PI * height.powi(2) * (3.0 - height) / 3.0;
    has_mass("if(r < 0.546, 10, 1)", &ball, sphere(1.0) + 9.0 * sphere(0.546));
    has_mass("if(z < 0.3, 10, 1)", &ball, 10.0 * sphere(1.0) - 9.0 * cap(0.7));
    has_mass("if(0.6*x + 0.8*y < 0.3, 10, 1)", &ball, 10.0 * sphere(1.0) - 9.0 * cap(0.7));
    has_mass("if((x - 0.2)^2 + (y + 0.1)^2 + (z - 0.3)^2 < 0.16, 10, 1)", &ball, sphere(1.0) + 9.0 * sphere(0.4));
    let disc = Domain::ball([0.0; 2], 1.0, Wall::Open).unwrap();
    has_mass("if(x < 0.3, 2, 1)", &disc, 2.0 * PI - (0.3_f64.acos() - 0.3 * 0.91_f64.sqrt()));
    let line = Domain::ball([0.0], 1.0, Wall::Open).unwrap();
    has_mass("if(x < 0.123456, 2, 1)", &line, 3.123456);
    has_mass("abs(x) + max(x, 0.3)", &line, 1.0 + 1.3 * 0.3 + 0.5 * 0.91);
    let tube = Domain::cylinder([0.0; 3], 2, [0.0, 1.0], 2.0, (Wall::Open, Axis::OPEN)).unwrap();
    has_mass("if(z < 0.3, 10, 1)", &tube, PI * 13.7);
    has_mass("if(x + 0.5*z < 0, 10, 1)", &tube, PI * 11.0);
}

#[test]
fn pieces_have_their_masses() {
    let domain = unit_box::<3>();
    let text = "if(x + 0.7*y + 0.3*z < 1, 100, if(z < 0.5, 1, 2))";
    let density = field(text, &domain);
    let found = piece_masses(&density, &domain, 1e-8).unwrap();
    let below = below_plane([1.0, 0.7, 0.3], 1.0);
    // Half of the box is that below z = 0.5, stretched to a unit cube.
    let lower = 0.5 * (1.0 - below_plane([1.0, 0.7, 0.15], 1.0));
    let places = [[0.1; 3], [0.9, 0.9, 0.2], [0.9, 0.9, 0.8]];
    for (place, expected) in places.iter().zip([100.0 * below, lower, 2.0 * (1.0 - below - lower)]) {
        let piece = found.iter().find(|p| p.0 == density.piece(place)).unwrap();
        assert!((piece.1.value - expected).abs() <= piece.1.error, "{piece:?} {expected}");
        assert!(piece.1.error < 1e-8 * expected);
    }
    assert_eq!(found.len(), 3);
    let sum: f64 = found.iter().map(|p| p.1.value).sum();
    let whole = total_mass(&density, &domain, TOLERANCE).unwrap();
    assert!((sum - whole.value).abs() <= 1e-8 * sum);
    assert!(piece_masses(&field("exp(-r^2)", &domain), &domain, 1e-8).is_none(), "of one piece");
}

#[test]
fn shells_by_the_dozen_are_told_apart() {
    let ball = Domain::ball([0.0; 3], 1.0, Wall::Open).unwrap();
    let density = field("1 + floor(20*r)", &ball);
    let found = piece_masses(&density, &ball, 1e-8).unwrap();
    for k in 0..20 {
        let radii = [f64::from(k), f64::from(k) + 1.0].map(|r| r / 20.0);
        let expected = (1.0 + f64::from(k)) * (sphere(radii[1]) - sphere(radii[0]));
        let number = density.piece(&[0.5 * (radii[0] + radii[1]), 0.0, 0.0]);
        let piece = found.iter().find(|p| p.0 == number).unwrap();
        assert!((piece.1.value / expected - 1.0).abs() < 1e-9, "shell {k}: {piece:?}, expected {expected}");
    }
}

/// Some 25 million evaluations each.
#[test]
#[ignore = "slow: .ci/full runs it"]
fn thousands_of_pieces_end_with_an_honest_error() {
    let ball = Domain::ball([0.0; 3], 1.0, Wall::Open).unwrap();
    let expected: f64 = (0..3000)
        .map(|k| (1.0 + f64::from(k)) * (sphere(f64::from(k + 1) / 3000.0) - sphere(f64::from(k) / 3000.0)))
        .sum();
    let checked = "1 + mod(floor(30*(x + 0.3*y)) + floor(30*(y - 0.2*z)) + floor(30*(z + 0.1*x)), 2)";
    let shells = mass("1 + floor(3000*r)", &ball);
    let cells = mass(checked, &unit_box::<3>());
    assert!((shells.value - expected).abs() <= shells.error, "{shells:?} {expected}");
    // As many cells of either kind, but for those at the faces.
    assert!((cells.value - 1.5).abs() <= cells.error.max(1e-3), "{cells:?}");
    assert!(piece_masses(&field(checked, &unit_box::<3>()), &unit_box::<3>(), 1e-8).is_none());
}

#[test]
fn threads_do_not_matter() {
    let domain = unit_box::<3>();
    let density = field("if((x - 0.47)^2 + (y - 0.51)^2 + (z - 0.53)^2 < 0.09, 1 + x, if(x + y > 1, 2, 3))", &domain);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| (total_mass(&density, &domain, 1e-8).unwrap(), piece_masses(&density, &domain, 1e-6).unwrap()))
    };
    assert_eq!(run(1), run(3));
}

/// Far smaller than anything between the points of a lattice: a star in a box of parsecs. What rounding leaves of the surface is in the error.
#[test]
fn tiny_bodies_are_found_or_are_in_the_error() {
    let domain = unit_box::<3>();
    for radius in [1e-5, 1e-7, 1e-8, 1e-9] {
        let density = 5.0 / sphere(radius);
        let text = format!("if((x - 0.31)^2 + (y - 0.47)^2 + (z - 0.77)^2 < {:e}, {density:e}, 1)", radius * radius);
        let found = mass(&text, &domain);
        let expected = 6.0 - sphere(radius);
        assert!((found.value - expected).abs() <= found.error, "{radius:e}: {found:?}");
        assert!(found.error < 1e-3 * expected, "{radius:e}: {found:?}");
    }
}

/// Threads and sheets take more cells than there are.
#[test]
#[ignore = "slow: .ci/full runs it"]
fn threads_and_sheets_that_are_not_found_are_in_the_error() {
    let domain = unit_box::<3>();
    for text in ["if((x - 0.31)^2 + (y - 0.47)^2 < 1e-16, 1e16, 1)", "if((x + 0.5*y - 0.71)^2 < 1e-18, 1e9, 1)"] {
        let found = mass(text, &domain);
        assert!(found.error > found.value, "{text}: {found:?}");
    }
}

#[test]
fn extreme_densities_neither_overflow_nor_vanish() {
    let domain = unit_box::<3>();
    for unit in ["1e300", "1e-300"] {
        let expected = unit.parse::<f64>().unwrap() * (1.0 + below_plane([1.0, 0.7, 0.3], 1.0));
        has_mass(&format!("{unit}*if(x + 0.7*y + 0.3*z < 1, 2, 1)"), &domain, expected);
    }
}
