//! The lowest density error that N equal particles can reach at the bottom of a density well (ALARIC,
//! appendix): the mass of one particle, spread over the ball that holds as much of the target, exceeds the
//! density at the center.

use crate::field::quadrature::integrate;
use sph::geometry::{unit_ball_volume, unit_sphere_area};

/// Points of the Gauss rule per panel, and panels.
const ORDER: usize = 8;
const PANELS: usize = 256;
/// Halvings of the interval in which lambda is sought: to rounding.
const BISECTIONS: usize = 200;

/// V lambda^d/Q (m/(V lambda^d) - rho*(0))^2 with Q the integral of rho*^2 over the unit ball, m = M/N the mass
/// of a particle and lambda the radius that encloses it. `density` is rho*(r) for r in [0, 1], symmetric
/// about a minimum at r = 0.
pub fn lowest_epsilon(d: usize, count: usize, density: impl Fn(f64) -> f64) -> f64 {
    let area = unit_sphere_area(d);
    let ball = |to: f64, power: i32| {
        let step = to / PANELS as f64;
        let shell = |r: f64| density(r).powi(power) * r.powi(d as i32 - 1);
        area * (0..PANELS).map(|p| integrate(ORDER, p as f64 * step, (p + 1) as f64 * step, &shell)).sum::<f64>()
    };
    let mass = ball(1.0, 1) / count as f64;
    let (mut lo, mut hi) = (0.0_f64, 1.0_f64);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (lo + hi);
        if ball(middle, 1) < mass {
            lo = middle
        } else {
            hi = middle
        }
        if hi - lo <= f64::EPSILON * hi {
            break;
        }
    }
    let volume = unit_ball_volume(d) * hi.powi(d as i32);
    volume / ball(1.0, 2) * (mass / volume - density(0.0)).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uniform_target_has_no_bound() {
        (1..=3).for_each(|d| assert!(lowest_epsilon(d, 100, |_| 2.0) < 1e-20));
    }

    /// rho* = r^2: m = A/((d+2) N), lambda = N^(-1/(d+2)), Q = A/(d+4).
    #[test]
    fn a_parabola_has_the_closed_form() {
        for d in 1..=3 {
            let (x, n) = (d as f64, 1000.0_f64);
            let area = x * unit_ball_volume(d);
            let volume = unit_ball_volume(d) * n.powf(-x / (x + 2.0));
            let mass = area / ((x + 2.0) * n);
            let expected = mass * mass / volume / (area / (x + 4.0));
            let got = lowest_epsilon(d, 1000, |r| r * r);
            assert!((got / expected - 1.0).abs() < 1e-9, "{d}-D: {got:e} against {expected:e}");
        }
    }

    /// Table 2 of the paper, which rounds to one digit (its last row's Delta is 1, misprinted 0.10).
    #[test]
    fn the_papers_column() {
        for (delta, paper) in [(0.0, 1e-4), (0.01, 7e-5), (0.05, 9e-6), (0.1, 8e-7), (0.5, 1e-9), (1.0, 8e-11)] {
            let well = |r: f64| (1.0 + delta) - (5.0 * r).cos() * (-5.0 * r * r).exp();
            let got = lowest_epsilon(1, 303, well);
            println!("Delta {delta}: {got:.2e}, paper {paper:.0e}");
            assert!((got / paper).ln().abs() < 2.0_f64.ln(), "Delta {delta}: {got:e}, paper {paper:e}");
        }
    }
}
