//! Blocks of particles that are seeded independently: in several processes, or one after the other.
//!
//! Mass bisection numbers particles along its cuts, so that particles of successive numbers lie together, and places each
//! from the target alone; so do shells, which number theirs from the inside out. A block is a range of numbers; its positions are to the
//! bit those of a whole run, whatever the other blocks are.

use super::bisection;
use super::name::Seeding;
use super::parting::Parting;
use super::shells::{Covering, Shells};
use crate::error::{Error, Result};
use crate::target::{Positions, Selected, Surroundings, Target, at};
use sph::parallel;
use std::ops::Range;

/// A part of the particles.
#[derive(Debug, Clone, PartialEq)]
pub struct Block<const D: usize> {
    /// Their numbers, from 0.
    pub particles: Range<usize>,
    /// Boxes that together hold their shares of the mass, in the unit of the domain's size.
    pub boxes: Vec<[[f64; D]; 2]>,
}

/// Divides the particles into `count` blocks of equal numbers, but for one particle. O(count log N).
///
/// # Errors
/// A target without mass in its domain.
pub fn blocks<const D: usize>(target: &Target<'_, D>, count: usize) -> Result<Vec<Block<D>>> {
    let edge = |k: usize| (target.count as u128 * k as u128 / count.max(1) as u128) as usize;
    let block = |k: usize| {
        let particles = edge(k)..edge(k + 1);
        let mut boxes = Vec::new();
        each_region(target, &particles, |target, own| {
            boxes.extend(bisection::cover(target, &own)?);
            Ok(())
        })?;
        Ok(Block { particles, boxes })
    };
    (0..count).map(block).collect()
}

/// Initial positions of which any block can be made without the rest.
pub struct Blockwise<'a, const D: usize> {
    pub(super) target: &'a Target<'a, D>,
    pub(super) seed: u64,
    /// Of each region with the number of its first particle; none if the seeding is mass bisection.
    pub(super) shells: Option<Vec<(usize, Shells<D>)>>,
}

/// Particles that are made at a time where they are dealt out to blocks.
const AT_A_TIME: usize = 1 << 20;

const BLOCKWISE: [Seeding; 3] = [Seeding::MassBisection, Seeding::Shells, Seeding::EqualAreaShells];

impl<'a, const D: usize> Blockwise<'a, D> {
    /// Whether it is a seeding that goes block by block.
    pub fn can_make(seeding: Seeding) -> bool {
        BLOCKWISE.contains(&seeding)
    }

    /// # Errors
    /// A seeding that does not go block by block.
    pub fn refuse_others(seeding: Seeding) -> Result<()> {
        if Self::can_make(seeding) { Ok(()) } else { Err(Self::not_blockwise(seeding)) }
    }

    fn not_blockwise(seeding: Seeding) -> Error {
        let able = BLOCKWISE.map(|s| s.method().name).join(", ");
        let problem = format!("is {}, which does not go block by block; use {able}", seeding.method().name);
        Error::scene("seeding", problem)
    }

    /// # Errors
    /// Other seedings than by mass bisection and on shells, and those of [`seed`](super::seed).
    pub fn new(target: &'a Target<'a, D>, seeding: Seeding, seed: u64) -> Result<Self> {
        let method = seeding.method();
        let covering = match seeding {
            Seeding::MassBisection => return Ok(Self { target, seed, shells: None }),
            Seeding::Shells => Covering::Spiral,
            Seeding::EqualAreaShells => Covering::EqualArea,
            other => return Err(Self::not_blockwise(other)),
        };
        method.check_dimension(D)?;
        let (mut shells, mut first) = (Vec::new(), 0);
        each_region(target, &(0..target.count), |region, own| {
            shells.push((first, Shells::new(region, covering, method, seed)?));
            first += own.len();
            Ok(())
        })?;
        Ok(Self { target, seed, shells: Some(shells) })
    }

    /// The positions of all particles within a distance of each of some places.
    ///
    /// # Errors
    /// A target without mass in its domain.
    pub fn near(&self, about: &[Surroundings<D>]) -> Result<Vec<Positions<D>>> {
        let mut all: Vec<Positions<D>> = about.iter().map(|_| std::array::from_fn(|_| Vec::new())).collect();
        let mut extend =
            |a: usize, some: Positions<D>| all[a].iter_mut().zip(some).for_each(|(all, one)| all.extend(one));
        if let Some(shells) = &self.shells {
            about
                .iter()
                .enumerate()
                .for_each(|(a, about)| shells.iter().for_each(|(_, own)| extend(a, own.near(about))));
            return Ok(all);
        }
        each_region(self.target, &(0..self.target.count), |region, _| {
            let found = bisection::near(region, self.seed, about)?;
            found.into_iter().enumerate().for_each(|(a, some)| extend(a, some));
            Ok(())
        })?;
        Ok(all)
    }

    /// Blocks that are about as deep as they are wide, of as many particles as lie there; none where those of successive numbers do so by themselves.
    ///
    /// # Errors
    /// A target without mass in its domain.
    pub fn parting(&self, blocks: usize) -> Result<Option<Parting<D>>> {
        self.shells.as_ref().map(|_| Parting::new(self.target, blocks)).transpose()
    }

    /// The positions of all particles of some blocks, by their numbers in each. All particles are made, and the others left out.
    ///
    /// # Errors
    /// A target without mass in its domain.
    pub fn parted(&self, parting: &Parting<D>, blocks: Range<usize>) -> Result<Vec<Positions<D>>> {
        let mut parts: Vec<Positions<D>> = blocks.clone().map(|_| std::array::from_fn(|_| Vec::new())).collect();
        for start in (0..self.target.count).step_by(AT_A_TIME) {
            let some = self.positions(start..self.target.count.min(start + AT_A_TIME))?;
            let whose = parallel::map(some[0].len(), |i| parting.block_of(&at(&some, i)));
            for (i, block) in whose.into_iter().enumerate().filter(|(_, block)| blocks.contains(block)) {
                (0..D).for_each(|k| parts[block - blocks.start][k].push(some[k][i]));
            }
        }
        Ok(parts)
    }

    /// The positions of the particles of some numbers, which ascend.
    ///
    /// # Errors
    /// A target without mass in its domain.
    pub fn each(&self, numbers: &[usize]) -> Result<Vec<[f64; D]>> {
        if self.shells.is_some() {
            return numbers.iter().map(|&i| Ok(at(&self.positions(i..i + 1)?, 0))).collect();
        }
        let (mut all, mut first) = (Vec::with_capacity(numbers.len()), 0);
        each_region(self.target, &(0..self.target.count), |region, own| {
            let here = numbers.iter().filter(|i| (first..first + own.len()).contains(i)).map(|i| i - first);
            let here: Vec<usize> = here.collect();
            first += own.len();
            if !here.is_empty() {
                all.extend(bisection::place_each(region, self.seed, &here)?);
            }
            Ok(())
        })?;
        Ok(all)
    }

    /// The positions of some particles.
    ///
    /// # Errors
    /// A target without mass in its domain.
    pub fn positions(&self, particles: Range<usize>) -> Result<Positions<D>> {
        let Some(shells) = &self.shells else { return seed_block(self.target, self.seed, particles) };
        let mut all: Positions<D> = std::array::from_fn(|_| Vec::with_capacity(particles.len()));
        for (i, (first, own)) in shells.iter().enumerate() {
            let end = shells.get(i + 1).map_or(self.target.count, |(next, _)| *next);
            let clamp = |i: usize| i.clamp(*first, end) - first;
            let part = own.positions(clamp(particles.start)..clamp(particles.end));
            all.iter_mut().zip(part).for_each(|(all, one)| all.extend(one));
        }
        Ok(all)
    }
}

/// The initial positions of some particles by mass bisection.
///
/// # Errors
/// A target without mass in its domain.
pub fn seed_block<const D: usize>(target: &Target<'_, D>, seed: u64, particles: Range<usize>) -> Result<Positions<D>> {
    let mut all: Positions<D> = std::array::from_fn(|_| Vec::with_capacity(particles.len()));
    each_region(target, &particles, |target, own| {
        let positions = bisection::place_block(target, seed, own)?;
        all.iter_mut().zip(positions).for_each(|(all, one)| all.extend(one));
        Ok(())
    })?;
    Ok(all)
}

/// Calls `with` for each region that has some of the particles, with their numbers there.
pub(super) fn each_region<const D: usize>(
    target: &Target<'_, D>,
    particles: &Range<usize>,
    mut with: impl FnMut(&Target<'_, D>, Range<usize>) -> Result<()>,
) -> Result<()> {
    let Some(regions) = target.regions() else { return with(target, particles.clone()) };
    let mut first = 0;
    for (region, count) in regions.counts(target.count).into_iter().enumerate() {
        let clamp = |i: usize| i.clamp(first, first + count) - first;
        let own = clamp(particles.start)..clamp(particles.end);
        if !own.is_empty() {
            with(&target.selected(regions, Selected::Region(region), count), own)?;
        }
        first += count;
    }
    Ok(())
}
