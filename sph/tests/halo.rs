//! What ranks are given of each other's particles.

use sph_core::domain::{Axis, Domain, Region};
use sph_core::exchange::together;
use sph_core::neighbors::{Halo, Sees, Tree};

const REACH: f64 = 0.06;

/// Each of two ranks has a half of a periodic square, but for some particles near its faces that have gone through them. What is given holds all
/// that is within reach, and little more: particles on the far side make no box that spans the domain.
#[test]
fn particles_that_went_through_a_face_are_given_their_surroundings_alone() {
    let domain = Domain::new([0.0; 2], [1.0; 2], [Axis::Periodic; 2], Region::Box).unwrap();
    let (count, cells) = (3200, 80);
    let place = |rank: usize, i: usize| {
        let cell = [(i % 40) as f64, (i / 40) as f64];
        // One in ten is moved by three cells.
        let shift = if i.is_multiple_of(10) { 3.0 / cells as f64 } else { 0.0 };
        let x = [0.5 * rank as f64 + cell[0] / cells as f64 - shift, cell[1] / cells as f64 - shift];
        x.map(|v| v.rem_euclid(1.0))
    };
    let all = |rank: usize| (0..count).map(move |i| place(rank, i));
    for sees in [Sees::Targets, Sees::Either] {
        let given = together(2, 1, |exchange| {
            let own: [Vec<f64>; 2] = std::array::from_fn(|k| all(exchange.rank()).map(|x| x[k]).collect());
            let tree = Tree::build(&own);
            let halo = Halo::new(exchange, &domain, (&tree, &vec![REACH; count]), None, sees);
            (0..halo.tree.len()).map(|i| halo.tree.position(i)).collect::<Vec<_>>()
        })
        .unwrap();
        for (rank, given) in given.iter().enumerate() {
            let is_near = |x: &[f64; 2]| {
                all(rank).any(|y| domain.displacement(x, &y).iter().map(|d| d * d).sum::<f64>() < REACH * REACH)
            };
            let near: Vec<[f64; 2]> = all(1 - rank).filter(|x| is_near(x)).collect();
            assert!(near.iter().all(|x| given.contains(x)), "{sees:?}, rank {rank}: not all that are near are given");
            let share = given.len() as f64 / near.len() as f64;
            assert!(share < 1.6, "{sees:?}, rank {rank}: {} are given, {} are near", given.len(), near.len());
        }
    }
}
