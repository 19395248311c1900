//! Reversed gravity in a periodic box: points that repel each other as 1/r^(d-1) come to rest as a gravitational
//! glass (White 1994, in Schaeffer et al. 1996; Diehl et al. 2015, sec. 3.1.5).
//!
//! The force is that of all images, in Ewald's way: a screened part that is summed over pairs, and the smooth rest
//! as a Fourier sum. Each point is the source of a unit flux on a neutral background, so that div F = n - n_0, n_0 the mean.
//! A displacement by F/n_0 therefore undoes a long wave of the density at once, whatever its length: the motion below
//! takes such steps with some memory of the last one, which is what a damped fluid does.

use crate::field::quadrature::integrate;
use sph::parallel;
use std::f64::consts::TAU;

/// Inverse length of the screening, in inverse mean spacings.
const ALPHA: f64 = 0.6;
/// alpha r beyond which the screened part, and k/(2 alpha) beyond which the rest is left out: e^-5.8 of its size.
const CUTOFF: f64 = 2.4;
/// Iterations. The forces fall by a factor of a hundred in the first thirty and slowly afterwards.
const ITERATIONS: usize = 100;
/// Part of the last displacement that is repeated.
const MEMORY: f64 = 0.8;
/// Displacement over F/n_0. Linear stability needs less than 2 (1 + memory): no wave is stiffer than a density wave.
const RATE: f64 = 1.0;
/// No point moves farther at once, in spacings: random sets have pairs of any force.
const LONGEST: f64 = 0.2;
/// Entries of the table of the screened force.
const ENTRIES: usize = 2048;

/// Points come to rest in a periodic box with these edges, in units in which the mean spacing is 1.
pub(super) fn repel<const D: usize>(edges: &[f64; D], points: &mut [[f64; D]]) {
    let gravity = Gravity::new(edges, ALPHA);
    let mut last = vec![[0.0; D]; points.len()];
    for _ in 0..ITERATIONS {
        let forces = gravity.forces(points);
        last.iter_mut().zip(&forces).zip(points.iter_mut()).for_each(|((step, force), x)| {
            let free: [f64; D] = sph::array(|k| RATE * force[k] + MEMORY * step[k]);
            let length = free.iter().map(|v| v * v).sum::<f64>().sqrt();
            let part = if length > LONGEST { LONGEST / length } else { 1.0 };
            *step = free.map(|v| part * v);
            *x = sph::array(|k| (x[k] + step[k]).rem_euclid(edges[k]));
        });
    }
}

/// One wave of the Fourier sum: whole periods along the axes, and (2/V) k/k^2 exp(-k^2/(4 alpha^2)).
struct Wave<const D: usize> {
    periods: [i32; D],
    strength: [f64; D],
}

struct Gravity<const D: usize> {
    edges: [f64; D],
    reach: f64,
    /// Images along each axis, on either side of the nearest, that the reach may meet.
    images: [i32; D],
    /// Screened force times r^(d-1), evenly over the squared distance up to the reach.
    table: Vec<f64>,
    waves: Vec<Wave<D>>,
    /// Most periods of a wave along each axis.
    most: [usize; D],
}

impl<const D: usize> Gravity<D> {
    fn new(edges: &[f64; D], alpha: f64) -> Self {
        let reach = CUTOFF / alpha;
        let waves = waves(edges, alpha);
        Self {
            most: sph::array(|k| waves.iter().map(|w| w.periods[k].unsigned_abs() as usize).max().unwrap_or(0)),
            edges: *edges,
            reach,
            // Half an edge that is as long as the reach but for rounding needs none.
            images: edges.map(|e| (reach / e - 0.5 - 1e-9).ceil().max(0.0) as i32),
            table: (0..=ENTRIES).map(|i| screened::<D>(alpha, reach * (i as f64 / ENTRIES as f64).sqrt())).collect(),
            waves,
        }
    }

    fn forces(&self, points: &[[f64; D]]) -> Vec<[f64; D]> {
        let per_point = self.most.iter().map(|m| m + 1).sum();
        let mut phases = vec![[0.0; 2]; per_point * points.len()];
        parallel::update_rows(&mut phases, per_point, |i, out| self.phases(&points[i], out));
        let phases: Vec<&[[f64; 2]]> = phases.chunks_exact(per_point).collect();
        let sums = parallel::tasks(self.waves.len(), |w| {
            phases.iter().fold([0.0; 2], |sum, phases| {
                let [c, s] = phase(phases, &self.most, &self.waves[w].periods);
                [sum[0] + c, sum[1] + s]
            })
        });
        parallel::tasks(points.len(), |i| {
            let mut force = self.near(&points[i], points);
            for (wave, sum) in self.waves.iter().zip(&sums) {
                let [c, s] = phase(phases[i], &self.most, &wave.periods);
                let amplitude = s * sum[0] - c * sum[1];
                (0..D).for_each(|k| force[k] += amplitude * wave.strength[k]);
            }
            force
        })
    }

    /// cos and sin of 0, 1, 2 ... periods along each axis, one axis behind the other.
    fn phases(&self, x: &[f64; D], out: &mut [[f64; 2]]) {
        let mut first = 0;
        for k in 0..D {
            for n in 0..=self.most[k] {
                let angle = n as f64 * TAU * x[k] / self.edges[k];
                out[first + n] = [angle.cos(), angle.sin()];
            }
            first += self.most[k] + 1;
        }
    }

    /// The screened part on a point at `x`.
    fn near(&self, x: &[f64; D], points: &[[f64; D]]) -> [f64; D] {
        let mut force = [0.0; D];
        let scale = ENTRIES as f64 / (self.reach * self.reach);
        for y in points {
            let nearest: [f64; D] = sph::array(|k| {
                // Both lie within the box; rounding the quotient would take longer than all the rest.
                let (d, edge) = (x[k] - y[k], self.edges[k]);
                if d > 0.5 * edge {
                    d - edge
                } else if d < -0.5 * edge {
                    d + edge
                } else {
                    d
                }
            });
            if (0..D).any(|k| self.images[k] == 0 && nearest[k].abs() >= self.reach) {
                continue;
            }
            self.for_each_image(&nearest, |d| {
                let squared = d.iter().map(|v| v * v).sum::<f64>();
                let entry = scale * squared;
                if entry > 0.0 && entry < ENTRIES as f64 {
                    let (i, rest) = (entry as usize, entry.fract());
                    let strength = (self.table[i] + rest * (self.table[i + 1] - self.table[i])) / power::<D>(squared);
                    (0..D).for_each(|k| force[k] += strength * d[k]);
                }
            });
        }
        force
    }

    fn for_each_image(&self, nearest: &[f64; D], mut visit: impl FnMut([f64; D])) {
        if self.images == [0; D] {
            return visit(*nearest);
        }
        let mut turn = self.images.map(|n| -n);
        loop {
            visit(sph::array(|k| nearest[k] + self.edges[k] * f64::from(turn[k])));
            let Some(k) = (0..D).find(|&k| turn[k] < self.images[k]) else { return };
            turn[k] += 1;
            (0..k).for_each(|j| turn[j] = -self.images[j]);
        }
    }
}

/// r^d of a squared distance.
fn power<const D: usize>(squared: f64) -> f64 {
    match D {
        1 => squared.sqrt(),
        2 => squared,
        _ => squared * squared.sqrt(),
    }
}

/// Force times r^(d-1) of a point whose flux is hidden by a Gaussian cloud of opposite sign: 1/S_d, S_d the surface of
/// the unit sphere, times the fraction of the cloud that lies beyond r.
fn screened<const D: usize>(alpha: f64, r: f64) -> f64 {
    let cloud = |from: f64| {
        let segment = |i: i32| {
            let a = from + 0.25 * f64::from(i);
            integrate(8, a, a + 0.25, &|t: f64| t.powi(D as i32 - 1) * (-t * t).exp())
        };
        (0..32).map(segment).sum::<f64>()
    };
    cloud(alpha * r) / cloud(0.0) / (D as f64 * sph::geometry::unit_ball_volume(D))
}

/// One of each pair of opposite waves up to the cutoff.
fn waves<const D: usize>(edges: &[f64; D], alpha: f64) -> Vec<Wave<D>> {
    let longest = 2.0 * alpha * CUTOFF;
    let most = edges.map(|e| (longest * e / TAU) as i32);
    let volume: f64 = edges.iter().product();
    let mut found = Vec::new();
    let mut periods = most.map(|n| -n);
    loop {
        let first = periods.iter().find(|&&n| n != 0);
        let k: [f64; D] = sph::array(|k| TAU * f64::from(periods[k]) / edges[k]);
        let square: f64 = k.iter().map(|v| v * v).sum();
        if first.is_some_and(|&n| n > 0) && square <= longest * longest {
            let weight = 2.0 / (volume * square) * (-square / (4.0 * alpha * alpha)).exp();
            found.push(Wave { periods, strength: k.map(|v| weight * v) });
        }
        let Some(k) = (0..D).find(|&k| periods[k] < most[k]) else { return found };
        periods[k] += 1;
        (0..k).for_each(|j| periods[j] = -most[j]);
    }
}

/// cos and sin of a wave's phase, the product of those along the axes.
fn phase<const D: usize>(phases: &[[f64; 2]], most: &[usize; D], periods: &[i32; D]) -> [f64; 2] {
    let (mut c, mut s, mut start) = (1.0, 0.0, 0);
    for k in 0..D {
        let [a, b] = phases[start + periods[k].unsigned_abs() as usize];
        let b = if periods[k] < 0 { -b } else { b };
        (c, s) = (c * a - s * b, c * b + s * a);
        start += most[k] + 1;
    }
    [c, s]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::testing::Random;

    fn random<const D: usize>(edges: &[f64; D], count: usize) -> Vec<[f64; D]> {
        let mut random = Random::new(7);
        (0..count).map(|_| random.point::<D>()).map(|u| sph::array(|k| u[k] * edges[k])).collect()
    }

    fn forces_do_not_depend_on_the_split<const D: usize>(edges: [f64; D], count: usize) {
        let points = random(&edges, count);
        let (a, b) = (Gravity::new(&edges, 0.5).forces(&points), Gravity::new(&edges, 0.9).forces(&points));
        let size = a.iter().flatten().map(|v| v * v).sum::<f64>().sqrt();
        let apart = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        assert!(apart < 0.01 * size, "{D}-D: {apart} of {size}");
        for k in 0..D {
            let sum: f64 = a.iter().map(|f| f[k]).sum();
            assert!(sum.abs() < 1e-9 * size, "{D}-D: the forces add up to {sum}");
        }
    }

    #[test]
    fn the_split_into_near_and_far_does_not_show() {
        forces_do_not_depend_on_the_split([6.0, 7.0, 5.0], 210);
        forces_do_not_depend_on_the_split([12.0, 14.0], 168);
        // A needle, whose images all lie within the reach.
        forces_do_not_depend_on_the_split([40.0, 2.0, 1.5], 120);
    }

    #[test]
    fn two_points_repel_as_they_do_in_empty_space() {
        let edges = [60.0; 3];
        for r in [0.3, 1.0, 2.0] {
            let force = Gravity::new(&edges, ALPHA).forces(&[[30.0, 30.0, 30.0], [30.0 + r, 30.0, 30.0]])[1];
            let alone = 1.0 / (2.0 * TAU * r * r);
            assert!((force[0] / alone - 1.0).abs() < 0.02 && force[1].abs() < 1e-9, "{force:?} at {r}");
        }
    }

    #[test]
    fn long_waves_of_the_density_vanish() {
        let edges = [9.0_f64; 3];
        let mut points = random(&edges, 729);
        // Power of the longest waves: 1 for random points.
        let power = |points: &[[f64; 3]]| {
            (0..3)
                .map(|k| {
                    let sum = points.iter().fold([0.0; 2], |s, x| {
                        let angle: f64 = TAU * x[k] / edges[k];
                        [s[0] + angle.cos(), s[1] + angle.sin()]
                    });
                    (sum[0] * sum[0] + sum[1] * sum[1]) / 729.0
                })
                .sum::<f64>()
                / 3.0
        };
        assert!(power(&points) > 0.1);
        repel(&edges, &mut points);
        assert!(power(&points) < 1e-4, "{}", power(&points));
    }
}
