//! Centers of mass of regions. Particles may have the right number and the right mass in each box, and still lie on one side of their region.

use crate::target::mass_points::MassPoints;
use crate::target::{Positions, Regions, Target, at};
use sph::domain::{Axis, Domain};
use sph::parallel;
use std::f64::consts::TAU;

/// Particles of a region from which on their center says something.
const FEW: f64 = 32.0;
/// What is left of the first harmonic of places that are spread along a periodic axis: less has no phase, and no center.
const SPREAD: f64 = 0.05;

/// First moments of what lies in one region: along open axes the sum of the coordinate, along periodic ones of the first harmonic.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moments<const D: usize> {
    weight: f64,
    sums: [[f64; 2]; D],
}

impl<const D: usize> Moments<D> {
    const NONE: Self = Self { weight: 0.0, sums: [[0.0; 2]; D] };

    fn add(&mut self, domain: &Domain<D>, x: &[f64; D], weight: f64) {
        self.weight += weight;
        for k in 0..D {
            let of = match domain.axes[k] {
                Axis::Periodic => {
                    let (sin, cos) = (TAU * (x[k] - domain.lo[k]) / domain.extent()[k]).sin_cos();
                    [cos, sin]
                }
                Axis::Walls { .. } => [x[k], 0.0],
            };
            (0..2).for_each(|c| self.sums[k][c] += weight * of[c]);
        }
    }

    /// Distance of the centers of both, along the axes along which they have one.
    fn apart(&self, other: &Self, domain: &Domain<D>) -> f64 {
        let mean = |m: &Self, k: usize| m.sums[k].map(|sum| sum / m.weight);
        let along = |k: usize| {
            let (a, b) = (mean(self, k), mean(other, k));
            match domain.axes[k] {
                Axis::Walls { .. } => a[0] - b[0],
                Axis::Periodic if a[0].hypot(a[1]).min(b[0].hypot(b[1])) < SPREAD => 0.0,
                Axis::Periodic => {
                    let turn = (a[1] * b[0] - a[0] * b[1]).atan2(a[0] * b[0] + a[1] * b[1]);
                    turn / TAU * domain.extent()[k]
                }
            }
        };
        (0..D).map(|k| along(k).powi(2)).sum::<f64>().sqrt()
    }
}

/// Those of all regions of a target, as points of mass.
pub(super) fn of_points<const D: usize>(
    (domain, regions): (&Domain<D>, &Regions<'_, D>),
    points: &MassPoints<D>,
) -> Vec<Moments<D>> {
    let positions = points.positions();
    let of = parallel::map(positions[0].len(), |i| regions.of(&at(positions, i)));
    moments((domain, regions.number()), positions, &of, &|i| points.share()[i])
}

/// Distances of the centers of particles from those of their regions, over the mean spacing there; none of regions with few particles.
pub(super) fn shifts<const D: usize>(
    (target, regions): (&Target<'_, D>, &Regions<'_, D>),
    wanted: &[Moments<D>],
    positions: &Positions<D>,
) -> Vec<Option<f64>> {
    let n = positions[0].len();
    let of = parallel::map(n, |i| regions.of(&at(positions, i)));
    let spacing = parallel::map(n, |i| target.spacing(target.number_density(&at(positions, i))));
    let found = moments((target.domain, wanted.len()), positions, &of, &|_| 1.0);
    let mut spacings = vec![0.0; wanted.len()];
    of.iter().zip(&spacing).filter_map(|(of, s)| Some(((*of)?, s))).for_each(|(region, s)| spacings[region] += s);
    let shift = |region: usize| {
        let (wanted, found) = (&wanted[region], &found[region]);
        let spacing = spacings[region] / found.weight;
        (wanted.weight > 0.0 && found.weight >= FEW && spacing > 0.0)
            .then(|| found.apart(wanted, target.domain) / spacing)
    };
    (0..wanted.len()).map(shift).collect()
}

fn moments<const D: usize>(
    (domain, regions): (&Domain<D>, usize),
    positions: &Positions<D>,
    of: &[Option<usize>],
    weight: &dyn Fn(usize) -> f64,
) -> Vec<Moments<D>> {
    let mut all = vec![Moments::NONE; regions];
    for (i, region) in of.iter().enumerate() {
        if let Some(region) = *region {
            all[region].add(domain, &at(positions, i), weight(i));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use sph::domain::Region;

    /// A row of places that lie across the face of a periodic axis has its center there, and one along a whole axis has none.
    #[test]
    fn centers_are_apart_by_the_nearest_way() {
        let axes = [Axis::Periodic, Axis::OPEN];
        let domain = Domain::new([0.0, -1.0], [2.0, 1.0], axes, Region::Box).unwrap();
        let row = |shift: f64, width: f64| {
            let mut all = Moments::NONE;
            (0..40).for_each(|i| {
                let x = (1.9 + shift + width * (f64::from(i) + 0.5) / 40.0).rem_euclid(2.0);
                all.add(&domain, &[x, 0.5 * shift], 2.0);
            });
            all
        };
        let expected = 0.3_f64.hypot(0.15);
        assert!((row(0.3, 0.4).apart(&row(0.0, 0.4), &domain) - expected).abs() < 1e-12);
        assert!((row(0.3, 2.0).apart(&row(0.0, 2.0), &domain) - 0.15).abs() < 1e-12);
        assert!(row(0.3, 0.4).apart(&row(0.3, 0.4), &domain) < 1e-12);
    }
}
