//! Initial positions: exactly N of them, all where the target admits particles.

mod bisection;
mod cells;
mod random;

use crate::error::{Error, Result};
use crate::rng::{Purpose, keyed};
use crate::target::{Positions, Target, at};
use rand::RngExt;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How the initial positions are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Seeding {
    /// Recursive bisection into equal masses, one particle per part: no long-wave error from the start.
    #[default]
    MassBisection,
    /// Independent random positions with probability proportional to the target.
    Random,
}

/// Places `target.count` particles.
///
/// # Errors
/// A target without mass in its domain.
pub fn seed<const D: usize>(target: &Target<'_, D>, seeding: Seeding, seed: u64) -> Result<Positions<D>> {
    let cells = cells::partition(target);
    if !(cells.iter().map(|c| c.mass).sum::<f64>() > 0.0) {
        return Err(Error::Numeric { stage: "seed", problem: "the target is zero everywhere in the domain".into() });
    }
    let mut positions = match seeding {
        Seeding::MassBisection => bisection::place(target, cells),
        Seeding::Random => random::place(target, &cells, seed),
    };
    if seeding == Seeding::MassBisection {
        jitter(target, &mut positions, seed);
    }
    Ok(positions)
}

/// Jitter as a fraction of the local spacing. Bisection of a symmetric target gives a lattice, an unstable
/// equilibrium that relaxation leaves late and unevenly; a tenth of the spacing is enough to leave it at once.
const JITTER: f64 = 0.1;

fn jitter<const D: usize>(target: &Target<'_, D>, positions: &mut Positions<D>, seed: u64) {
    let moved: Vec<[f64; D]> = (0..positions[0].len())
        .into_par_iter()
        .map(|i| {
            let x = at(positions, i);
            let spacing = target.spacing(target.number_density(&x));
            let mut rng = keyed(seed, Purpose::SeedJitter, i as u64);
            let mut y = x.map(|v| v + JITTER * spacing * (2.0 * rng.random::<f64>() - 1.0));
            target.domain.wrap(&mut y);
            if target.admits(&y) { y } else { x }
        })
        .collect();
    for k in 0..D {
        positions[k].par_iter_mut().zip(&moved).for_each(|(x, y)| *x = y[k]);
    }
}
