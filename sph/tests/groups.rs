//! Groups of particles that lie close together.

use sph_core::geometry::{Positions, at};
use sph_core::neighbors::{Groups, Tree};

#[test]
fn groups_hold_every_particle_once_and_close_together() {
    fn check<const D: usize>(edge: usize) {
        let count = edge.pow(D as u32);
        let place = |i: usize, k: usize| (i / edge.pow(k as u32) % edge) as f64;
        let positions: Positions<D> = std::array::from_fn(|k| (0..count).map(|i| place(i, k)).collect());
        let groups = Groups::new(&Tree::build(&positions), 8);
        let mut seen = vec![false; count];
        for group in 0..groups.len() {
            let members = groups.members(group);
            assert!((1..=8).contains(&members.len()), "{}", members.len());
            for &i in members {
                assert!(!std::mem::replace(&mut seen[i as usize], true), "twice");
                let (a, b) = (at(&positions, i as usize), at(&positions, members[0] as usize));
                assert!((0..D).all(|k| (a[k] - b[k]).abs() <= 8.0), "{a:?} and {b:?}");
            }
        }
        assert!(seen.iter().all(|seen| *seen));
    }
    check::<1>(1000);
    check::<2>(40);
    check::<3>(17);
    assert!(Groups::new(&Tree::build(&[vec![], vec![]]), 8).is_empty());
}
