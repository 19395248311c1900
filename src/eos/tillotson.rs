//! The equation of state of Tillotson (1962, General Atomic report GA-3216; Melosh 1989, Impact Cratering, appendix II):
//!
//! P_c = (a + b/w) rho u + A mu + B mu^2, condensed or cold (rho > rho_0 or u < u_iv),
//! P_e = a rho u + (b rho u/w + A mu e^(-beta nu)) e^(-alpha nu^2), expanded and hot (rho < rho_0 and u > u_cv),
//!
//! with eta = rho/rho_0, mu = eta - 1, nu = 1/eta - 1, w = u/(u_0 eta^2) + 1, and a mixture linear in u between the two.
//!
//! As SWIFT and WoMa have it, no pressure is less than `least_pressure` (material parts rather than pull), P_c falls linearly to
//! 0 from `eta_min` to `eta_zero` where these are given, and T = (u - u_cold)/C_V. The constants are Melosh's table AII.3, those
//! of ice (and the pairs of eta) as in SWIFT's `tillotson.h`.

use super::response::Response;
use crate::ode;
use std::sync::OnceLock;

/// Constants of one material, in cgs.
#[derive(Debug, Clone, Copy)]
pub struct Tillotson {
    pub name: &'static str,
    /// rho_0.
    pub density: f64,
    /// a, b, alpha, beta.
    pub numbers: [f64; 4],
    /// A, B.
    pub moduli: [f64; 2],
    /// u_0, u_iv, u_cv.
    pub energies: [f64; 3],
    /// P_c is 0 below the first, whole above the second.
    pub tension: [f64; 2],
    pub least_pressure: f64,
    /// C_V per gram and kelvin.
    pub heat_capacity: f64,
    cold: &'static OnceLock<Vec<f64>>,
}

impl PartialEq for Tillotson {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// Pascals in dyn/cm^2.
const PA: f64 = 10.0;
/// J/kg in erg/g.
const J_KG: f64 = 1e4;
/// kg/m^3 in g/cm^3.
const KG_M3: f64 = 1e-3;

macro_rules! tillotson {
    ($label:literal, $rho:literal, $numbers:expr, [$a:literal, $b:literal], [$u0:literal, $iv:literal, $cv:literal], $tension:expr, $least:literal, $heat:literal) => {{
        static COLD: OnceLock<Vec<f64>> = OnceLock::new();
        Tillotson {
            name: $label,
            density: $rho * KG_M3,
            numbers: $numbers,
            moduli: [$a * PA, $b * PA],
            energies: [$u0 * J_KG, $iv * J_KG, $cv * J_KG],
            tension: $tension,
            least_pressure: $least * PA,
            heat_capacity: $heat * J_KG,
            cold: &COLD,
        }
    }};
}

/// In SI as in the tables: rho_0; a, b, alpha, beta; A, B; u_0, u_iv, u_cv; eta_zero, eta_min; least pressure; C_V.
impl Tillotson {
    pub fn iron() -> Self {
        let solid = [0.5, 1.5, 5.0, 5.0];
        tillotson!("iron", 7800.0, solid, [1.28e11, 1.05e11], [9.5e6, 2.4e6, 8.67e6], [0.0, 0.0], 0.01, 449.0)
    }

    pub fn granite() -> Self {
        let solid = [0.5, 1.3, 5.0, 5.0];
        tillotson!("granite", 2680.0, solid, [1.8e10, 1.8e10], [1.6e7, 3.5e6, 1.8e7], [0.0, 0.0], 0.01, 790.0)
    }

    pub fn basalt() -> Self {
        let solid = [0.5, 1.5, 5.0, 5.0];
        tillotson!("basalt", 2700.0, solid, [2.67e10, 2.67e10], [4.87e8, 4.72e6, 1.82e7], [0.0, 0.0], 0.01, 790.0)
    }

    pub fn water() -> Self {
        let liquid = [0.7, 0.15, 10.0, 5.0];
        tillotson!("water", 998.0, liquid, [2.18e9, 1.325e10], [7.0e6, 4.19e5, 2.69e6], [0.875, 0.925], 0.01, 4186.0)
    }

    pub fn ice() -> Self {
        let solid = [0.3, 0.1, 10.0, 5.0];
        tillotson!("ice", 1293.0, solid, [1.07e10, 6.5e10], [1.0e7, 7.73e5, 3.04e6], [0.875, 0.925], 0.0, 2093.0)
    }

    pub fn response(&self, density: f64, energy: f64) -> Response {
        let [_, incipient, complete] = self.energies;
        let found = if density >= self.density || energy <= incipient {
            self.condensed(density, energy)
        } else if energy >= complete {
            self.expanded(density, energy)
        } else {
            let (cold, hot) = (self.condensed(density, energy), self.expanded(density, energy));
            let (width, share) = (complete - incipient, (energy - incipient) / (complete - incipient));
            let mix = |c: f64, h: f64| c + share * (h - c);
            Response {
                pressure: mix(cold.pressure, hot.pressure),
                by_density: mix(cold.by_density, hot.by_density),
                by_energy: mix(cold.by_energy, hot.by_energy) + (hot.pressure - cold.pressure) / width,
            }
        };
        match found.pressure > self.least_pressure {
            true => found,
            false => Response { pressure: self.least_pressure, by_density: 0.0, by_energy: 0.0 },
        }
    }

    /// 1/w with its derivatives by density and energy.
    fn inverse_w(&self, density: f64, energy: f64) -> [f64; 3] {
        let eta = density / self.density;
        let hot = energy / (self.energies[0] * eta * eta);
        let inverse = 1.0 / (1.0 + hot);
        [inverse, 2.0 * hot / density * inverse * inverse, -inverse * inverse / (self.energies[0] * eta * eta)]
    }

    fn condensed(&self, density: f64, energy: f64) -> Response {
        let ([a, b, ..], [modulus, second]) = (self.numbers, self.moduli);
        let (eta, [v, v_rho, v_u]) = (density / self.density, self.inverse_w(density, energy));
        let mu = eta - 1.0;
        let whole = Response {
            pressure: (a + b * v) * density * energy + modulus * mu + second * mu * mu,
            by_density: (a + b * v + b * v_rho * density) * energy + (modulus + 2.0 * second * mu) / self.density,
            by_energy: (a + b * v + b * v_u * energy) * density,
        };
        let [zero, full] = self.tension;
        if eta < zero {
            Response { pressure: 0.0, by_density: 0.0, by_energy: 0.0 }
        } else if eta < full {
            let share = (eta - zero) / (full - zero);
            let slope = 1.0 / ((full - zero) * self.density);
            Response {
                pressure: share * whole.pressure,
                by_density: share * whole.by_density + slope * whole.pressure,
                by_energy: share * whole.by_energy,
            }
        } else {
            whole
        }
    }

    fn expanded(&self, density: f64, energy: f64) -> Response {
        let ([a, b, alpha, beta], modulus) = (self.numbers, self.moduli[0]);
        let (eta, [v, v_rho, v_u]) = (density / self.density, self.inverse_w(density, energy));
        let (mu, nu) = (eta - 1.0, 1.0 / eta - 1.0);
        let nu_rho = -1.0 / (eta * density);
        let (fall, fade) = ((-alpha * nu * nu).exp(), (-beta * nu).exp());
        let inner = b * density * energy * v + modulus * mu * fade;
        let inner_rho = b * energy * (v + density * v_rho) + modulus * fade * (1.0 / self.density - beta * mu * nu_rho);
        Response {
            pressure: a * density * energy + inner * fall,
            by_density: a * energy + (inner_rho - 2.0 * alpha * nu * nu_rho * inner) * fall,
            by_energy: a * density + b * density * (v + energy * v_u) * fall,
        }
    }

    /// u_cold: 0 up to rho_0, and the work of the compression without heat beyond.
    pub fn cold_energy(&self, density: f64) -> f64 {
        let x = (density / self.density).ln();
        if !(x > 0.0) {
            return 0.0;
        }
        let table = self.cold.get_or_init(|| self.cold_curve());
        let step = COLD_RANGE / COLD_STEPS as f64;
        let i = ((x / step) as usize).min(COLD_STEPS - 1);
        let slope = |k: usize, u: f64| {
            let rho = self.density * (k as f64 * step).exp();
            self.response(rho, u).pressure / rho
        };
        let (u0, u1) = (table[i], table[i + 1]);
        let (m0, m1) = (step * slope(i, u0), step * slope(i + 1, u1));
        let t = x / step - i as f64;
        if t > 1.0 {
            // Beyond the table compression goes on as at its end.
            return u1 + m1 * (t - 1.0);
        }
        let s = 1.0 - t;
        u0 + (u1 - u0) * t * t * (3.0 - 2.0 * t) + m0 * t * s * s - m1 * t * t * s
    }

    /// By Runge-Kutta in ln rho: du/dln rho = P/rho.
    fn cold_curve(&self) -> Vec<f64> {
        let step = COLD_RANGE / COLD_STEPS as f64;
        let mut energies = vec![0.0];
        let mut u = 0.0;
        for i in 0..COLD_STEPS {
            let slope = |x: f64, [u]: [f64; 1]| {
                let rho = self.density * x.exp();
                [self.response(rho, u).pressure / rho]
            };
            [u] = ode::step(i as f64 * step, [u], step, slope);
            energies.push(u);
        }
        energies
    }
}

/// ln of the largest compression of the cold curve's table, and its steps.
const COLD_RANGE: f64 = 5.0;
const COLD_STEPS: usize = 2000;
