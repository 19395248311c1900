//! White dwarfs of cold, completely degenerate electrons (Chandrasekhar 1935, MNRAS 95, 207; 1939, chapters X and XI):
//! rho = B x^3 and P = A (x (2 x^2 - 3) sqrt(x^2 + 1) + 3 asinh x) with the Fermi momentum x in units of m_e c.

use super::emden::{Emden, End, Point};
use super::table::Table;
use crate::error::{Error, Result};
use std::f64::consts::PI;

/// Constants of nature in the units of the model; CODATA 2022 in cgs.
pub(super) struct Electrons {
    /// m_e c^2 per mass of nuclei, mu_e m_u.
    rest_energy: f64,
    /// B.
    density: f64,
    /// A.
    pressure: f64,
}

const SPEED_OF_LIGHT: f64 = 2.997_924_58e10;
const ELECTRON_MASS: f64 = 9.109_383_713_9e-28;
const ATOMIC_MASS: f64 = 1.660_539_068_92e-24;
const HBAR: f64 = 1.054_571_817e-27;

/// Halvings of the search for the central density.
const BISECTIONS: usize = 100;
/// Central densities are looked for between these of y_0 - 1; the mass between them goes from 1e-7 to all but 1e-7 of the limit.
const CENTERS: [f64; 2] = [1e-10, 1e7];
/// Below this x the closed form of the pressure loses digits.
const SMALL: f64 = 0.1;

impl Electrons {
    /// In cgs.
    pub fn new(nucleons_per_electron: f64) -> Self {
        let mass = nucleons_per_electron * ATOMIC_MASS;
        let inverse_length = ELECTRON_MASS * SPEED_OF_LIGHT / HBAR;
        let energy = ELECTRON_MASS * SPEED_OF_LIGHT.powi(2);
        let number = inverse_length.powi(3) / (3.0 * PI * PI);
        Self { rest_energy: energy / mass, density: mass * number, pressure: number * energy / 8.0 }
    }

    fn pressure(&self, x: f64) -> f64 {
        if x < SMALL {
            // 8 int_0^x t^4 / sqrt(1 + t^2) dt by terms.
            let s = x * x;
            let series = 1.0 / 5.0 - s * (1.0 / 14.0 - s * (1.0 / 24.0 - s * (5.0 / 176.0 - s * (35.0 / 1664.0))));
            return 8.0 * self.pressure * x.powi(5) * series;
        }
        self.pressure * (x * (2.0 * x * x - 3.0) * (x * x + 1.0).sqrt() + 3.0 * x.asinh())
    }

    /// The length in which s = r / length makes the equation plain.
    fn length(&self, gravity: f64) -> f64 {
        (self.rest_energy / (4.0 * PI * gravity * self.density)).sqrt()
    }

    /// Solution for a central y_0 = 1 + `center`, in y - 1 so that low densities keep their digits.
    fn solve(center: f64) -> Option<Vec<Point>> {
        let source = |u: f64| (u.max(0.0) * (u + 2.0)).powf(1.5);
        Emden { dimension: 3, source: &source, center, end: End::Surface(0.0) }.solve()
    }

    fn mass(&self, gravity: f64, end: &Point) -> f64 {
        4.0 * PI * self.density * self.length(gravity).powi(3) * end.mass(3)
    }
}

/// A white dwarf of `mass` grams.
///
/// # Errors
/// A mass that none can have.
pub(super) fn white_dwarf(mass: f64, nucleons_per_electron: f64, gravity: f64) -> Result<Table> {
    let electrons = Electrons::new(nucleons_per_electron);
    let of = |center: f64| -> Option<(f64, Vec<Point>)> {
        let points = Electrons::solve(center)?;
        Some((electrons.mass(gravity, points.last()?), points))
    };
    let none = || Error::scene("input.profile.white-dwarf", "has no solution at its mass");
    let [mut low, mut high] = CENTERS.map(f64::ln);
    let [least, most] = [of(CENTERS[0]).ok_or_else(none)?.0, of(CENTERS[1]).ok_or_else(none)?.0];
    if !(mass > least && mass < most) {
        let problem = format!(
            "is {mass:.4e} g, expected from {least:.3e} g to {most:.6e} g, the largest mass with {nucleons_per_electron} nucleons per \
             electron (Chandrasekhar's limit)"
        );
        return Err(Error::scene("input.profile.white-dwarf.mass", problem));
    }
    let mut points = Vec::new();
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        let (found, of_middle) = of(middle.exp()).ok_or_else(none)?;
        points = of_middle;
        if (found / mass - 1.0).abs() < 1e-12 {
            break;
        }
        if found < mass { low = middle } else { high = middle }
    }
    let momentum = |u: f64| (u * (u + 2.0)).max(0.0).sqrt();
    let length = electrons.length(gravity);
    Ok(Table {
        radii: points.iter().map(|p| p.xi * length).collect(),
        density: points.iter().map(|p| electrons.density * momentum(p.phi).powi(3)).collect(),
        pressure: Some(points.iter().map(|p| electrons.pressure(momentum(p.phi))).collect()),
        ..Table::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sph_formats::units::{GRAVITATIONAL_CONSTANT_CGS as G, SOLAR_MASS_CGS};

    /// Chandrasekhar (1939), table 25: mass over the limit's, and radius over l_1 = sqrt(2 A / pi G) / B = 2 sqrt(...) y_0 eta.
    #[test]
    fn masses_follow_the_central_density_as_in_the_tables() {
        let electrons = Electrons::new(2.0);
        let limit = electrons.mass(G, Electrons::solve(1e7).unwrap().last().unwrap());
        // 5.836 / mu_e^2 solar masses.
        assert!((limit / SOLAR_MASS_CGS / 1.4588 - 1.0).abs() < 2e-3, "{}", limit / SOLAR_MASS_CGS);
        for (inverse_square, fraction) in [
            (0.01, 0.95733),
            (0.02, 0.92419),
            (0.05, 0.84709),
            (0.1, 0.75243),
            (0.2, 0.61589),
            (0.5, 0.35033),
            (0.8, 0.15316),
        ] {
            let center = 1.0 / f64::sqrt(inverse_square) - 1.0;
            let mass = electrons.mass(G, Electrons::solve(center).unwrap().last().unwrap());
            assert!((mass / limit / fraction - 1.0).abs() < 1e-4, "{inverse_square}: {}", mass / limit);
        }
    }

    /// Of slow electrons P = K rho^(5/3): an n = 1.5 polytrope, R = (2.5 K / 4 pi G)^(1/2) rho_c^(-1/6) 3.65375 and M R^3 constant.
    #[test]
    fn light_ones_are_polytropes() {
        let electrons = Electrons::new(2.0);
        let constant = 1.6 * electrons.pressure / electrons.density.powf(5.0 / 3.0);
        let table = white_dwarf(1e-3 * SOLAR_MASS_CGS, 2.0, G).unwrap();
        let (radius, center) = (table.radii.last().unwrap(), table.density[0]);
        let expected = (2.5 * constant / (4.0 * PI * G)).sqrt() * center.powf(-1.0 / 6.0) * 3.653_753_7;
        // Relativity is of the order x^2 of the center.
        let x = (center / electrons.density).cbrt();
        assert!((radius / expected - 1.0).abs() < x * x, "{radius:e} {expected:e} {x}");
        assert!(x < 0.1, "{x}");
    }

    #[test]
    fn both_forms_of_the_pressure_agree_and_carry_the_weight() {
        let electrons = Electrons::new(2.0);
        let [below, above] = [SMALL * (1.0 - 1e-9), SMALL * (1.0 + 1e-9)].map(|x| electrons.pressure(x));
        assert!((above / below - 1.0).abs() < 1e-7, "{below:e} {above:e}");
        let table = white_dwarf(0.6 * SOLAR_MASS_CGS, 2.0, G).unwrap();
        let pressure = table.pressure.unwrap();
        let mut within = 0.0;
        for i in 1..table.radii.len() - 1 {
            let (a, b) = (table.radii[i - 1], table.radii[i]);
            let middle = 0.5 * (table.density[i - 1] + table.density[i]);
            let before = within;
            within += 4.0 / 3.0 * PI * (b.powi(3) - a.powi(3)) * middle;
            if i > 100 && i % 100 == 0 {
                let weight = middle * G * 0.5 * (before + within) / (0.5 * (a + b)).powi(2);
                let fall = (pressure[i - 1] - pressure[i]) / (b - a);
                assert!((fall / weight - 1.0).abs() < 1e-3, "{i}: {fall:e} {weight:e}");
            }
        }
        assert!((within / (0.6 * SOLAR_MASS_CGS) - 1.0).abs() < 1e-4);
    }

    #[test]
    fn masses_beyond_the_limit_are_refused() {
        let error = white_dwarf(1.5 * SOLAR_MASS_CGS, 2.0, G).err().unwrap().to_string();
        assert!(error.contains("limit") && error.contains("white-dwarf.mass"), "{error}");
    }
}
