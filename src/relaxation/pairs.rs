//! Pairs: particles far closer together than the spacing that the target has there, down to the same place.
//!
//! No force of a smooth kernel parts what coincides (its gradient vanishes at the origin), and at jumps that N
//! particles do not resolve a stage may press two together. Here each of a pair moves away from the other until
//! they are apart (mirror images at walls count, a particle's own too); which way coincident ones go is drawn by their place in the tree.

use super::relaxation_domain;
use crate::kernel::unit_ball_volume;
use crate::neighbors::{Batch, LeafPass, Reach, Sources, Tree, for_each_target};
use crate::rng::{Purpose, keyed};
use crate::target::{Positions, Target, at};
use pulp::Simd;
use rand::RngExt;
use rayon::prelude::*;

/// Distance over the smaller spacing of the two below which particles are the same one twice.
pub const COINCIDENT: f64 = 1e-3;
/// Distance below which the particles of a result count as paired; random points have some, relaxed ones none.
pub const PAIRED: f64 = 0.15;
/// How far pairs are moved apart, in spacings.
const APART: f64 = 0.25;
/// Share of that by which each of a pair moves at random.
const SIDEWAYS: f64 = 0.2;
/// Rounds after which the rest is left: thousands at one place are apart by then.
const MAX_ROUNDS: usize = 1000;
/// Squared distance, in limits, below which there is no direction from one to the other.
const NO_DIRECTION: f64 = 1e-24;

/// The way that a particle should go, and whether it is one of a pair.
#[derive(Debug, Clone, Copy)]
struct Parting<const D: usize> {
    shift: [f64; D],
    paired: bool,
}

impl<const D: usize> Default for Parting<D> {
    fn default() -> Self {
        Self { shift: [0.0; D], paired: false }
    }
}

/// Channel 0: the distance up to which a particle wants to be apart.
struct PartingPass<'a> {
    apart: &'a [f64],
    /// The distance that makes a pair over that.
    threshold: f64,
    round: u64,
}

impl<const D: usize> LeafPass<D, 1, f64> for PartingPass<'_> {
    type Output = Parting<D>;

    #[inline(always)]
    fn leaf<S: Simd>(&self, _: S, batch: &mut Batch<'_, D, 1, f64>, out: &mut [Parting<D>]) {
        let unit = batch.unit();
        for (i, out) in batch.targets().zip(out) {
            let target = batch.target(i);
            let (mut shift, mut same, mut paired) = ([0.0; D], 0, false);
            for j in 0..batch.len() {
                let x = batch.position(j);
                let apart = self.apart[i].min(batch.channel(0, j) * unit.channels[0]) / unit.length;
                let r2 = (0..D).map(|k| (x[k] - target[k]).powi(2)).sum::<f64>();
                if r2 < NO_DIRECTION * apart * apart {
                    same += 1;
                } else if r2 < (self.threshold * apart).powi(2) {
                    paired = true;
                    let r = r2.sqrt();
                    let push = 0.5 * (apart - r) * unit.length / r;
                    (0..D).for_each(|k| shift[k] += push * (target[k] - x[k]));
                }
            }
            // One at distance 0 is the particle itself.
            let coincident = same > 1;
            paired |= coincident;
            if paired {
                // A little to the side, too: along a crowded line there is no room.
                let size = self.apart[i] * if coincident { 0.5 } else { SIDEWAYS };
                let way = direction::<D>(i as u64, self.round);
                (0..D).for_each(|k| shift[k] += size * way[k]);
            }
            *out = Parting { shift, paired };
        }
    }
}

/// A random vector no longer than 1 and not much shorter.
fn direction<const D: usize>(particle: u64, round: u64) -> [f64; D] {
    let mut rng = keyed(round, Purpose::Parting, particle);
    let tries = (32.0 / unit_ball_volume(D)) as usize;
    for _ in 0..tries {
        let way: [f64; D] = std::array::from_fn(|_| 2.0 * rng.random::<f64>() - 1.0);
        let size2 = way.iter().map(|v| v * v).sum::<f64>();
        if (0.25..=1.0).contains(&size2) {
            return way;
        }
    }
    std::array::from_fn(|k| if k == 0 { 1.0 } else { 0.0 })
}

/// Parts particles that are closer than `threshold` of the smaller of their spacings; returns how many were
/// found so. Without pairs this is one pass, and positions stay as they are, bit for bit.
pub fn part_pairs<const D: usize>(target: &Target<'_, D>, positions: &mut Positions<D>, threshold: f64) -> usize {
    let n = positions[0].len();
    if n < 2 {
        return 0;
    }
    let domain = relaxation_domain(target.domain);
    let mut found = 0;
    for round in 0..MAX_ROUNDS {
        let tree = Tree::build(positions);
        let apart: Vec<f64> = tree
            .order()
            .par_iter()
            .map(|&i| APART * target.spacing(target.number_density(&at(positions, i as usize))).min(domain.size()))
            .collect();
        let sources = [Sources::<D, 1>::new(&tree, &apart, [&apart], Reach::Target)];
        let pass = PartingPass { apart: &apart, threshold: threshold / APART, round: round as u64 };
        let partings = for_each_target::<D, 1, f64, _>(&domain, &sources, 1.0, &pass);
        let paired = partings.iter().filter(|p| p.paired).count();
        if paired == 0 {
            break;
        }
        found = found.max(paired);
        for ((parting, &i), limit) in partings.iter().zip(tree.order()).zip(&apart).filter(|((p, _), _)| p.paired) {
            let from = at(positions, i as usize);
            let size = parting.shift.iter().map(|s| s * s).sum::<f64>().sqrt();
            let scale = if size > *limit { limit / size } else { 1.0 };
            let mut x = std::array::from_fn(|k| from[k] + scale * parting.shift[k]);
            domain.confine(&from, &mut x);
            if target.admits(&x) {
                (0..D).for_each(|k| positions[k][i as usize] = x[k]);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::{Axis, Domain, Region};
    use crate::field::ScalarField;
    use crate::target::Resolution;

    struct One;

    impl<const D: usize> ScalarField<D> for One {
        fn value(&self, _: &[f64; D]) -> f64 {
            1.0
        }
    }

    fn in_box<const D: usize>(start: Positions<D>, threshold: f64) -> (Positions<D>, usize) {
        let domain = Domain::new([0.0; D], [1.0; D], [Axis::REFLECTING; D], Region::Box).unwrap();
        let target = Target {
            domain: &domain,
            density: &One,
            resolution: Resolution::EqualMass,
            count: start[0].len(),
            mass: 1.0,
            resolution_integral: 1.0,
            largest_spacing: f64::INFINITY,
        };
        let mut positions = start;
        let found = part_pairs(&target, &mut positions, threshold);
        assert!((0..target.count).all(|i| domain.contains(&at(&positions, i))));
        (positions, found)
    }

    fn closest<const D: usize>(x: &Positions<D>) -> f64 {
        let distance2 = |i: usize, j: usize| (0..D).map(|k| (x[k][i] - x[k][j]).powi(2)).sum::<f64>();
        let n = x[0].len();
        let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
        pairs.fold(f64::INFINITY, |m, (i, j)| m.min(distance2(i, j))).sqrt()
    }

    #[test]
    fn particles_at_one_place_part_the_same_way_each_time() {
        let start: Positions<3> = std::array::from_fn(|_| vec![0.3; 200]);
        let (x, found) = in_box(start.clone(), COINCIDENT);
        assert_eq!(found, 200);
        assert!(closest(&x) > COINCIDENT * 200_f64.powf(-1.0 / 3.0), "{}", closest(&x));
        assert_eq!(x, in_box(start, COINCIDENT).0);
        let corner: Positions<2> = std::array::from_fn(|_| vec![1.0; 50]);
        assert!(closest(&in_box(corner, PAIRED).0) > PAIRED * 50_f64.powf(-0.5));
        let line: Positions<1> = [vec![0.0; 20]];
        assert!(closest(&in_box(line, PAIRED).0) > PAIRED / 20.0);
    }

    #[test]
    fn what_is_apart_stays_bit_for_bit() {
        let place = |i: usize| (i as f64 + 0.5) / 10.0;
        let start: Positions<2> =
            [(0..100).map(|i| place(i % 10)).collect(), (0..100).map(|i| place(i / 10)).collect()];
        assert_eq!(in_box(start.clone(), PAIRED), (start, 0));
    }
}
