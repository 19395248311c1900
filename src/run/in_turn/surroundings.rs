//! What a block's particles see of the others', and what those see.

use super::kept::{Block, Kept};
use crate::error::Result;
use crate::relaxation::Hold;
use crate::target::{Positions, Target, at};
use sph::kernel::support_over_spacing;
use sph::neighbors::Sights;
use sph::parallel;

/// Support radii away from a block within which are all that its particles see, and that those see in turn, as far as is known before these
/// are known; beyond it nothing is looked at closely.
const FAR: f64 = 2.0;
/// Boxes by which it is known about where a block is, and particles to a box where that is to be known closely.
const BOXES: usize = 64;
const CLOSELY: usize = 64;

/// Where the particles of each block are, about, and what has come of its passes.
pub(super) struct Map<'a, const D: usize> {
    target: Target<'a, D>,
    /// Support radius over spacing.
    ratio: f64,
    sights: Vec<Option<Sights<D>>>,
    /// As [`Block::ratios`].
    ratios: Vec<Vec<[f64; 2]>>,
}

/// Particles of other blocks about one.
pub(super) struct Surroundings<const D: usize> {
    pub positions: Positions<D>,
    pub holds: Vec<Hold>,
}

impl<'a, const D: usize> Map<'a, D> {
    pub fn new(target: Target<'a, D>, kernel_neighbors: f64, blocks: usize) -> Self {
        Self {
            target,
            ratio: support_over_spacing(D, kernel_neighbors),
            sights: vec![None; blocks],
            ratios: vec![Vec::new(); blocks],
        }
    }

    /// How many times a block has been relaxed.
    pub fn passes(&self, block: usize) -> usize {
        self.ratios[block].len()
    }

    /// The target over the summed density in all blocks after so many passes; none where it is resolved nowhere.
    pub fn common(&self, passes: usize) -> Option<f64> {
        let after = self.ratios.iter().filter_map(|of_block| of_block.get(passes.checked_sub(1)?));
        let (sum, count) = after.fold((0.0, 0.0), |(sum, count), [s, n]| (sum + s, count + n));
        (count > 0.0).then(|| sum / count)
    }

    /// Takes note of a block as it is now.
    pub fn note(&mut self, block: usize, Block { ratios, positions }: &Block<D>) {
        self.ratios[block].clone_from(ratios);
        let sights = Sights::new(self.target.domain, positions, &self.supports(positions), BOXES);
        self.sights[block] = Some(sights.widened(FAR));
    }

    /// Support radii that the target's spacing gives.
    fn supports(&self, positions: &Positions<D>) -> Vec<f64> {
        let density = self.target.number_densities(positions);
        let largest = self.target.domain.size();
        parallel::map(density.len(), |i| self.target.support(density[i], self.ratio).min(largest))
    }

    /// All of which the sums at a block's particles, which are `own`, are made, and those at particles that see these.
    ///
    /// # Errors
    /// Blocks that cannot be read.
    pub fn about(&self, kept: &Kept, (block, own): (usize, &Positions<D>)) -> Result<Surroundings<D>> {
        let domain = self.target.domain;
        let (positions, support) = self.near(kept, block)?;
        let closely = |x: &Positions<D>, h: &[f64]| Sights::new(domain, x, h, h.len().div_ceil(CLOSELY));
        let seen = closely(own, &self.supports(own)).reached(domain, &positions, &support);
        let some = |values: &[f64]| values.iter().zip(&seen).filter(|(_, seen)| **seen).map(|(v, _)| *v).collect();
        let (there, radii): (Positions<D>, Vec<f64>) = (std::array::from_fn(|k| some(&positions[k])), some(&support));
        let by_those = closely(&there, &radii).reached(domain, &positions, &[]);
        let kept: Vec<usize> = (0..seen.len()).filter(|&i| seen[i] || by_those[i]).collect();
        Ok(Surroundings {
            positions: std::array::from_fn(|k| kept.iter().map(|&i| positions[k][i]).collect()),
            holds: kept.iter().map(|&i| if seen[i] { Hold::Held } else { Hold::Beyond }).collect(),
        })
    }

    /// Particles of other blocks that are not far from one, and their support radii.
    fn near(&self, kept: &Kept, block: usize) -> Result<(Positions<D>, Vec<f64>)> {
        let (mut positions, mut support): (Positions<D>, _) = (std::array::from_fn(|_| Vec::new()), Vec::new());
        let (domain, Some(own)) = (self.target.domain, &self.sights[block]) else { return Ok((positions, support)) };
        let meets = |other: usize| self.sights[other].as_ref().is_some_and(|s| own.may_meet(domain, s));
        for other in (0..kept.blocks()).filter(|&other| other != block && meets(other)) {
            let there = kept.there::<D>(other)?;
            let radii = self.supports(&there.positions);
            let is_near =
                parallel::map(radii.len(), |i| own.may_reach(domain, &at(&there.positions, i), FAR * radii[i]));
            for i in (0..radii.len()).filter(|&i| is_near[i]) {
                support.push(radii[i]);
                (0..D).for_each(|k| positions[k].push(there.positions[k][i]));
            }
        }
        Ok((positions, support))
    }
}

impl<const D: usize> Surroundings<D> {
    /// A block's own particles, followed by these, and what each may do.
    pub fn with(&self, own: &Positions<D>) -> (Positions<D>, Vec<Hold>) {
        let all = std::array::from_fn(|k| [own[k].as_slice(), &self.positions[k]].concat());
        let holds = vec![Hold::Free; own[0].len()].into_iter().chain(self.holds.iter().copied()).collect();
        (all, holds)
    }
}
