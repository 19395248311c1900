//! Bare points: Shepard's weights over the nearest points, in the local form of Franke and Little (1980, doi
//! 10.1002/nme.1620150306), `w_i = ((R - d_i) / (R d_i))^2` with `R` the distance of the farthest one used.
//! Exact at the points, within the range of the values around, continuous, O(log N).
//!
//! Points with a domain of their own have images across its periodic axes; others fill their bounding box.
//!
//! Matter ends where the nearest point is farther away than that point's own 2^D-th neighbor; no place
//! within a lattice or a glass is.

use super::bvh::Aabb;
use super::sampled::{Outside, Sampler};
use crate::error::{Error, Result};
use sph::domain::{Axis, Domain, Region};
use sph::nearest::Nearest;
use sph::parallel;
use sph_formats::Values;

pub(crate) struct Cloud<const D: usize> {
    tree: Nearest<D>,
    /// How far each point's matter reaches, and the farthest of these.
    reach: Vec<f64>,
    farthest: f64,
    /// About all points.
    bounds: Aabb<D>,
    domain: Domain<D>,
}

impl<const D: usize> Cloud<D> {
    /// From points that are finite, in their own domain if they have one.
    ///
    /// # Errors
    /// No points, more than 2^32 of them, or points that span no volume.
    pub(crate) fn new(name: &str, points: &[[f64; D]], domain: Option<&Domain<D>>) -> Result<Self> {
        let wrapped: Vec<[f64; D]> = match domain {
            Some(domain) => points.iter().map(|p| domain.wrapped(p)).collect(),
            None => Vec::new(),
        };
        let points = if domain.is_some() { wrapped.as_slice() } else { points };
        let bounds = Aabb::around(points);
        if points.len() < 2 || (0..D).any(|k| bounds.lo[k] >= bounds.hi[k]) {
            return Err(Error::field(
                name,
                format!(
                    "the {} points of the cloud span no {D}-dimensional box ({} to {}); choose another dimension",
                    points.len(),
                    super::check::point_text(&bounds.lo),
                    super::check::point_text(&bounds.hi)
                ),
            ));
        }
        let tree = Nearest::new(points).map_err(|e| Error::field(name, e.to_string()))?;
        let domain = match domain {
            Some(domain) => domain.clone(),
            None => Domain::new(bounds.lo, bounds.hi, [Axis::OPEN; D], Region::Box)?,
        };
        let mut cloud = Self { tree, reach: vec![], farthest: f64::INFINITY, bounds, domain };
        let neighbors = (1 << D) + 1;
        cloud.reach = parallel::map(points.len(), |i| match cloud.nearest(&points[i], neighbors).last() {
            Some(&(_, d)) if points.len() >= neighbors => d,
            _ => f64::INFINITY,
        });
        cloud.farthest = cloud.reach.iter().copied().fold(0.0, f64::max);
        Ok(cloud)
    }

    pub(crate) fn domain(&self) -> Domain<D> {
        self.domain.clone()
    }

    /// The nearest `n` points or images of points, and their distances, ascending.
    pub(super) fn nearest(&self, x: &[f64; D], n: usize) -> Vec<(usize, f64)> {
        let n = n.min(self.len());
        let x = self.domain.wrapped(x);
        let mut found = self.tree.find(&x, n);
        let reach = found.last().map_or(0.0, |f| f.1);
        for image in self.images_within(&x, reach) {
            found.extend(self.tree.find(&image, n));
        }
        found.sort_unstable_by(nearer);
        found.truncate(n);
        found
    }

    /// The same, in a fraction of the time where `reach` is a little more than how far they reach: a tree finds all that are near with
    /// less work than the nearest of them.
    pub(super) fn nearest_about(&self, x: &[f64; D], n: usize, reach: f64) -> Vec<(usize, f64)> {
        let mut found = self.within(x, reach);
        if found.len() < n {
            return self.nearest(x, n);
        }
        if found.len() > n {
            found.select_nth_unstable_by(n, nearer);
            found.truncate(n);
        }
        found.sort_unstable_by(nearer);
        found
    }

    /// The points or images of points no farther from `x` than `reach`, and their distances, in no order that means anything.
    pub(super) fn within(&self, x: &[f64; D], reach: f64) -> Vec<(usize, f64)> {
        let x = self.domain.wrapped(x);
        let mut found = self.tree.within(&x, reach);
        for image in self.images_within(&x, reach) {
            found.extend(self.tree.within(&image, reach));
        }
        found
    }

    /// Images of `x`, but itself, from which a point of the box may be as near as `reach`.
    fn images_within(&self, x: &[f64; D], reach: f64) -> Vec<[f64; D]> {
        let (lo, hi) = (&self.domain.lo, &self.domain.hi);
        let is_inside = |k: usize| x[k] - lo[k] > reach && hi[k] - x[k] > reach;
        if (0..D).all(|k| self.domain.axes[k] != Axis::Periodic || is_inside(k)) {
            return Vec::new();
        }
        let periodic: Vec<usize> = (0..D).filter(|&k| self.domain.axes[k] == Axis::Periodic).collect();
        let extent = self.domain.extent();
        let image = |code: usize| {
            let (mut image, mut rest, mut gap) = (*x, code, 0.0);
            for &k in &periodic {
                image[k] += [0.0, 1.0, -1.0][rest % 3] * extent[k];
                rest /= 3;
                gap += (self.domain.lo[k] - image[k]).max(image[k] - self.domain.hi[k]).max(0.0).powi(2);
            }
            (gap.sqrt() <= reach).then_some(image)
        };
        (1..3_usize.pow(periodic.len() as u32)).filter_map(image).collect()
    }
}

/// The order of points by their distance; of equal distances that of their numbers.
pub(super) fn nearer(a: &(usize, f64), b: &(usize, f64)) -> std::cmp::Ordering {
    a.1.total_cmp(&b.1).then(a.0.cmp(&b.0))
}

/// Turns distances, ascending, into weights that sum to 1; `all` says whether there are no other points.
pub(super) fn weigh(found: &mut [(usize, f64)], all: bool) {
    let farthest = found.last().map_or(0.0, |f| f.1);
    // Where every point of the cloud takes part, the farthest keeps a weight too.
    let radius = if all { 2.0 * farthest } else { farthest };
    let nearest = found.first().map_or(0.0, |f| f.1);
    if nearest <= 1e-12 * radius || radius == 0.0 {
        // At a point, or at several in one place.
        found.iter_mut().for_each(|f| f.1 = if f.1 <= 1e-12 * radius { 1.0 } else { 0.0 });
    } else if nearest == farthest {
        found.iter_mut().for_each(|f| f.1 = 1.0);
    } else {
        found.iter_mut().for_each(|f| f.1 = ((radius - f.1) / f.1 * nearest / radius).powi(2));
    }
    let sum: f64 = found.iter().map(|f| f.1).sum();
    found.iter_mut().for_each(|f| f.1 /= sum);
}

impl<const D: usize> Cloud<D> {
    pub(super) fn len(&self) -> usize {
        self.tree.len()
    }

    /// Whether `x` is within the box, along the axes that do not repeat.
    pub(super) fn is_boxed(&self, x: &[f64; D]) -> bool {
        let (lo, hi) = (&self.domain.lo, &self.domain.hi);
        let slack = |k: usize| 1e-12 * (hi[k] - lo[k]);
        let inside = |k: usize| x[k] >= lo[k] - slack(k) && x[k] <= hi[k] + slack(k);
        (0..D).all(|k| self.domain.axes[k] == Axis::Periodic || inside(k))
    }

    /// Whether there is matter at `x`, whose nearest point, and the distance from it, is `nearest`.
    pub(super) fn holds(&self, x: &[f64; D], nearest: (usize, f64)) -> bool {
        self.is_boxed(x) && nearest.1 <= self.reach[nearest.0]
    }

    /// The point that is nearest to `x` or has the nearest image, and its distance.
    pub(super) fn near(&self, x: &[f64; D]) -> (usize, f64) {
        let x = self.domain.wrapped(x);
        let own = self.tree.one(&x);
        let images = self.images_within(&x, own.1).into_iter().map(|image| self.tree.one(&image));
        images.fold(own, |a, b| if nearer(&b, &a).is_lt() { b } else { a })
    }

    /// Whether there is no matter within `reach` of `x`.
    pub(super) fn is_bare_within(&self, x: &[f64; D], reach: f64) -> bool {
        self.near(x).1 > reach + self.farthest
    }

    /// Whether no point or image reaches `x` from the bounds of all points.
    pub(super) fn is_far_from(&self, x: &[f64; D]) -> bool {
        let x = self.domain.wrapped(x);
        let is_far = |x: &[f64; D]| self.bounds.distance_squared(x).sqrt() > self.farthest;
        is_far(&x) && self.images_within(&x, self.farthest).iter().all(is_far)
    }
}

impl<const D: usize> Sampler<D> for Cloud<D> {
    fn sample(&self, values: &Values, stride: usize, x: &[f64; D], outside: Outside, out: &mut [f64]) -> bool {
        let n = 4 * (D + 1);
        if outside == Outside::Reject && self.is_far_from(x) {
            return false;
        }
        let mut found = self.nearest(x, n);
        if outside == Outside::Reject && !found.first().is_some_and(|&nearest| self.holds(x, nearest)) {
            return false;
        }
        weigh(&mut found, self.len() <= n);
        out.fill(0.0);
        for (i, w) in found {
            for (c, v) in out.iter_mut().enumerate() {
                *v += w * values.get(i * stride + c);
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::super::ScalarField;
    use super::super::testing::Random;
    use super::*;
    use crate::field::sampled::SampledDensity;
    use std::sync::Arc;

    fn cloud<const D: usize>(n: usize, f: impl Fn(&[f64; D]) -> f64) -> (Vec<[f64; D]>, SampledDensity<Cloud<D>>) {
        let mut random = Random::new(2);
        let points: Vec<[f64; D]> = (0..n).map(|_| random.point()).collect();
        let values = Values::F64(points.iter().map(f).collect());
        let sampler = Arc::new(Cloud::new("rho", &points, None).unwrap());
        (points, SampledDensity { sampler, values })
    }

    fn exact_and_bounded<const D: usize>() {
        let f = |x: &[f64; D]| 1.0 + x.iter().sum::<f64>();
        for n in [3, 20, 5000] {
            let (points, field) = cloud(n, f);
            for p in &points {
                assert!((field.value(p) - f(p)).abs() < 1e-12, "{p:?}");
            }
            let mut random = Random::new(4);
            for _ in 0..500 {
                let x = random.point::<D>();
                let v = field.value(&x);
                assert!(v == 0.0 || (1.0..=1.0 + D as f64).contains(&v), "{v}");
                if n == 5000 && v != 0.0 {
                    assert!((v - f(&x)).abs() < 0.2, "{v} {}", f(&x));
                }
            }
        }
    }

    #[test]
    fn points_are_met_and_bounds_kept_in_every_dimension() {
        exact_and_bounded::<1>();
        exact_and_bounded::<2>();
        exact_and_bounded::<3>();
    }

    #[test]
    fn matter_ends_with_the_points() {
        let mut points = Vec::new();
        for i in -10..=10_i32 {
            for j in -10..=10_i32 {
                for k in -10..=10_i32 {
                    if i * i + j * j + k * k <= 100 {
                        points.push([i, j, k].map(f64::from));
                    }
                }
            }
        }
        let values = Values::F32(vec![2.0; points.len()]);
        let field = SampledDensity { sampler: Arc::new(Cloud::new("rho", &points, None).unwrap()), values };
        assert_eq!(field.value(&[9.0, 9.0, 9.0]), 0.0);
        let mut random = Random::new(8);
        for _ in 0..2000 {
            let x = random.point::<3>().map(|v| 18.0 * v - 9.0);
            if x.iter().map(|v| v * v).sum::<f64>() < 81.0 {
                assert!((field.value(&x) - 2.0).abs() < 1e-12, "{x:?}");
            }
        }
    }

    /// The nearest of all 27 images of all points.
    #[test]
    fn images_across_periodic_faces_are_found() {
        let mut random = Random::new(5);
        let points: Vec<[f64; 3]> = (0..60).map(|_| sph::array(|_| random.unit())).collect();
        let axes = [Axis::Periodic, Axis::OPEN, Axis::Periodic];
        let domain = Domain::new([0.0; 3], [1.0; 3], axes, Region::Box).unwrap();
        let cloud = Cloud::new("rho", &points, Some(&domain)).unwrap();
        for _ in 0..50 {
            let x: [f64; 3] = sph::array(|_| random.unit());
            let distance = |p: &[f64; 3], i: i32, k: i32| {
                let d = [p[0] - x[0] + f64::from(i), p[1] - x[1], p[2] - x[2] + f64::from(k)];
                d.iter().map(|d| d * d).sum::<f64>().sqrt()
            };
            let images = |p: &[f64; 3]| (0..9).map(|c| distance(p, c / 3 - 1, c % 3 - 1)).collect::<Vec<_>>();
            let mut all: Vec<f64> = points.iter().flat_map(images).collect();
            all.sort_by(f64::total_cmp);
            let found: Vec<f64> = cloud.nearest(&x, 12).iter().map(|f| f.1).collect();
            assert!(found.iter().zip(&all).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}\n{:?}", &all[..12]);
            // Whether the guess reaches too far or not far enough.
            for guess in [0.5 * found[11], 1.2 * found[11], 0.7] {
                assert_eq!(cloud.nearest_about(&x, 12, guess), cloud.nearest(&x, 12), "{guess}");
            }
        }
    }

    #[test]
    fn coincident_points_share_and_flat_clouds_are_refused() {
        let points = vec![[0.0], [0.0], [1.0]];
        let sampler = Arc::new(Cloud::new("rho", &points, None).unwrap());
        let field = SampledDensity { sampler, values: Values::F64(vec![1.0, 3.0, 5.0]) };
        assert_eq!(field.value(&[0.0]), 2.0);
        assert!(Cloud::new("rho", &[[0.0, 1.0], [1.0, 1.0]], None).is_err());
        assert!(Cloud::<2>::new("rho", &[], None).is_err());
    }
}
