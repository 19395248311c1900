//! Wrapping, confining and mirroring of positions, for arbitrary domains and points.

use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use sph_core::domain::{Axis, Domain, Region, Wall};
use sph_core::random::keyed;

/// Domains and points by chance, in each test.
const CASES: u64 = 256;

/// Calls `check` with a generator of its own for each case.
fn for_each_case(stream: u64, check: impl Fn(&mut Xoshiro256PlusPlus)) {
    (0..CASES).for_each(|case| check(&mut keyed(1, stream, case)));
}

fn axis(random: &mut Xoshiro256PlusPlus) -> Axis {
    let mut wall = || if random.random() { Wall::Reflecting } else { Wall::Open };
    let (lo, hi) = (wall(), wall());
    if random.random() { Axis::Periodic } else { Axis::Walls { lo, hi } }
}

fn box_domain(random: &mut Xoshiro256PlusPlus) -> Domain<2> {
    let lo = [(); 2].map(|()| random.random_range(-1e3..1e3));
    let hi = lo.map(|lo| lo + random.random_range(1e-6..1e3));
    let axes = [(); 2].map(|()| axis(random));
    Domain::new(lo, hi, axes, Region::Box).unwrap()
}

fn far<const D: usize>(random: &mut Xoshiro256PlusPlus) -> [f64; D] {
    [(); D].map(|()| random.random_range(-1e4..1e4))
}

fn inside(domain: &Domain<2>, random: &mut Xoshiro256PlusPlus) -> [f64; 2] {
    std::array::from_fn(|k| domain.lo[k] + random.random_range(0.0..0.999) * (domain.hi[k] - domain.lo[k]))
}

#[test]
fn wrapping_ends_in_the_box_and_moves_by_whole_lengths() {
    for_each_case(0, |random| {
        let (domain, x) = (box_domain(random), far::<2>(random));
        let mut y = x;
        domain.wrap(&mut y);
        for k in 0..2 {
            let length = domain.hi[k] - domain.lo[k];
            if domain.axes[k] == Axis::Periodic {
                assert!(y[k] >= domain.lo[k] && y[k] < domain.hi[k], "{domain:?}: {x:?} to {y:?}");
                let turns = (x[k] - y[k]) / length;
                assert!((turns - turns.round()).abs() < 1e-6 * turns.abs().max(1.0), "{domain:?}: {x:?} to {y:?}");
            } else {
                assert_eq!(x[k], y[k], "{domain:?}");
            }
        }
        let mut again = y;
        domain.wrap(&mut again);
        assert_eq!(again, y, "{domain:?}");
    });
}

#[test]
fn a_confined_particle_is_inside_wherever_it_went() {
    for_each_case(1, |random| {
        let domain = box_domain(random);
        let (from, x) = (inside(&domain, random), far::<2>(random));
        let mut y = x;
        domain.confine(&from, &mut y);
        assert!(domain.contains(&y), "{domain:?} from {x:?} to {y:?}");
    });
}

#[test]
fn images_are_as_far_from_a_wall_as_their_originals() {
    for_each_case(2, |random| {
        let domain = box_domain(random);
        let x = inside(&domain, random);
        for k in 0..2 {
            let length = domain.hi[k] - domain.lo[k];
            let images = domain.axis_images(k, domain.lo[k] - length, domain.hi[k] + length);
            assert_eq!(images[0].apply(x[k]), x[k], "{domain:?}");
            for image in &images[1..] {
                let y = image.apply(x[k]);
                assert!(
                    !(y > domain.lo[k] && y < domain.hi[k]) || (y - x[k]).abs() <= 1e-9 * length,
                    "{domain:?}: {y}"
                );
            }
        }
    });
}

#[test]
fn displacements_are_the_shortest() {
    for_each_case(3, |random| {
        let domain = box_domain(random);
        let d = domain.displacement(&inside(&domain, random), &inside(&domain, random));
        for k in 0..2 {
            let length = domain.hi[k] - domain.lo[k];
            let limit = if domain.axes[k] == Axis::Periodic { 0.5 } else { 1.0 };
            assert!(d[k].abs() <= limit * length * (1.0 + 1e-9), "{domain:?}: {d:?}");
        }
    });
}

#[test]
fn mirroring_in_a_sphere_twice_leads_back() {
    for_each_case(4, |random| {
        let radius = random.random_range(1e-3..1e3);
        let direction: [f64; 3] = [(); 3].map(|()| random.random_range(-1.0..1.0));
        let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
        let depth = random.random_range(0.01..0.99);
        let domain = Domain::ball([0.0; 3], radius, Wall::Reflecting).unwrap();
        let x = direction.map(|d| d / length * radius * depth);
        let (image, stretch) = domain.region.mirror_with_stretch(&x).unwrap();
        assert!(!domain.contains(&image), "{radius}: {x:?}");
        let (back, shrink) = domain.region.mirror_with_stretch(&image).unwrap();
        assert!((0..3).all(|k| (back[k] - x[k]).abs() < 1e-9 * radius), "{radius}: {x:?} to {back:?}");
        assert!((stretch * shrink - 1.0).abs() < 1e-9, "{radius}: {x:?}");
    });
}

#[test]
fn mirroring_in_a_cylinder_twice_leads_back_at_the_same_height() {
    for_each_case(5, |random| {
        let (radius, axis) = (random.random_range(1e-3..1e3), random.random_range(0..3_usize));
        let (angle, depth) = (random.random_range(0.0..6.2_f64), random.random_range(0.51..0.99));
        let height = random.random_range(-0.49..0.49_f64);
        let ends = (Wall::Reflecting, Axis::OPEN);
        let domain = Domain::cylinder([0.0; 3], axis, [0.5 * radius, radius], 1.0, ends).unwrap();
        let mut around = [radius * depth * angle.cos(), radius * depth * angle.sin()].into_iter();
        let x: [f64; 3] = std::array::from_fn(|k| if k == axis { height } else { around.next().unwrap() });
        assert!(domain.contains(&x), "{domain:?}: {x:?}");
        let (image, stretch) = domain.region.mirror_with_stretch(&x).unwrap();
        assert!(!domain.contains(&image) && image[axis] == height, "{domain:?}: {x:?} to {image:?}");
        let (back, shrink) = domain.region.mirror_with_stretch(&image).unwrap();
        assert!((0..3).all(|k| (back[k] - x[k]).abs() < 1e-9 * radius), "{domain:?}: {x:?} to {back:?}");
        assert!((stretch * shrink - 1.0).abs() < 1e-9, "{domain:?}: {x:?}");
        let to_surface = (radius * (1.0 - depth)).min(radius * (depth - 0.5));
        let expected = to_surface.min(0.5 - height.abs());
        assert!((domain.distance_to_edge(&x) - expected).abs() < 1e-9 * radius.max(1.0), "{domain:?}: {x:?}");
    });
}

#[test]
fn cylinders_have_their_volume_and_three_dimensions() {
    let ends = (Wall::Open, Axis::Periodic);
    let domain = Domain::cylinder([1.0, 2.0, 3.0], 0, [1.0, 2.0], 5.0, ends).unwrap();
    assert!((domain.volume() - 15.0 * std::f64::consts::PI).abs() < 1e-12);
    assert_eq!((domain.lo, domain.hi), ([-1.5, 0.0, 1.0], [3.5, 4.0, 5.0]));
    assert!(!domain.contains(&[9.0, 2.0, 3.5]) && domain.contains(&[9.0, 2.0, 4.5]));
    assert!(Domain::cylinder([0.0; 2], 1, [0.0, 1.0], 1.0, ends).unwrap_err().to_string().contains("3-D only"));
}

/// Of points it is their distance, and no two points of boxes are nearer than these.
#[test]
fn boxes_are_as_far_apart_as_their_nearest_points() {
    for_each_case(77, |random| {
        let domain = Domain::new([0.0; 3], [1.0, 2.0, 0.5], [(); 3].map(|()| axis(random)), Region::Box).unwrap();
        let point = |random: &mut Xoshiro256PlusPlus| -> [f64; 3] {
            std::array::from_fn(|k| domain.lo[k] + random.random::<f64>() * (domain.hi[k] - domain.lo[k]))
        };
        let squared = |x: &[f64; 3], y: &[f64; 3]| domain.displacement(x, y).iter().map(|d| d * d).sum::<f64>();
        let corners = |x: &[f64; 3], y: &[f64; 3]| {
            [std::array::from_fn(|k| x[k].min(y[k])), std::array::from_fn(|k| x[k].max(y[k]))]
        };
        let (x, y) = (point(random), point(random));
        let of_points = domain.squared_distance_of_boxes([&x, &x], [&y, &y]);
        assert!((of_points - squared(&x, &y)).abs() < 1e-12, "{x:?}, {y:?}");
        let (a, b): ([[f64; 3]; 2], [[f64; 3]; 2]) = (corners(&x, &point(random)), corners(&y, &point(random)));
        let least = domain.squared_distance_of_boxes([&a[0], &a[1]], [&b[0], &b[1]]);
        let within = |random: &mut Xoshiro256PlusPlus, c: &[[f64; 3]; 2]| -> [f64; 3] {
            std::array::from_fn(|k| c[0][k] + random.random::<f64>() * (c[1][k] - c[0][k]))
        };
        for _ in 0..100 {
            let (p, q) = (within(random, &a), within(random, &b));
            assert!(squared(&p, &q) >= least - 1e-12, "{a:?}, {b:?}: {p:?} and {q:?}");
        }
    });
}
