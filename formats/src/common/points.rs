//! Checks that apply to every radial profile: radii ascend, enclosed masses do not decrease outwards, densities are valid.

use crate::common::text::Text;
use crate::error::Result;
use std::f64::consts::PI;

/// How much enclosed masses may shrink outwards, of themselves: files have ten digits of them.
const ROUNDING: f64 = 1e-8;
/// How far the mass of the densities may be off that stated before it is said.
const AGREEMENT: f64 = 0.01;

/// One variable of a profile, from the center outwards, and where each value stands in the file.
pub struct Series<'a> {
    pub values: &'a [f64],
    pub place: &'a dyn Fn(usize) -> String,
}

/// Checks points that share their radii: these ascend (equal ones are a jump) and none is negative.
///
/// # Errors
/// [`crate::FormatError::Input`] with line and column of the first value that cannot be.
pub fn check(text: &Text, radii: &Series, masses: &Series, density: &Series) -> Result<()> {
    let fault = |series: &Series, i: usize, problem: String| Err(text.error((series.place)(i), problem));
    let mut last = 0.0;
    for (i, &r) in radii.values.iter().enumerate() {
        if !r.is_finite() || r < 0.0 {
            return fault(radii, i, format!("the radius is {r:e}, expected a finite one that is not negative"));
        }
        if r < last {
            let problem = format!("the radius is {r:e} cm outside of {last:e} cm; rows are missing or out of order");
            return fault(radii, i, problem);
        }
        last = r;
    }
    if radii.values.len() < 2 || radii.values.first() == radii.values.last() {
        return fault(radii, 0, "expected at least two different radii".into());
    }
    check_masses(text, masses)?;
    check_density(text, density)
}

/// Refuses enclosed masses that are negative, not finite or shrink outwards: rows are then out of order, or the numbers are no
/// masses.
///
/// # Errors
/// [`crate::FormatError::Input`] with line and column of the first.
pub fn check_masses(text: &Text, masses: &Series) -> Result<()> {
    let mut within = 0.0;
    for (i, &m) in masses.values.iter().enumerate() {
        let fault = |problem: String| Err(text.error((masses.place)(i), problem));
        if !m.is_finite() || m < 0.0 {
            return fault(format!("the enclosed mass is {m:e} g, expected a finite one that is not negative"));
        }
        if m < within * (1.0 - ROUNDING) {
            return fault(format!("the enclosed mass shrinks outwards, from {within:e} to {m:e} g"));
        }
        within = m;
    }
    Ok(())
}

/// Refuses densities that are negative or not finite.
///
/// # Errors
/// [`crate::FormatError::Input`] with line and column of the first.
pub fn check_density(text: &Text, density: &Series) -> Result<()> {
    match density.values.iter().position(|rho| !rho.is_finite() || *rho < 0.0) {
        Some(i) => {
            let problem = format!("the density is {:e}, expected a finite one that is not negative", density.values[i]);
            Err(text.error((density.place)(i), problem))
        }
        None => Ok(()),
    }
}

/// Says so where the mass of point values (straight lines in the volume between them) is not what the file states.
pub fn mass_note(radii: &[f64], masses: &[f64], density: &[f64]) -> Option<String> {
    let shell = |r: &[f64], rho: f64| 4.0 * PI / 3.0 * (r[1].powi(3) - r[0].powi(3)) * rho;
    let means = density.windows(2).map(|w| 0.5 * (w[0] + w[1]));
    let sum: f64 = radii.windows(2).zip(means).map(|(r, rho)| shell(r, rho)).sum();
    disagreement(sum, masses.last()? - masses.first()?)
}

/// The words for two masses that differ by more than a percent.
pub fn disagreement(sum: f64, stated: f64) -> Option<String> {
    let ratio = sum / stated;
    ((ratio - 1.0).abs() > AGREEMENT)
        .then(|| format!("the densities add up to {sum:e} g, {ratio:.3} times the {stated:e} g of the enclosed masses"))
}

/// How many radii occur twice in a row, in words.
pub fn jumps_note(radii: &[f64]) -> Option<String> {
    let jumps = radii.windows(2).filter(|w| w[0] == w[1]).count();
    (jumps > 0).then(|| format!("{jumps} repeated radii are taken as jumps"))
}
