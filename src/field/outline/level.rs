//! The level function whose zero set is the surface.

use crate::field::cloud::Cloud;
use crate::field::listed::Listed;
use nalgebra::{SMatrix, SVector};
use sph::domain::{Axis, Domain};
use std::cell::Cell;
use std::fmt;
use std::sync::Arc;

/// Reach of a particle in its spacings.
pub(super) const REACH: f64 = 3.0;
/// Places farther than this from the nearest particle, in its spacings, are outside: one that is alone reaches 0.8.
pub(super) const FARTHEST: f64 = 1.25;
/// Steps to the surface, the longest of them in spacings, and when it is reached, in spacings.
pub(super) const STEPS: usize = 12;
const LONGEST: f64 = 0.5;
pub(super) const REACHED: f64 = 1e-3;
/// Distance of points of the surface, in spacings.
pub(super) const APART: f64 = 0.5;

/// What ends at a smooth surface.
pub(in crate::field) struct Outline<const D: usize> {
    /// Unlike that of any other one.
    pub(super) number: u64,
    pub(super) particles: Arc<Listed<D>>,
    pub(super) domain: Domain<D>,
    pub(super) blobs: Vec<Blob<D>>,
    /// For each particle with the surface nearby those that a place about it depends on, the nearest first, from `starts[i]` to
    /// `starts[i + 1]`, with their distances from it, and the longest of their reaches. None are well within.
    pub(super) starts: Vec<usize>,
    pub(super) seen: Vec<(u32, f64)>,
    pub(super) reaches: Vec<f64>,
    /// How far about each particle there is no surface for sure, where that is known.
    pub(super) depths: Vec<f64>,
    /// Points of the surface, its normals and the spacings there.
    pub(super) surface: Option<Cloud<D>>,
    pub(super) ends: Vec<End<D>>,
}

/// A particle as the surface sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Blob<const D: usize> {
    pub(super) at: [f64; D],
    pub(super) volume: f64,
    pub(super) spacing: f64,
    /// One over the square of its reach.
    narrowness: f64,
    /// Its reach, longer where the surface is bent outwards: the mean offset at the surface over `c_d`.
    pub(super) mark: f64,
}

impl<const D: usize> Blob<D> {
    pub(super) fn new(at: [f64; D], volume: f64) -> Self {
        let spacing = volume.powf(1.0 / D as f64);
        let reach = REACH * spacing;
        Self { at, volume, spacing, narrowness: 1.0 / (reach * reach), mark: reach }
    }

    pub(super) fn reach(&self) -> f64 {
        REACH * self.spacing
    }
}

/// A point of the surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct End<const D: usize> {
    pub(super) at: [f64; D],
    pub(super) normal: [f64; D],
    pub(super) spacing: f64,
    /// How far about it the surface is known to have no edge.
    pub(super) smooth: f64,
}

/// The particle that is nearest to a place, its distance, and whether the place is within.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    pub(super) near: (usize, f64),
    pub(super) is_within: bool,
}

/// What was found for the last place that a thread asked for: it is asked about several times in a row, whether it is within, for what is there, and
/// for the surface.
pub(super) struct Last<T>(Cell<Option<(u64, [f64; 3], T)>>);

impl<T: Copy> Last<T> {
    const fn none() -> Self {
        Self(Cell::new(None))
    }

    /// What `find` finds for `x`, of the outline with that number.
    pub(super) fn or<const D: usize>(&self, number: u64, x: &[f64; D], find: impl FnOnce() -> T) -> T {
        let padded = sph::array(|k| x.get(k).copied().unwrap_or(0.0));
        match self.0.get() {
            Some((of, place, found)) if of == number && place == padded => found,
            _ => {
                let found = find();
                self.0.set(Some((number, padded, found)));
                found
            }
        }
    }
}

thread_local! {
    static FOUND: Last<Found> = const { Last::none() };
    static NEAREST_END: Last<(usize, f64)> = const { Last::none() };
}

/// The level at a place, negative within, and its gradient.
struct Level<const D: usize> {
    value: f64,
    gradient: SVector<f64, D>,
}

impl<const D: usize> fmt::Debug for Outline<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Outline").field("particles", &self.blobs.len()).field("ends", &self.ends.len()).finish()
    }
}

/// Mean distance from a plane of what lies on one side of it within the unit ball, weighted by (1 - r^2)^3.
const fn beside_plane(d: usize) -> f64 {
    match d {
        1 => 35.0 / 128.0,
        2 => 256.0 / (315.0 * std::f64::consts::PI),
        _ => 63.0 / 256.0,
    }
}

/// Growth of that distance over itself where the plane is bent, over the sum of its curvatures.
pub(super) const fn of_bent(d: usize) -> f64 {
    match d {
        1 => 0.0,
        2 => 128.0 / (315.0 * std::f64::consts::PI),
        _ => 63.0 / 512.0,
    }
}

/// The same without weights.
pub(super) const fn of_half_ball(d: usize) -> f64 {
    match d {
        1 => 0.5,
        2 => 4.0 / (3.0 * std::f64::consts::PI),
        _ => 0.375,
    }
}

pub(super) fn length<const D: usize>(v: &[f64; D]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

impl<const D: usize> Outline<D> {
    /// The particles that a place near `i` depends on.
    pub(super) fn seen_at(&self, i: usize) -> &[(u32, f64)] {
        &self.seen[self.starts[i]..self.starts[i + 1]]
    }

    /// Those of them that may reach to a place `distance` from `i`.
    fn reaching(&self, i: usize, distance: f64) -> impl Iterator<Item = &Blob<D>> + '_ {
        let farthest = (distance + self.reaches[i]) * (1.0 + 1e-12);
        self.seen_at(i).iter().take_while(move |f| f.1 <= farthest).map(|f| &self.blobs[f.0 as usize])
    }

    /// The level at `x`, `distance` from particle `i`; `None` where nothing reaches.
    fn level(&self, x: &[f64; D], near: (usize, f64)) -> Option<f64> {
        match self.domain.axes.contains(&Axis::Periodic) {
            true => self.level_by(|at| self.domain.displacement(x, at), near),
            false => self.level_by(|at| sph::array(|k| at[k] - x[k]), near),
        }
    }

    /// The same, with the way to the places of particles.
    #[inline]
    fn level_by(&self, offset: impl Fn(&[f64; D]) -> [f64; D], (i, distance): (usize, f64)) -> Option<f64> {
        let (mut sum, mut reach, mut mean) = (0.0, 0.0, [0.0; D]);
        for blob in self.reaching(i, distance) {
            let offset = offset(&blob.at);
            // Nothing instead of a branch for those that do not reach: which they are is not to be foreseen.
            let left = (1.0 - offset.iter().map(|v| v * v).sum::<f64>() * blob.narrowness).max(0.0);
            let weight = blob.volume * left * left * left;
            sum += weight;
            reach += weight * blob.mark;
            (0..D).for_each(|k| mean[k] += weight * offset[k]);
        }
        (sum > 0.0).then(|| (length(&mean) - beside_plane(D) * reach) / sum)
    }

    /// The level with its gradient.
    fn sloped(&self, x: &[f64; D], near: (usize, f64)) -> Option<Level<D>> {
        match self.domain.axes.contains(&Axis::Periodic) {
            true => self.sloped_by(|at| self.domain.displacement(x, at), near),
            false => self.sloped_by(|at| sph::array(|k| at[k] - x[k]), near),
        }
    }

    /// The same, with the way to the places of particles.
    #[inline]
    fn sloped_by(&self, offset: impl Fn(&[f64; D]) -> [f64; D], (i, distance): (usize, f64)) -> Option<Level<D>> {
        type Vector<const D: usize> = SVector<f64, D>;
        let (mut sum, mut reach, mut mean) = (0.0, 0.0, Vector::<D>::zeros());
        let (mut sums, mut reaches, mut means) =
            (Vector::<D>::zeros(), Vector::<D>::zeros(), SMatrix::<f64, D, D>::zeros());
        for blob in self.reaching(i, distance) {
            let offset = Vector::<D>::from(offset(&blob.at));
            let left = 1.0 - offset.norm_squared() * blob.narrowness;
            if left > 0.0 {
                let square = blob.volume * left * left;
                let weight = square * left;
                let slope = offset * (6.0 * square * blob.narrowness);
                sum += weight;
                reach += weight * blob.mark;
                mean += offset * weight;
                sums += slope;
                reaches += slope * blob.mark;
                means += offset * slope.transpose();
            }
        }
        if !(sum > 0.0) {
            return None;
        }
        let (mean, reach) = (mean / sum, reach / sum);
        let away = mean.norm();
        let value = away - beside_plane(D) * reach;
        if !(away > 0.0) {
            return Some(Level { value, gradient: Vector::<D>::zeros() });
        }
        let unit = mean / away;
        // d m_a / d x_b = -delta_ab + (sum g_b o_a - m_a sum g_b) / sum w, with g the slope of a weight.
        let of_mean = means.transpose() * unit / sum - sums * (mean.dot(&unit) / sum) - unit;
        let of_reach = (reaches - sums * reach) / sum;
        Some(Level { value, gradient: of_mean - of_reach * beside_plane(D) })
    }

    /// Whether `x` is within.
    pub(super) fn holds(&self, x: &[f64; D]) -> bool {
        self.found(x).is_within
    }

    /// The particle that is nearest to `x`, and whether `x` is within.
    pub(super) fn found(&self, x: &[f64; D]) -> Found {
        let find = || {
            let near = self.particles.near(x);
            Found { near, is_within: self.is_within(x, near) }
        };
        FOUND.with(|last| last.or(self.number, x, find))
    }

    /// The point of the surface that is nearest to `x`, and its distance.
    pub(super) fn nearest_end(&self, x: &[f64; D]) -> Option<(usize, f64)> {
        let surface = self.surface.as_ref()?;
        Some(NEAREST_END.with(|last| last.or(self.number, x, || surface.near(x))))
    }

    /// No more than the distance of the surface from a place that is `distance` from particle `i`, less a spacing: without a search, which takes long where
    /// the surface is far.
    pub(super) fn depth(&self, (i, distance): (usize, f64)) -> f64 {
        self.depths.get(i).map_or(f64::NEG_INFINITY, |depth| depth - distance)
    }

    fn is_within(&self, x: &[f64; D], (near, distance): (usize, f64)) -> bool {
        self.seen_at(near).is_empty()
            || self.depth((near, distance)) > 0.0
            || self.is_close(near, distance) && self.level(x, (near, distance)).is_some_and(|level| level <= 0.0)
    }

    /// Whether particle `i` has all those in its list that a place so far from it depends on.
    fn is_close(&self, i: usize, distance: f64) -> bool {
        distance <= FARTHEST * self.blobs[i].spacing
    }

    /// The place of the surface that Newton's steps along the normal lead to from `x`, with the normal there; `None` where they lead to none.
    pub(super) fn led(&self, x: &[f64; D], spacing: f64, steps: usize) -> Option<End<D>> {
        let mut x = SVector::<f64, D>::from(*x);
        let mut near = self.particles.near(&x.into());
        for _ in 0..steps {
            let Level { value, gradient } = self.sloped(&x.into(), near)?;
            let slope = gradient.norm();
            if !(slope > 0.0) {
                return None;
            }
            let normal = gradient / slope;
            let step = (value / slope).clamp(-LONGEST * spacing, LONGEST * spacing);
            x -= normal * step;
            if step.abs() <= REACHED * spacing {
                return Some(End { at: self.domain.wrapped(&x.into()), normal: normal.into(), spacing, smooth: 0.0 });
            }
            near.1 = length(&self.domain.displacement(&self.blobs[near.0].at, &x.into()));
            if !self.is_close(near.0, near.1) || self.seen_at(near.0).is_empty() {
                near = self.particles.near(&x.into());
            }
        }
        None
    }
}
