//! Compares the forces of ALARIC with the sum over all pairs, implemented independently from the paper's equations.

use super::fluid::{AlaricOptions, Fluid};
use crate::field::ScalarField;
use crate::seeding::{Seeding, seed};
use crate::target::{Target, at};
use sph::domain::{Axis, Domain, Region};
use sph::kernel::KernelName;
use std::f64::consts::{PI, TAU};

struct Bumpy;
impl<const D: usize> ScalarField<D> for Bumpy {
    fn value(&self, x: &[f64; D]) -> f64 {
        1.5 + (0..D).map(|k| 0.4 * (TAU * x[k] + k as f64).sin()).sum::<f64>()
    }
}

/// Wendland C4 of Dehnen & Aly (2012), Table 1, and its derivative by q.
fn wendland<const D: usize>(q: f64) -> (f64, f64) {
    if q >= 1.0 {
        return (0.0, 0.0);
    }
    let p = 1.0 - q;
    match D {
        1 => (1.5 * p.powi(5) * (1.0 + 5.0 * q + 8.0 * q * q), -1.5 * 14.0 * q * p.powi(4) * (1.0 + 4.0 * q)),
        _ => {
            let sigma = if D == 2 { 9.0 / PI } else { 495.0 / (32.0 * PI) };
            let value = p.powi(6) * (1.0 + 6.0 * q + 35.0 / 3.0 * q * q);
            (sigma * value, -sigma * 56.0 / 3.0 * q * p.powi(5) * (1.0 + 5.0 * q))
        }
    }
}

/// n and Omega of one particle (eq. 9 and 12 in number densities).
fn density<const D: usize>(i: usize, support: f64, distance: impl Fn(usize, usize) -> f64, count: usize) -> (f64, f64) {
    let d = D as f64;
    let (mut n, mut by_support) = (0.0, 0.0);
    for j in 0..count {
        let q = distance(i, j) / support;
        let (w, slope) = wendland::<D>(q);
        n += w / support.powi(D as i32);
        by_support -= (d * w + q * slope) / support.powi(D as i32 + 1);
    }
    (n, 1.0 + support / (d * n) * by_support)
}

fn check<const D: usize>(count: usize, viscosity: bool) {
    let domain = Domain::new([0.0; D], [1.0; D], [Axis::Periodic; D], Region::Box).unwrap();
    let target = Target::of_equal_masses(&domain, &Bumpy, count, 1.5);
    let start = seed(&target, Seeding::Random, 11).unwrap().positions;
    let options = AlaricOptions { viscosity, ..AlaricOptions::new(D) };
    let mut fluid = Fluid::<D, f64>::new(KernelName::WendlandC4, target, start, &options);
    for i in 0..count {
        fluid.velocities[i] = sph::array(|k| 3.0 * (i as f64 * 1.7 + k as f64).sin());
        fluid.alpha[i] = 0.3 + 0.2 * (i as f64).cos();
    }
    fluid.evaluate();
    let x: Vec<[f64; D]> = (0..count).map(|i| at(fluid.state.positions(), i)).collect();
    let away = |a: usize, b: usize| domain.displacement(&x[b], &x[a]);
    let distance = |a: usize, b: usize| away(a, b).iter().map(|v| v * v).sum::<f64>().sqrt();
    let support = &fluid.support;
    let sums: Vec<(f64, f64)> = (0..count).map(|i| density::<D>(i, support[i], distance, count)).collect();
    let pressure: Vec<f64> = (0..count).map(|i| sums[i].0 - target.number_density(&x[i])).collect();
    let slope = |r: f64, h: f64| wendland::<D>(r / h).1 / h.powi(D as i32 + 1);
    let fastest = fluid.velocities.iter().map(|v| v.iter().map(|c| c * c).sum::<f64>().sqrt()).fold(1.0, f64::max);
    let size = fluid.accelerations.iter().flatten().fold(0.0_f64, |m, a| m.max(a.abs()));
    for a in 0..count {
        let mut expected = [0.0; D];
        for b in (0..count).filter(|&b| b != a) {
            let (r, direction) = (distance(a, b), away(a, b));
            let term = |i: usize| pressure[i] / (sums[i].0.powi(2) * sums[i].1) * slope(r, support[i]);
            let mut along = -(term(a) + term(b));
            if viscosity {
                let relative: f64 =
                    (0..D).map(|k| (fluid.velocities[a][k] - fluid.velocities[b][k]) * direction[k] / r).sum();
                let mean = -0.5 * (slope(r, support[a]) + slope(r, support[b]));
                along -= fluid.alpha[b] * fastest * relative * mean / (0.5 * (sums[a].0 + sums[b].0));
            }
            (0..D).for_each(|k| expected[k] += along * direction[k] / r);
        }
        for k in 0..D {
            let error = (fluid.accelerations[a][k] - expected[k]).abs();
            assert!(error < 1e-10 * size, "{D}-D, particle {a}: {} against {}", fluid.accelerations[a][k], expected[k]);
        }
    }
}

#[test]
fn the_ideal_force_is_the_sum_over_all_pairs() {
    check::<1>(60, false);
    check::<2>(150, false);
    check::<3>(700, false);
}

#[test]
fn the_viscous_force_is_the_sum_over_all_pairs() {
    check::<1>(60, true);
    check::<2>(150, true);
    check::<3>(700, true);
}
