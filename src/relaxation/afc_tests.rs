//! Tests of AFC in every dimension and with every boundary.

use super::afc::{AfcOptions, AwayFromClosest};
use super::control::Control;
use super::report::StopReason;
use super::stage::relax_new;
use crate::field::ScalarField;
use crate::seeding::{Seeding, seed};
use crate::target::{Positions, Target, at};
use sph::domain::{Axis, Domain, Region, Wall};
use sph::kernel::KernelName;

struct Slope;
impl<const D: usize> ScalarField<D> for Slope {
    fn value(&self, x: &[f64; D]) -> f64 {
        1.0 + 0.5 * x[0]
    }
}

fn target<const D: usize>(domain: &Domain<D>, count: usize) -> Target<'_, D> {
    Target::of_equal_masses(domain, &Slope, count, 1.25 * domain.volume())
}

fn run<const D: usize>(target: &Target<'_, D>, start: Positions<D>, steps: usize) -> (Positions<D>, [f64; 2]) {
    let options = AfcOptions { steps, ..AfcOptions::new(D) };
    let stage = AwayFromClosest { kernel: KernelName::WendlandC4, target: *target, options };
    let relaxed = relax_new(&stage, start, &Control::default());
    let report = relaxed.report();
    assert_eq!((report.stop, report.history.len()), (StopReason::IterationLimit, steps + 1));
    (relaxed.particles.positions.clone(), [report.history[0].epsilon, report.epsilon().unwrap()])
}

fn improves<const D: usize>(count: usize) {
    let unit = |axis| Domain::new([0.0; D], [1.0; D], [axis; D], Region::Box).unwrap();
    let half = Axis::Walls { lo: Wall::Reflecting, hi: Wall::Open };
    let ball = |wall| Domain::ball([0.5; D], 0.5, wall).unwrap();
    for domain in [
        unit(Axis::Periodic),
        unit(Axis::REFLECTING),
        unit(Axis::OPEN),
        unit(half),
        ball(Wall::Reflecting),
        ball(Wall::Open),
    ] {
        let target = target(&domain, count);
        let start = seed(&target, Seeding::Random, 2).unwrap().positions;
        let (x, [first, best]) = run(&target, start, 80);
        assert!((0..count).all(|i| domain.contains(&at(&x, i))), "{domain:?}");
        assert!(best < 0.5 * first, "{D}-D {domain:?}: {first:e} -> {best:e}");
    }
}

#[test]
fn the_error_falls_in_every_dimension_and_boundary() {
    improves::<1>(100);
    improves::<2>(300);
    improves::<3>(500);
}

struct Uniform;
impl ScalarField<1> for Uniform {
    fn value(&self, _: &[f64; 1]) -> f64 {
        1.0
    }
}

/// In a periodic interval the first two flee each other, the third the first, through the end: each by a tenth of
/// the spacing of a third.
#[test]
fn each_goes_its_step_away_from_the_closest() {
    let domain = Domain::new([0.0], [1.0], [Axis::Periodic], Region::Box).unwrap();
    let target = Target { density: &Uniform, mass: 1.0, resolution_integral: 1.0, ..target(&domain, 3) };
    let (mut x, [first, best]) = run(&target, [vec![0.3, 0.4, 0.9]], 1);
    x[0].sort_by(f64::total_cmp);
    let expected = [0.3 - 0.1 / 3.0, 0.4 + 0.1 / 3.0, 0.9 - 0.1 / 3.0];
    assert!(best < first, "{first} -> {best}");
    x[0].iter().zip(expected).for_each(|(x, e)| assert!((x - e).abs() < 1e-12, "{x} against {e}"));
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let domain = Domain::ball([0.5; 2], 0.5, Wall::Reflecting).unwrap();
    let target = target(&domain, 400);
    let start = seed(&target, Seeding::Random, 2).unwrap().positions;
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&target, start.clone(), 20).0)
    };
    let one = with(1);
    assert!(with(2) == one && with(5) == one);
}
