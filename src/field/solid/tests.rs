use super::super::testing::Random;
use super::*;
use std::f64::consts::PI;

fn ellipsoid<const D: usize>(center: [f64; D], radii: [f64; D]) -> Primitive<D> {
    Primitive { shape: Shape::Ellipsoid { radii }, center, frame: upright() }
}

fn half_space<const D: usize>(center: [f64; D], normal: [f64; D]) -> Primitive<D> {
    Primitive { shape: Shape::HalfSpace { normal }, center, frame: upright() }
}

/// Primitives of a box, from `first` on, and what makes them one.
fn cuboid<const D: usize>(first: usize, lo: [f64; D], hi: [f64; D]) -> (Vec<Primitive<D>>, Tree) {
    let unit = |k: usize, sign: f64| sph::array(|i| if i == k { sign } else { 0.0 });
    let faces = (0..D).flat_map(|k| [half_space(lo, unit(k, -1.0)), half_space(hi, unit(k, 1.0))]).collect();
    (faces, Tree::All((first..first + 2 * D).map(Tree::Leaf).collect()))
}

fn solid<const D: usize>(primitives: Vec<Primitive<D>>, tree: Tree, reach: f64) -> Solid<D> {
    Solid::new(primitives, tree, Aabb { lo: [-reach; D], hi: [reach; D] }).unwrap()
}

fn off(found: f64, expected: f64) -> f64 {
    (found / expected - 1.0).abs()
}

/// A ball with a corner of a box taken out.
fn bitten() -> Solid<3> {
    let (mut primitives, tree) = cuboid(0, [0.1; 3], [2.0; 3]);
    primitives.push(ellipsoid([0.0; 3], [1.0; 3]));
    solid(primitives, Tree::Less(Box::new(Tree::Leaf(6)), vec![tree]), 1.0)
}

#[test]
fn volumes_are_those_of_closed_forms() {
    let one = |primitive: Primitive<3>, reach: f64| solid(vec![primitive], Tree::Leaf(0), reach).volume();
    assert!(off(one(ellipsoid([0.0; 3], [1.0; 3]), 1.0), 4.0 / 3.0 * PI) < 1e-5);
    assert!(off(one(ellipsoid([0.1, 0.0, 0.0], [1.0, 0.5, 0.25]), 1.2), 4.0 / 3.0 * PI / 8.0) < 1e-5);
    let shape = Shape::Torus { radius: 1.0, tube: 0.3 };
    let turned = [[0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.0, 0.8, -0.6]];
    let torus = |frame| Primitive { shape: shape.clone(), center: [0.0; 3], frame };
    for frame in [upright(), turned] {
        assert!(off(one(torus(frame), 1.4), 2.0 * PI * PI * 0.09) < 1e-4);
    }
    let (mut primitives, block) = cuboid(0, [-0.5, -1.0, -0.25], [0.5, 1.0, 0.25]);
    assert!(off(solid(primitives.clone(), block.clone(), 1.0).volume(), 1.0) < 1e-4);
    // A bore through the block.
    primitives.push(Primitive { shape: Shape::Cylinder { radius: 0.3 }, center: [0.0; 3], frame: upright() });
    let bored = Tree::Less(Box::new(block), vec![Tree::Leaf(6)]);
    assert!(off(solid(primitives, bored, 1.0).volume(), 1.0 - PI * 0.09 * 0.5) < 1e-4);
    let two = vec![ellipsoid([-0.25, 0.0, 0.0], [1.0; 3]), ellipsoid([0.25, 0.0, 0.0], [1.0; 3])];
    let lens = PI * (4.0 + 0.5) * (2.0_f64 - 0.5).powi(2) / 12.0;
    let leaves = vec![Tree::Leaf(0), Tree::Leaf(1)];
    assert!(off(solid(two.clone(), Tree::All(leaves.clone()), 1.3).volume(), lens) < 1e-5);
    assert!(off(solid(two, Tree::Any(leaves), 1.3).volume(), 8.0 / 3.0 * PI - lens) < 1e-5);
    let disc = vec![ellipsoid([0.0; 2], [1.0, 0.5]), half_space([0.0; 2], [0.6, 0.8])];
    let half = Tree::All(vec![Tree::Leaf(0), Tree::Leaf(1)]);
    assert!(off(solid(disc, half, 1.0).volume(), 0.25 * PI) < 1e-6);
    let (line, interval) = cuboid(0, [-0.5], [0.25]);
    assert!(off(solid(line, interval, 1.0).volume(), 0.75) < 1e-12);
}

/// Ends of chords through the solid are points of its surface.
fn surface_points(solid: &Solid<3>, number: usize) -> Vec<[f64; 3]> {
    let mut random = Random::new(5);
    let mut points = Vec::new();
    while points.len() < number {
        let x = random.point::<3>().map(|v| 2.0 * v - 1.0);
        for axis in 0..3 {
            for t in solid.chords(axis, &x).unwrap().into_iter().flatten() {
                let mut p = x;
                p[axis] = t;
                points.push(p);
            }
        }
    }
    points
}

#[test]
fn the_nearest_point_is_on_the_surface_and_none_is_nearer() {
    let bitten = bitten();
    let points = surface_points(&bitten, 60_000);
    let mut random = Random::new(6);
    for _ in 0..300 {
        let x = random.point::<3>().map(|v| 2.4 * v - 1.2);
        let p = bitten.nearest_on_surface(&x);
        let found = distance(&p, &x);
        let sampled = points.iter().map(|q| distance(q, &x)).fold(f64::INFINITY, f64::min);
        assert!(found <= sampled + 1e-9, "{x:?}: {found} {sampled}");
        // As far as 60 000 points are from each other.
        assert!(sampled - found < 0.06, "{x:?}: {found} {sampled}");
        assert!(bitten.is_on_surface(&p), "{x:?}");
        assert_eq!(bitten.nearest_within(&x, 0.9 * found), None);
        assert_eq!(bitten.nearest_within(&x, 1.1 * found), Some(p));
    }
}

#[test]
fn edges_and_corners_are_nearest_where_they_should_be() {
    let bitten = bitten();
    // Into the hollow corner from outside: its tip is the corner of the box.
    let tip = bitten.nearest_on_surface(&[0.05; 3]);
    assert!(distance(&tip, &[0.1; 3]) < 1e-7, "{tip:?}");
    // Straight above the hollow the rim of two faces and the ball is nearest.
    let rim = bitten.nearest_on_surface(&[0.9, 0.9, 0.3]);
    assert!(bitten.is_on_surface(&rim) && (rim[2] - 0.1).abs() < 1e-9, "{rim:?}");
    assert!(bitten.contains(&[0.05, 0.9, 0.0]) && !bitten.contains(&[0.2, 0.2, 0.2]));
}

#[test]
fn nearest_points_of_primitives_are_where_their_normals_lead_back() {
    let mut random = Random::new(7);
    let frame = [[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]];
    let shapes = [
        Shape::Ellipsoid { radii: [1.0, 0.5, 0.2] },
        Shape::Ellipsoid { radii: [0.4; 3] },
        Shape::Cylinder { radius: 0.7 },
        Shape::Torus { radius: 0.8, tube: 0.3 },
        Shape::HalfSpace { normal: [0.0, 0.6, 0.8] },
    ];
    for shape in shapes {
        let primitive = Primitive { shape, center: [0.1, 0.2, -0.1], frame };
        for _ in 0..200 {
            let x = random.point::<3>().map(|v| 3.0 * v - 1.5);
            let p = primitive.nearest(&x);
            let n = primitive.normal(&p, &x);
            let (away, along) = (distance(&p, &x), (0..3).map(|k| n[k] * (x[k] - p[k])).sum::<f64>());
            assert!((along.abs() - away).abs() < 1e-7 * (1.0 + away), "{primitive:?} {x:?} {p:?}");
            assert_eq!(along < 0.0, primitive.contains(&x), "{primitive:?} {x:?}");
        }
    }
}

#[test]
fn the_middle_of_an_ellipsoid_has_its_nearest_point_on_the_shortest_axis() {
    let flat = ellipsoid([0.0; 3], [1.0, 0.5, 0.2]);
    for x in [[0.0; 3], [0.1, 0.1, 0.0]] {
        let p = flat.nearest(&x);
        let n = flat.normal(&p, &x);
        let along: f64 = (0..3).map(|k| n[k] * (p[k] - x[k])).sum();
        assert!((along - distance(&p, &x)).abs() < 1e-7 && p[2] > 0.15, "{x:?} {p:?}");
    }
}

/// Volumes over that of the unit of length, which may be a light year in kilometers or a nanometer in light years.
#[test]
fn volumes_do_not_depend_on_the_unit_of_length() {
    let volume = |unit: f64| {
        let (mut primitives, block) =
            cuboid(0, [-0.6 * unit, -1.1 * unit, -0.25 * unit], [0.5 * unit, unit, 0.3 * unit]);
        let shapes = [
            Shape::Ellipsoid { radii: [0.7 * unit, 0.4 * unit, 0.9 * unit] },
            Shape::Cylinder { radius: 0.1 * unit },
            Shape::Torus { radius: 0.8 * unit, tube: 0.15 * unit },
        ];
        let turned = [[0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.0, 0.8, -0.6]];
        let center = [0.1 * unit, -0.2 * unit, 0.0];
        primitives.extend(shapes.into_iter().map(|shape| Primitive { shape, center, frame: turned }));
        let tree = Tree::Less(Box::new(block), (6..9).map(Tree::Leaf).collect());
        solid(primitives, tree, 2.0 * unit).volume() / unit.powi(3)
    };
    let expected = volume(1.0);
    assert!(expected > 0.1, "{expected}");
    for exponent in [-90, -40, 40, 90] {
        let unit = 2_f64.powi(exponent);
        assert!(off(volume(unit), expected) < 1e-9, "{} in units of {unit:e}, expected {expected}", volume(unit));
    }
}
