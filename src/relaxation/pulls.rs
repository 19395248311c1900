//! The gravity of a self-gravitating body on its particles.
//!
//! Gravity of the particles is found by the tree, and found anew now and then. In between, each particle that moves feels what it
//! felt before, and the difference of the target's gravity between both places.

use super::arrangement::Arrangement;
use crate::target::{Equilibrium, Positions, at};
use serde::{Deserialize, Serialize};
use sph::geometry::distance;
use sph::gravity::{OPENING_ANGLE, gravity, softening_radius};
use sph::lanes::Real;
use sph::parallel;

/// The target's g over the distance from the center, by cubic polynomials between nodes.
pub(super) struct Well<const D: usize> {
    center: [f64; D],
    radii: Vec<f64>,
    /// g / r, negative inward, and its slope.
    values: Vec<[f64; 2]>,
}

/// Nodes in even steps of the radius, and in even ratios: neither shells nor a core are missed.
const EVEN: usize = 2048;
const PER_OCTAVE: i32 = 64;
/// Octaves within the radius.
const OCTAVES: i32 = 24;
/// How far particles go at most, in radii.
const FARTHEST: f64 = 4.0;
/// Particles of a shell over which changes are averaged, and shells at most.
const PER_SHELL: usize = 400;
const SHELLS: usize = 48;
/// Step of differences, in radii of their place.
const STEP: f64 = 1e-4;

impl<const D: usize> Well<D> {
    /// That of a body of this radius; `None` where it is not its own gravity that holds it.
    pub fn new(equilibrium: &dyn Equilibrium<D>, radius: f64) -> Option<Self> {
        let center = equilibrium.own_center()?;
        let even = (1..=EVEN).map(|i| radius * i as f64 / EVEN as f64);
        let octaves = (-OCTAVES * PER_OCTAVE..).map(|i| radius * (f64::from(i) / f64::from(PER_OCTAVE)).exp2());
        let mut radii: Vec<f64> = octaves.take_while(|r| *r < FARTHEST * radius).chain(even).collect();
        radii.sort_by(f64::total_cmp);
        radii.dedup();
        let over_radius = |r: f64| {
            let x = sph::array(|k| center[k] + if k == 0 { r } else { 0.0 });
            equilibrium.gravity(&x, STEP * r)[0] / (x[0] - center[0])
        };
        let value = |r: f64| {
            let [below, here, above] = [1.0 - STEP, 1.0, 1.0 + STEP].map(|share| over_radius(share * r));
            [here, (above - below) / (2.0 * STEP * r)]
        };
        let values = parallel::map(radii.len(), |i| value(radii[i]));
        Some(Self { center, radii, values })
    }

    /// The target's g.
    pub fn at(&self, x: &[f64; D]) -> [f64; D] {
        let r = distance(x, &self.center);
        let above = self.radii.partition_point(|e| *e <= r).clamp(1, self.radii.len() - 1);
        let (a, b) = (self.radii[above - 1], self.radii[above]);
        let ([from, slope], [to, last_slope]) = (self.values[above - 1], self.values[above]);
        let (width, t) = (b - a, ((r - a) / (b - a)).clamp(0.0, 1.0));
        let s = 1.0 - t;
        let hermite = s * s * ((1.0 + 2.0 * t) * from + t * width * slope)
            + t * t * ((1.0 + 2.0 * s) * to - s * width * last_slope);
        sph::array(|k| hermite * (x[k] - self.center[k]))
    }
}

/// Per particle, D numbers each, what all others attract it with beyond the target's g.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Pulls(Vec<f64>);

impl Pulls {
    /// Of all particles, each of `mass`, on each other, and of a point in the center.
    pub fn new<const D: usize, R: Real>(
        arrangement: &Arrangement<'_, D, R>,
        (equilibrium, well): (&dyn Equilibrium<D>, &Well<D>),
        mass: f64,
        spacing: &[f64],
    ) -> Self {
        let softening = softening_radius::<D>(spacing.iter().map(|s| s.powi(-(D as i32))));
        let pulls = gravity(arrangement.tree(), &vec![mass; spacing.len()], softening, OPENING_ANGLE);
        let point = equilibrium.point_mass();
        let beyond = parallel::map(pulls.len(), |i| {
            let x = at(arrangement.positions(), i);
            let (wanted, others) = (well.at(&x), point.map_or([0.0; D], |p| p.pull(&x).acceleration));
            std::array::from_fn::<f64, D, _>(|k| pulls[i].acceleration[k] + others[k] - wanted[k])
        });
        Self(beyond.into_iter().flatten().collect())
    }

    /// These with what `fresh` ones differ from them by on average over shells; `fraction` is the share of the mass nearer to the center.
    pub fn following<const D: usize>(
        &self,
        fresh: &Self,
        (positions, fraction): (&Positions<D>, &[f64]),
        center: &[f64; D],
    ) -> Self {
        let n = fraction.len();
        let shells = (n / PER_SHELL).clamp(1, SHELLS);
        let shell = |i: usize| ((fraction[i] * shells as f64) as usize).min(shells - 1);
        let outward = |i: usize| -> [f64; D] {
            let x = at(positions, i);
            let r = distance(&x, center);
            sph::array(|k| if r > 0.0 { (x[k] - center[k]) / r } else { 0.0 })
        };
        let mut mean = vec![[0.0; 2]; shells];
        for i in 0..n {
            let way = outward(i);
            let more: f64 = (0..D).map(|k| way[k] * (fresh.0[i * D + k] - self.0[i * D + k])).sum();
            mean[shell(i)][0] += more;
            mean[shell(i)][1] += 1.0;
        }
        let mean: Vec<f64> = mean.iter().map(|[sum, count]| sum / count.max(1.0)).collect();
        // From the middle of a shell to that of the next.
        let at_share = |share: f64| {
            let t = (share * shells as f64 - 0.5).clamp(0.0, (shells - 1) as f64);
            let (low, part) = (t as usize, t.fract());
            (1.0 - part) * mean[low] + part * mean[(low + 1).min(shells - 1)]
        };
        let all = parallel::map(n, |i| {
            let (way, more) = (outward(i), at_share(fraction[i]));
            std::array::from_fn::<f64, D, _>(|k| self.0[i * D + k] + more * way[k])
        });
        Self(all.into_iter().flatten().collect())
    }

    /// Whether it is of `count` particles in `dimension` dimensions.
    pub fn is_of(&self, count: usize, dimension: usize) -> bool {
        self.0.len() == count * dimension
    }

    /// What particle `i` feels at `x`.
    pub fn on<const D: usize>(&self, i: usize, x: &[f64; D], well: &Well<D>) -> [f64; D] {
        let wanted = well.at(x);
        sph::array(|k| wanted[k] + self.0[i * D + k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An even core of a tenth of the radius with half of the mass, in an even body.
    struct Cored;

    fn enclosed(r: f64, d: i32) -> f64 {
        0.5 * (r / 0.1).min(1.0).powi(d) + 0.5 * r.min(1.0).powi(d)
    }

    impl<const D: usize> Equilibrium<D> for Cored {
        fn pressure(&self, _: &[f64; D]) -> f64 {
            1.0
        }
        fn gravity(&self, x: &[f64; D], _: f64) -> [f64; D] {
            let r = distance(x, &[0.5; D]);
            x.map(|v| -(v - 0.5) * enclosed(r, D as i32) / r.powi(D as i32))
        }
        fn has_gravity(&self) -> bool {
            true
        }
        fn own_center(&self) -> Option<[f64; D]> {
            Some([0.5; D])
        }
        fn gamma(&self) -> f64 {
            5.0 / 3.0
        }
    }

    fn check<const D: usize>() {
        let well = Well::<D>::new(&Cored, 1.0).unwrap();
        for i in 1..4000 {
            let r = 3.9 * (f64::from(i) / 4000.0).powi(3);
            let x: [f64; D] = sph::array(|k| 0.5 + r * if k == 0 { 1.0 } else { 0.0 });
            let (found, wanted) = (well.at(&x), Equilibrium::<D>::gravity(&Cored, &x, 0.0));
            let error = (found[0] / wanted[0] - 1.0).abs();
            // Where the density jumps, so does the slope.
            let limit = if [0.1, 1.0].iter().any(|jump| (r / jump - 1.0).abs() < 0.02) { 2e-3 } else { 1e-7 };
            assert!(error < limit, "{D}-D, {r}: {error:e}");
            assert!(found.iter().skip(1).all(|g| g.abs() < 1e-14));
        }
        assert!(well.at(&[0.5; D]).iter().all(|g| *g == 0.0));
    }

    #[test]
    fn the_well_is_that_of_the_target() {
        check::<1>();
        check::<2>();
        check::<3>();
    }
}
