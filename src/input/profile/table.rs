//! Radii, densities and pressures of a model, before it becomes an input.

use crate::field::RadialProfile;
use crate::field::quadrature::integrate;
use sph::geometry::{unit_ball_volume, unit_sphere_area};
use sph::gravity::strength;

/// Rows of a table made from a density in closed form.
const ROWS: usize = 4000;
/// What interpolation between rows may be off by, as a share of the mass: more is no rounding.
const MOST_OFF: f64 = 1e-3;
/// Gauss points between two rows.
const ORDER: usize = 6;

/// A model by rows, outwards.
#[derive(Default)]
pub(super) struct Table {
    pub radii: Vec<f64>,
    pub density: Vec<f64>,
    pub pressure: Option<Vec<f64>>,
    pub internal_energy: Option<Vec<f64>>,
    pub temperature: Option<Vec<f64>>,
    /// Numbers of materials.
    pub material: Option<Vec<f64>>,
    /// What to know of it.
    pub notes: Vec<String>,
}

impl Table {
    /// Takes off what interpolation between the rows adds to a body of this mass, or leaves out: densities change by one factor near 1.
    pub fn hold(&mut self, d: usize, mass: f64) {
        let factor = mass / self.mass(d);
        if (factor - 1.0).abs() < MOST_OFF {
            self.density.iter_mut().for_each(|rho| *rho *= factor);
        }
    }

    /// What interpolation between the rows has.
    fn mass(&self, d: usize) -> f64 {
        RadialProfile::from_nodes(d, &self.radii, &self.density).total_mass().value
    }

    /// How many times the mass of a body of three dimensions its rows have, where that is no matter of rounding.
    pub fn misses(&self, mass: f64) -> Option<f64> {
        Some(self.mass(3) / mass).filter(|times| !((times - 1.0).abs() < MOST_OFF))
    }
}

/// Radii from the center to `outer`, even within `scale` and by equal factors beyond.
pub(super) fn radii_beyond_core(scale: f64, outer: f64) -> Vec<f64> {
    let end = (outer / scale).asinh();
    let mut radii: Vec<f64> = (0..ROWS).map(|i| scale * (end * i as f64 / (ROWS - 1) as f64).sinh()).collect();
    radii[ROWS - 1] = outer;
    radii
}

/// Radii by equal factors.
pub(super) fn radii_of_cusp(inner: f64, outer: f64) -> Vec<f64> {
    let span = (outer / inner).ln();
    let mut radii: Vec<f64> = (0..ROWS).map(|i| inner * (span * i as f64 / (ROWS - 1) as f64).exp()).collect();
    radii[ROWS - 1] = outer;
    radii
}

/// Masses within the radii, of a density in `d` dimensions that is constant within the first of them.
fn enclosed(d: usize, radii: &[f64], density: &dyn Fn(f64) -> f64) -> Vec<f64> {
    let volume = |r: f64| unit_ball_volume(d) * r.powi(d as i32);
    let shell = |r: f64| unit_sphere_area(d) * r.powi(d as i32 - 1) * density(r);
    let mut mass = if radii[0] > 0.0 { density(radii[0]) * volume(radii[0]) } else { 0.0 };
    let mut masses = vec![mass];
    for pair in radii.windows(2) {
        mass += integrate(ORDER, pair[0], pair[1], &shell);
        masses.push(mass);
    }
    masses
}

/// The table of a density of any scale, scaled to `mass`; the pressure carries its weight and is 0 at the outer radius.
pub(super) fn hydrostatic(d: usize, radii: Vec<f64>, mass: f64, gravity: f64, density: &dyn Fn(f64) -> f64) -> Table {
    let masses = enclosed(d, &radii, density);
    let scale = mass / masses[masses.len() - 1];
    let mut pressure = vec![0.0; radii.len()];
    for i in (0..radii.len() - 1).rev() {
        let (a, b) = (radii[i], radii[i + 1]);
        // The mass between is the integral up to the radius.
        let weight = |r: f64| {
            let within =
                masses[i] + integrate(ORDER, a, r, &|s| unit_sphere_area(d) * s.powi(d as i32 - 1) * density(s));
            if r > 0.0 { density(r) * strength(d) * gravity * within / r.powi(d as i32 - 1) } else { 0.0 }
        };
        pressure[i] = pressure[i + 1] + scale * scale * integrate(ORDER, a, b, &weight);
    }
    let density = radii.iter().map(|r| scale * density(*r)).collect();
    Table { radii, density, pressure: Some(pressure), ..Table::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A density that bends sharply at its surface, as that of a polytrope of n = 1/2, is not what lies between its rows.
    #[test]
    fn rows_hold_the_mass_to_the_last_digit() {
        for d in 1..=3 {
            let radii = radii_beyond_core(0.5, 2.0);
            let density = radii.iter().map(|r| (1.0 - 0.25 * r * r).max(0.0).sqrt()).collect();
            let mut table = Table { radii, density, ..Table::default() };
            let found = |t: &Table| RadialProfile::from_nodes(d, &t.radii, &t.density).total_mass().value;
            let exact = match d {
                1 => std::f64::consts::PI,
                2 => 4.0 / 3.0 * std::f64::consts::TAU,
                _ => 2.0 * std::f64::consts::PI.powi(2),
            };
            let before = (found(&table) / exact - 1.0).abs();
            table.hold(d, exact);
            assert!(before > 1e-8 && (found(&table) / exact - 1.0).abs() < 1e-14, "{d}-D: {before}");
        }
    }

    /// A uniform sphere: P = (2 pi/3) G rho^2 (R^2 - r^2).
    #[test]
    fn weights_are_those_of_closed_forms() {
        let table = hydrostatic(3, radii_beyond_core(0.5, 2.0), 10.0, 3.0, &|_| 7.0);
        let rho = 10.0 / (unit_ball_volume(3) * 8.0);
        for i in (0..table.radii.len()).step_by(500) {
            let expected = std::f64::consts::TAU / 3.0 * 3.0 * rho * rho * (4.0 - table.radii[i].powi(2));
            let found = table.pressure.as_ref().unwrap()[i];
            assert!((found - expected).abs() < 1e-10 * rho * rho * 30.0, "{found} {expected}");
            assert!((table.density[i] / rho - 1.0).abs() < 1e-12);
        }
    }
}
