//! The aim of the density solver where no sum over neighbors can follow the target: the target smoothed by the kernel.
//!
//! With the target's points of mass ([`crate::target::mass_points`]) the smoothed density at a particle is a sum as its own is, at the
//! support radius that belongs to it: n_s(x, H) with H = eta (kappa/n_s)^(1/d). It varies over a spacing or so, and is followed between
//! two looks by its gradient along which H follows, in ln n_s. A particle aims at n*^(1 - s) n_s^s, s going from 0 where the target is resolved to 1.
//!
//! The pressure energy sum_i n_i/n_s,i is not at rest at n = n* where smoothing matters: int n (W n)/n_s changes by
//! 1 + psi, psi(x) = int W(|x - y|, H(y)) n*(y)/n_s(y) d^d y, which varies about a layer. A potential -psi holds particles against that.

use super::snapshot::rows;
use crate::metrics::LedgerOf;
use crate::target::mass_points::MassPoints;
use crate::target::{Positions, Target, at};
use serde::{Deserialize, Serialize};
use sph::domain::Domain;
use sph::kernel::KernelName;
use sph::nearest::Nearest;
use sph::parallel;
use sph::sums::DensitySums;
use std::sync::Arc;

/// Sharpness of the target ([`Target::sharpness`]) up to which particles aim at the target alone, and from which on at the smoothed one alone.
const RESOLVED: f64 = 1.5;
const UNRESOLVED: f64 = 2.0;
/// What the error of a particle counts that aims at the smoothed target alone: some percent are enough there, and even distances matter. In space, where
/// particles have more ways around each other, it is more: with a tenth the mass of steep bodies moved by several times as much there, while lines and
/// planes came out with closer pairs and larger errors where it counted as much.
const fn weight_of_unresolved(d: usize) -> f64 {
    if d < 3 { 0.1 } else { 0.3 }
}

/// Spacings by which a particle may move before aims are looked for anew: of what is too steep for sums a gradient tells little farther off.
const FAR: f64 = 0.05;

/// What a clump is taken for, between it and a filament, and the longest of Newton's steps, in ln H.
const LEAST_PART: f64 = 0.2;
const LONGEST: f64 = 1.0;

/// Radii of a point within which a particle may come to be that feels it, from the first look on.
const MARGIN: f64 = 1.5;

/// Radii over which n_s is followed by its gradient from the middle of some points to each of them, and the change of ln n_s, at most.
const NEAR: f64 = 0.25;
const MOST_CHANGE: f64 = 0.5;

/// Aims of particles, in their order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Aims<const D: usize> {
    /// How much each aims at the smoothed target.
    share: Vec<f64>,
    /// ln n_s and its gradient where it was looked for.
    logarithm: Vec<f64>,
    #[serde(with = "rows")]
    slope: Vec<[f64; D]>,
    #[serde(with = "rows")]
    place: Vec<[f64; D]>,
    /// The gradient of psi.
    #[serde(with = "rows")]
    drift: Vec<[f64; D]>,
}

/// How much a particle aims at the smoothed target where the target is so sharp.
pub(super) fn share(sharpness: f64) -> f64 {
    ((sharpness - RESOLVED) / (UNRESOLVED - RESOLVED)).clamp(0.0, 1.0)
}

impl<const D: usize> Aims<D> {
    /// Not looked for yet.
    pub fn new(share: Vec<f64>) -> Self {
        let n = share.len();
        Self {
            share,
            logarithm: vec![0.0; n],
            slope: vec![[0.0; D]; n],
            place: vec![[0.0; D]; n],
            drift: vec![[0.0; D]; n],
        }
    }

    /// Takes up what was found at the particles: n_s and its gradient, and the gradient of psi if it is known.
    pub fn look(
        &mut self,
        places: impl Fn(usize) -> [f64; D] + Sync,
        found: &[(f64, [f64; D])],
        drift: Option<&[[f64; D]]>,
    ) {
        let share = &self.share;
        let known = |i: usize| share[i] > 0.0 && found[i].0 > 0.0;
        parallel::update(&mut self.logarithm, |i, l| *l = if known(i) { found[i].0.ln() } else { 0.0 });
        parallel::update(&mut self.slope, |i, s| {
            *s = if known(i) { found[i].1.map(|g| g / found[i].0) } else { [0.0; D] }
        });
        parallel::update(&mut self.place, |i, x| *x = places(i));
        if let Some(drift) = drift {
            parallel::update(&mut self.drift, |i, d| *d = drift[i].map(|v| share[i] * v));
        }
        // What is seen nowhere aims at the target.
        parallel::update(&mut self.share, |i, s| {
            if !(found[i].0 > 0.0) {
                *s = 0.0
            }
        });
    }

    /// Whether a particle's aim has to be looked for.
    pub fn is_aimed(&self, i: usize) -> bool {
        self.share[i] > 0.0
    }

    /// Whether a particle has moved so far since its aim was looked for that the gradient does not tell it.
    pub fn are_stale(&self, domain: &Domain<D>, positions: &Positions<D>, spacing: &[f64]) -> bool {
        let is_far = |i: usize| {
            let moved = domain.displacement(&self.place[i], &at(positions, i));
            self.is_aimed(i) && moved.iter().map(|m| m * m).sum::<f64>() > (FAR * spacing[i]).powi(2)
        };
        parallel::count(spacing.len(), is_far) > 0
    }

    /// What the error of a particle counts where that against the target would count `resolved`, and the target is so sharp.
    pub fn weight(&self, i: usize, resolved: f64, sharpness: f64) -> f64 {
        let unresolved = const { weight_of_unresolved(D) };
        if self.is_aimed(i) { resolved + share(sharpness) * (unresolved - resolved) } else { resolved }
    }

    /// The number density that a particle at `x` aims at, where the target has `wanted`.
    pub fn density(&self, domain: &Domain<D>, i: usize, x: &[f64; D], wanted: f64) -> f64 {
        let share = self.share[i];
        if share == 0.0 {
            return wanted;
        }
        let moved = domain.displacement(&self.place[i], x);
        let smoothed = self.logarithm[i] + (0..D).map(|k| self.slope[i][k] * moved[k]).sum::<f64>();
        let of_target = if share < 1.0 { (1.0 - share) * wanted.ln() } else { 0.0 };
        (of_target + share * smoothed).exp()
    }

    /// The gradient of its logarithm; `of_target` is that of ln n*.
    pub fn log_slope(&self, i: usize, of_target: impl FnOnce() -> [f64; D]) -> [f64; D] {
        let share = self.share[i];
        if share == 0.0 {
            return of_target();
        }
        let rest = if share < 1.0 { of_target() } else { [0.0; D] };
        sph::array(|k| share * self.slope[i][k] + if share < 1.0 { (1.0 - share) * rest[k] } else { 0.0 })
    }

    /// The change of psi since a particle's aim was looked for, as far as it aims at the smoothed target, and its gradient.
    pub fn drift(&self, domain: &Domain<D>, i: usize, x: &[f64; D]) -> (f64, [f64; D]) {
        let (moved, drift) = (domain.displacement(&self.place[i], x), self.drift[i]);
        ((0..D).map(|k| drift[k] * moved[k]).sum(), drift)
    }

    /// Follows particles into a new order.
    pub fn reorder(&mut self, order: &[u32]) {
        self.share = parallel::reordered(&self.share, order);
        self.logarithm = parallel::reordered(&self.logarithm, order);
        self.slope = parallel::reordered(&self.slope, order);
        self.place = parallel::reordered(&self.place, order);
        self.drift = parallel::reordered(&self.drift, order);
    }

    /// Whether these are of `count` particles.
    pub fn is_of(&self, count: usize) -> bool {
        let vectors = [&self.slope, &self.place, &self.drift];
        let lengths = [self.share.len(), self.logarithm.len()].into_iter().chain(vectors.map(Vec::len));
        let vectors = vectors.into_iter().flatten().flatten();
        lengths.into_iter().all(|length| length == count)
            && self.share.iter().chain(&self.logarithm).chain(vectors).all(|v| v.is_finite())
    }
}

/// n_s at a particle with one radius, and the radius that belongs to it.
pub(super) struct Smoothed<const D: usize> {
    pub density: f64,
    /// With the radius that follows n_s from place to place.
    pub gradient: [f64; D],
    /// Newton's step from the one that it was seen with.
    pub radius: f64,
}

impl<const D: usize> Smoothed<D> {
    /// Of what is `seen` with the radius `support`; `radius` is that of a number density. With H ~ n_s^(-1/D) a change of n_s that would be g with H fixed is
    /// g / (1 + d ln n_s / d ln H / D). That is 1 of what is even about a particle, 2/3 of a layer in space and 1/3 of a filament; a clump within the
    /// kernel, of which it is nothing, has no such radius.
    pub fn new(seen: &DensitySums<D>, support: f64, radius: impl Fn(f64) -> f64) -> Self {
        let density = seen.weighted;
        if !(density > 0.0) {
            return Self { density: 0.0, gradient: [0.0; D], radius: support };
        }
        let part = (1.0 + seen.weighted_slope / (D as f64 * density)).max(LEAST_PART);
        let step = ((radius(density) / support).ln() / part).clamp(-LONGEST, LONGEST);
        Self { density, gradient: seen.gradient.map(|g| g / part), radius: support * step.exp() }
    }
}

/// The points of mass of a target, found when they are first asked for, and what they do to particles that aim at the smoothed target.
pub(super) struct Points<const D: usize> {
    points: Option<Option<Arc<MassPoints<D>>>>,
    /// Support radii of the points, and what each stands for over n_s there.
    pub strength: Option<(Vec<f64>, Vec<f64>)>,
}

impl<const D: usize> Points<D> {
    pub const fn unknown() -> Self {
        Self { points: None, strength: None }
    }

    /// Those about a block of a target.
    pub const fn of_block(points: Arc<MassPoints<D>>) -> Self {
        Self { points: Some(Some(points)), strength: None }
    }

    pub const fn are_known(&self) -> bool {
        self.points.is_some()
    }

    /// Finds them, in the `ledger` where that is of the same target; whether there are any.
    pub fn find(&mut self, target: &Target<'_, D>, ledger: Option<&LedgerOf<'_, D>>) -> bool {
        let known = || ledger.and_then(|ledger| ledger.points_of_whole(target));
        let find = || known().unwrap_or_else(|| MassPoints::new(target).map(Arc::new));
        self.points.get_or_insert_with(find).is_some()
    }

    pub fn get(&self) -> Option<&MassPoints<D>> {
        self.points.as_ref().and_then(Option::as_deref)
    }

    /// Finds n_s at the points that act on particles for which `is_aimed`, with the radii of the nearest of the particles that
    /// `support` are of.
    pub fn strengthen(
        &mut self,
        kernel: KernelName,
        domain: &Domain<D>,
        (positions, support): (&Positions<D>, &[f64]),
        (count, is_aimed): (usize, impl Fn(usize) -> bool),
    ) {
        self.strength = None;
        let Some(points) = self.get() else { return };
        let particles: Vec<[f64; D]> = (0..support.len()).map(|i| at(positions, i)).collect();
        let Ok(tree) = Nearest::new(&particles) else { return };
        let radii = parallel::map(points.share().len(), |c| support[tree.one(&at(points.positions(), c)).0]);
        let aimed: Vec<usize> = (0..support.len()).filter(|&i| is_aimed(i)).collect();
        let looked = match 2 * aimed.len() < support.len() {
            true => {
                let aimed = positions.each_ref().map(|x| aimed.iter().map(|&i| x[i]).collect());
                let reaches = points.reach(kernel, domain, &parallel::map(radii.len(), |c| MARGIN * radii[c]), &aimed);
                parallel::map(radii.len(), |c| if reaches[c] { radii[c] } else { 0.0 })
            }
            false => radii.clone(),
        };
        let found = smoothed(points, (kernel, domain), &looked, count);
        let over = |c: usize| if found[c] > 0.0 { count as f64 * points.share()[c] / found[c] } else { 0.0 };
        let strength = parallel::map(found.len(), over);
        self.strength = Some((radii, strength));
    }

    /// The gradient of psi at the particles for which `is_aimed`, where it is known.
    pub fn drift(
        &self,
        kernel: KernelName,
        domain: &Domain<D>,
        (positions, support): (&Positions<D>, &[f64]),
        is_aimed: impl Fn(usize) -> bool + Sync,
    ) -> Option<Vec<[f64; D]>> {
        let (points, (radii, strength)) = self.get().zip(self.strength.as_ref())?;
        if radii.len() != points.share().len() || strength.len() != radii.len() {
            return None;
        }
        let known = strength.iter().filter(|s| **s > 0.0);
        let mean = known.clone().sum::<f64>() / (known.count() as f64).max(1.0);
        let theirs = vec![mean; support.len()];
        let looked = parallel::map(support.len(), |i| if is_aimed(i) { support[i] } else { 0.0 });
        Some(points.seen_gradient(kernel, domain, (positions, &looked, &theirs), (radii, strength)))
    }
}

/// Some points next to each other, in tree order, and where n_s is looked for in place of all of them.
struct Group<const D: usize> {
    middle: [f64; D],
    radius: f64,
    members: std::ops::Range<usize>,
}

/// n_s of `count` particles at `points` for their radii `looked`, zero where a radius is zero. What is smooth over a radius is followed from
/// the middle of a few points to each of them by its gradient, in ln n_s; where that is too far, a point is looked at by itself.
fn smoothed<const D: usize>(
    points: &MassPoints<D>,
    (kernel, domain): (KernelName, &Domain<D>),
    looked: &[f64],
    count: usize,
) -> Vec<f64> {
    let place = |c: usize| at(points.positions(), c);
    let size = 1 << D;
    let groups = parallel::map(looked.len().div_ceil(size), |g| {
        let members = g * size..looked.len().min((g + 1) * size);
        let first = members.clone().find(|&c| looked[c] > 0.0)?;
        let (x, n) = (place(first), members.len() as f64);
        let away = |k: usize| members.clone().map(|c| domain.displacement(&x, &place(c))[k]).sum::<f64>() / n;
        let middle = domain.wrapped(&sph::array(|k| x[k] + away(k)));
        Some(Group { middle, radius: looked[first], members })
    });
    let groups: Vec<Group<D>> = groups.into_iter().flatten().collect();
    let sums = |x: &[[f64; D]], radii: &[f64]| {
        let places = std::array::from_fn(|k| x.iter().map(|x| x[k]).collect());
        points.number_densities(kernel, domain, (&places, radii), count)
    };
    let middles: Vec<[f64; D]> = groups.iter().map(|g| g.middle).collect();
    let seen = sums(&middles, &groups.iter().map(|g| g.radius).collect::<Vec<f64>>());
    let follow = |g: usize, c: usize| {
        let (Group { middle, radius, .. }, seen) = (&groups[g], &seen[g]);
        let away = domain.displacement(middle, &place(c));
        let change = (0..D).map(|k| seen.gradient[k] * away[k]).sum::<f64>() / seen.weighted;
        let is_near = away.iter().map(|a| a * a).sum::<f64>() < (NEAR * radius).powi(2);
        (is_near && change.abs() < MOST_CHANGE).then(|| seen.weighted * change.exp())
    };
    let followed = parallel::map(groups.len(), |g| {
        let of = |c: usize| if looked[c] > 0.0 { follow(g, c) } else { Some(0.0) };
        groups[g].members.clone().map(of).collect::<Vec<Option<f64>>>()
    });
    let mut found = vec![0.0; looked.len()];
    let mut alone = Vec::new();
    for (group, followed) in groups.iter().zip(followed) {
        for (c, value) in group.members.clone().zip(followed) {
            match value {
                Some(value) => found[c] = value,
                None => alone.push(c),
            }
        }
    }
    let seen =
        sums(&parallel::map(alone.len(), |a| place(alone[a])), &parallel::map(alone.len(), |a| looked[alone[a]]));
    alone.iter().zip(seen).for_each(|(&c, seen)| found[c] = seen.weighted);
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::AnalyticField;
    use sph::domain::{Axis, Region};

    /// Against sums at every point, in the mean over the mass: of what is smooth, and of a layer that is thinner than anything.
    #[test]
    fn what_is_followed_is_what_is_seen() {
        fn check<const D: usize>(count: usize) {
            let domain = Domain::new([0.0; D], [1.0; D], [Axis::Periodic; D], Region::Box).unwrap();
            for (density, most) in [("exp(cos(2*pi*x))", 0.03), ("1 + if(abs(x - 0.5) < 1e-4, 1e5, 0)", 0.1)] {
                let field = AnalyticField::<D>::new("density", density, [0.0; D]).unwrap();
                let mass = crate::field::total_mass(&field, &domain, 1e-6).unwrap().value;
                let target = Target::of_equal_masses(&domain, &field, count, mass);
                let points = MassPoints::new(&target).unwrap();
                let n = points.share().len();
                let width = 2.5 * (count as f64).powf(-1.0 / D as f64);
                let radius = |c: usize| if c.is_multiple_of(7) { 0.0 } else { width };
                let looked: Vec<f64> = (0..n).map(radius).collect();
                let kernel = KernelName::WendlandC4;
                let found = smoothed(&points, (kernel, &domain), &looked, count);
                let seen = points.number_densities(kernel, &domain, (points.positions(), &looked), count);
                let off = |c: usize| if seen[c].weighted > 0.0 { found[c] / seen[c].weighted - 1.0 } else { found[c] };
                let mean = (0..n).map(|c| points.share()[c] * off(c).abs()).sum::<f64>();
                assert!(mean < most, "{D}-D, {density}: {mean}");
                assert!((0..n).all(|c| looked[c] > 0.0 || found[c] == 0.0));
            }
        }
        check::<1>(50);
        check::<2>(400);
        check::<3>(1500);
    }

    /// n_s with its own radius, of a layer and a filament that get thinner along x, at three places: the gradient is its difference. With the radius fixed it
    /// is 2/3 and 1/3 of that.
    #[test]
    fn gradients_are_those_of_the_density_at_its_own_radius() {
        fn check<const D: usize>(text: &str) {
            let domain = Domain::new([-1.0; D], [1.0; D], [Axis::OPEN; D], Region::Box).unwrap();
            let field = AnalyticField::<D>::new("density", text, [0.0; D]).unwrap();
            let mass = crate::field::total_mass(&field, &domain, 1e-4).unwrap().value;
            let count = 2000;
            let points = MassPoints::new(&Target::of_equal_masses(&domain, &field, count, mass)).unwrap();
            let look = |x: f64| {
                let place: Positions<D> = std::array::from_fn(|k| vec![if k == 0 { x } else { 0.0 }]);
                let mut support = 0.3;
                let step = |support: f64| {
                    let seen = points.number_densities(KernelName::WendlandC4, &domain, (&place, &[support]), count);
                    Smoothed::new(&seen[0], support, |n| 2.5 * n.powf(-1.0 / D as f64))
                };
                (0..8).for_each(|_| support = step(support).radius);
                step(support)
            };
            let (left, middle, right) = (look(-0.05), look(0.0), look(0.05));
            let difference = (right.density / left.density).ln() / 0.1;
            let gradient = middle.gradient[0] / middle.density;
            assert!((gradient / difference - 1.0).abs() < 0.1, "{D}-D, {text}: {gradient}, not {difference}");
        }
        check::<2>("exp(-x - (y/0.004)^2)");
        check::<3>("exp(-x - (z/0.004)^2)");
        check::<3>("exp(-x - (y^2 + z^2)/0.01^2)");
        check::<3>("exp(-x)");
    }
}
