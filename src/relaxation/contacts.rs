//! Layers on both sides of a jump, which stages relax each by itself or hold: where particles of different regions have come too close, or those
//! of one region beside the surface have, they part by the mean of their spacings.
//!
//! A layer does not know where the particles of the other lie along the surface, so that some face each other across it. Moves are small parts of a
//! spacing: spheres of the diameter that is asked for fill a third of the volume, where even random ones jam at two thirds.

use crate::random::Purpose;
use crate::target::{Positions, Target, at};
use sph::neighbors::{Reach, Sources, Tree};
use sph::parallel;
use sph::sums::{Apart, partings};

/// Distance over the mean spacing of two particles below which they part.
const CLOSEST: f64 = 0.87;
/// How far from a surface particles part, in spacings.
const BESIDE: f64 = 1.5;
/// Rounds after which the rest is left.
const ROUNDS: usize = 60;
/// No particle moves farther in a round, in its own spacing.
const MAX_STEP: f64 = 0.1;

/// Parts particles beside the surfaces between regions; returns how many. Without surfaces, and where none are too close, positions stay as they
/// are, bit for bit.
pub(super) fn part_contacts<const D: usize>(target: &Target<'_, D>, positions: &mut Positions<D>) -> usize {
    let n = positions[0].len();
    if n < 2 || target.regions().is_none_or(|regions| regions.number() < 2) {
        return 0;
    }
    let spacing = |positions: &Positions<D>| {
        let density = target.number_densities(positions);
        parallel::map(n, |i| target.spacing(density[i]).min(target.domain.size()))
    };
    let first = spacing(positions);
    let is_beside = parallel::map(n, |i| target.is_beside_region(&at(positions, i), BESIDE * first[i]));
    if !is_beside.contains(&true) {
        return 0;
    }
    let domain = target.domain.mirrored();
    let mut moved = vec![false; n];
    for round in 0..ROUNDS {
        let tree = Tree::build(positions);
        let own = spacing(positions);
        let apart = parallel::map(n, |place| CLOSEST * own[tree.order()[place] as usize]);
        let sources = [Sources::<D, 1>::new(&tree, &apart, [&apart], Reach::Either)];
        let found = partings(&domain, &sources, (Apart::Mean, 1.0), (round as u64, Purpose::Parting as u64));
        let mut any = false;
        for ((parting, &i), own) in found.iter().zip(tree.order()).zip(&apart) {
            let i = i as usize;
            if !parting.paired || !is_beside[i] {
                continue;
            }
            let from = at(positions, i);
            let size = parting.shift.iter().map(|s| s * s).sum::<f64>().sqrt();
            let scale = if size > MAX_STEP * own { MAX_STEP * own / size } else { 1.0 };
            let mut x = std::array::from_fn(|k| from[k] + scale * parting.shift[k]);
            domain.confine(&from, &mut x);
            if x != from && target.admits(&x) && target.keeps_region(&from, &x) {
                (0..D).for_each(|k| positions[k][i] = x[k]);
                (moved[i], any) = (true, true);
            }
        }
        if !any {
            break;
        }
    }
    moved.iter().filter(|m| **m).count()
}
