//! Moves particles that are too close to each other apart in small steps, with all that come into their way.

use super::pairs::{parted, partings_among};
use crate::target::{Positions, Target, at};
use sph::domain::Domain;
use sph::exchange::Exchange;
use sph::sums::Apart;

/// Distance over the mean spacing within which others may be in the way of those that part: they move by less than a spacing.
const IN_THE_WAY: f64 = 2.0;
/// Rounds after which the rest is left.
const ROUNDS: usize = 60;
/// No particle moves farther in a round, in the distance that it is to have.
const MAX_STEP: f64 = 0.1;

/// Which particles part, and how.
pub(super) struct Separation<'a, const D: usize> {
    pub exchange: &'a dyn Exchange,
    pub domain: &'a Domain<D>,
    pub target: &'a Target<'a, D>,
    /// That of each particle to others, of those at some positions.
    pub distance: &'a dyn Fn(&Positions<D>) -> Vec<f64>,
    /// What that is of two, and the part of it below which they are too close.
    pub close: (Apart, f64),
    pub may_move: &'a [bool],
    /// What is left of the shift of one of them.
    pub way: &'a (dyn Fn(usize, [f64; D]) -> [f64; D] + Sync),
}

impl<const D: usize> Separation<'_, D> {
    /// Parts those of `positions` that are `near`, by whose places in this list all else is told; says whether any moved, on whatever rank.
    pub fn of(&self, positions: &mut Positions<D>, near: Vec<usize>) -> bool {
        let mut those = positions.each_ref().map(|x| near.iter().map(|&i| x[i]).collect::<Vec<f64>>());
        let mut any = false;
        for round in 0..ROUNDS {
            if !self.exchange.any(self.once(&mut those, round as u64)) {
                break;
            }
            any = true;
        }
        for (place, i) in near.into_iter().enumerate() {
            (0..D).for_each(|k| positions[k][i] = those[k][place]);
        }
        any
    }

    /// One round: every particle that may move and is too close to another goes a part of the way; says whether any did.
    fn once(&self, those: &mut Positions<D>, round: u64) -> bool {
        let distance = (self.distance)(those);
        let found = partings_among(self.exchange, self.domain, those, |i| distance[i], self.close, round);
        let mut any = false;
        for (i, parting) in found.into_iter().filter(|(i, parting)| parting.paired && self.may_move[*i]) {
            let from = at(those, i);
            let shift = (self.way)(i, parting.shift);
            if let Some(x) = parted(self.target, self.domain, &from, &shift, MAX_STEP * distance[i])
                && x != from
            {
                (0..D).for_each(|k| those[k][i] = x[k]);
                any = true;
            }
        }
        any
    }
}

/// Those of `chosen`, and the particles that may be in their way.
pub(super) fn near<const D: usize>(
    (exchange, domain): (&dyn Exchange, &Domain<D>),
    positions: &Positions<D>,
    spacing: &[f64],
    chosen: &[bool],
) -> Vec<usize> {
    let reach = |i: usize| if chosen[i] { 2.0 * IN_THE_WAY * spacing[i] } else { 0.0 };
    let mut near = chosen.to_vec();
    for (i, parting) in partings_among(exchange, domain, positions, reach, (Apart::Mean, 1.0), 0) {
        near[i] |= parting.paired;
    }
    (0..near.len()).filter(|&i| near[i]).collect()
}
