//! The particles of other blocks that a block's particles see, and the particles that those see.

use super::kept::{Block, Kept, Left, Moved};
use crate::error::Result;
use crate::relaxation::Hold;
use crate::target::{Positions, Target, at};
use sph::kernel::support_over_spacing;
use sph::neighbors::{Seeing, Sights};
use sph::parallel;

/// Support radii away from a block within which are those that move with it, all that these and its own see, and what those see in turn, as far as is
/// known before these are known; beyond it nothing is looked at closely.
const FAR: f64 = 3.5;
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

/// Particles of other blocks about one; those that move with it come first.
pub(super) struct Surroundings<const D: usize> {
    pub positions: Positions<D>,
    pub holds: Vec<Hold>,
    whose: Vec<Whose>,
}

/// The block that a particle is of, and its place there.
#[derive(Debug, Clone, Copy)]
struct Whose {
    block: usize,
    place: usize,
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

    /// All of which the sums at a block's particles, which are `own`, are made, and those at particles that see these. With an `overlap` those that its
    /// particles see move with it, and count as its own for what is about them.
    ///
    /// # Errors
    /// Blocks that cannot be read.
    pub fn about(&self, kept: &Kept, (block, own): (usize, &Positions<D>), overlap: bool) -> Result<Surroundings<D>> {
        let domain = self.target.domain;
        let Near { positions, support, whose } = self.near(kept, block)?;
        let widened = |h: &[f64]| parallel::map(h.len(), |i| MOVED * h[i]);
        let radii = self.supports(own);
        let is_free = match overlap {
            true => Seeing::new(own, &radii).reach(domain, &positions, &[]),
            false => vec![false; support.len()],
        };
        let free: Vec<usize> = (0..support.len()).filter(|&i| is_free[i]).collect();
        let some = |x: &[f64], of: &[usize]| of.iter().map(|&i| x[i]).collect::<Vec<f64>>();
        let moving: Positions<D> = std::array::from_fn(|k| [own[k].as_slice(), &some(&positions[k], &free)].concat());
        let radii = [radii, some(&support, &free)].concat();
        let seen = Seeing::new(&moving, &widened(&radii)).reach(domain, &positions, &widened(&support));
        let held: Vec<usize> = (0..support.len()).filter(|&i| seen[i] && !is_free[i]).collect();
        let (there, radii) = (std::array::from_fn(|k| some(&positions[k], &held)), some(&support, &held));
        let by_those = Seeing::new(&there, &radii).reach(domain, &positions, &[]);
        let is_beyond = |i: &usize| by_those[*i] && !seen[*i] && !is_free[*i];
        let beyond: Vec<usize> = (0..support.len()).filter(is_beyond).collect();
        let holds = [(Hold::Free, free.len()), (Hold::Held, held.len()), (Hold::Beyond, beyond.len())];
        let all = [free, held, beyond].concat();
        Ok(Surroundings {
            positions: std::array::from_fn(|k| some(&positions[k], &all)),
            holds: holds.into_iter().flat_map(|(hold, count)| std::iter::repeat_n(hold, count)).collect(),
            whose: all.iter().map(|&i| whose[i]).collect(),
        })
    }

    /// Particles of other blocks that are not far from one.
    fn near(&self, kept: &Kept, block: usize) -> Result<Near<D>> {
        let mut near = Near { positions: std::array::from_fn(|_| Vec::new()), support: Vec::new(), whose: Vec::new() };
        let (domain, Some(own)) = (self.target.domain, &self.sights[block]) else { return Ok(near) };
        let meets = |other: usize| self.sights[other].as_ref().is_some_and(|s| own.may_meet(domain, s));
        for other in (0..kept.blocks()).filter(|&other| other != block && meets(other)) {
            let there = kept.there::<D>(other)?;
            let radii = self.supports(&there.positions);
            let is_near =
                parallel::map(radii.len(), |i| own.may_reach(domain, &at(&there.positions, i), FAR * radii[i]));
            for i in (0..radii.len()).filter(|&i| is_near[i]) {
                near.support.push(radii[i]);
                near.whose.push(Whose { block: other, place: i });
                (0..D).for_each(|k| near.positions[k].push(there.positions[k][i]));
            }
        }
        Ok(near)
    }
}

/// Particles of other blocks, and their support radii.
struct Near<const D: usize> {
    positions: Positions<D>,
    support: Vec<f64>,
    whose: Vec<Whose>,
}

impl<const D: usize> Surroundings<D> {
    /// A block's own particles, followed by these, and what each may do.
    pub fn with(&self, own: &Positions<D>) -> (Positions<D>, Vec<Hold>) {
        let all = std::array::from_fn(|k| [own[k].as_slice(), &self.positions[k]].concat());
        let holds = vec![Hold::Free; own[0].len()].into_iter().chain(self.holds.iter().copied()).collect();
        (all, holds)
    }

    /// Those that move with the block.
    pub fn free(&self) -> usize {
        self.holds.iter().take_while(|hold| **hold == Hold::Free).count()
    }

    /// Those that have moved with the block, by the blocks that they are of, where `all` are this block's `own` particles and these.
    pub fn moved(&self, all: &Positions<D>, own: usize) -> Vec<Moved<D>> {
        let mut blocks: Vec<Moved<D>> = Vec::new();
        // Those of a block follow each other.
        for (i, &Whose { block, place }) in self.whose[..self.free()].iter().enumerate() {
            if blocks.last().is_none_or(|last| last.block != block) {
                blocks.push(Moved { block, places: Vec::new(), positions: std::array::from_fn(|_| Vec::new()) });
            }
            let Some(last) = blocks.last_mut() else { continue };
            last.places.push(place);
            (0..D).for_each(|k| last.positions[k].push(all[k][own + i]));
        }
        blocks
    }
}
