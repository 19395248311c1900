//! Mirror images about the edges of hulls.

use sph_core::domain::{Axis, Domain, Ghosts, Hull, Region, Wall};
use std::sync::Arc;

/// What is below all of some planes through the origin.
#[derive(Debug)]
struct Wedge<const D: usize>(Vec<[f64; D]>);

impl<const D: usize> Wedge<D> {
    fn heights(&self, x: &[f64; D]) -> Vec<f64> {
        self.0.iter().map(|n| (0..D).map(|k| n[k] * x[k]).sum()).collect()
    }
}

impl<const D: usize> Hull<D> for Wedge<D> {
    fn contains(&self, x: &[f64; D]) -> bool {
        self.heights(x).iter().all(|h| *h < 0.0)
    }

    /// Of a place inside.
    fn nearest_on_surface(&self, x: &[f64; D]) -> [f64; D] {
        let heights = self.heights(x);
        let nearest = (0..heights.len()).max_by(|&a, &b| heights[a].total_cmp(&heights[b])).unwrap();
        std::array::from_fn(|k| x[k] - heights[nearest] * self.0[nearest][k])
    }

    fn volume(&self) -> f64 {
        1.0
    }
}

/// Images of places in a wedge of these outward normals, in surfaces nearer than `reach`.
fn images<const D: usize>(normals: &[[f64; D]], places: &[[f64; D]], reach: f64) -> Vec<[f64; D]> {
    let hull = Region::Hull(Arc::new(Wedge(normals.to_vec())), Wall::Open);
    let domain = Domain::new([-1.0; D], [1.0; D], [Axis::OPEN; D], hull).unwrap();
    let positions = std::array::from_fn(|k| places.iter().map(|x| x[k]).collect());
    Ghosts::mirror(&domain, &positions, |_| reach).positions
}

/// The share of a disc about the edge of a wedge that an even grid in it fills with its images.
fn filled(angle: f64) -> f64 {
    let (sin, cos) = angle.sin_cos();
    // One face along x, the other at `angle` from it.
    let normals = [[0.0, -1.0], [-sin, cos]];
    let wedge = Wedge(normals.to_vec());
    let grid = (0..200 * 200).map(|i| [(i % 200) as f64 - 99.5, (i / 200) as f64 - 99.5].map(|v| v / 100.0));
    let inside: Vec<[f64; 2]> = grid.filter(|x| wedge.contains(x)).collect();
    let within = |x: &&[f64; 2]| x[0].hypot(x[1]) < 0.5;
    let all = inside.iter().filter(within).count() + images(&normals, &inside, 0.9).iter().filter(within).count();
    all as f64 / (100.0 * 100.0 * std::f64::consts::PI * 0.25)
}

#[test]
fn the_space_about_an_edge_is_filled() {
    for degrees in [60.0_f64, 80.0, 90.0, 100.0, 120.0] {
        let share = filled(degrees.to_radians());
        // What is left beyond edges sharper than 72 degrees takes a third image.
        let expected = if degrees < 72.0 { 5.0 * degrees / 360.0 } else { 1.0 };
        assert!((share - expected).abs() < 0.03, "{degrees}: {share}");
    }
    // In faces that are smooth, and in those of a blade, the nearest counts.
    for degrees in [30.0_f64, 135.0, 175.0] {
        let share = filled(degrees.to_radians());
        assert!((share - 2.0 * degrees / 360.0).abs() < 0.03, "{degrees}: {share}");
    }
}

#[test]
fn a_corner_has_the_images_of_a_box() {
    let normals = [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
    let x = [0.1, 0.2, 0.3];
    let mut found = images(&normals, &[x], 0.5);
    let image = |c: usize| -> [f64; 3] { std::array::from_fn(|k| if c >> k & 1 == 1 { -x[k] } else { x[k] }) };
    let mut expected: Vec<[f64; 3]> = (1..8).map(image).collect();
    let by_place = |a: &[f64; 3], b: &[f64; 3]| a.partial_cmp(b).unwrap();
    found.sort_by(by_place);
    expected.sort_by(by_place);
    assert_eq!(found.len(), 7, "{found:?}");
    let off = found.iter().zip(&expected).flat_map(|(a, b)| (0..3).map(move |k| (a[k] - b[k]).abs()));
    assert!(off.fold(0.0, f64::max) < 1e-15, "{found:?}");
    // Faces farther than the reach do not count.
    assert_eq!(images(&normals, &[x], 0.25).len(), 3);
    assert_eq!(images(&normals, &[[0.1, 0.8, 0.8]], 0.5), [[-0.1, 0.8, 0.8]]);
}

/// All of the plane but a quadrant.
#[derive(Debug)]
struct Nook;

impl Hull<2> for Nook {
    fn contains(&self, x: &[f64; 2]) -> bool {
        x[0] < 0.0 || x[1] < 0.0
    }

    fn nearest_on_surface(&self, x: &[f64; 2]) -> [f64; 2] {
        let (below, beside) = ([x[0].max(0.0), 0.0], [0.0, x[1].max(0.0)]);
        let away = |p: [f64; 2]| (p[0] - x[0]).hypot(p[1] - x[1]);
        if away(below) <= away(beside) { below } else { beside }
    }

    fn volume(&self) -> f64 {
        1.0
    }
}

/// Each place beyond a re-entrant edge is filled from the face that is nearer, and once.
#[test]
fn the_space_beyond_a_re_entrant_edge_is_filled_once() {
    let hull = Region::Hull(Arc::new(Nook), Wall::Open);
    let domain = Domain::new([-1.0; 2], [1.0; 2], [Axis::OPEN; 2], hull).unwrap();
    let grid = (0..200 * 200).map(|i| [(i % 200) as f64 - 99.5, (i / 200) as f64 - 99.5].map(|v| v / 100.0));
    let inside: Vec<[f64; 2]> = grid.filter(|x| Nook.contains(x)).collect();
    let positions = [0, 1].map(|k| inside.iter().map(|x| x[k]).collect());
    let images = Ghosts::mirror(&domain, &positions, |_| 0.9).positions;
    assert!(images.iter().all(|y| !Nook.contains(y)));
    let within = images.iter().filter(|y| y[0].hypot(y[1]) < 0.5).count() as f64;
    let share = within / (100.0 * 100.0 * std::f64::consts::PI * 0.25 * 0.25);
    assert!((0.97..1.1).contains(&share), "{share}");
}
