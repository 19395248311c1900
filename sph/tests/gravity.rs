//! Gravity by the tree against sums over all pairs, and its softening.

use rand::RngExt;
use sph_core::gravity::{OPENING_ANGLE, direct_gravity, gravity, sampled_gravity, strength};
use sph_core::neighbors::Tree;
use sph_core::random::keyed;

fn cloud<const D: usize>(n: usize) -> ([Vec<f64>; D], Vec<f64>) {
    let mut random = keyed(7, 0, n as u64);
    let positions = std::array::from_fn(|_| (0..n).map(|_| random.random::<f64>().powi(2)).collect());
    (positions, (0..n).map(|i| 1.0 + (i % 3) as f64).collect())
}

/// Force and potential of a unit mass at a distance, by Simpson's rule over the mass of (1 - u)^4 (1 + 4 u) within it.
fn of_a_mass<const D: usize>(r: f64, softening: f64) -> f64 {
    let shape = |u: f64| (1.0 - u).powi(4) * (1.0 + 4.0 * u) * u.powi(D as i32 - 1);
    let within = |end: f64| {
        let n = 400;
        let h = end / f64::from(n);
        let weight = |i: i32| {
            if i == 0 || i == n {
                1.0
            } else if i % 2 == 1 {
                4.0
            } else {
                2.0
            }
        };
        (0..=n).map(|i| weight(i) * shape(f64::from(i) * h)).sum::<f64>() * h / 3.0
    };
    let share = if r < softening { within(r / softening) / within(1.0) } else { 1.0 };
    share * strength(D) / r.powi(D as i32 - 1)
}

/// The tree against a sum over all pairs that knows nothing of nodes or lanes.
#[test]
fn the_tree_agrees_with_all_pairs() {
    fn check<const D: usize>() {
        for (n, softening) in [(1, 0.1), (2, 0.0), (3000, 0.0), (3000, 0.05)] {
            let (positions, masses) = cloud::<D>(n);
            let tree = Tree::build(&positions);
            let pulls = gravity(&tree, &tree.to_tree_order(&masses), softening, OPENING_ANGLE);
            let (mut squares, mut all) = (0.0, 0.0);
            for place in (0..n).step_by(17) {
                let i = tree.order()[place] as usize;
                let (mut wanted, mut size) = ([0.0; D], 0.0);
                for j in (0..n).filter(|&j| j != i) {
                    let d: [f64; D] = std::array::from_fn(|k| positions[k][j] - positions[k][i]);
                    let r = d.iter().map(|v| v * v).sum::<f64>().sqrt();
                    let force = masses[j] * of_a_mass::<D>(r, softening);
                    (0..D).for_each(|k| wanted[k] += force * d[k] / r);
                    size += force;
                }
                let direct = &direct_gravity(&positions, &masses, softening, &[i])[0];
                for k in 0..D {
                    squares += (pulls[place].acceleration[k] - wanted[k]).powi(2);
                    all += wanted[k].powi(2);
                    assert!((direct.acceleration[k] - wanted[k]).abs() <= 1e-9 * size, "{D}-D {n} {softening}");
                }
                let off = (pulls[place].potential - direct.potential).abs();
                assert!(off <= 1e-3 * direct.potential.abs().max(1e-9), "{D}-D {n} {softening}: {off}");
            }
            assert!(squares.sqrt() <= 1e-3 * all.sqrt(), "{D}-D {n}: {:e}", (squares / all).sqrt());
        }
    }
    check::<1>();
    check::<2>();
    check::<3>();
}

/// A sample of leaves has what they have among all.
#[test]
fn a_sample_has_the_gravity_of_all() {
    let (positions, masses) = cloud::<3>(2000);
    let tree = Tree::build(&positions);
    let masses = tree.to_tree_order(&masses);
    let all = gravity(&tree, &masses, 0.01, OPENING_ANGLE);
    let some = sampled_gravity(&tree, &masses, 0.01, OPENING_ANGLE, 7);
    assert!(some.len() > 200 && some.len() < 400, "{}", some.len());
    assert!(some.iter().all(|(place, pull)| *pull == all[*place]));
}

/// The slope of the potential of two masses is their force, within the softening radius, at its edge and beyond.
#[test]
fn force_is_minus_the_slope_of_the_potential() {
    fn check<const D: usize>() {
        let at = |r: f64| {
            let positions: [Vec<f64>; D] = std::array::from_fn(|k| vec![0.0, if k == 0 { r } else { 0.0 }]);
            direct_gravity(&positions, &[2.0, 1.0], 0.7, &[1])[0]
        };
        for r in [0.05, 0.3, 0.6, 0.7, 0.8, 2.0] {
            let step = 1e-5;
            let slope = (at(r + step).potential - at(r - step).potential) / (2.0 * step);
            let force = at(r).acceleration[0];
            assert!((slope + force).abs() < 1e-6 * force.abs(), "{D}-D {r}: {slope} {force}");
            assert!((force / (-2.0 * of_a_mass::<D>(r, 0.7)) - 1.0).abs() < 1e-7, "{D}-D {r}: {force}");
        }
    }
    check::<1>();
    check::<2>();
    check::<3>();
}
