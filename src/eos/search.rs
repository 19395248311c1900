//! Inverse functions of an equation of state: densities, energies and adiabats.

use super::equation::EquationOfState;
use super::error::{EosError, Warmth};
use crate::ode;
use crate::roots::root;

/// Brackets grow by this factor, at most so often.
const GROWTH: f64 = 1.08;
const MOST_GROWTHS: usize = 400;
/// Largest step along an adiabat in ln rho: Runge-Kutta's error is some 1e-9 then.
const ADIABAT_STEP: f64 = 0.05;
const MOST_ADIABAT_STEPS: f64 = 1000.0;

impl EquationOfState {
    /// u of a material of this density.
    pub fn energy_with(&self, density: f64, warmth: Warmth) -> f64 {
        match warmth {
            // What the compression has put in, whatever it was before.
            _ if self.is_barotropic() => self.cold_energy(density),
            Warmth::Energy(u) => u,
            Warmth::Temperature(t) => self.energy_at(density, t),
            Warmth::Power { temperature, density: usual, exponent } => {
                self.energy_at(density, temperature * (density / usual).powf(exponent))
            }
        }
    }

    fn pressure_with(&self, density: f64, warmth: Warmth) -> f64 {
        self.pressure(density, self.energy_with(density, warmth))
    }

    /// rho(P, u) or rho(P, T): of several the one that is nearest to the usual density on the way from there, which is the condensed
    /// one. A pressure at or below the least that the material has gives the largest density at which it has that.
    ///
    /// # Errors
    /// A pressure that the material does not reach.
    pub fn density(&self, pressure: f64, warmth: Warmth) -> Result<f64, EosError> {
        self.density_near(pressure, warmth, self.usual_density())
    }

    /// [`Self::density`], looked for from `guess` on.
    ///
    /// # Errors
    /// As for [`Self::density`].
    pub fn density_near(&self, pressure: f64, warmth: Warmth, guess: f64) -> Result<f64, EosError> {
        let mut growth = 1.0 + 0.05 * (GROWTH - 1.0);
        let least = if let Self::Tillotson(solid) = self { solid.least_pressure } else { 0.0 };
        let pressure = pressure.max(least);
        let excess = |rho: f64| self.pressure_with(rho, warmth) - pressure;
        let (mut near, mut at_near) = (guess, excess(guess));
        let up = !(at_near > 0.0);
        for _ in 0..MOST_GROWTHS {
            let far = if up { near * growth } else { near / growth };
            let at_far = excess(far);
            if (at_far > 0.0) == up {
                let (low, high) = if up { (near, far) } else { (far, near) };
                let (at_low, at_high) = if up { (at_near, at_far) } else { (at_far, at_near) };
                return Ok(root(&excess, (low, at_low), (high, at_high)));
            }
            (near, at_near) = (far, at_far);
            growth = (growth * growth).min(GROWTH);
        }
        let ends = [guess.min(near), guess.max(near)].map(|rho| self.pressure_with(rho, warmth));
        Err(EosError::NoDensity { material: self.name(), pressure, warmth, least: ends[0], most: ends[1] })
    }

    /// u(rho, P).
    ///
    /// # Errors
    /// A pressure that is less than what the density alone makes, or another than a barotropic material has.
    pub fn energy(&self, density: f64, pressure: f64) -> Result<f64, EosError> {
        if let Self::IdealGas { gamma, .. } = self {
            return match pressure >= 0.0 {
                true => Ok(pressure / ((gamma - 1.0) * density)),
                false => Err(EosError::TooCold { material: self.name(), density, pressure, cold: 0.0 }),
            };
        }
        let cold = self.cold_energy(density);
        let least = self.pressure(density, cold);
        let too_cold = || EosError::TooCold { material: self.name(), density, pressure, cold: least };
        if self.is_barotropic() {
            return if (pressure - least).abs() <= 1e-6 * least.abs() { Ok(cold) } else { Err(too_cold()) };
        }
        if !(pressure >= least) {
            return if pressure >= least - 1e-12 * least.abs() { Ok(cold) } else { Err(too_cold()) };
        }
        let excess = |u: f64| self.pressure(density, u) - pressure;
        let mut width = (pressure / density).max(1e-3 * cold.abs()).max(f64::MIN_POSITIVE);
        let (mut low, mut at_low) = (cold, least - pressure);
        for _ in 0..MOST_GROWTHS {
            let high = low + width;
            let at_high = excess(high);
            if at_high > 0.0 {
                return Ok(root(&excess, (low, at_low), (high, at_high)));
            }
            (low, at_low) = (high, at_high);
            width *= 2.0;
        }
        Err(too_cold())
    }

    /// u after a compression from `from` (density and energy) to `density` without exchange of heat: du = P/rho^2 drho.
    pub fn adiabat(&self, from: [f64; 2], density: f64) -> f64 {
        let [start, energy] = from;
        match self {
            Self::IdealGas { gamma, .. } => return energy * (density / start).powf(gamma - 1.0),
            Self::Barotropic(law) => return energy + law.energy(density) - law.energy(start),
            _ => {}
        }
        let span = (density / start).ln();
        let steps = (span.abs() / ADIABAT_STEP).ceil().clamp(1.0, MOST_ADIABAT_STEPS);
        let h = span / steps;
        let (mut x, mut u) = (start.ln(), energy);
        let slope = |x: f64, [u]: [f64; 1]| {
            let rho = x.exp();
            [self.pressure(rho, u) / rho]
        };
        for _ in 0..steps as usize {
            [u] = ode::step(x, [u], h, slope);
            x += h;
        }
        u
    }
}
