//! The gas around a softened point mass, within the radius inside which the model is replaced.
//!
//! Lengths are in units of the radius r_c, masses in what the model has within it, densities in the model's there, and G = 1, so
//! that all depends on three numbers of the model, see [`Edge`]. Of the gas mass m and the point's share c of all the mass
//!
//! dP/dr = -rho g, g = (m(r) + c F(r))/r^2, dm/dr = S r^2 rho, m(1) = 1 - c,
//!
//! with F the part of the point's mass within r by its softening kernel. Three laws close this:
//!
//! - cubic: rho = a r^3 + b r^2 + d (Phantom, set_cubic_core.f90 at 154c674). Density, gradient and mass at r_c give
//!   a = 30 (1 - c)/S + 2 s - 10, b = (s - 3 a)/2, d = 1 - a - b, with s the slope d ln rho/d ln r of the model;
//! - constant entropy: P/rho^gamma is that at r_c, so that the enthalpy h = gamma/(gamma - 1) P/rho follows dh/dr = -g; c is what
//!   leaves no mass in the center (Phantom, set_fixedentropycore.f90 at 0620daa);
//! - modified Lane-Emden (Ohlmann et al. 2017, A&A 599, A5, sec. 2.2): rho = rho_0 theta^n, which is the same equation for
//!   h = (n + 1) K rho^(1/n), K such that the gradient is the model's: h(1) = -n/s. The pressure is integrated from the
//!   model's at r_c with that density.

use crate::ode;
use sph::point_mass::Softening;

/// The model at the radius.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    /// S = 4 pi rho r^3/M.
    pub concentration: f64,
    /// s = d ln rho/d ln r, negative.
    pub slope: f64,
    /// P r/(rho G M).
    pub pressure: f64,
}

/// The gas by nodes from 0 to 1, and the point's share of the mass.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Inner {
    pub radii: Vec<f64>,
    pub density: Vec<f64>,
    /// Over that at the radius.
    pub pressure: Vec<f64>,
    pub core: f64,
}

/// Even steps from the radius to the center.
const STEPS: usize = 2000;
const BISECTIONS: usize = 200;
/// A cubic core is nowhere denser than this many times the model, as in Phantom.
const LARGEST_EXCESS: f64 = 1.3;

/// Enthalpy, gas mass and pressure in units of that at the radius.
type State = [f64; 3];

/// One law of the gas: density by radius and enthalpy.
struct Shot<'a> {
    edge: Edge,
    softening: Softening,
    core: f64,
    density: &'a dyn Fn(f64, f64) -> f64,
}

impl Shot<'_> {
    fn slope(&self, x: f64, [h, m, _]: State) -> State {
        let density = (self.density)(x, h);
        let pull = (m + self.core * self.softening.enclosed(x)) / (x * x);
        [-pull, self.edge.concentration * x * x * density, -density * pull / self.edge.pressure]
    }

    /// Inward from the radius; `None` where the gas takes more than the mass that there is. Beside the gas, the mass that is left over in
    /// the center.
    fn run(&self, enthalpy: f64) -> Option<(Inner, f64)> {
        let mut state = [enthalpy, 1.0 - self.core, 1.0];
        let step = -1.0 / STEPS as f64;
        let mut rows = vec![(1.0, (self.density)(1.0, state[0]), state[2])];
        for i in (2..=STEPS).rev() {
            let x = i as f64 / STEPS as f64;
            state = ode::step(x, state, step, |x, state| self.slope(x, state));
            if !(state[1] > 0.0) {
                return None;
            }
            let x = (i - 1) as f64 / STEPS as f64;
            rows.push((x, (self.density)(x, state[0]), state[2]));
        }
        let (x, density, pressure) = *rows.last()?;
        let left = state[1] - self.edge.concentration * x.powi(3) * density / 3.0;
        rows.push((0.0, density, pressure));
        rows.reverse();
        let inner = Inner {
            radii: rows.iter().map(|r| r.0).collect(),
            density: rows.iter().map(|r| r.1).collect(),
            pressure: rows.iter().map(|r| r.2).collect(),
            core: self.core,
        };
        Some((inner, left))
    }
}

impl Edge {
    /// The cubic core with the point's share `core` of the mass; without one, with the smallest that leaves the gas nowhere denser
    /// than 1.3 times the `model`.
    ///
    /// # Errors
    /// The shares between which there is such gas, where `core` is none of them or there are none: the least and the most.
    pub(super) fn cubic(
        &self,
        core: Option<f64>,
        model: &dyn Fn(f64) -> f64,
        softening: Softening,
    ) -> Result<Inner, [f64; 2]> {
        let s = self.slope;
        let share = |a: f64| 1.0 - self.concentration * (a + 10.0 - 2.0 * s) / 30.0;
        // b = 0, from where on the density falls outward everywhere.
        let most = share(s / 3.0);
        let least = (0..STEPS)
            .map(|i| i as f64 / STEPS as f64)
            .map(|x| {
                let base = 1.0 - 0.5 * s + 0.5 * s * x * x;
                (LARGEST_EXCESS * model(x) - base) / (x.powi(3) - 1.5 * x * x + 0.5)
            })
            .fold(f64::INFINITY, f64::min);
        let least = share(least).max(0.0);
        let core = core.unwrap_or(least);
        let tiny = 1e-9;
        if !(core > 0.0 && core < 1.0 && core >= least - tiny && core <= most + tiny) {
            return Err([least, most]);
        }
        let a = 30.0 * (1.0 - core) / self.concentration + 2.0 * s - 10.0;
        let b = 0.5 * (s - 3.0 * a);
        let d = 1.0 - a - b;
        let density = |x: f64, _: f64| x * x * (a * x + b) + d;
        let shot = Shot { edge: *self, softening, core, density: &density };
        shot.run(1.0).map(|(inner, _)| inner).ok_or([least, most])
    }

    /// Gas of one entropy.
    pub(super) fn isentropic(&self, gamma: f64, softening: Softening) -> Option<Inner> {
        let enthalpy = gamma / (gamma - 1.0) * self.pressure;
        self.polytropic(enthalpy, 1.0 / (gamma - 1.0), softening)
    }

    /// The modified Lane-Emden equation of the index `n`.
    pub(super) fn lane_emden(&self, n: f64, softening: Softening) -> Option<Inner> {
        self.polytropic(-n / self.slope, n, softening)
    }

    /// rho = (h/h(1))^n with the point's share for which no mass is left over in the center; `None` where there is none.
    fn polytropic(&self, enthalpy: f64, n: f64, softening: Softening) -> Option<Inner> {
        let density = |_: f64, h: f64| (h / enthalpy).powf(n);
        let shot = |core: f64| Shot { edge: *self, softening, core, density: &density }.run(enthalpy);
        let has_too_much = |core: f64| shot(core).is_some_and(|(_, left)| left > 0.0);
        if !has_too_much(0.0) {
            return None;
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if has_too_much(middle) { low = middle } else { high = middle }
        }
        shot(low).map(|(inner, _)| inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EDGE: Edge = Edge { concentration: 0.6, slope: -2.0, pressure: 0.4 };

    /// The gas mass by trapezoids, with the share of the point.
    fn total(inner: &Inner) -> f64 {
        let shell = |i: usize| 0.6 * inner.radii[i].powi(2) * inner.density[i];
        let pairs = 1..inner.radii.len();
        inner.core + pairs.map(|i| 0.5 * (shell(i) + shell(i - 1)) * (inner.radii[i] - inner.radii[i - 1])).sum::<f64>()
    }

    fn slope(values: &[f64], inner: &Inner, i: usize) -> f64 {
        (values[i + 1] - values[i - 1]) / (inner.radii[i + 1] - inner.radii[i - 1])
    }

    #[test]
    fn density_gradient_mass_and_weight_are_those_at_the_radius() {
        for softening in [Softening::CubicSpline, Softening::WendlandC2] {
            let model = |x: f64| x.max(1e-3).powi(-2);
            let cubic = EDGE.cubic(None, &model, softening).unwrap();
            let entropy = EDGE.isentropic(5.0 / 3.0, softening).unwrap();
            let lane = EDGE.lane_emden(3.0, softening).unwrap();
            let end = STEPS - 1;
            for (inner, has_gradient) in [(&cubic, true), (&entropy, false), (&lane, true)] {
                assert!((total(inner) - 1.0).abs() < 1e-6, "{}", total(inner));
                assert!(inner.core > 0.0 && inner.core < 1.0);
                assert_eq!((inner.radii[STEPS], inner.density[STEPS], inner.pressure[STEPS]), (1.0, 1.0, 1.0));
                let log: Vec<f64> = inner.density.iter().map(|v| v.ln()).collect();
                assert!(!has_gradient || (slope(&log, inner, end) + 2.0).abs() < 0.02);
                assert!(inner.density.windows(2).all(|w| w[1] <= w[0]));
                let mut mass = 0.0;
                for i in 1..STEPS {
                    let (x, step) = (inner.radii[i], inner.radii[i] - inner.radii[i - 1]);
                    mass += 0.6 * (x - 0.5 * step).powi(2) * 0.5 * (inner.density[i] + inner.density[i - 1]) * step;
                    let pull = (mass + inner.core * softening.enclosed(x)) / (x * x);
                    let holds = -0.4 * slope(&inner.pressure, inner, i) / inner.density[i];
                    assert!((holds / pull - 1.0).abs() < 1e-4 || x < 0.05, "{x}: {holds} against {pull}");
                }
            }
            let k = |i: usize| entropy.pressure[i] / entropy.density[i].powf(5.0 / 3.0);
            assert!((0..=STEPS).all(|i| (k(i) - 1.0).abs() < 1e-8));
        }
    }

    /// Without a point the equation is that of Lane and Emden: a polytrope cut anywhere leaves no core.
    #[test]
    fn a_polytropes_own_gas_needs_no_point() {
        // n = 1 at xi = 2: theta = sin(xi)/xi, M = xi sin(xi)... in units of 4 pi: sin(xi) - xi cos(xi).
        let xi = 2.0_f64;
        let (theta, mass) = (xi.sin() / xi, xi.sin() - xi * xi.cos());
        let edge = Edge {
            concentration: theta * xi.powi(3) / mass,
            slope: -mass / (xi * theta),
            pressure: 0.5 * theta * xi / mass,
        };
        let found = edge.lane_emden(1.0, Softening::CubicSpline);
        assert!(found.is_none_or(|inner| inner.core < 1e-6));
        // Less gas at the same gradient has a core.
        let less = Edge { concentration: 0.8 * edge.concentration, ..edge };
        assert!(less.lane_emden(1.0, Softening::CubicSpline).unwrap().core > 0.05);
    }

    #[test]
    fn what_is_no_core_is_refused_with_what_would_be() {
        let model = |x: f64| x.max(1e-3).powi(-2);
        let [least, most] = EDGE.cubic(Some(0.999), &model, Softening::CubicSpline).unwrap_err();
        assert!(least > 0.0 && most < 0.999 && least < most, "{least} {most}");
        assert!(EDGE.cubic(Some(0.5 * (least + most)), &model, Softening::CubicSpline).is_ok());
        // A uniform ball.
        let flat = Edge { concentration: 3.0, slope: -1e-3, pressure: 0.4 };
        assert!(flat.cubic(None, &|_| 1.0, Softening::CubicSpline).is_err());
        assert!(flat.isentropic(5.0 / 3.0, Softening::CubicSpline).is_none());
    }
}
