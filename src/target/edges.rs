//! Finds where the target changes faster than a sum over neighbors can follow, and where it is discontinuous.

use super::matter::Matter;
use super::{Positions, Target, at};
use sph::domain::{Axis, Wall};
use sph::geometry::distance;
use sph::parallel;

impl<const D: usize> Target<'_, D> {
    /// How sharply the target changes about `x`, in units in which 1 is too sharp for a sum over neighbors at
    /// `support` to follow: a factor e over a support radius, or a discontinuity or kink within its reach. `here` is n*.
    ///
    /// Of a smooth function the second difference of ln n* over s is four times that over s/2. What is left of
    /// that beyond a few percent is no curvature but an edge.
    pub fn sharpness(&self, x: &[f64; D], here: f64, support: f64) -> f64 {
        let reach = (EDGE_REACH * support).min(0.25 * self.domain.size());
        let bend = |way: &[f64; D], h: f64| {
            Some(self.logarithm_along(x, way, h)? + self.logarithm_along(x, way, -h)? - 2.0 * here.ln())
        };
        let edge = |way: &[f64; D], reach: f64| Some((bend(way, reach)? - 4.0 * bend(way, 0.5 * reach)?).abs() / EDGE);
        // Not a number where n* vanishes on both sides of something: as sharp as can be.
        let worse = |most: f64, e: f64| if e.is_nan() { f64::INFINITY } else { most.max(e) };
        let step = GRADIENT_STEP * support;
        if let Some(outward) = self.outward(x)
            && let Some(farthest) = edge(&outward, reach)
        {
            // A radial target changes along the radius only; several distances find thin layers.
            let steepness = support * self.log_derivative(x, here, &outward, step).abs();
            let nearer = NEARER.iter().filter_map(|share| edge(&outward, share * reach));
            return nearer.fold(worse(steepness, farthest), worse);
        }
        let slope = self.log_gradient(x, step);
        let steepness = support * slope.iter().map(|g| g * g).sum::<f64>().sqrt();
        ways::<D>().filter_map(|way| edge(&way, reach)).fold(steepness, worse)
    }

    /// Whether a sum over neighbors at the target's own support can have the target's density at `x`, for `ratio` = H n*^(1/d): what is
    /// resolved depends on places, not on where particles have gathered.
    pub fn is_resolved_at(&self, x: &[f64; D], ratio: f64) -> bool {
        let here = self.number_density(x);
        let support = self.support(here, ratio);
        !self.domain.is_edge_within(x, support) && self.sharpness(x, here, support) < 1.0
    }

    /// [`Self::is_resolved_at`] of some places, as the bits of a number. Where the target is smooth, a look from the middle of places that
    /// are near each other, farther than any of them looks, says it of all.
    pub fn are_resolved_at(&self, places: &[[f64; D]], ratio: f64) -> usize {
        if places.len() > 1 && self.is_smooth() && self.is_resolved_about(places, ratio) {
            return (1 << places.len()) - 1;
        }
        let bit = |(bit, x): (usize, &[f64; D])| usize::from(self.is_resolved_at(x, ratio)) << bit;
        places.iter().enumerate().map(bit).sum()
    }

    fn is_resolved_about(&self, places: &[[f64; D]], ratio: f64) -> bool {
        let middle = sph::array(|k| places.iter().map(|x| x[k]).sum::<f64>() / places.len() as f64);
        let radius = places.iter().map(|x| distance(x, &middle)).fold(0.0, f64::max);
        let here = self.number_density(&middle);
        let support = self.support(here, ratio);
        let farthest = WIDER * support + radius;
        let is_even = |share: f64| self.sharpness(&middle, here, share * farthest) < 1.0;
        radius <= TOGETHER * support && !self.domain.is_edge_within(&middle, farthest) && is_even(1.0) && is_even(0.5)
    }

    /// Whether an edge beyond which is vacuum is nearer than `reach`, and the target is not denser at its face.
    pub fn ends_within(&self, x: &[f64; D], reach: f64) -> bool {
        let (domain, here) = (self.domain, self.number_density(x));
        let falls_to = |k: usize, face: f64| {
            let mut y = *x;
            y[k] = face;
            !(self.number_density(&y) > here)
        };
        let is_near = |k: usize| match domain.axes[k] {
            Axis::Walls { lo, hi } if domain.has_faces(k) => {
                lo == Wall::Open && x[k] - domain.lo[k] < reach && falls_to(k, domain.lo[k])
                    || hi == Wall::Open && domain.hi[k] - x[k] < reach && falls_to(k, domain.hi[k])
            }
            _ => false,
        };
        (0..D).any(is_near) || domain.region.wall() == Some(Wall::Open) && domain.region.is_surface_within(x, reach)
    }

    /// |grad ln n*| times `support`: the logarithm of the change over a support radius.
    pub fn steepness(&self, x: &[f64; D], support: f64) -> f64 {
        support * self.log_gradient(x, GRADIENT_STEP * support).iter().map(|g| g * g).sum::<f64>().sqrt()
    }

    /// The direction in which a radial target changes; at its center any. None where images of it meet.
    fn outward(&self, x: &[f64; D]) -> Option<[f64; D]> {
        let center = self.center().filter(|_| !self.domain.axes.contains(&Axis::Periodic))?;
        let radius = distance(x, &center);
        let first = || sph::array(|k| if k == 0 { 1.0 } else { 0.0 });
        Some(if radius > 0.0 { sph::array(|k| (x[k] - center[k]) / radius) } else { first() })
    }

    /// [`Self::sharpness`] at every particle, where n* is `number_density`, for `ratio` = H n*^(1/d).
    pub fn sharpnesses(&self, positions: &Positions<D>, number_density: &[f64], ratio: f64) -> Vec<f64> {
        parallel::map(number_density.len(), |i| {
            self.sharpness(&at(positions, i), number_density[i], self.support(number_density[i], ratio))
        })
    }

    /// Whether the target is discontinuous within `support` of `x`: there the change over the interval of the largest
    /// change does not lessen as the interval is halved, as that of the steepest slope does.
    pub fn is_discontinuous_near(&self, x: &[f64; D], support: f64) -> bool {
        let reach = support.min(0.25 * self.domain.size());
        let changes = |way: [f64; D]| is_discontinuous(&|h| self.logarithm_along(x, &way, h), reach);
        // A radial target changes along the radius only.
        self.outward(x).map_or_else(|| ways::<D>().any(changes), changes)
    }

    /// ln n* at a distance `h` from `x`; `None` outside of the domain, or of the region that this is the target of.
    pub(super) fn logarithm_along(&self, x: &[f64; D], way: &[f64; D], h: f64) -> Option<f64> {
        let mut y: [f64; D] = sph::array(|k| x[k] + h * way[k]);
        self.domain.wrap(&mut y);
        self.density_inside(&y).map(f64::ln)
    }

    /// [`Self::is_discontinuous_near`] at every particle, for `ratio` = H n*^(1/d); empty where no particle is near a
    /// discontinuity. `sharpness` is that of [`Self::sharpnesses`]: below 1 there is none.
    pub fn near_discontinuities(
        &self,
        positions: &Positions<D>,
        number_density: &[f64],
        sharpness: &[f64],
        ratio: f64,
    ) -> Vec<bool> {
        let near = parallel::map(number_density.len(), |i| {
            !(sharpness[i] < 1.0)
                && self.is_discontinuous_near(&at(positions, i), self.support(number_density[i], ratio))
        });
        if near.contains(&true) { near } else { Vec::new() }
    }
}

/// Whether `f`, a logarithm (`None` outside of the domain), is discontinuous within `reach` of 0.
fn is_discontinuous(f: &dyn Fn(f64) -> Option<f64>, reach: f64) -> bool {
    let step = 2.0 * reach / INTERVALS as f64;
    let change = |a: f64, b: f64| Some((f(b)? - f(a)?).abs());
    let widest = (0..INTERVALS)
        .map(|i| i as f64 * step - reach)
        .filter_map(|a| Some((change(a, a + step)?, a)))
        .fold((0.0, 0.0), |most, next| if next.0 > most.0 { next } else { most });
    let (all, mut a) = widest;
    if !(all > LEAST_CHANGE) {
        return false;
    }
    let (mut width, mut left) = (step, all);
    for _ in 0..HALVINGS {
        width *= 0.5;
        let (lower, upper) = (change(a, a + width).unwrap_or(0.0), change(a + width, a + 2.0 * width).unwrap_or(0.0));
        if upper > lower {
            a += width;
        }
        left = lower.max(upper);
    }
    left > 0.5 * all || left.is_infinite()
}

/// Directions from the center of a cube (a square) to its faces, edges and corners, one of each opposite pair: none
/// is farther than 28 degrees from one of them.
pub(crate) fn ways<const D: usize>() -> impl Iterator<Item = [f64; D]> {
    // The steps -1, 0, 1 along each axis as digits; the second half of the numbers mirrors the first.
    let all = 3usize.pow(D as u32);
    (all / 2 + 1..all).map(|code| {
        let step: [f64; D] = sph::array(|k| (code / 3usize.pow(k as u32) % 3) as f64 - 1.0);
        let length = step.iter().map(|s| s * s).sum::<f64>().sqrt();
        sph::array(|k| step[k] / length)
    })
}

/// Step of the differences that give a gradient, in support radii: a tenth of a spacing.
const GRADIENT_STEP: f64 = 0.04;
/// How far edges are sought, in support radii.
const EDGE_REACH: f64 = 1.0;
/// Shares of that distance at which thin layers are sought along the radius of a radial target.
const NEARER: [f64; 2] = [0.8, 0.6];
/// How far from their middle places may be, in its support radii, that are looked at together, and by what part the support of one of
/// them is larger than that of the middle, where the density changes by less than a factor e over that.
const TOGETHER: f64 = 0.8;
const WIDER: f64 = 1.15;
/// Defect of the second differences of ln n* that makes an edge.
const EDGE: f64 = 0.15;
/// Intervals over which a discontinuity is first sought, and halvings of the one that changes most.
const INTERVALS: usize = 8;
const HALVINGS: usize = 8;
/// Change of ln n* that counts as a discontinuity, at least.
const LEAST_CHANGE: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::ScalarField;

    #[test]
    fn ways_are_apart_and_leave_no_gap() {
        let ways: Vec<[f64; 3]> = ways().collect();
        assert_eq!(ways.len(), 13);
        let cosine = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| a[k] * b[k]).sum::<f64>().abs();
        for (i, a) in ways.iter().enumerate() {
            assert!(ways[..i].iter().all(|b| cosine(a, b) < 0.9));
        }
        for i in 0..2000 {
            let (z, angle) = (i as f64 / 2000.0, 2.4 * i as f64);
            let across = (1.0 - z * z).sqrt();
            let e = [across * angle.cos(), across * angle.sin(), z];
            let nearest = ways.iter().map(|w| cosine(w, &e)).fold(0.0, f64::max);
            assert!(nearest > 28f64.to_radians().cos(), "{e:?}: {nearest}");
        }
    }

    struct Layers;
    impl ScalarField<3> for Layers {
        fn value(&self, x: &[f64; 3]) -> f64 {
            if distance(x, &[0.0; 3]) < 0.5 { 3.0 } else { 1.0 }
        }

        fn center(&self) -> Option<[f64; 3]> {
            Some([0.0; 3])
        }
    }

    #[test]
    fn a_radial_discontinuity_is_sharp_as_far_as_a_support_reaches() {
        let domain = sph::domain::Domain::ball([0.0; 3], 1.0, sph::domain::Wall::Open).unwrap();
        let target = Target::of_equal_masses(&domain, &Layers, 1000, 1.0);
        for i in 0..900 {
            let radius = f64::from(i) / 1000.0;
            let (z, angle) = (f64::from(i) / 450.0 - 1.0, 2.4 * f64::from(i));
            let across = (1.0 - z * z).sqrt();
            let x = [across * angle.cos(), across * angle.sin(), z].map(|e| radius * e);
            let sharpness = target.sharpness(&x, target.number_density(&x), 0.1);
            let near = (radius - 0.5).abs();
            assert!(if near < 0.1 { sharpness > 1.0 } else { sharpness < 1e-9 }, "at {radius}: {sharpness}");
        }
    }

    #[test]
    fn discontinuities_are_told_from_slopes_however_steep() {
        for place in [-0.9, -0.31, 0.0, 0.77] {
            assert!(is_discontinuous(&|h| Some(if h < place { 0.0 } else { 0.7 } + 0.2 * h), 1.0), "at {place}");
        }
        assert!(is_discontinuous(&|h| Some(if h < 0.4 { 1.0 } else { f64::NEG_INFINITY }), 1.0), "into vacuum");
        assert!(!is_discontinuous(&|h| Some(30.0 * h), 1.0), "an exponential");
        assert!(!is_discontinuous(&|h| Some(-(h * h) * 50.0), 1.0), "a Gaussian");
        assert!(!is_discontinuous(&|h| (h < 0.3).then_some(h), 1.0), "the end of the domain");
        assert!(!is_discontinuous(&|h| Some(if h < 0.2 { 0.0 } else { 0.05 }), 1.0), "next to nothing");
    }
}
