//! Masses against closed forms.

use super::*;
use crate::field::{AnalyticField, Primitive, Shape, Solid, Tree, upright};
use sph::domain::{Axis, Wall};
use std::f64::consts::PI;
use std::sync::Arc;

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

/// A layer on a ball, with a wave along it, far denser than all around: half of the cells' points see the same as everywhere, rules
/// along its inner axis give up.
#[test]
fn a_thin_dense_shell_with_a_wave_in_it_is_met() {
    let cube = Domain::new([0.0; 3], [0.48, 0.48, 0.36], [Axis::Periodic; 3], Region::Box).unwrap();
    let r = "sqrt((x - 0.2367)^2 + (y - 0.3803)^2 + (z - 0.4229 + 0.1)^2)";
    let core = "sqrt((x - 0.2414)^2 + (y - 0.2408)^2 + (z - 0.1874)^2)";
    let around = format!("1e-10*((1 + ({core}/0.0063)^2)^-6 + 0.0218*max(1 - {core}/0.24, 0)^1.5) + 6e-11");
    let (inner, outer) = (0.0244_f64, 0.029_f64);
    // What the wave is over a sphere of radius q: its mean times sin(k q)/(k q).
    let k = 26.0 * 2f64.sqrt();
    let text = format!("if(({r} >= {inner})*({r} < {outer}), 4.15*(1 + 0.94*sin(26*(y + z))), {around})");
    let e = {
        let field = AnalyticField::new("density", &text, [0.0; 3]).unwrap();
        total_mass(&field, &cube, 1e-10).unwrap()
    };
    let volume = 4.0 / 3.0 * PI * (outer.powi(3) - inner.powi(3));
    let of_wave = |q: f64| 4.0 * PI / k.powi(3) * ((k * q).sin() - k * q * (k * q).cos());
    let mean = (26.0_f64 * (0.3803 + 0.3229)).sin();
    let shell = 4.15 * (volume + 0.94 * mean * (of_wave(outer) - of_wave(inner)));
    // All around holds less than 1e-10 of the cube.
    assert!((e.value - shell).abs() <= e.error + 1e-10 * 0.083 && e.error <= 2e-6 * shell, "{e:?} {shell}");
}

#[test]
fn narrow_peaks_are_met() {
    let cube = Domain::new([0.0; 3], [1.0; 3], [Axis::OPEN; 3], Region::Box).unwrap();
    let text = "1 + 1e6*exp(-((x - 0.31)^2 + (y - 0.42)^2 + (z - 0.53)^2)/1e-8)";
    bounds_true_error(mass(text, &cube), 1.0 + 1e6 * PI.powf(1.5) * 1e-12, 1e-7);
    let line = Domain::new([0.0], [1.0], [Axis::OPEN], Region::Box).unwrap();
    bounds_true_error(mass("1e-9 + exp(-((x - 0.3141)/1e-6)^2)", &line), 1e-9 + PI.sqrt() * 1e-6, 1e-7);
    // Behind another discontinuity.
    let text = "if(x < 0.4999, 1, if(sqrt((x - 0.51)^2 + (y - 0.42)^2 + (z - 0.53)^2) < 0.003, 1e8, 2))";
    let ball = 4.0 / 3.0 * PI * 0.003_f64.powi(3);
    bounds_true_error(mass(text, &cube), 0.4999 + 2.0 * 0.5001 + (1e8 - 2.0) * ball, 1e-7);
}

fn solid<const D: usize>(balls: &[([f64; D], f64)]) -> Domain<D> {
    let of = |(center, radius): &([f64; D], f64)| Primitive {
        shape: Shape::Ellipsoid { radii: [*radius; D] },
        center: *center,
        frame: upright(),
    };
    let side = |k: usize, sign: f64| balls.iter().map(|(c, r)| sign * c[k] + r).fold(f64::NEG_INFINITY, f64::max);
    let lo = sph::array(|k| -side(k, -1.0));
    let hi = sph::array(|k| side(k, 1.0));
    let tree = Tree::Any((0..balls.len()).map(Tree::Leaf).collect());
    let solid = Solid::new(balls.iter().map(of).collect(), tree, Aabb { lo, hi }).unwrap();
    Domain::new(lo, hi, [Axis::OPEN; D], Region::Hull(Arc::new(solid), Wall::Open)).unwrap()
}

#[test]
fn narrow_peaks_within_shapes_are_met() {
    let disc = solid(&[([0.0; 2], 1.0), ([1.2, 0.3], 0.6)]);
    let union = Lens { radii: [1.0, 0.6], apart: 1.2_f64.hypot(0.3) }.area_of_both();
    let text = "1 + 1e5*exp(-((x - 0.113)^2 + (y - 0.217)^2)/1e-6)";
    let is_met = |e: MassEstimate, expected: f64| {
        assert!((e.value / expected - 1.0).abs() < 1e-8 && e.error < 1e-6 * expected, "{e:?} {expected}");
    };
    is_met(mass(text, &disc), union + 0.1 * PI);
    let text = "1 + 1e6*exp(-((x - 0.113)^2 + (y - 0.217)^2 + (z + 0.05)^2)/1e-6)";
    let ball = solid(&[([0.0; 3], 1.0)]);
    is_met(mass(text, &ball), 4.0 / 3.0 * PI + 1e-3 * PI.powf(1.5));
}

#[test]
fn poles_within_shapes_are_known_as_well_as_is_said() {
    let domain = solid(&[([0.0], 1.0), ([1.5], 0.25)]);
    let integral = |from: f64, to: f64| (to.powf(0.36) - from.powf(0.36)) / 0.36;
    // The pole at 0.7: 1.7 to the left, 0.3 to the right within the first ball, and the second ball.
    let exact = integral(0.0, 1.7) + integral(0.0, 0.3) + integral(0.55, 1.05);
    bounds_true_error(mass("sqrt((x - 0.7)^2)^-0.64", &domain), exact, 1e-4);
    // Much of so steep a pole is within the last digits of its place.
    let exact = [1.7_f64, 0.3].map(|l| l.powf(0.1) / 0.1).iter().sum::<f64>();
    let e = mass("sqrt((x - 0.7)^2)^-0.9", &solid(&[([0.0], 1.0)]));
    assert!((e.value - exact).abs() < 2.0 * e.error && e.error < 0.3 * exact, "{e:?} {exact}");
}

#[test]
fn poles_without_a_finite_mass_are_refused() {
    fn refused<const D: usize>(text: &str) {
        let domain = Domain::new([0.0; D], [1.0; D], [Axis::OPEN; D], Region::Box).unwrap();
        let field = AnalyticField::new("density", text, [0.31; D]).unwrap();
        let error = total_mass(&field, &domain, 1e-9).unwrap_err().to_string();
        assert!(error.contains("no finite mass"), "{D}-D, {text}: {error}");
    }
    refused::<1>("r^-2");
    refused::<1>("tan(40*x)^2");
    refused::<2>("r^-2");
    refused::<2>("r^-3");
    refused::<3>("r^-3");
    refused::<3>("r^-4");
}

#[test]
fn discontinuities_within_shapes_are_met() {
    let domain = solid(&[([0.0; 2], 1.0), ([1.2, 0.3], 0.6)]);
    let e = mass("if(hypot(x - 0.1, y - 0.2) < 0.06, 3844, 1)", &domain);
    let union = Lens { radii: [1.0, 0.6], apart: 1.2_f64.hypot(0.3) }.area_of_both();
    bounds_true_error(e, union + 3843.0 * PI * 0.06 * 0.06, 1e-8);
    // A ring that chords graze, partly outside.
    let e = mass("if((hypot(x, y) > 0.9)*(hypot(x, y) < 0.95), 1000, 0)", &solid(&[([0.0; 2], 0.93)]));
    bounds_true_error(e, 1000.0 * PI * (0.93_f64.powi(2) - 0.81), 1e-8);
    let ball = solid(&[([0.0; 3], 1.0)]);
    let e = mass("if(sqrt((x - 0.3)^2 + (y + 0.2)^2 + z^2) < 0.05, 1e5, 1 + x)", &ball);
    let small = 4.0 / 3.0 * PI * 0.05_f64.powi(3);
    bounds_true_error(e, 4.0 / 3.0 * PI + (1e5 - 1.3) * small, 2e-6);
}

/// Two discs that overlap.
struct Lens {
    radii: [f64; 2],
    apart: f64,
}

impl Lens {
    fn area_of_both(&self) -> f64 {
        let ([a, b], d) = (self.radii, self.apart);
        // The chord that they share, seen from either center.
        let x = (d * d + a * a - b * b) / (2.0 * d);
        let segment = |r: f64, x: f64| r * r * (x / r).acos() - x * (r * r - x * x).sqrt();
        PI * (a * a + b * b) - segment(a, x) - segment(b, d - x)
    }
}

/// In a cell about a center far away, which is long and thin, a ring lies between all points at the faces and in the middle.
#[test]
fn a_ring_at_the_edge_of_a_disc_is_met() {
    let mut annulus = Domain::ball([0.0; 2], 0.96, Wall::Open).unwrap();
    if let Region::Ball { inner_radius, .. } = &mut annulus.region {
        *inner_radius = 0.3;
    }
    let (apart, inner, outer) = (0.9505_f64, 0.05375_f64, 0.0962_f64);
    let within = |radius: f64| {
        let both = Lens { radii: [0.96, radius], apart }.area_of_both();
        PI * (0.96_f64.powi(2) + radius * radius) - both
    };
    let exact = PI * (0.96_f64.powi(2) - 0.09) + 4357.6 * (within(outer) - within(inner));
    for turn in 0..24 {
        let (sin, cos) = (0.05 * f64::from(turn)).sin_cos();
        let r = format!("hypot(x - {:?}, y - {:?})", apart * cos, apart * sin);
        let e = mass(&format!("if(({r} >= {inner})*({r} < {outer}), 4358.6, 1)"), &annulus);
        bounds_true_error(e, exact, 1e-6);
    }
}

#[test]
fn evaluations_end_where_particles_need_no_more() {
    let cube = Domain::new([0.0; 3], [1.0; 3], [Axis::OPEN; 3], Region::Box).unwrap();
    let text = "if(abs(0.3*x + 0.5*y - 0.8*z + 0.1) < 0.03, 2e5*exp(-hypot(x - 0.5, y - 0.4)/0.5), \
                if((x - 0.7)^2/0.01 + (y - 0.2)^2/0.02 + (z - 0.7)^2/0.03 < 1, 50, 1))";
    let counted = Counted { field: AnalyticField::new("density", text, [0.0; 3]).unwrap(), count: AtomicU64::new(0) };
    let e = total_mass(&counted, &cube, 1e-10).unwrap();
    assert!(e.error < ENOUGH * e.value, "{e:?}");
    let count = counted.count.load(Ordering::Relaxed);
    // Half of them: some seconds at most, where all end at twice that.
    assert!(count < MAX_PART_EVALUATIONS as u64 / 2, "{count}");
}

struct Counted<const D: usize> {
    field: AnalyticField<D>,
    count: AtomicU64,
}

impl<const D: usize> ScalarField<D> for Counted<D> {
    fn value(&self, x: &[f64; D]) -> f64 {
        self.count.fetch_add(1, Ordering::Relaxed);
        self.field.value(x)
    }

    fn trace(&self, x: &[f64; D]) -> crate::field::Trace {
        self.count.fetch_add(1, Ordering::Relaxed);
        self.field.trace(x)
    }

    fn enclosure(&self, patch: &Patch<D>) -> Option<Enclosure> {
        self.field.enclosure(patch)
    }

    fn is_piecewise(&self) -> bool {
        self.field.is_piecewise()
    }
}

#[test]
fn extreme_values_neither_overflow_nor_vanish() {
    for unit in ["1e300", "1e-300"] {
        let disc = Domain::ball([0.0; 2], 1.0, Wall::Open).unwrap();
        let e = mass(&format!("{unit}*(1 + r)"), &disc);
        let expected = unit.parse::<f64>().unwrap() * PI * 5.0 / 3.0;
        assert!((e.value / expected - 1.0).abs() < 1e-8 && e.error / expected < 1e-8, "{e:?}");
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
