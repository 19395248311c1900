//! Points with lists of their nearest neighbors: the point nearest to a position is found by a walk that starts at the result for an earlier
//! position.
//!
//! With points of the list of `i` that are all within its reach `R_i`, a point is the nearest of all to a place `x` if none of its list is nearer and
//! `2 |x - x_i| <= R_i`: whatever is nearer to `x` is no farther than twice that from `x_i`, and so in the list. Where this cannot be known a tree is
//! asked. Of points as near as each other it is the first, wherever the walk began.

use super::cloud::{Cloud, nearer};
use crate::error::Result;
use sph::domain::{Axis, Domain};
use sph::parallel;
use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};

/// Points that are as near as each other, but for rounding.
pub(super) const ALIKE: f64 = 1.0 + 1e-12;
/// Steps of a walk after which, and distance of its beginning over the reach of its list from which on, a tree is faster.
const STEPS: usize = 4;
const FAR: f64 = 1.5;

pub(super) struct Listed<const D: usize> {
    cloud: Cloud<D>,
    domain: Domain<D>,
    /// In the domain.
    points: Vec<[f64; D]>,
    /// The points about each one by their distance, itself first, so many for each; none where there are no more than these.
    lists: Vec<u32>,
    count: usize,
    /// No more than their distances from it, which are not to be found anew for each place.
    spans: Vec<f32>,
    /// How far they reach; 0 where the nearest image of a point is not the only one.
    reach: Vec<f64>,
    /// Unlike that of any others.
    number: u64,
}

/// Numbers of such points.
static COUNT: AtomicU64 = AtomicU64::new(0);

thread_local! {
    /// Which points a thread has looked among, and which of them was found.
    static LAST: Cell<(u64, usize)> = const { Cell::new((u64::MAX, 0)) };
}

impl<const D: usize> Listed<D> {
    /// Points in a domain, with lists of `count`.
    ///
    /// # Errors
    /// Those of a cloud: too many points, or points that span no volume.
    pub(super) fn new(name: &str, points: &[[f64; D]], domain: &Domain<D>, count: usize) -> Result<Self> {
        let mut listed = Self {
            cloud: Cloud::new(name, points, Some(domain))?,
            domain: domain.clone(),
            points: points.iter().map(|p| domain.wrapped(p)).collect(),
            lists: Vec::new(),
            spans: Vec::new(),
            count,
            reach: Vec::new(),
            number: COUNT.fetch_add(1, Ordering::Relaxed),
        };
        listed.list();
        Ok(listed)
    }

    fn list(&mut self) {
        if self.points.len() <= self.count {
            return;
        }
        let period = self.shortest_period();
        let found = parallel::map(self.points.len(), |i| {
            let found = self.cloud.nearest(&self.points[i], self.count);
            let reach = found.last().map_or(0.0, |f| f.1);
            let reach = if 2.0 * reach < period { reach } else { 0.0 };
            (found.into_iter().map(|f| (f.0 as u32, below(f.1))).collect::<Vec<(u32, f32)>>(), reach)
        });
        self.reach = found.iter().map(|f| f.1).collect();
        (self.lists, self.spans) = found.into_iter().flat_map(|f| f.0).unzip();
    }

    fn shortest_period(&self) -> f64 {
        let extent = self.domain.extent();
        let periods = (0..D).filter(|&k| self.domain.axes[k] == Axis::Periodic).map(|k| extent[k]);
        periods.fold(f64::INFINITY, f64::min)
    }

    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    pub(super) fn points(&self) -> &[[f64; D]] {
        &self.points
    }

    /// The list of `i`; empty where there are none.
    pub(super) fn list_of(&self, i: usize) -> &[u32] {
        self.lists.get(i * self.count..(i + 1) * self.count).unwrap_or_default()
    }

    /// The same, each with no more than its distance from `i`.
    pub(super) fn spanned_list_of(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let spans = self.spans.get(i * self.count..(i + 1) * self.count).unwrap_or_default();
        self.list_of(i).iter().zip(spans).map(|(&j, &span)| (j as usize, f64::from(span)))
    }

    /// How far the list of `i` reaches; 0 where that is not known.
    pub(super) fn reach(&self, i: usize) -> f64 {
        self.reach.get(i).copied().unwrap_or(0.0)
    }

    pub(super) fn distance(&self, i: usize, x: &[f64; D]) -> f64 {
        self.domain.displacement(&self.points[i], x).iter().map(|d| d * d).sum::<f64>().sqrt()
    }

    /// Those nearest to point `i`, itself first.
    pub(super) fn about(&self, i: usize, n: usize) -> Vec<(usize, f64)> {
        let (x, reach) = (&self.points[i], self.reach(i));
        if reach == 0.0 {
            return self.cloud.nearest(x, n);
        }
        if n <= self.count {
            return self.list_of(i)[..n].iter().map(|&j| (j as usize, self.distance(j as usize, x))).collect();
        }
        // As far as they reach where points are as dense as those of the list, and a little more.
        let guess = 1.1 * reach * (n as f64 / self.count as f64).powf(1.0 / D as f64);
        self.cloud.nearest_about(x, n, guess)
    }

    /// The nearest `n` points or images of points, and their distances, ascending; in less time where they are known to be no farther than `most`.
    pub(super) fn nearest_about(&self, x: &[f64; D], n: usize, most: f64) -> Vec<(usize, f64)> {
        if most.is_finite() { self.cloud.nearest_about(x, n, ALIKE * most) } else { self.cloud.nearest(x, n) }
    }

    /// Whether there is no matter within `reach` of `x`.
    pub(super) fn is_bare_within(&self, x: &[f64; D], reach: f64) -> bool {
        self.cloud.is_bare_within(x, reach)
    }

    /// The points or images of points no farther from `x` than `reach`, and their distances, in no order that means anything.
    pub(super) fn within(&self, x: &[f64; D], reach: f64) -> Vec<(usize, f64)> {
        self.cloud.within(x, reach)
    }

    /// The point that is nearest to `x` or has the nearest image, and its distance.
    pub(super) fn near(&self, x: &[f64; D]) -> (usize, f64) {
        let (number, last) = LAST.get();
        let first = if number == self.number { last } else { 0 };
        let found = self.walked(x, first).unwrap_or_else(|| {
            let found = self.cloud.near(x);
            self.walked(x, found.0).unwrap_or(found)
        });
        LAST.set((self.number, found.0));
        found
    }

    /// The same; `None` where there is no matter at `x`.
    pub(super) fn held(&self, x: &[f64; D]) -> Option<(usize, f64)> {
        if self.cloud.is_far_from(x) {
            return None;
        }
        Some(self.near(x)).filter(|&nearest| self.cloud.holds(&self.domain.wrapped(x), nearest))
    }

    /// The same by a walk from point `i`, if it leads to what is sure to be the nearest.
    fn walked(&self, x: &[f64; D], i: usize) -> Option<(usize, f64)> {
        let mut best = (i, self.distance(i, x));
        // Not that of a NaN either.
        if !(best.1 <= FAR * self.reach(i)) {
            return None;
        }
        for _ in 0..STEPS {
            let (middle, distance) = best;
            let (mut alike, mut is_sure) = (ALIKE * distance, self.is_sure(best));
            for (j, span) in self.spanned_list_of(middle) {
                // Those that follow are no nearer to `x`.
                if span > 2.0 * ALIKE * distance {
                    break;
                }
                let next = (j, self.distance(j, x));
                if nearer(&next, &best).is_lt() {
                    (best, alike) = (next, ALIKE * next.1);
                }
                // Wherever the walk began, all that are as near as each other have to be sure of it.
                is_sure &= next.1 > alike || self.is_sure(next);
            }
            if best.0 == middle {
                return is_sure.then_some(best);
            }
        }
        None
    }

    /// Whether all that may be as near to a place as a point, which is so far from it, are in the point's list.
    fn is_sure(&self, (i, distance): (usize, f64)) -> bool {
        2.0 * ALIKE * ALIKE * distance < self.reach(i)
    }
}

/// The largest number of single precision that is no more.
fn below(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) > value { near.next_down() } else { near }
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::*;
    use sph::domain::Region;

    fn is_the_nearest<const D: usize>(points: &[[f64; D]], axes: [Axis; D], count: usize) -> usize {
        let domain = Domain::new([0.0; D], [1.0; D], axes, Region::Box).unwrap();
        let listed = Listed::new("rho", points, &domain, count).unwrap();
        let mut random = Random::new(3);
        let mut walked = 0;
        for round in 0..2000 {
            // Some beyond the box, and some right between points.
            let x: [f64; D] = match round % 4 {
                0 => sph::array(|_| 3.0 * random.unit() - 1.0),
                1 => {
                    let i = (random.unit() * points.len() as f64) as usize;
                    let list = listed.list_of(i);
                    let other = points[list.get(1).map_or(i, |j| *j as usize)];
                    sph::array(|k| 0.5 * (points[i][k] + other[k]))
                }
                _ => random.point(),
            };
            let all = (0..points.len()).map(|i| (i, listed.distance(i, &x)));
            let expected = all.min_by(nearer).unwrap();
            let found = listed.near(&x);
            assert!(
                (found.1 / expected.1 - 1.0).abs() < 1e-12 || found.1 == expected.1,
                "{x:?}: {found:?} {expected:?}"
            );
            // From anywhere to the same, or to nothing: from some of those about it, and from one that may be far.
            let about = listed.list_of(expected.0);
            for round in 0..5 {
                let any = (random.unit() * points.len() as f64) as usize;
                let first = if round == 0 || about.is_empty() { any } else { about[any % about.len()] as usize };
                if let Some(again) = listed.walked(&x, first) {
                    walked += 1;
                    assert_eq!(again, found, "{x:?} from {first}");
                    assert_eq!(again, expected, "{x:?} from {first}");
                }
            }
            assert_eq!(listed.near(&x), found);
        }
        walked
    }

    fn in_dimension<const D: usize>(n: usize) {
        let mut random = Random::new(1);
        let scattered: Vec<[f64; D]> = (0..n).map(|_| random.point()).collect();
        let side = (n as f64).powf(1.0 / D as f64) as usize;
        let lattice: Vec<[f64; D]> = (0..side.pow(D as u32))
            .map(|i| sph::array(|k| (i / side.pow(k as u32) % side) as f64 / side as f64))
            .collect();
        for points in [&scattered, &lattice] {
            for axes in [[Axis::OPEN; D], [Axis::Periodic; D]] {
                assert!(is_the_nearest(points, axes, 12) > 500);
                // As many as there are, so that there are no lists.
                assert_eq!(is_the_nearest(&scattered[..8], axes, 8), 0);
            }
        }
    }

    #[test]
    fn a_walk_from_any_point_leads_to_the_nearest() {
        in_dimension::<1>(40);
        in_dimension::<2>(200);
        in_dimension::<3>(600);
    }

    /// Matter is where the nearest of all images reaches, whether it is found among the nearest or asked for by itself, and far from all points as well.
    #[test]
    fn what_holds_a_place_is_the_nearest_image_that_reaches_it() {
        let mut random = Random::new(6);
        let points: Vec<[f64; 3]> = (0..200).map(|_| sph::array(|_| 0.3 * random.unit() - 0.1)).collect();
        for axes in [[Axis::Periodic; 3], [Axis::OPEN; 3], [Axis::Periodic, Axis::OPEN, Axis::REFLECTING]] {
            let domain = Domain::new([-1.0; 3], [1.0; 3], axes, Region::Box).unwrap();
            for count in [16, 200] {
                let listed = Listed::new("rho", &points, &domain, count).unwrap();
                let mut held = 0;
                for i in 0..2000 {
                    let width = if i % 2 == 0 { 0.5 } else { 2.0 };
                    let x: [f64; 3] = sph::array(|_| width * (random.unit() - 0.5));
                    let nearest = listed.cloud.nearest(&x, 1)[0];
                    assert_eq!(listed.near(&x), nearest, "{x:?}");
                    let expected = Some(nearest).filter(|&n| listed.cloud.holds(&x, n));
                    assert_eq!(listed.held(&x), expected, "{x:?}");
                    held += usize::from(expected.is_some());
                }
                assert!((70..1930).contains(&held), "{held}");
            }
        }
    }
}
