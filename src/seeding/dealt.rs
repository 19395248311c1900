//! Initial positions that several ranks generate together, and exchange so that each rank has those of a part of space.
//!
//! Mass bisection numbers its particles so that successive ones lie together. Shells number theirs from the inside out, so that successive ones form
//! layers; these are renumbered here, leaf by leaf of a tree of planes, and each rank has a range of the new numbers. The number of a particle does
//! not depend on how many ranks there are.

use super::blocks::{Blockwise, each_region, seed_block};
use super::parting::Parting;
use crate::error::Result;
use crate::target::{Positions, Target, at};
use sph::exchange::Exchange;
use sph::parallel;
use std::ops::Range;

/// Particles of a leaf, on average, and leaves at most.
const OF_A_LEAF: usize = 64;
const MOST_LEAVES: usize = 1 << 13;

impl<const D: usize> Blockwise<'_, D> {
    /// Those initial positions of a whole run that belong to this rank, where `shares` are the numbers of each rank: one range after the other from 0
    /// to the target's count. All ranks call it together.
    ///
    /// # Errors
    /// A target without mass in its domain, on all of them.
    pub fn dealt(&self, exchange: &dyn Exchange, shares: &[Range<usize>]) -> Result<Positions<D>> {
        let own = shares[exchange.rank()].clone();
        if self.shells.is_none() {
            return seed_block(self.target, self.seed, own);
        }
        // As they are made: some of each share's.
        let made = self.positions(own.clone())?;
        let leaves = Leaves::new(self.target)?;
        let whose = parallel::map(made[0].len(), |i| leaves.of(own.start + i, &at(&made, i)));
        let mut here = vec![0.0; leaves.count];
        whose.iter().for_each(|&leaf| here[leaf] += 1.0);
        let mut next = firsts(&exchange.all(&here), exchange.rank());
        let mut to = vec![Vec::new(); exchange.ranks()];
        for (i, &leaf) in whose.iter().enumerate() {
            let number = next[leaf];
            next[leaf] += 1;
            let rank = shares.partition_point(|share| share.end <= number);
            to[rank].push(number as f64);
            to[rank].extend(at(&made, i));
        }
        drop(made);
        let mut dealt: Positions<D> = std::array::from_fn(|_| vec![0.0; own.len()]);
        for seed in exchange.swap(to).iter().flat_map(|from| from.chunks_exact(D + 1)) {
            (0..D).for_each(|k| dealt[k][seed[0] as usize - own.start] = seed[k + 1]);
        }
        Ok(dealt)
    }
}

/// The number of the first particle of this rank in each leaf: leaf by leaf, and in each by the rank that has made it.
fn firsts(all: &[Vec<f64>], rank: usize) -> Vec<usize> {
    let mut next = 0;
    let first = |leaf: usize| {
        let before: f64 = all[..rank].iter().map(|counts| counts[leaf]).sum();
        let first = next + before as usize;
        next += all.iter().map(|counts| counts[leaf]).sum::<f64>() as usize;
        first
    };
    (0..all.first().map_or(0, Vec::len)).map(first).collect()
}

/// Leaves of all regions, one region after the other.
struct Leaves<const D: usize> {
    /// Numbers of the first particle and of the first leaf of each region.
    regions: Vec<(usize, usize, Parting<D>)>,
    count: usize,
}

impl<const D: usize> Leaves<D> {
    fn new(target: &Target<'_, D>) -> Result<Self> {
        let (mut all, mut first) = (Self { regions: Vec::new(), count: 0 }, 0);
        each_region(target, &(0..target.count), |region, own| {
            let leaves = (own.len() / OF_A_LEAF).clamp(1, MOST_LEAVES).next_power_of_two();
            all.regions.push((first, all.count, Parting::coarse(region, leaves)?));
            all.count += leaves;
            first += own.len();
            Ok(())
        })?;
        Ok(all)
    }

    /// The leaf of the particle that was made with this number.
    fn of(&self, number: usize, x: &[f64; D]) -> usize {
        let region = self.regions.partition_point(|(first, ..)| *first <= number) - 1;
        let (_, first, parting) = &self.regions[region];
        first + parting.block_of(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::AnalyticField;
    use crate::seeding::Seeding;
    use sph::domain::{Domain, Wall};
    use sph::exchange::together;

    const COUNT: usize = 5000;

    fn shares(ranks: usize) -> Vec<Range<usize>> {
        (0..ranks).map(|rank| COUNT * rank / ranks..COUNT * (rank + 1) / ranks).collect()
    }

    /// Shells are dealt out in one order whatever the number of ranks, none is lost, and shares are no shells but parts of space.
    #[test]
    fn ranks_have_parts_of_space_of_the_same_seeds() {
        let domain = Domain::ball([0.0; 3], 1.0, Wall::Open).unwrap();
        let field = AnalyticField::new("density", "exp(-5*r)", [0.0; 3]).unwrap();
        let target = Target::of_equal_masses(&domain, &field, COUNT, 1.0);
        let seeds = Blockwise::new(&target, Seeding::EqualAreaShells, 1).unwrap();
        let on = |ranks: usize| together(ranks, 1, |exchange| seeds.dealt(exchange, &shares(ranks)).unwrap()).unwrap();
        let whole = |parts: &[Positions<3>]| -> Vec<[u64; 3]> {
            let place = |part: &Positions<3>, i: usize| at(part, i).map(f64::to_bits);
            parts.iter().flat_map(|part| (0..part[0].len()).map(|i| place(part, i)).collect::<Vec<_>>()).collect()
        };
        let one = whole(&on(1));
        let made = seeds.positions(0..COUNT).unwrap();
        let mut both = [one.clone(), whole(&[made])];
        both.iter_mut().for_each(|all| all.sort_unstable());
        assert!(both[0] == both[1]);
        for ranks in [2, 3, 8] {
            let parts = on(ranks);
            assert!(whole(&parts) == one, "{ranks} ranks");
            let wide = parts.iter().map(|part| {
                let widths = part.iter().map(|x| {
                    let [least, most] = [f64::min, f64::max].map(|f| x.iter().copied().fold(x[0], f));
                    most - least
                });
                widths.product::<f64>()
            });
            // Of the box about the ball, which shells would fill.
            let wide: f64 = wide.sum::<f64>() / 8.0;
            assert!(wide < 1.5, "{ranks} ranks: boxes about them fill {wide} of the one about all");
        }
    }
}
