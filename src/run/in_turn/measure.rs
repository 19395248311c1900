//! What is measured of blocks one after the other, and the figures over all of them.

use super::kept::{Kept, Left, Sums, Sweep};
use crate::error::{Error, Result};
use crate::metrics::{DensityFold, ErrorFigures, Ledger, LedgerFigures, Measured, Ratios};
use crate::scene::Scene;
use crate::target::{Positions, Target, at};
use serde::Serialize;
use sph::neighbors::{Reach, Sources, Tree};
use sph::sums::{density, support_guess};

/// Density errors over a set of particles, the mass as given and re-fitted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SetFigures {
    pub as_given: ErrorFigures,
    pub refitted: ErrorFigures,
}

/// Figures over all blocks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BlockFigures {
    pub all: SetFigures,
    /// None where no particle is in the interior.
    pub interior: Option<SetFigures>,
    pub ledger: LedgerFigures,
    /// Mean deviation, re-fitted in the interior, of particles that see others of another block, and of the rest of them.
    pub seams: Option<[f64; 2]>,
    /// Smallest distance of two particles in spacings.
    pub closest_pair: f64,
}

impl BlockFigures {
    /// What decides whether blocks are gone over again that were left with such a mean deviation.
    pub(super) fn sweep(&self, left: f64) -> Sweep {
        let mean = self.interior.map_or(self.all.refitted.mean, |interior| interior.refitted.mean);
        Sweep { mean, left, seams: self.seams }
    }
}

/// The first of some particles.
fn first<const D: usize>(all: &Positions<D>, count: usize) -> Positions<D> {
    all.each_ref().map(|x| x[..count].to_vec())
}

/// The sums at `own` particles among others that follow them.
fn sums<const D: usize>(
    scene: &Scene,
    target: &Target<'_, D>,
    (all, own): (&Positions<D>, usize),
) -> (Sums, Measured<D>) {
    let neighbors = scene.kernel_neighbors(D);
    let masses = target.equal_masses(all[0].len());
    let spacing = |i: usize| target.spacing(target.number_density(&at(all, i))).min(target.domain.size());
    let guess = support_guess::<D>(neighbors, all[0].len(), spacing);
    let mut measured = Measured::new(scene.kernel(), target.domain, all, &masses, &guess, neighbors);
    let groups = measured.groups();
    measured.leave_out_unresolved(target, all, (&groups, neighbors));
    let sums = Sums {
        support: measured.support[..own].to_vec(),
        density: measured.sums[..own].iter().map(|s| s.weighted).collect(),
        target: target.densities(&first(all, own)),
        interior: measured.interior[..own].to_vec(),
        seam: Vec::new(),
    };
    (sums, measured)
}

/// What decides whether a block is taken as a stage has left it.
#[derive(Clone, Copy)]
pub(super) struct Judged {
    pub left: Left,
    /// Smallest distance of one of its particles to any in spacings.
    pub closest_pair: f64,
}

/// Judges `own` particles among others that follow them, with a factor on the mass or what fits best.
pub(super) fn judged<const D: usize>(
    scene: &Scene,
    target: &Target<'_, D>,
    (all, own): (&Positions<D>, usize),
    factor: Option<f64>,
) -> Judged {
    let (sums, measured) = sums(scene, target, (all, own));
    let left = Left { ratio: sums.ratio(), mean: sums.mean_error(factor) };
    Judged { left, closest_pair: closest(&measured, target, own) }
}

/// Smallest distance of one of the first particles to any in spacings.
fn closest<const D: usize>(measured: &Measured<D>, target: &Target<'_, D>, own: usize) -> f64 {
    measured.nearest_over_spacing(target.domain)[..own].iter().fold(f64::INFINITY, |least, d| least.min(*d))
}

impl Sums {
    /// With the volume of particles that all have the mass `m`.
    fn ratios(&self, m: f64) -> Ratios<'_> {
        Ratios { density: &self.density, target: &self.target, mass: m }
    }

    /// Whether each particle is counted: all; those of the interior; those of it that see another block; those that do not.
    fn sets(&self) -> [Vec<bool>; 4] {
        let interior = &self.interior;
        let inside = |sees: bool| interior.iter().zip(&self.seam).map(|(i, seam)| *i && *seam == sees).collect();
        [vec![true; interior.len()], interior.clone(), inside(true), inside(false)]
    }

    /// Mean deviation where the target is resolved, the mass re-fitted by `factor` or what fits best, or over all where it is nowhere.
    fn mean_error(&self, factor: Option<f64>) -> f64 {
        let any = self.interior.contains(&true);
        let counts = |i: usize| self.interior[i] || !any;
        let mean = |f: &dyn Fn(usize) -> f64| {
            let (sum, count) =
                (0..self.density.len()).filter(|&i| counts(i)).fold((0.0, 0.0), |(s, n), i| (s + f(i), n + 1.0));
            sum / count
        };
        let factor = factor.unwrap_or_else(|| mean(&|i| self.target[i] / self.density[i]));
        mean(&|i| (factor * self.density[i] / self.target[i] - 1.0).abs())
    }

    /// The target over the summed density where it is resolved, added up, and over how many particles.
    fn ratio(&self) -> [f64; 2] {
        let inside = (0..self.density.len()).filter(|&i| self.interior[i]);
        inside.fold([0.0; 2], |[sum, count], i| [sum + self.target[i] / self.density[i], count + 1.0])
    }
}

/// Takes up blocks one by one.
pub(super) struct Measuring<'a, const D: usize> {
    scene: &'a Scene,
    target: Target<'a, D>,
    ledger: Ledger<D>,
    found: Vec<f64>,
    closest_pair: f64,
}

impl<'a, const D: usize> Measuring<'a, D> {
    pub fn new(scene: &'a Scene, target: Target<'a, D>) -> Self {
        Self { scene, target, ledger: Ledger::new(&target), found: Vec::new(), closest_pair: f64::INFINITY }
    }

    /// Measures a block's `own` particles among the others that follow them.
    pub fn take(&mut self, all: &Positions<D>, own: usize) -> Sums {
        let (mut sums, measured) = sums(self.scene, &self.target, (all, own));
        let first = first(all, own);
        sums.seam = self.see_others((&first, &sums.support), &all.each_ref().map(|x| x[own..].to_vec()));
        let there = self.ledger.found(&measured, &self.target, &first, &self.target.equal_masses(own));
        self.found.resize(there.len(), 0.0);
        self.found.iter_mut().zip(there).for_each(|(all, one)| *all += one);
        self.closest_pair = self.closest_pair.min(closest(&measured, &self.target, own));
        sums
    }

    /// Whether others are within the support of each particle.
    fn see_others(&self, (own, support): (&Positions<D>, &[f64]), others: &Positions<D>) -> Vec<bool> {
        if others[0].is_empty() {
            return vec![false; support.len()];
        }
        let (here, there) = (Tree::build(own), Tree::build(others));
        let (radii, units) = (here.to_tree_order(support), [vec![1.0; support.len()], vec![1.0; there.len()]]);
        let sources = [
            Sources::new(&here, &radii, [units[0].as_slice()], Reach::Target).silent(),
            Sources::new(&there, &[], [units[1].as_slice()], Reach::Target),
        ];
        let mut seen = vec![false; support.len()];
        let found = density::<D, 1, f32>(self.scene.kernel(), self.target.domain, &sources);
        found.iter().zip(here.order()).for_each(|(sums, &i)| seen[i as usize] = sums.weighted > 0.0);
        seen
    }

    /// The figures, from what was kept of all blocks.
    ///
    /// # Errors
    /// Blocks that cannot be read.
    pub fn figures(self, kept: &Kept) -> Result<BlockFigures> {
        let mass = self.target.mass / self.target.count as f64;
        let each = |with: &mut dyn FnMut(&Ratios<'_>, &[Vec<bool>; 4])| -> Result<()> {
            (0..kept.blocks()).try_for_each(|block| {
                let sums = kept.sums(block)?;
                with(&sums.ratios(mass), &sums.sets());
                Ok(())
            })
        };
        // Of all particles, and of the interior, of which those near seams and the others are parts.
        let mut fits = [DensityFold::default(), DensityFold::default()];
        each(&mut |ratios, sets| fits.iter_mut().zip(sets).for_each(|(fit, set)| fit.look(ratios, set)))?;
        each(&mut |ratios, sets| fits.iter_mut().zip(sets).for_each(|(fit, set)| fit.refit(ratios, set)))?;
        let [all, interior] = &fits;
        let mut as_given = [all.with(1.0), interior.with(1.0)];
        let mut refitted = [all, interior, interior, interior].map(|fit| fit.with(fit.factor()));
        each(&mut |ratios, sets| {
            as_given.iter_mut().zip(sets).for_each(|(fold, set)| fold.take(ratios, set));
            refitted.iter_mut().zip(sets).for_each(|(fold, set)| fold.take(ratios, set));
        })?;
        let [all, interior] = [0, 1].map(|set| {
            let both = as_given[set].figures().zip(refitted[set].figures());
            both.map(|(as_given, refitted)| SetFigures { as_given, refitted })
        });
        let nowhere = || Error::Numeric { stage: "measure", problem: "no particle has a density".into() };
        let (all, ledger) = (all.ok_or_else(nowhere)?, self.ledger.figures_of(&self.found));
        let seams = refitted[2].figures().zip(refitted[3].figures()).map(|(near, rest)| [near.mean, rest.mean]);
        Ok(BlockFigures { all, interior, ledger, seams, closest_pair: self.closest_pair })
    }
}
