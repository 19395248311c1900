//! Layers thinner than the spacing of particles: an even sheet at the height of their mass.

use crate::seeding::Density;
use sph::domain::{Axis, Domain, Region};
use sph_prep::seeding::{Seeding, seed};
use sph_prep::target::{Positions, Target, at};
use sph_prep::{Control, FORMATS, Scene, place};

fn seeds<F: Fn(&[f64; 3]) -> f64 + Send + Sync>(
    domain: &Domain<3>,
    density: F,
    mass: f64,
    count: usize,
) -> Positions<3> {
    let density = Density(density);
    let target = Target::of_equal_masses(domain, &density, count, mass);
    seed(&target, Seeding::MassBisection, 0).unwrap().positions
}

/// Smallest distance of two of the particles.
fn closest(domain: &Domain<3>, x: &[[f64; 3]]) -> f64 {
    let distance = |i: usize, j: usize| domain.displacement(&x[i], &x[j]).iter().map(|v| v * v).sum::<f64>().sqrt();
    (1..x.len()).flat_map(|i| (0..i).map(move |j| (i, j))).fold(f64::INFINITY, |m, (i, j)| m.min(distance(i, j)))
}

/// Particles of a layer that falls by a factor e within a fourth of the spacing at its foot are each of a whole column, so that all are at its mean
/// height. Jitter of a tenth of the column's width, sqrt(12) scale heights, is 0.2 scale heights at one particle and 0.005 on average of 2000; Gauss's
/// rule has the mass of cells to a percent. By the centers of cells the mean was 1.19.
#[test]
fn particles_of_a_thin_layer_are_at_the_height_of_its_mass() {
    let axes = [Axis::Periodic, Axis::Periodic, Axis::OPEN];
    let domain = Domain::new([0.0; 3], [1.0; 3], axes, Region::Box).unwrap();
    let (count, height) = (2000, 0.0025);
    let x = seeds(&domain, |x| (-x[2] / height).exp(), height, count);
    let mean = x[2].iter().sum::<f64>() / count as f64 / height;
    assert!((mean - 1.0).abs() < 0.025, "mean height {mean}");
    let highest = x[2].iter().fold(0.0_f64, |m, z| m.max(*z)) / height;
    assert!((1.0..1.5).contains(&highest), "the highest at {highest}");
}

/// A part of few particles is some cells wide, whose mass is all over them: by that of their middles it seemed thinner than a layer of an eighth of the
/// spacing, and columns were cut across. Halves of a square column are 0.7 spacings wide, and jitter takes 0.2 spacings of the target, 0.15 of the sheet.
#[test]
fn thin_layers_are_cut_along_and_not_across() {
    let axes = [Axis::Periodic, Axis::Periodic, Axis::OPEN];
    let domain = Domain::new([0.0; 3], [1.0; 3], axes, Region::Box).unwrap();
    let (count, height) = (2500, 0.0025);
    let x = seeds(&domain, |x| (-x[2] / height).exp(), height, count);
    let all: Vec<[f64; 3]> = (0..count).map(|i| at(&x, i)).collect();
    let least = closest(&domain, &all) * (count as f64).sqrt();
    assert!(least > 0.5, "the closest are {least} spacings of the sheet apart");
}

/// Closest pair of the seeds of an expression, in mean spacings.
fn closest_of(expression: &str, domain: &str, count: usize) -> f64 {
    let text = format!(
        "input: {{expression: '{expression}'}}\ndomain: {{{domain}}}\nparticles: {count}\nseeding: mass-bisection\n\
         wvt: {{iterations: 0}}\npolish: none\n"
    );
    place(&Scene::parse(&text).unwrap(), FORMATS, &Control::default()).unwrap().1.neighbors.closest_pair
}

/// Halves of a square column of two are 0.71 spacings of the sheet wide, of which a sum over it has 0.83 to each; jitter takes up to a tenth. Columns
/// were cut across: 0.07.
#[test]
fn thin_discs_have_no_close_pairs() {
    let disc = closest_of("exp(-sqrt(x^2+y^2))/cosh(z/0.02)^2", "box: [[-5, -5, -2], [5, 5, 2]], boundary: open", 500);
    assert!(disc > 0.45, "disc {disc}");
}
