//! The nearest points are those that a search over all of them finds.

use rand::RngExt;
use sph_core::nearest::Nearest;
use sph_core::random::keyed;

fn as_by_search<const D: usize>() {
    let mut random = keyed(1, D as u64, 0);
    let mut point = || std::array::from_fn(|_| random.random());
    let points: Vec<[f64; D]> = (0..500).map(|_| point()).collect();
    let tree = Nearest::new(&points).unwrap();
    assert_eq!(tree.len(), 500);
    for _ in 0..100 {
        let x: [f64; D] = point();
        let distance = |i: usize| (0..D).map(|k| (points[i][k] - x[k]).powi(2)).sum::<f64>().sqrt();
        let mut all: Vec<usize> = (0..500).collect();
        all.sort_by(|&i, &j| distance(i).total_cmp(&distance(j)));
        let found = tree.find(&x, 20);
        assert_eq!(found.iter().map(|f| f.0).collect::<Vec<_>>(), all[..20]);
        assert!(found.iter().all(|&(i, d)| (d - distance(i)).abs() < 1e-15));
        assert_eq!(tree.one(&x), (all[0], found[0].1));
        let reach = 0.5 * (distance(all[19]) + distance(all[20]));
        let mut within = tree.within(&x, reach);
        within.sort_by(|a, b| a.1.total_cmp(&b.1));
        assert_eq!(within, found);
        assert!(tree.within(&x, -reach).is_empty());
    }
}

#[test]
fn the_nearest_points_are_those_of_a_search_over_all() {
    as_by_search::<1>();
    as_by_search::<2>();
    as_by_search::<3>();
}

#[test]
fn few_points_and_equal_ones_are_all_found() {
    let tree = Nearest::new(&[[0.5, 0.5]; 100]).unwrap();
    assert_eq!(tree.find(&[0.0, 0.0], 200).len(), 100);
    assert!(tree.find(&[0.0, 0.0], 0).is_empty());
}

#[test]
fn no_points_are_refused() {
    let error = Nearest::<3>::new(&[]).err().unwrap();
    assert_eq!(error.to_string(), "0 points in 3 dimensions cannot be indexed: there are none");
}
