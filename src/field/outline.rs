//! Where a body of particles ends: a smooth surface half a spacing beyond the outermost of them.
//!
//! About a place `x` the particles nearer than their reach `R_j` have the mean offset `m = sum w_j (x_j - x) / sum w_j`, with the
//! weights `w_j = V_j (1 - (|x - x_j| / R_j)^2)^3`, the volume `V_j` of a particle and `R_j = 3 V_j^(1/d)`. Where matter goes on to all
//! sides it is 0; on a plane at which matter ends it is `c_d R` long. The surface is where `|m| = c_d R`, R being the mean reach (the
//! blobs of Zhu & Bridson 2005, ACM Trans. Graph. 24, 965, equations 2 to 5, with volumes as weights, so that it is the
//! same whatever the masses and however steep the density). It evens out steps of less than a reach, as those of a lattice that is cut.
//!
//! Behind a surface that is bent by `K`, the sum of its principal curvatures, the half of the ball that is filled lacks a layer
//! `(k_1 u^2 + k_2 v^2) / 2` thick, which lies in the plane and so changes the sum of the weights, but not that of the offsets: there the
//! mean offset is `c_d R (1 + b_d K R)`. `K` is that of the surface found with `K = 0`, evened out over a reach.
//!
//! Where spacings grow steeply outwards, the outermost particles may be too few to tell of a surface: it has holes, or leaves particles out. Then there
//! is none.
//!
//! Volumes follow from the distance of the `6 (d + 1)` nearest particles, less what of the ball about them is empty: half of it
//! where their mean offset is that of half a ball. Nothing here depends on units, masses or densities.

use super::bvh::Aabb;
use super::cloud::Cloud;
use crate::error::Result;
use nalgebra::{SMatrix, SVector};
use sph::domain::{Axis, Domain, Hull, Region, Wall};
use sph::geometry::unit_ball_volume;
use sph::parallel;
use std::fmt;
use std::sync::Arc;

/// Reach of a particle in its spacings.
const REACH: f64 = 3.0;
/// Places farther than this from the nearest particle, in its spacings, are outside: one that is alone reaches 0.8.
const FARTHEST: f64 = 1.25;
/// Mean offset of the particles about one, over that in half a ball, from which on the surface may be near.
const UNEVEN: f64 = 0.3;
/// Particles among which those are that a place depends on, at first, and how far these are looked for, in what reaches to it.
const SEEN: usize = 64;
const MARGIN: f64 = 1.5;
/// Steps to the surface, the longest of them in spacings, and when it is reached, in spacings.
const STEPS: usize = 12;
const LONGEST: f64 = 0.5;
const REACHED: f64 = 1e-3;
/// Distance of points of the surface, in spacings.
const APART: f64 = 0.5;
/// Largest curvature that is allowed for, over that of a reach.
const MOST_BENT: f64 = 2.0;
/// Steps along the surface towards a place.
const SLIDES: usize = 3;
/// Places at which a surface, or a box that is filled, is looked at, and the largest share of those within that may be empty for all that.
const LOOKS: usize = 4000;
const EMPTY: f64 = 0.01;
/// Of a body that fills its box: how far within the faces it is looked for, in spacings, and the largest sine of the angle between a
/// face and the surface there.
const WITHIN: f64 = 1.5;
const FLAT: f64 = 0.2;

/// What ends at a smooth surface.
pub(super) struct Outline<const D: usize> {
    cloud: Cloud<D>,
    domain: Domain<D>,
    blobs: Vec<Blob<D>>,
    /// For each particle with the surface nearby those that a place about it depends on, the nearest first, from `starts[i]` to
    /// `starts[i + 1]`, with their distances from it, and the longest of their reaches. None are well within.
    starts: Vec<usize>,
    seen: Vec<(u32, f64)>,
    reaches: Vec<f64>,
    /// Points of the surface, its normals and the spacings there.
    surface: Option<Cloud<D>>,
    ends: Vec<End<D>>,
}

/// A particle as the surface sees it.
#[derive(Debug, Clone, Copy)]
struct Blob<const D: usize> {
    at: [f64; D],
    volume: f64,
    spacing: f64,
    /// Its reach, longer where the surface is bent outwards: the mean offset at the surface over `c_d`.
    mark: f64,
}

impl<const D: usize> Blob<D> {
    fn reach(&self) -> f64 {
        REACH * self.spacing
    }
}

/// A point of the surface.
#[derive(Debug, Clone, Copy)]
struct End<const D: usize> {
    at: [f64; D],
    normal: [f64; D],
    spacing: f64,
}

/// The level at a place, negative within, and its gradient.
struct Level<const D: usize> {
    value: f64,
    gradient: SVector<f64, D>,
}

/// Where particles end.
pub(super) enum Ends<const D: usize> {
    /// They fill a box; its faces along axes that do not repeat are half a spacing beyond the outermost.
    Box(Domain<D>),
    Surface(Arc<Outline<D>>),
}

impl<const D: usize> Ends<D> {
    /// Whether there is matter at `x`.
    pub(super) fn holds(&self, x: &[f64; D]) -> bool {
        match self {
            Self::Box(filled) => filled.contains(x),
            Self::Surface(outline) => outline.domain.contains(x) && outline.holds(&outline.domain.wrapped(x)),
        }
    }

    /// How far `x`, within, is from where matter ends.
    pub(super) fn distance(&self, x: &[f64; D]) -> f64 {
        match self {
            Self::Box(filled) => (0..D)
                .filter(|&k| filled.axes[k] != Axis::Periodic)
                .map(|k| (x[k] - filled.lo[k]).min(filled.hi[k] - x[k]))
                .fold(f64::INFINITY, f64::min),
            Self::Surface(outline) => outline.surface.as_ref().map_or(f64::INFINITY, |surface| surface.near(x).1),
        }
    }

    /// The domain that the particles fill.
    ///
    /// # Errors
    /// None, as there is a box about them.
    pub(super) fn domain(&self) -> Result<Domain<D>> {
        match self {
            Self::Box(filled) => Ok(filled.clone()),
            Self::Surface(outline) => {
                let Domain { lo, hi, axes, .. } = outline.domain;
                let hull: Arc<dyn Hull<D>> = Arc::clone(outline) as Arc<dyn Hull<D>>;
                Ok(Domain::new(lo, hi, axes, Region::Hull(hull, Wall::Open))?)
            }
        }
    }
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
const fn of_bent(d: usize) -> f64 {
    match d {
        1 => 0.0,
        2 => 128.0 / (315.0 * std::f64::consts::PI),
        _ => 63.0 / 512.0,
    }
}

/// The same without weights.
const fn of_half_ball(d: usize) -> f64 {
    match d {
        1 => 0.5,
        2 => 4.0 / (3.0 * std::f64::consts::PI),
        _ => 0.375,
    }
}

fn length<const D: usize>(v: &[f64; D]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

impl<const D: usize> Outline<D> {
    /// Particles by whose distance volumes are told, and over which they are evened out.
    const ABOUT: usize = 6 * (D + 1);
    const EVENED: usize = 2 * (D + 1);

    /// Where `points` end in a domain that repeats as `domain` does; `None` where all its axes repeat, where the points are few, or where no
    /// surface is found.
    ///
    /// # Errors
    /// Those of a cloud: too many points, or points that span no volume.
    pub(super) fn of(name: &str, points: &[[f64; D]], domain: &Domain<D>) -> Result<Option<Ends<D>>> {
        if points.len() <= 2 * Self::ABOUT || domain.axes.iter().all(|a| *a == Axis::Periodic) {
            return Ok(None);
        }
        let mut outline = Self {
            cloud: Cloud::new(name, points, Some(domain))?,
            domain: domain.clone(),
            blobs: Vec::new(),
            starts: Vec::new(),
            seen: Vec::new(),
            reaches: Vec::new(),
            surface: None,
            ends: Vec::new(),
        };
        let points: Vec<[f64; D]> = points.iter().map(|p| domain.wrapped(p)).collect();
        let is_uneven = outline.measure(&points);
        outline.look_around(&is_uneven);
        let flat = outline.find_ends();
        outline.bend(&flat);
        outline.ends = outline.find_ends().into_iter().flatten().collect();
        let places: Vec<[f64; D]> = outline.ends.iter().map(|e| e.at).collect();
        let bounds = Aabb::around(&places);
        if places.len() < 2 || (0..D).any(|k| !(bounds.lo[k] < bounds.hi[k])) {
            return Ok(None);
        }
        outline.enclose();
        if let Some(filled) = outline.filled_box() {
            return Ok(Some(Ends::Box(filled)));
        }
        outline.surface = Some(Cloud::new(name, &places, Some(&outline.domain))?);
        Ok(outline.is_whole().then(|| Ends::Surface(Arc::new(outline))))
    }

    /// Finds the volumes; returns whether the surroundings of each particle are uneven.
    fn measure(&mut self, points: &[[f64; D]]) -> Vec<bool> {
        let found = parallel::map(points.len(), |i| {
            let about = self.cloud.nearest(&points[i], Self::ABOUT + 1);
            let reach = about.last().map_or(0.0, |f| f.1);
            let mut mean = [0.0; D];
            for (j, _) in &about[1..] {
                let offset = self.domain.displacement(&points[i], &points[*j]);
                (0..D).for_each(|k| mean[k] += offset[k] / Self::ABOUT as f64);
            }
            let uneven = if reach > 0.0 { (length(&mean) / (of_half_ball(D) * reach)).min(1.0) } else { 1.0 };
            // The farthest is on the ball, and counts half.
            let volume = unit_ball_volume(D) * reach.powi(D as i32) * (1.0 - 0.5 * uneven) / (Self::ABOUT as f64 + 0.5);
            let near: Vec<u32> = about[..Self::EVENED].iter().map(|f| f.0 as u32).collect();
            (volume, near, uneven > UNEVEN)
        });
        let even = |i: usize| {
            let logs = found[i].1.iter().map(|&j| found[j as usize].0.ln());
            (logs.sum::<f64>() / Self::EVENED as f64).exp()
        };
        self.blobs = parallel::map(found.len(), |i| {
            let volume = even(i);
            let spacing = volume.powf(1.0 / D as f64);
            Blob { at: points[i], volume, spacing, mark: REACH * spacing }
        });
        found.into_iter().map(|f| f.2).collect()
    }

    /// Allows for the curvature of the surface, of which `ends` are points by particle, the nearest to it first.
    fn bend(&mut self, ends: &[Vec<End<D>>]) {
        let own = parallel::map(ends.len(), |i| self.curvature(&ends[i]));
        let evened = |i: usize| {
            let (mut sum, mut weights) = (0.0, 0.0);
            for &(j, _) in self.seen_at(i) {
                let Some(curvature) = own[j as usize] else { continue };
                let offset = length(&self.domain.displacement(&self.blobs[i].at, &self.blobs[j as usize].at));
                let left = 1.0 - (offset / self.blobs[i].reach()).powi(2);
                if left > 0.0 {
                    let weight = left * left * left;
                    sum += weight * curvature;
                    weights += weight;
                }
            }
            let reach = self.blobs[i].reach();
            let bent = if weights > 0.0 { (sum / weights * reach).clamp(-MOST_BENT, MOST_BENT) } else { 0.0 };
            reach * (1.0 + of_bent(D) * bent)
        };
        let marks = parallel::map(ends.len(), evened);
        self.blobs.iter_mut().zip(marks).for_each(|(blob, mark)| blob.mark = mark);
    }

    /// The sum of the principal curvatures at the first of these points of the surface, from the normals at the others about it.
    fn curvature(&self, ends: &[End<D>]) -> Option<f64> {
        let (first, about) = ends.split_first()?;
        let normal = SVector::<f64, D>::from(first.normal);
        let along = |end: &End<D>| {
            let offset = SVector::<f64, D>::from(self.domain.displacement(&first.at, &end.at));
            (SVector::<f64, D>::from(end.normal) - normal).dot(&offset) / offset.norm_squared()
        };
        let all: Vec<f64> = about.iter().map(along).filter(|k| k.is_finite()).collect();
        (!all.is_empty()).then(|| (D - 1) as f64 * all.iter().sum::<f64>() / all.len() as f64)
    }

    /// Lists the particles that places about each one depend on, where the surface may be near.
    fn look_around(&mut self, is_uneven: &[bool]) {
        let n = self.blobs.len();
        let lists = parallel::map(n, |i| {
            let near = self.cloud.nearest(&self.blobs[i].at, Self::ABOUT + 1);
            if near.iter().all(|f| !is_uneven[f.0]) {
                return Vec::new();
            }
            let own = FARTHEST * self.blobs[i].spacing;
            let far = MARGIN * (self.blobs[i].reach() + own);
            let mut count = SEEN.min(n);
            let mut found = self.cloud.nearest(&self.blobs[i].at, count);
            while count < n && found.last().is_some_and(|f| f.1 < far) {
                count = (2 * count).min(n);
                found = self.cloud.nearest(&self.blobs[i].at, count);
            }
            found.retain(|&(j, distance)| distance < self.blobs[j].reach() + own);
            found.into_iter().map(|f| (f.0 as u32, f.1)).collect::<Vec<(u32, f64)>>()
        });
        self.starts = Vec::with_capacity(n + 1);
        self.starts.push(0);
        for list in lists {
            self.reaches.push(list.iter().map(|f| self.blobs[f.0 as usize].reach()).fold(0.0, f64::max));
            self.seen.extend(list);
            self.starts.push(self.seen.len());
        }
    }

    /// The particles that a place near `i` depends on.
    fn seen_at(&self, i: usize) -> &[(u32, f64)] {
        &self.seen[self.starts[i]..self.starts[i + 1]]
    }

    /// Those of them that may reach to a place `distance` from `i`.
    fn reaching(&self, i: usize, distance: f64) -> impl Iterator<Item = &Blob<D>> + '_ {
        let farthest = (distance + self.reaches[i]) * (1.0 + 1e-12);
        self.seen_at(i).iter().take_while(move |f| f.1 <= farthest).map(|f| &self.blobs[f.0 as usize])
    }

    /// The level at `x`, `distance` from particle `i`; `None` where nothing reaches.
    fn level(&self, x: &[f64; D], (i, distance): (usize, f64)) -> Option<f64> {
        let (mut sum, mut reach, mut mean) = (0.0, 0.0, [0.0; D]);
        for blob in self.reaching(i, distance) {
            let offset = self.domain.displacement(x, &blob.at);
            let own = blob.reach();
            let left = 1.0 - offset.iter().map(|v| v * v).sum::<f64>() / (own * own);
            if left > 0.0 {
                let weight = blob.volume * left * left * left;
                sum += weight;
                reach += weight * blob.mark;
                (0..D).for_each(|k| mean[k] += weight * offset[k]);
            }
        }
        (sum > 0.0).then(|| (length(&mean) - beside_plane(D) * reach) / sum)
    }

    /// The level with its gradient.
    fn sloped(&self, x: &[f64; D], (i, distance): (usize, f64)) -> Option<Level<D>> {
        type Vector<const D: usize> = SVector<f64, D>;
        let (mut sum, mut reach, mut mean) = (0.0, 0.0, Vector::<D>::zeros());
        let (mut sums, mut reaches, mut means) =
            (Vector::<D>::zeros(), Vector::<D>::zeros(), SMatrix::<f64, D, D>::zeros());
        for blob in self.reaching(i, distance) {
            let offset = Vector::<D>::from(self.domain.displacement(x, &blob.at));
            let own = blob.reach();
            let left = 1.0 - offset.norm_squared() / (own * own);
            if left > 0.0 {
                let weight = blob.volume * left * left * left;
                let slope = offset * (6.0 * blob.volume * left * left / (own * own));
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
    fn holds(&self, x: &[f64; D]) -> bool {
        let (near, distance) = self.cloud.near(x);
        if self.seen_at(near).is_empty() {
            return true;
        }
        distance <= FARTHEST * self.blobs[near].spacing
            && self.level(x, (near, distance)).is_some_and(|level| level <= 0.0)
    }

    /// The place of the surface that Newton's steps along the normal lead to from `x`, with the normal there; `None` where they lead to none.
    fn led(&self, x: &[f64; D], spacing: f64, steps: usize) -> Option<End<D>> {
        let mut x = SVector::<f64, D>::from(*x);
        for _ in 0..steps {
            let near = self.cloud.near(&x.into());
            let Level { value, gradient } = self.sloped(&x.into(), near)?;
            let slope = gradient.norm();
            if !(slope > 0.0) {
                return None;
            }
            let normal = gradient / slope;
            let step = (value / slope).clamp(-LONGEST * spacing, LONGEST * spacing);
            x -= normal * step;
            if step.abs() <= REACHED * spacing {
                return Some(End { at: self.domain.wrapped(&x.into()), normal: normal.into(), spacing });
            }
        }
        None
    }

    /// Points of the surface: the nearest to each particle at it, and some about that.
    fn find_ends(&self) -> Vec<Vec<End<D>>> {
        parallel::map(self.blobs.len(), |i| {
            let Blob { at: x, spacing, .. } = &self.blobs[i];
            let is_near = |end: &End<D>| length(&self.domain.displacement(x, &end.at)) <= 2.0 * spacing;
            let own = |from: &[f64; D]| Some(self.led(from, *spacing, STEPS)?).filter(is_near);
            if self.seen_at(i).is_empty() {
                return Vec::new();
            }
            let Some(middle) = own(x) else { return Vec::new() };
            let about = tangents(&middle.normal)
                .into_iter()
                .filter_map(|t| own(&sph::array(|k| middle.at[k] + APART * spacing * t[k])));
            std::iter::once(middle).chain(about).collect()
        })
    }

    /// Makes the box along axes that do not repeat as large as what is within the surface.
    fn enclose(&mut self) {
        for k in (0..D).filter(|&k| self.domain.axes[k] != Axis::Periodic) {
            let beyond = |e: &End<D>, side: f64| e.at[k] + side * 0.5 * e.spacing;
            self.domain.lo[k] = self.ends.iter().map(|e| beyond(e, -1.0)).fold(f64::INFINITY, f64::min);
            self.domain.hi[k] = self.ends.iter().map(|e| beyond(e, 1.0)).fold(f64::NEG_INFINITY, f64::max);
        }
        self.domain.region = Region::Box;
    }

    /// Whether all particles are within, and no holes, as the nearest points of the surface tell.
    fn is_whole(&self) -> bool {
        let Some(surface) = &self.surface else { return false };
        if parallel::count(self.blobs.len(), |i| !self.holds(&self.blobs[i].at)) > 0 {
            return false;
        }
        let is_behind = |i: usize| {
            let x: [f64; D] =
                sph::array(|k| self.domain.lo[k] + share(i, k, D) * (self.domain.hi[k] - self.domain.lo[k]));
            let (nearest, _) = surface.near(&x);
            let End { at, normal, spacing } = self.ends[nearest];
            let offset = SVector::<f64, D>::from(self.domain.displacement(&at, &x));
            (offset.dot(&normal.into()) < -APART * spacing).then_some(x)
        };
        let behind = parallel::count(LOOKS, |i| is_behind(i).is_some());
        let empty = parallel::count(LOOKS, |i| is_behind(i).is_some_and(|x| !self.holds(&x)));
        empty as f64 <= EMPTY * behind as f64
    }

    /// The box that the particles fill, if they do: the surface lies flat along its faces, and matter is everywhere within.
    fn filled_box(&self) -> Option<Domain<D>> {
        let mut filled = self.domain.clone();
        let mut within = [[0.0; 2]; D];
        for k in (0..D).filter(|&k| self.domain.axes[k] != Axis::Periodic) {
            for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
                let is_flat = |e: &&End<D>| e.normal[k] * sign > (1.0 - FLAT * FLAT).sqrt();
                let mut flat: Vec<(f64, f64)> =
                    self.ends.iter().filter(is_flat).map(|e| (e.at[k], e.spacing)).collect();
                flat.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
                let &(face, spacing) = flat.get(flat.len() / 2)?;
                within[k][side] = face - sign * WITHIN * spacing;
                if side == 0 { filled.lo[k] = face } else { filled.hi[k] = face }
            }
            // All are in it.
            filled.lo[k] = self.blobs.iter().map(|b| b.at[k]).fold(filled.lo[k], f64::min);
            filled.hi[k] = self.blobs.iter().map(|b| b.at[k]).fold(filled.hi[k], f64::max);
        }
        let place = |i: usize, k: usize| {
            let [lo, hi] = if self.domain.axes[k] == Axis::Periodic { [filled.lo[k], filled.hi[k]] } else { within[k] };
            let corner = if i >> k & 1 == 0 { 0.0 } else { 1.0 };
            lo + if i < 1 << D { corner } else { share(i, k, D) } * (hi - lo)
        };
        let all = parallel::count(LOOKS, |i| self.holds(&sph::array(|k| place(i, k))));
        (all == LOOKS).then_some(filled)
    }
}

/// Where along axis `k` of the unit cube place `i` is, of a sequence that fills it evenly: that of the generalized golden ratio.
pub(super) fn share(i: usize, k: usize, d: usize) -> f64 {
    (0.5 + i as f64 * golden(d).powi(-(k as i32 + 1))).fract()
}

/// The root of x^(d+1) = x + 1.
fn golden(d: usize) -> f64 {
    match d {
        1 => 1.618_033_988_749_895,
        2 => 1.324_717_957_244_746,
        _ => 1.220_744_084_605_76,
    }
}

/// Unit vectors along a surface with this normal, both ways.
fn tangents<const D: usize>(normal: &[f64; D]) -> Vec<[f64; D]> {
    let mut all: Vec<[f64; D]> = Vec::new();
    // The axes but for the one that is nearest to the normal, made orthogonal.
    let steepest = (0..D).fold(0, |best, k| if normal[k].abs() > normal[best].abs() { k } else { best });
    let mut basis = vec![SVector::<f64, D>::from(*normal)];
    for k in (0..D).filter(|&k| k != steepest) {
        let mut axis = SVector::<f64, D>::zeros();
        axis[k] = 1.0;
        basis.iter().for_each(|b| axis -= b * b.dot(&axis));
        axis /= axis.norm();
        basis.push(axis);
        all.push(axis.into());
        all.push((-axis).into());
    }
    all
}

impl<const D: usize> Hull<D> for Outline<D> {
    fn contains(&self, x: &[f64; D]) -> bool {
        self.holds(x)
    }

    fn nearest_on_surface(&self, x: &[f64; D]) -> [f64; D] {
        let Some((nearest, distance)) = self.surface.as_ref().map(|surface| surface.near(x)) else { return *x };
        let End { at, normal, spacing } = self.ends[nearest];
        let offset = SVector::<f64, D>::from(self.domain.displacement(x, &at));
        let from = SVector::<f64, D>::from(*x);
        // Towards the foot of the perpendicular, as far as the points of the surface are apart.
        let slid = |offset: SVector<f64, D>, normal: SVector<f64, D>| {
            let along = offset - normal * normal.dot(&offset);
            let size = along.norm();
            offset - along * if size > APART * spacing { APART * spacing / size } else { 1.0 }
        };
        let mut offset = slid(offset, normal.into());
        if distance > REACH * spacing {
            return (from + offset).into();
        }
        for _ in 0..SLIDES {
            let Some(end) = self.led(&(from + offset).into(), spacing, STEPS) else { break };
            offset = self.domain.displacement(x, &end.at).into();
            let next = slid(offset, end.normal.into());
            if (next - offset).norm() <= REACHED * spacing {
                break;
            }
            offset = next;
        }
        (from + offset).into()
    }

    /// The sum of the particles' own.
    fn volume(&self) -> f64 {
        self.blobs.iter().map(|b| b.volume).sum()
    }

    fn nearest_within(&self, x: &[f64; D], reach: f64) -> Option<[f64; D]> {
        let (nearest, distance) = self.surface.as_ref()?.near(x);
        // The foot is nearer than the nearest of the points by less than these are apart.
        if distance > reach + APART * self.ends[nearest].spacing {
            return None;
        }
        Some(self.nearest_on_surface(x)).filter(|p| length(&self.domain.displacement(p, x)) < reach)
    }
}
