//! What a block's particles see of the others', and what those see.

use super::kept::{Block, Kept, Left};
use crate::error::Result;
use crate::relaxation::Hold;
use crate::target::{Positions, Target, at};
use sph::kernel::support_over_spacing;
use sph::neighbors::{Seeing, Sights};
use sph::parallel;

/// Support radii away from a block within which are all that its particles see, and that those see in turn, as far as is known before these
/// are known; beyond it nothing is looked at closely.
const FAR: f64 = 2.5;
/// Boxes by which it is known about where a block is.
const BOXES: usize = 64;
/// Support radii within which particles are looked for that a block's own see, since these move by some half a spacing.
const MOVED: f64 = 1.2;

/// Where the particles of each block are, about, and what has come of its passes.
pub(super) struct Map<'a, const D: usize> {
    target: Target<'a, D>,
    /// Support radius over spacing.
    ratio: f64,
    sights: Vec<Option<Sights<D>>>,
    /// As [`Block::passes`], and how many particles each block has.
    passes: Vec<Vec<Left>>,
    own: Vec<usize>,
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
            passes: vec![Vec::new(); blocks],
            own: vec![0; blocks],
        }
    }

    /// How many times a block has been relaxed.
    pub fn passes(&self, block: usize) -> usize {
        self.passes[block].len()
    }

    /// The target over the summed density in all blocks after so many passes; none where it is resolved nowhere.
    pub fn common(&self, passes: usize) -> Option<f64> {
        let (sum, count) = self.left_by(passes).fold((0.0, 0.0), |(sum, count), (_, left)| {
            let [s, n] = left.ratio;
            (sum + s, count + n)
        });
        (count > 0.0).then(|| sum / count)
    }

    /// The mean deviation with which so many passes have left all blocks.
    pub fn left(&self, passes: usize) -> f64 {
        let (sum, count) = self.left_by(passes).fold((0.0, 0.0), |(sum, count), (own, left)| {
            let own = own as f64;
            (sum + left.mean * own, count + own)
        });
        sum / count
    }

    /// What so many passes have left of each block, and how many particles it has.
    fn left_by(&self, passes: usize) -> impl Iterator<Item = (usize, &Left)> {
        self.own
            .iter()
            .zip(&self.passes)
            .filter_map(move |(own, of_block)| Some((*own, of_block.get(passes.checked_sub(1)?)?)))
    }

    /// Takes note of a block as it is now.
    pub fn note(&mut self, block: usize, Block { passes, positions }: &Block<D>) {
        self.passes[block].clone_from(passes);
        self.own[block] = positions[0].len();
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
        let widened = |h: &[f64]| parallel::map(h.len(), |i| MOVED * h[i]);
        let seen = Seeing::new(own, &widened(&self.supports(own))).reach(domain, &positions, &widened(&support));
        let some = |values: &[f64]| values.iter().zip(&seen).filter(|(_, seen)| **seen).map(|(v, _)| *v).collect();
        let (there, radii): (Positions<D>, Vec<f64>) = (std::array::from_fn(|k| some(&positions[k])), some(&support));
        let by_those = Seeing::new(&there, &radii).reach(domain, &positions, &[]);
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
