//! Wrapping, confining and mirroring of positions, for arbitrary domains and points.

use proptest::prelude::*;
use sph::domain::{Axis, Domain, Region, Wall};

fn axis() -> impl Strategy<Value = Axis> {
    let wall = prop_oneof![Just(Wall::Reflecting), Just(Wall::Open)];
    prop_oneof![Just(Axis::Periodic), (wall.clone(), wall).prop_map(|(lo, hi)| Axis::Walls { lo, hi })]
}

fn bounds() -> impl Strategy<Value = (f64, f64)> {
    (-1e3..1e3_f64, 1e-6..1e3_f64).prop_map(|(lo, size)| (lo, lo + size))
}

fn box_domain() -> impl Strategy<Value = Domain<2>> {
    ([bounds(), bounds()], [axis(), axis()])
        .prop_map(|(b, axes)| Domain::new([b[0].0, b[1].0], [b[0].1, b[1].1], axes, Region::Box).unwrap())
}

fn inside(domain: &Domain<2>, share: [f64; 2]) -> [f64; 2] {
    std::array::from_fn(|k| domain.lo[k] + share[k] * (domain.hi[k] - domain.lo[k]))
}

proptest! {
    #[test]
    fn wrapping_ends_in_the_box_and_moves_by_whole_lengths(domain in box_domain(), x in [-1e4..1e4_f64, -1e4..1e4_f64]) {
        let mut y = x;
        domain.wrap(&mut y);
        for k in 0..2 {
            let length = domain.hi[k] - domain.lo[k];
            if domain.axes[k] == Axis::Periodic {
                prop_assert!(y[k] >= domain.lo[k] && y[k] < domain.hi[k]);
                let turns = (x[k] - y[k]) / length;
                prop_assert!((turns - turns.round()).abs() < 1e-6 * turns.abs().max(1.0));
            } else {
                prop_assert_eq!(x[k], y[k]);
            }
        }
        let mut again = y;
        domain.wrap(&mut again);
        prop_assert_eq!(again, y);
    }

    #[test]
    fn a_confined_particle_is_inside_wherever_it_went(
        domain in box_domain(), share in [0.0..0.999_f64, 0.0..0.999_f64], x in [-1e4..1e4_f64, -1e4..1e4_f64]
    ) {
        let from = inside(&domain, share);
        let mut y = x;
        domain.confine(&from, &mut y);
        prop_assert!(domain.contains(&y), "{:?} from {:?} to {:?}", domain, x, y);
    }

    #[test]
    fn images_are_as_far_from_a_wall_as_their_originals(domain in box_domain(), share in [0.0..0.999_f64, 0.0..0.999_f64]) {
        let x = inside(&domain, share);
        for k in 0..2 {
            let length = domain.hi[k] - domain.lo[k];
            let images = domain.axis_images(k, domain.lo[k] - length, domain.hi[k] + length);
            prop_assert_eq!(images[0].apply(x[k]), x[k]);
            for image in &images[1..] {
                let y = image.apply(x[k]);
                prop_assert!(!(y > domain.lo[k] && y < domain.hi[k]) || (y - x[k]).abs() <= 1e-9 * length, "{y}");
            }
        }
    }

    #[test]
    fn displacements_are_the_shortest(domain in box_domain(), a in [0.0..0.999_f64, 0.0..0.999_f64], b in [0.0..0.999_f64, 0.0..0.999_f64]) {
        let d = domain.displacement(&inside(&domain, a), &inside(&domain, b));
        for k in 0..2 {
            let length = domain.hi[k] - domain.lo[k];
            let limit = if domain.axes[k] == Axis::Periodic { 0.5 } else { 1.0 };
            prop_assert!(d[k].abs() <= limit * length * (1.0 + 1e-9));
        }
    }

    #[test]
    fn mirroring_in_a_sphere_twice_leads_back(radius in 1e-3..1e3_f64, direction in [-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64], depth in 0.01..0.99_f64) {
        let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
        prop_assume!(length > 1e-3);
        let domain = Domain::ball([0.0; 3], radius, Wall::Reflecting).unwrap();
        let x = direction.map(|d| d / length * radius * depth);
        let (image, stretch) = domain.region.mirror_with_stretch(&x).unwrap();
        prop_assert!(!domain.contains(&image));
        let (back, shrink) = domain.region.mirror_with_stretch(&image).unwrap();
        for k in 0..3 {
            prop_assert!((back[k] - x[k]).abs() < 1e-9 * radius);
        }
        prop_assert!((stretch * shrink - 1.0).abs() < 1e-9);
    }

    #[test]
    fn mirroring_in_a_cylinder_twice_leads_back_at_the_same_height(
        radius in 1e-3..1e3_f64, angle in 0.0..6.2_f64, depth in 0.51..0.99_f64, height in -0.49..0.49_f64, axis in 0..3_usize
    ) {
        let ends = (Wall::Reflecting, Axis::OPEN);
        let domain = Domain::cylinder([0.0; 3], axis, [0.5 * radius, radius], 1.0, ends).unwrap();
        let mut around = [radius * depth * angle.cos(), radius * depth * angle.sin()].into_iter();
        let x: [f64; 3] = std::array::from_fn(|k| if k == axis { height } else { around.next().unwrap() });
        prop_assert!(domain.contains(&x));
        let (image, stretch) = domain.region.mirror_with_stretch(&x).unwrap();
        prop_assert!(!domain.contains(&image) && image[axis] == height);
        let (back, shrink) = domain.region.mirror_with_stretch(&image).unwrap();
        prop_assert!((0..3).all(|k| (back[k] - x[k]).abs() < 1e-9 * radius));
        prop_assert!((stretch * shrink - 1.0).abs() < 1e-9);
        let to_surface = (radius * (1.0 - depth)).min(radius * (depth - 0.5));
        let expected = to_surface.min(0.5 - height.abs());
        prop_assert!((domain.distance_to_edge(&x) - expected).abs() < 1e-9 * radius.max(1.0));
    }
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
