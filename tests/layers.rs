//! Layers thinner than the spacing of particles: an even sheet at the height of their mass.

use crate::seeding::{Density, closest};
use sph::domain::{Axis, Domain, Region};
use sph_prep::seeding::{Seeding, seed};
use sph_prep::target::{Positions, Target};
use sph_prep::{Control, FORMATS, Scene, place};

/// Scale height of the layer, in widths of its box.
const HEIGHT: f64 = 0.0025;

/// Seeds of a layer that falls exponentially from the floor of a box that is periodic along it.
fn layer(count: usize) -> (Domain<3>, Positions<3>) {
    let axes = [Axis::Periodic, Axis::Periodic, Axis::OPEN];
    let domain = Domain::new([0.0; 3], [1.0; 3], axes, Region::Box).unwrap();
    let density = Density(|x: &[f64; 3]| (-x[2] / HEIGHT).exp());
    let target = Target::of_equal_masses(&domain, &density, count, HEIGHT);
    let positions = seed(&target, Seeding::MassBisection, 0).unwrap().positions;
    (domain, positions)
}

/// Particles of a layer that falls by a factor e within a fourth of the spacing at its foot are each of a whole column, so that all are at its mean
/// height. Jitter of a tenth of the column's width, sqrt(12) scale heights, is 0.2 scale heights at one particle and 0.005 on average of 2000; Gauss's
/// rule has the mass of cells to a percent. By the centers of cells the mean was 1.19.
#[test]
fn particles_of_a_thin_layer_are_at_the_height_of_its_mass() {
    let count = 2000;
    let (_, x) = layer(count);
    let mean = x[2].iter().sum::<f64>() / count as f64 / HEIGHT;
    assert!((mean - 1.0).abs() < 0.025, "mean height {mean}");
    let highest = x[2].iter().fold(0.0_f64, |m, z| m.max(*z)) / HEIGHT;
    assert!((1.0..1.5).contains(&highest), "the highest at {highest}");
}

/// A part of few particles is some cells wide, whose mass is all over them: by that of their middles it seemed thinner than a layer of an eighth of the
/// spacing, and columns were cut across. Halves of a square column are 0.7 spacings wide, and jitter takes 0.2 spacings of the target, 0.15 of the sheet.
#[test]
fn thin_layers_are_cut_along_and_not_across() {
    let count = 2500;
    let (domain, x) = layer(count);
    let least = closest(&domain, &x) * (count as f64).sqrt();
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
