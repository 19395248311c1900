//! Tables of SWIFT's and WoMa's text format for SESAME and ANEOS: lines of comments (`#`), a date, the numbers of densities
//! and temperatures, the densities (kg/m^3), the temperatures (K), and for each temperature a row per density of u (J/kg), P (Pa),
//! sound speed (m/s) and entropy (J/kg/K).
//!
//! Between the nodes ln u is linear in ln rho and ln T, and ln P in ln u at each of two densities and then in ln rho, as SWIFT
//! interpolates. Energies that do not grow with temperature, and pressures that are not positive, are raised to the least that do.

use super::error::EosError;
use super::response::Response;
use std::path::{Path, PathBuf};

/// Rows of a table by density, each by temperature: natural logarithms in cgs.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    path: PathBuf,
    densities: Vec<f64>,
    temperatures: Vec<f64>,
    energies: Vec<Vec<f64>>,
    pressures: Vec<Vec<f64>>,
}

/// Bytes of the largest table that is read.
const LARGEST: u64 = 1 << 30;
/// Least growth of ln u from one temperature to the next.
const LEAST_GROWTH: f64 = 1e-9;
/// A first density or temperature of 0 becomes this part of the second.
const NEARLY_ZERO: f64 = 1e-5;
/// Pressures that are not positive become this part of the least that is.
const VACUUM: f64 = 1e-3;

impl Table {
    /// # Errors
    /// A file that cannot be read, or is no such table.
    pub fn read(path: &Path) -> Result<Self, EosError> {
        let refuse = |problem: String| EosError::Table { path: path.to_owned(), problem };
        let size = std::fs::metadata(path).map_err(|e| refuse(format!("cannot be read: {e}")))?.len();
        if size > LARGEST {
            return Err(refuse(format!("has {size} bytes, expected at most {LARGEST}")));
        }
        let text = std::fs::read_to_string(path).map_err(|e| refuse(format!("cannot be read: {e}")))?;
        Self::parse(&text).map(|table| Self { path: path.to_owned(), ..table }).map_err(refuse)
    }

    /// # Errors
    /// What is no such table.
    fn parse(text: &str) -> Result<Self, String> {
        let rows = text.lines().filter(|line| !line.trim_start().starts_with('#'));
        let mut words = rows.flat_map(str::split_whitespace);
        let mut next = |what: &str| -> Result<f64, String> {
            let word = words.next().ok_or_else(|| format!("ends before its {what}"))?;
            word.parse::<f64>().map_err(|_| format!("has '{word}' for a number among its {what}"))
        };
        next("date")?;
        let mut length = |what: &str| match next(what)? {
            n if n.fract() == 0.0 && (2.0..=1e5).contains(&n) => Ok(n as usize),
            n => Err(format!("states {n} as its {what}, expected 2 to 100000")),
        };
        let (densities, temperatures) = (length("number of densities")?, length("number of temperatures")?);
        let mut axis = |count: usize, what: &str, unit: f64| -> Result<Vec<f64>, String> {
            let mut values = Vec::with_capacity(count);
            for _ in 0..count {
                values.push(next(what)? * unit);
            }
            if values[0] == 0.0 {
                // Zero has no logarithm.
                values[0] = NEARLY_ZERO * values[1];
            }
            let grows = values.windows(2).all(|pair| pair[0] < pair[1]);
            match grows && values[0] > 0.0 && values[count - 1].is_finite() {
                true => Ok(values.into_iter().map(f64::ln).collect()),
                false => Err(format!("has {what} that are not positive and growing")),
            }
        };
        let rho = axis(densities, "densities", 1e-3)?;
        let kelvin = axis(temperatures, "temperatures", 1.0)?;
        let mut energies = vec![Vec::with_capacity(temperatures); densities];
        let mut pressures = vec![Vec::with_capacity(temperatures); densities];
        for _ in 0..temperatures {
            for (u, p) in energies.iter_mut().zip(&mut pressures) {
                let row = [next("rows")?, next("rows")?, next("rows")?, next("rows")?];
                if !row[..2].iter().all(|v| v.is_finite()) {
                    return Err(format!("has an energy of {} and a pressure of {}", row[0], row[1]));
                }
                u.push(row[0] * 1e4);
                p.push(row[1] * 10.0);
            }
        }
        let least =
            |rows: &[Vec<f64>]| rows.iter().flatten().filter(|v| **v > 0.0).fold(f64::INFINITY, |m, v| m.min(*v));
        let [low_u, low_p] = [least(&energies), least(&pressures)].map(|v| VACUUM * v);
        if !(low_u.is_finite() && low_p.is_finite()) {
            return Err("has no positive energy or no positive pressure".into());
        }
        for row in &mut energies {
            let mut last = f64::NEG_INFINITY;
            for u in row.iter_mut() {
                last = u.max(low_u).ln().max(last + LEAST_GROWTH);
                *u = last;
            }
        }
        pressures.iter_mut().flatten().for_each(|p| *p = p.max(low_p).ln());
        Ok(Self { path: PathBuf::new(), densities: rho, temperatures: kelvin, energies, pressures })
    }

    pub(super) fn name(&self) -> String {
        self.path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned())
    }

    pub(super) fn response(&self, density: f64, energy: f64) -> Response {
        let (j, w) = place(&self.densities, density.ln());
        let ln_u = energy.max(f64::MIN_POSITIVE).ln();
        let at = |row: usize| {
            let (u, p) = (&self.energies[row], &self.pressures[row]);
            let (i, s) = place(u, ln_u);
            let slope = (p[i + 1] - p[i]) / (u[i + 1] - u[i]);
            (p[i] + s.max(0.0) * (p[i + 1] - p[i]), if s < 0.0 { 0.0 } else { slope })
        };
        let ((low, low_u), (high, high_u)) = (at(j), at(j + 1));
        let pressure = (low + w * (high - low)).exp();
        Response {
            pressure,
            by_density: pressure / density * (high - low) / (self.densities[j + 1] - self.densities[j]),
            by_energy: pressure / energy.max(f64::MIN_POSITIVE) * (low_u + w * (high_u - low_u)),
        }
    }

    pub(super) fn energy_at(&self, density: f64, temperature: f64) -> f64 {
        let (j, w) = place(&self.densities, density.ln());
        let (i, s) = place(&self.temperatures, temperature.max(f64::MIN_POSITIVE).ln());
        let s = s.max(0.0);
        let at = |row: usize| self.energies[row][i] + s * (self.energies[row][i + 1] - self.energies[row][i]);
        (at(j) + w * (at(j + 1) - at(j))).exp()
    }

    pub(super) fn temperature(&self, density: f64, energy: f64) -> f64 {
        let (j, w) = place(&self.densities, density.ln());
        let ln_u = energy.max(f64::MIN_POSITIVE).ln();
        let row: Vec<f64> = self.energies[j].iter().zip(&self.energies[j + 1]).map(|(a, b)| a + w * (b - a)).collect();
        let (i, s) = place(&row, ln_u);
        (self.temperatures[i] + s.max(0.0) * (self.temperatures[i + 1] - self.temperatures[i])).exp()
    }

    pub(super) fn least_energy(&self, density: f64) -> f64 {
        let (j, w) = place(&self.densities, density.ln());
        (self.energies[j][0] + w * (self.energies[j + 1][0] - self.energies[j][0])).exp()
    }

    /// Where the pressure at the least temperature begins to grow as that of a solid or a liquid.
    pub(super) fn usual_density(&self) -> f64 {
        let steepness =
            |j: usize| (self.pressures[j + 1][0] - self.pressures[j][0]) / (self.densities[j + 1] - self.densities[j]);
        let steepest = (0..self.densities.len() - 1).max_by(|a, b| steepness(*a).total_cmp(&steepness(*b)));
        self.densities[steepest.map_or(0, |j| j + 1)].exp()
    }
}

/// The interval of an ascending axis, and the place in it: beyond 0 and 1 outside of the axis.
fn place(axis: &[f64], x: f64) -> (usize, f64) {
    let i = axis.partition_point(|v| *v <= x).saturating_sub(1).min(axis.len() - 2);
    (i, (x - axis[i]) / (axis[i + 1] - axis[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of an ideal gas: u = 3e3 T J/kg, P = 2/3 rho u, of which both logarithms are linear.
    fn gas() -> String {
        let (rho, t): ([f64; 3], [f64; 4]) = ([1.0, 10.0, 100.0], [100.0, 1000.0, 1e4, 1e5]);
        let mut text = String::from("# gas\n# rows\n20260101\n3 4\n1 10 100\n100 1000 1e4 1e5\n");
        for t in t {
            for rho in rho {
                let u = 3e3 * t;
                text += &format!("{u:e} {:e} {:e} 1\n", 2.0 / 3.0 * rho * u, 1.0);
            }
        }
        text
    }

    #[test]
    fn the_table_of_an_ideal_gas_is_that_gas() {
        let table = Table::parse(&gas()).unwrap();
        for (rho, t) in [(5e-3, 300.0), (0.07, 5e4), (1e-3, 100.0), (0.1, 1e5)] {
            let u = table.energy_at(rho, t);
            assert!((u / (3e7 * t) - 1.0).abs() < 1e-12, "{u}");
            assert!((table.temperature(rho, u) / t - 1.0).abs() < 1e-12);
            let found = table.response(rho, u);
            for (found, expected) in [
                (found.pressure, 2.0 / 3.0 * rho * u),
                (found.by_density, 2.0 / 3.0 * u),
                (found.by_energy, 2.0 / 3.0 * rho),
            ] {
                assert!((found / expected - 1.0).abs() < 1e-11, "{found} {expected}");
            }
        }
    }

    #[test]
    fn what_is_no_table_is_told() {
        for (text, part) in [
            (String::new(), "ends before its date"),
            (gas().replace("3 4", "3 5"), "ends before"),
            (gas().replace("3 4", "1e9 4"), "number of densities"),
            (gas().replace("1 10 100\n", "1 10 5\n"), "not positive and growing"),
            (gas().replace("1000 1e4", "1000 nan"), "temperatures"),
            (gas().replace("20260101", "iron"), "'iron'"),
        ] {
            let error = Table::parse(&text).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }
}
