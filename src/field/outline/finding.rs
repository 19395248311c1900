//! Finds the surface of a set of particles.

use super::ends::Ends;
use super::level::{APART, Blob, End, FARTHEST, Outline, STEPS, length, of_bent, of_half_ball};
use crate::error::Result;
use crate::field::bvh::Aabb;
use crate::field::cloud::{Cloud, nearer};
use crate::field::listed::Listed;
use nalgebra::SVector;
use sph::domain::{Axis, Domain, Region};
use sph::geometry::unit_ball_volume;
use sph::parallel;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Mean offset of the particles about one, over that in half a ball, from which on the surface may be near.
const UNEVEN: f64 = 0.3;
/// Largest curvature that is allowed for, over that of a reach.
const MOST_BENT: f64 = 2.0;
/// Places at which a surface, or a box that is filled, is looked at, and the largest share of those within that may be empty for all that.
const LOOKS: usize = 4000;
const EMPTY: f64 = 0.01;
/// Of a body that fills its box: how far within the faces it is looked for, in spacings, and the largest sine of the angle between a
/// face and the surface there.
const WITHIN: f64 = 1.5;
const FLAT: f64 = 0.2;
/// How far particles are looked for on which a place depends, in what reaches to it.
const MARGIN: f64 = 1.5;
/// A surface whose normals have no smaller cosine between them has no edge, and how far that is looked for, in spacings, among no more than so many.
const SMOOTH: f64 = 0.6;
const LOOKED: [f64; 4] = [4.0, 8.0, 16.0, 32.0];
const ENOUGH: usize = 1000;

/// Numbers of outlines.
static COUNT: AtomicU64 = AtomicU64::new(0);

/// The particles nearest to one, itself first, and whether they lie to one side of it.
struct Surroundings {
    about: Vec<u32>,
    is_uneven: bool,
}

impl<const D: usize> Outline<D> {
    /// Particles by whose distance volumes are told, and over which they are evened out.
    const ABOUT: usize = 6 * (D + 1);
    const EVENED: usize = 2 * (D + 1);

    /// Where `particles` end in a domain that repeats as `domain` does; `None` where all its axes repeat, where they are few, or where no
    /// surface is found.
    ///
    /// # Errors
    /// Those of a cloud: too many points, or points that span no volume.
    pub(in crate::field) fn of(name: &str, particles: &Arc<Listed<D>>, domain: &Domain<D>) -> Result<Option<Ends<D>>> {
        if particles.len() <= 2 * Self::ABOUT || domain.axes.iter().all(|a| *a == Axis::Periodic) {
            return Ok(None);
        }
        let mut outline = Self {
            number: COUNT.fetch_add(1, Ordering::Relaxed),
            particles: Arc::clone(particles),
            domain: domain.clone(),
            blobs: Vec::new(),
            starts: Vec::new(),
            seen: Vec::new(),
            reaches: Vec::new(),
            depths: Vec::new(),
            surface: None,
            ends: Vec::new(),
        };
        let about = outline.measure();
        outline.look_around(about);
        let flat = outline.find_ends();
        outline.bend(&flat);
        let ends = outline.find_ends();
        let first: Vec<End<D>> = ends.iter().filter_map(|ends| ends.first().copied()).collect();
        outline.ends = ends.into_iter().flatten().collect();
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
        outline.look_for_edges(name, &first);
        if !outline.is_whole() {
            return Ok(None);
        }
        outline.measure_depths();
        Ok(Some(Ends::Surface(Arc::new(outline))))
    }

    /// Finds the volumes; returns those about each particle where their surroundings are uneven.
    fn measure(&mut self) -> Vec<Surroundings> {
        let points = self.particles.points();
        let found = parallel::map(points.len(), |i| {
            let about = self.particles.about(i, Self::ABOUT + 1);
            let reach = about.last().map_or(0.0, |f| f.1);
            let mut mean = [0.0; D];
            for (j, _) in &about[1..] {
                let offset = self.domain.displacement(&points[i], &points[*j]);
                (0..D).for_each(|k| mean[k] += offset[k] / Self::ABOUT as f64);
            }
            let uneven = if reach > 0.0 { (length(&mean) / (of_half_ball(D) * reach)).min(1.0) } else { 1.0 };
            // The farthest is on the ball, and counts half.
            let volume = unit_ball_volume(D) * reach.powi(D as i32) * (1.0 - 0.5 * uneven) / (Self::ABOUT as f64 + 0.5);
            let about = about.into_iter().map(|f| f.0 as u32).collect();
            (volume, Surroundings { about, is_uneven: uneven > UNEVEN })
        });
        let even = |i: usize| {
            let logs = found[i].1.about[..Self::EVENED].iter().map(|&j| found[j as usize].0.ln());
            (logs.sum::<f64>() / Self::EVENED as f64).exp()
        };
        self.blobs = parallel::map(found.len(), |i| Blob::new(points[i], even(i)));
        found.into_iter().map(|f| f.1).collect()
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
    fn look_around(&mut self, around: Vec<Surroundings>) {
        let n = self.blobs.len();
        let lists = parallel::map(n, |i| {
            if around[i].about.iter().all(|&j| !around[j as usize].is_uneven) {
                return Vec::new();
            }
            let own = FARTHEST * self.blobs[i].spacing;
            let far = MARGIN * (self.blobs[i].reach() + own);
            let mut found = self.particles.within(&self.blobs[i].at, far);
            found.retain(|&(j, distance)| distance < self.blobs[j].reach() + own);
            found.sort_unstable_by(nearer);
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

    /// Finds how far about each particle there is no surface: points of the surface are nearer to each of its places than a spacing.
    fn measure_depths(&mut self) {
        let Some(surface) = &self.surface else { return };
        self.depths = parallel::map(self.blobs.len(), |i| {
            let (nearest, distance) = surface.near(&self.blobs[i].at);
            distance - self.ends[nearest].spacing.max(self.blobs[i].spacing)
        });
    }

    /// Finds how far about each point of the surface there is no edge, of which the `first` points by particle tell enough.
    fn look_for_edges(&mut self, name: &str, first: &[End<D>]) {
        let places: Vec<[f64; D]> = first.iter().map(|e| e.at).collect();
        let Ok(cloud) = Cloud::new(name, &places, Some(&self.domain)) else { return };
        let smooth = parallel::map(self.ends.len(), |i| {
            let End { at, normal, spacing, .. } = &self.ends[i];
            let is_turned = |j: usize| (0..D).map(|k| normal[k] * first[j].normal[k]).sum::<f64>() < SMOOTH;
            let mut known = 0.0;
            for reach in LOOKED.map(|reach| reach * spacing) {
                let found = cloud.within(at, reach);
                let edge = found.iter().filter(|f| is_turned(f.0)).map(|f| f.1).fold(f64::INFINITY, f64::min);
                known = edge.min(reach);
                if edge < reach || found.len() > ENOUGH {
                    break;
                }
            }
            known
        });
        self.ends.iter_mut().zip(smooth).for_each(|(end, smooth)| end.smooth = smooth);
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
            let End { at, normal, spacing, .. } = self.ends[nearest];
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
pub(in crate::field) fn share(i: usize, k: usize, d: usize) -> f64 {
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
