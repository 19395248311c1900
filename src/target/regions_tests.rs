//! Regions of targets whose pieces are known.

use super::*;
use crate::field::AnalyticField;
use crate::target::Target;
use crate::target::locator::Locator;
use sph::domain::{Axis, Region as Extent};

fn with_regions<const D: usize>(text: &str, count: usize, mut check: impl FnMut(Option<&Regions<'_, D>>)) {
    let domain = Domain::new([0.0; D], [1.0; D], [Axis::Periodic; D], Extent::Box).unwrap();
    let field = AnalyticField::<D>::new("density", text, [0.5; D]).unwrap();
    let mass = crate::field::total_mass(&field, &domain, 1e-4).unwrap().value;
    let target = Target::of_equal_masses(&domain, &field, count, mass);
    check(target.find_regions(None).as_ref());
}

#[test]
fn a_cloud_and_its_surroundings_are_two_regions_of_two_bodies() {
    with_regions::<3>("if(r < 0.1, 1000, 1)", 20_000, |regions| {
        let regions = regions.unwrap();
        let ball = 4.0 / 3.0 * std::f64::consts::PI * 1e-3;
        let wanted = 1000.0 * ball / (1.0 + 999.0 * ball);
        let cloud = regions.of(&[0.5; 3]).unwrap();
        assert!((regions.number(), regions.bodies()) == (2, 2));
        assert!((regions.get(cloud).share - wanted).abs() < 1e-3, "{} {wanted}", regions.get(cloud).share);
        assert!((0..3).all(|k| (regions.get(cloud).lo[k] - 0.4).abs() < 0.05));
        assert_ne!(regions.of(&[0.1; 3]), Some(cloud));
        assert_eq!(regions.counts(20_000).iter().sum::<usize>(), 20_000);
    });
}

#[test]
fn islands_of_one_piece_are_told_apart_and_near_vacuum_has_no_particles() {
    let islands = "if((x - 0.25)^2 + (y - 0.5)^2 < 0.01, 2, if((x - 0.75)^2 + (y - 0.5)^2 < 0.02, 2, 1e-10))";
    with_regions::<2>(islands, 1000, |regions| {
        let regions = regions.unwrap();
        let at = |x: [f64; 2]| regions.of(&x);
        assert_eq!(regions.number(), 2);
        assert_eq!(at([0.5, 0.1]), None);
        let share = |x: [f64; 2]| regions.get(at(x).unwrap()).share;
        assert!((share([0.25, 0.5]) - 1.0 / 3.0).abs() < 2e-3, "{}", share([0.25, 0.5]));
        assert_eq!(at([0.25, 0.58]), at([0.25, 0.5]));
    });
    // The same condition for both: one piece, two islands.
    with_regions::<2>("if((abs(x - 0.5) - 0.25)^2 + (y - 0.5)^2 < 0.01, 1, 0)", 1000, |regions| {
        let regions = regions.unwrap();
        assert_eq!((regions.number(), regions.bodies()), (2, 2));
        assert_ne!(regions.of(&[0.25, 0.5]), regions.of(&[0.75, 0.5]));
    });
}

#[test]
fn what_is_continuous_is_one_and_small_jumps_leave_one_body() {
    with_regions::<1>("if(x < 0.5, 1 + x, 2 - x)", 100, |regions| assert!(regions.is_none()));
    with_regions::<2>("1 + x*(1 - x)", 100, |regions| assert!(regions.is_none()));
    with_regions::<2>("if(r < 0.2, 3, 1)", 1000, |regions| {
        let regions = regions.unwrap();
        assert_eq!((regions.number(), regions.bodies()), (2, 1));
    });
    with_regions::<1>("if(abs(x - 0.5) < 0.2, 100, 1)", 1000, |regions| {
        let regions = regions.unwrap();
        // Through the periodic face the outside is one.
        assert_eq!((regions.number(), regions.bodies()), (2, 2));
        assert_eq!(regions.of(&[0.05]), regions.of(&[0.95]));
    });
}

/// One between two that touch in density does not make them one body; and where some are apart, others are that differ by less.
#[test]
fn what_differs_by_much_is_not_joined_by_a_third() {
    let bodies = |text: &str| {
        let mut found = Vec::new();
        with_regions::<3>(text, 6000, |regions| {
            let regions = regions.unwrap();
            let places = [[0.2, 0.5, 0.5], [0.7, 0.25, 0.5], [0.7, 0.75, 0.5]];
            found = places.map(|x| regions.body_of(regions.of(&x).unwrap())).to_vec();
        });
        found
    };
    let [dense, thin, middle] = bodies("if(x < 0.4, 9, if(y < 0.5, 1, 3))").try_into().unwrap();
    assert!(dense != middle && dense != thin && thin != middle, "{dense} {middle} {thin}");
    let [dense, thin, middle] = bodies("if(x < 0.4, 9, if(y < 0.5, 1, 1.2))").try_into().unwrap();
    assert!(dense != middle && thin == middle, "{dense} {middle} {thin}");
    let [dense, thin, middle] = bodies("if(x < 0.4, 5, if(y < 0.5, 1, 3))").try_into().unwrap();
    assert!(dense == middle && thin == middle, "{dense} {middle} {thin}");
}

/// Beside a pole cells are halved until they have no extent.
#[test]
fn cells_without_extent_are_found_all_the_same() {
    let cell = |lo: f64, hi: f64| Cell { mass: hi - lo, ..Cell::new([lo], [hi]) };
    let domain = Domain::new([0.0], [1.0], [Axis::OPEN], Extent::Box).unwrap();
    let cells = [cell(0.0, 0.5), cell(0.5, 0.5), cell(0.5, 0.5)];
    let locator = Locator::new(&domain, &cells);
    assert_eq!(locator.find(&[0.2]), 0);
    assert_eq!(cells[locator.find(&[0.5])].lo, [0.5]);
}

/// Surfaces of the domain, or of others, take many cells and show little; a core that no first cell shows takes many halvings and shows most.
#[test]
fn a_small_dense_core_is_found_among_wide_surfaces() {
    let domain = Domain::ball([0.0; 3], 1.0, sph::domain::Wall::Open).unwrap();
    for radius in [0.003_f64, 0.007, 0.009, 0.01, 0.012, 0.03] {
        let dense = radius.powi(-3);
        let text = format!("if(r < {radius}, {dense}, 1)");
        let field = AnalyticField::<3>::new("density", &text, [0.0; 3]).unwrap();
        let mass = crate::field::total_mass(&field, &domain, 1e-4).unwrap().value;
        let target = Target::of_equal_masses(&domain, &field, 3000, mass);
        let regions = target.find_regions(None).unwrap_or_else(|| panic!("{radius}"));
        let core = regions.of(&[0.0; 3]).unwrap();
        assert_eq!(regions.number(), 2, "{radius}");
        let wanted = 1.0 / (2.0 - radius.powi(3));
        assert!((regions.get(core).share - wanted).abs() < 1e-3, "{radius}: {} {wanted}", regions.get(core).share);
    }
}
