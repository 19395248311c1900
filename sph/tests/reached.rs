//! Which particles others see, against all pairs.

use sph_core::domain::{Axis, Domain, Region};
use sph_core::neighbors::Seeing;

#[test]
fn those_are_reached_that_any_sees_or_that_see_any() {
    let domain = Domain { lo: [0.0; 2], hi: [1.0; 2], axes: [Axis::Periodic; 2], region: Region::Box };
    let place = |i: usize, seed: f64| [(i as f64 * 0.7548 + seed).fract(), (i as f64 * 0.5698 + 2.0 * seed).fract()];
    let set = |count: usize, seed: f64| -> [Vec<f64>; 2] {
        std::array::from_fn(|k| (0..count).map(|i| place(i, seed)[k] * if seed > 0.2 { 1.0 } else { 0.3 }).collect())
    };
    let (own, others) = (set(200, 0.1), set(500, 0.37));
    let radii = |count: usize| -> Vec<f64> { (0..count).map(|i| 0.002 + 0.05 * place(i, 0.7)[0].powi(3)).collect() };
    let (support, theirs) = (radii(200), radii(500));
    let apart = |i: usize, j: usize| {
        (0..2).map(|k| ((own[k][i] - others[k][j] + 0.5).rem_euclid(1.0) - 0.5).powi(2)).sum::<f64>().sqrt()
    };
    let seeing = Seeing::new(&own, &support);
    for far in [&theirs[..], &[]] {
        let reach = |i: usize, j: usize| far.get(j).map_or(support[i], |far| support[i].max(*far));
        let expected: Vec<bool> = (0..500).map(|j| (0..200).any(|i| apart(i, j) <= reach(i, j))).collect();
        assert!(expected.contains(&true) && expected.contains(&false));
        assert_eq!(seeing.reach(&domain, &others, far), expected);
    }
}

#[test]
fn none_see_nothing() {
    let domain = Domain { lo: [0.0], hi: [1.0], axes: [Axis::Periodic], region: Region::Box };
    assert_eq!(Seeing::<1>::new(&[vec![]], &[]).reach(&domain, &[vec![0.5]], &[2.0]), [false]);
}
