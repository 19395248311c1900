//! Measures of blocks, taken one after the other, and the figures over all of them.

use super::kept::{Kept, Left, Sums, Sweep};
use crate::error::{Error, Result};
use crate::metrics::{
    DensityFold, ErrorFigures, Ledger, LedgerFigures, Looking, Measured, Ratios, least_closest_pair, smoothed_densities,
};
use crate::scene::Scene;
use crate::target::mass_points::MassPoints;
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
    /// Of all particles against the target as the kernel sees it.
    pub smoothed: SetFigures,
    /// Mean deviation of those that can have it from what particles aim at, the mass re-fitted.
    #[serde(skip)]
    aimed: f64,
    /// The factor by which the interior is re-fitted.
    pub refit_interior: Option<f64>,
    pub ledger: LedgerFigures,
    /// Mean deviation, re-fitted in the interior, of particles that see others of another block, and of the rest of them; from the smoothed
    /// target where they aim at that.
    pub seams: Option<[f64; 2]>,
    /// Smallest distance of two particles in spacings.
    pub closest_pair: f64,
}

impl BlockFigures {
    /// What decides whether blocks are gone over again that were left with such a mean deviation.
    pub(super) fn sweep(&self, left: f64) -> Sweep {
        Sweep { mean: self.aimed, left, seams: self.seams, epsilon: self.stated() }
    }

    /// epsilon that a tolerance bounds, as in [`DensityError::stated`](crate::metrics::DensityError::stated).
    pub fn stated(&self) -> f64 {
        self.interior.unwrap_or(self.all).refitted.epsilon
    }
}

/// The first of some particles.
fn first<const D: usize>(all: &Positions<D>, count: usize) -> Positions<D> {
    all.each_ref().map(|x| x[..count].to_vec())
}

/// All but the first of some particles.
fn rest<const D: usize>(all: &Positions<D>, count: usize) -> Positions<D> {
    all.each_ref().map(|x| x[count..].to_vec())
}

/// Whether others are within the support of each particle.
fn see_others<const D: usize>(
    scene: &Scene,
    target: &Target<'_, D>,
    (own, support): (&Positions<D>, &[f64]),
    others: &Positions<D>,
) -> Vec<bool> {
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
    let found = density::<D, 1, f32>(scene.kernel(), target.domain, &sources);
    found.iter().zip(here.order()).for_each(|(sums, &i)| seen[i as usize] = sums.weighted > 0.0);
    seen
}

/// The sums at `own` particles among others that follow them, with the points of mass about these where they aim at the smoothed target.
fn sums<const D: usize>(
    scene: &Scene,
    target: &Target<'_, D>,
    (all, own): (&Positions<D>, usize),
    points: Option<&MassPoints<D>>,
) -> (Sums, Measured<D>) {
    let neighbors = scene.kernel_neighbors(D);
    let masses = target.equal_masses(all[0].len());
    let spacing = |i: usize| target.spacing(target.number_density(&at(all, i))).min(target.domain.size());
    let guess = support_guess::<D>(neighbors, all[0].len(), spacing);
    let mut measured = Measured::new(scene.kernel(), target.domain, all, &masses, &guess, neighbors);
    let groups = measured.groups();
    measured.leave_out_unresolved(target, all, (&groups, neighbors));
    let (own_places, support) = (first(all, own), &measured.support[..own]);
    let aim = points.map_or_else(Vec::new, |points| {
        points.mass_densities(scene.kernel(), target.domain, (&own_places, support), target.mass)
    });
    let sums = Sums {
        support: support.to_vec(),
        density: measured.sums[..own].iter().map(|s| s.weighted).collect(),
        target: target.densities(&own_places),
        aim,
        smoothed: Vec::new(),
        interior: measured.interior[..own].to_vec(),
        seam: Vec::new(),
    };
    (sums, measured)
}

/// What decides whether a block is taken as a stage has left it.
#[derive(Clone, Copy)]
pub(super) struct Judged {
    pub left: Left,
    /// Mean deviation of those of its particles that see others, and of the others' that move with it; none where none do.
    seam: Option<f64>,
    /// Smallest distance of one of its particles to any in spacings.
    closest_pair: f64,
}

/// Mean deviation over that before with which a block is taken whose seams have gained.
const HARDLY_WORSE: f64 = 1.1;

impl Judged {
    /// Whether it is to take the place of what `was`.
    pub fn is_better_than(&self, was: &Self) -> bool {
        let seams_gain = self.seam.zip(was.seam).is_some_and(|(is, was)| is < was);
        let most = if seams_gain { HARDLY_WORSE } else { 1.0 };
        self.left.mean <= most * was.left.mean && self.closest_pair >= least_closest_pair(was.closest_pair)
    }
}

/// Judges a block's `own` particles and those of others that are `free` with them, the first of all, with a factor on the mass or what fits best, by the
/// target or, with points of mass about them, by the smoothed one.
pub(super) fn judged<const D: usize>(
    scene: &Scene,
    target: &Target<'_, D>,
    (all, own, free): (&Positions<D>, usize, usize),
    (factor, points): (Option<f64>, Option<&MassPoints<D>>),
) -> Judged {
    let both = own + free;
    let (mut sums, measured) = sums(scene, target, (all, both), points);
    let left = Left { ratio: sums.ratio(), mean: sums.mean_error(factor, &|_| true) };
    let seam = (free > 0).then(|| {
        sums.seam = see_others(scene, target, (&first(all, own), &sums.support[..own]), &rest(all, own));
        sums.mean_error(factor, &|i| i >= own || sums.seam[i])
    });
    Judged { left, seam, closest_pair: closest(&measured, target, both) }
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

    /// With the target as the kernel sees it in place of the target.
    fn as_seen(&self, m: f64) -> Ratios<'_> {
        Ratios { target: &self.smoothed, ..self.ratios(m) }
    }

    /// With what particles aim at in place of the target.
    fn aimed(&self, m: f64) -> Ratios<'_> {
        Ratios { target: self.aims(), ..self.ratios(m) }
    }

    /// What the particles aim at.
    fn aims(&self) -> &[f64] {
        if self.aim.is_empty() { &self.target } else { &self.aim }
    }

    /// Whether a particle can have what it aims at.
    fn can(&self, i: usize) -> bool {
        if self.aim.is_empty() { self.interior[i] } else { self.aim[i] > 0.0 }
    }

    /// Whether each particle is counted: all, twice; those of the interior; all that can have what they aim at; those of them that see another
    /// block; those that do not.
    fn sets(&self) -> [Vec<bool>; 6] {
        let all = 0..self.interior.len();
        let can = |sees: &dyn Fn(bool) -> bool| all.clone().map(|i| self.can(i) && sees(self.seam[i])).collect();
        let all_are = vec![true; all.len()];
        [all_are.clone(), all_are, self.interior.clone(), can(&|_| true), can(&|sees| sees), can(&|sees| !sees)]
    }

    /// Mean deviation of some particles where the target is resolved, the mass re-fitted by `factor` or what fits best, or over all where it is nowhere.
    fn mean_error(&self, factor: Option<f64>, of: &dyn Fn(usize) -> bool) -> f64 {
        let any = (0..self.density.len()).any(|i| self.can(i));
        let (aims, counts) = (self.aims(), |i: usize| self.can(i) || !any);
        let mean = |of: &dyn Fn(usize) -> bool, f: &dyn Fn(usize) -> f64| {
            let among = (0..self.density.len()).filter(|&i| counts(i) && of(i));
            let (sum, count) = among.fold((0.0, 0.0), |(s, n), i| (s + f(i), n + 1.0));
            sum / count
        };
        let factor = factor.unwrap_or_else(|| mean(&|_| true, &|i| aims[i] / self.density[i]));
        mean(of, &|i| (factor * self.density[i] / aims[i] - 1.0).abs())
    }

    /// The target over the summed density where it is resolved, added up, and over how many particles.
    fn ratio(&self) -> [f64; 2] {
        let inside = (0..self.density.len()).filter(|&i| self.can(i));
        inside.fold([0.0; 2], |[sum, count], i| [sum + self.aims()[i] / self.density[i], count + 1.0])
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

    /// Measures a block's `own` particles among the others that follow them, with points of mass about them where they aim at the smoothed
    /// target.
    pub fn take(&mut self, all: &Positions<D>, own: usize, points: Option<&MassPoints<D>>) -> Sums {
        let (mut sums, measured) = sums(self.scene, &self.target, (all, own), points);
        let first = first(all, own);
        let looking = Looking { positions: &first, support: &sums.support, together: None };
        let by = (&self.target, Some(&self.ledger));
        sums.smoothed = smoothed_densities(self.scene.kernel(), by, &looking, &mut sums.interior);
        sums.seam = see_others(self.scene, &self.target, (&first, &sums.support), &rest(all, own));
        let there = self.ledger.found(&measured, &self.target, &first, &self.target.equal_masses(own));
        self.found.resize(there.len(), 0.0);
        self.found.iter_mut().zip(there).for_each(|(all, one)| *all += one);
        self.closest_pair = self.closest_pair.min(closest(&measured, &self.target, own));
        sums
    }

    /// The figures, from what was kept of all blocks.
    ///
    /// # Errors
    /// Blocks that cannot be read.
    pub fn figures(self, kept: &Kept) -> Result<BlockFigures> {
        let mass = self.target.mass / self.target.count as f64;
        // Of all particles against the target and as the kernel sees it, and of the interior; against what they aim at of those that can have it, of
        // which those near seams and the others are parts.
        let each = |with: &mut dyn FnMut(usize, &Ratios<'_>, &[bool])| -> Result<()> {
            (0..kept.blocks()).try_for_each(|block| {
                let sums = kept.sums(block)?;
                let (ratios, seen, aimed) = (sums.ratios(mass), sums.as_seen(mass), sums.aimed(mass));
                let of = [&ratios, &seen, &ratios, &aimed, &aimed, &aimed];
                sums.sets().iter().zip(of).enumerate().for_each(|(i, (set, ratios))| with(i, ratios, set));
                Ok(())
            })
        };
        let mut fits = [0; 4].map(|_| DensityFold::default());
        each(&mut |i, ratios, set| fits.get_mut(i).into_iter().for_each(|fit| fit.look(ratios, set)))?;
        each(&mut |i, ratios, set| fits.get_mut(i).into_iter().for_each(|fit| fit.refit(ratios, set)))?;
        let [whole, seen, inside, aim] = &fits;
        let mut as_given = [whole, seen, inside].map(|fit| fit.with(1.0));
        let mut refitted = [whole, seen, inside, aim, aim, aim].map(|fit| fit.with(fit.factor()));
        each(&mut |i, ratios, set| {
            as_given.get_mut(i).into_iter().for_each(|fold| fold.take(ratios, set));
            refitted[i].take(ratios, set);
        })?;
        let [all, smoothed, interior] = [0, 1, 2].map(|set| {
            let both = as_given[set].figures().zip(refitted[set].figures());
            both.map(|(as_given, refitted)| SetFigures { as_given, refitted })
        });
        let nowhere = || Error::Numeric { stage: "measure", problem: "no particle has a density".into() };
        let (all, smoothed) = all.zip(smoothed).ok_or_else(nowhere)?;
        let aimed = refitted[3].figures().or(interior.map(|of| of.refitted)).unwrap_or(all.refitted).mean;
        let seams = refitted[4].figures().zip(refitted[5].figures()).map(|(near, rest)| [near.mean, rest.mean]);
        let (ledger, refit_interior) = (self.ledger.figures_of(&self.found), interior.map(|_| inside.factor()));
        Ok(BlockFigures {
            all,
            interior,
            smoothed,
            aimed,
            refit_interior,
            ledger,
            seams,
            closest_pair: self.closest_pair,
        })
    }
}
