//! Faces of the zones: as listed, or reconstructed from mass and density.

use super::sheet::Sheet;
use crate::common::text::Text;
use crate::error::Result;
use std::f64::consts::PI;

/// Mass of the shells over the enclosed mass that is listed; both surface first, radii and masses at outer faces.
pub fn shells_over_stated(radii: &[f64], masses: &[f64], density: &[f64]) -> Option<f64> {
    let inner = radii.iter().skip(1).copied().chain([0.0]);
    let shells = radii.iter().zip(inner).zip(density);
    let sum: f64 = shells.map(|((outer, inner), rho)| rho * 4.0 * PI / 3.0 * (outer.powi(3) - inner.powi(3))).sum();
    let ratio = sum / masses.first()?;
    (ratio.is_finite() && ratio > 0.0).then_some(ratio)
}

/// Radial nodes, ascending from the inner boundary, out of outer faces listed from the surface.
///
/// # Errors
/// [`crate::FormatError::Input`] with the line of the first face that does not lie within the one before it.
pub fn nodes(text: &Text, sheet: &Sheet, radii: &[f64], center: f64) -> Result<Vec<f64>> {
    let mut outer = f64::INFINITY;
    for (&r, &line) in radii.iter().zip(&sheet.lines) {
        if !r.is_finite() || r <= center {
            let problem = format!("the outer radius is {r:e} cm, expected a finite one above {center:e}");
            return Err(text.line_error(line, problem));
        }
        if r == outer {
            let problem = format!(
                "the radius {r:e} cm is that of the zone before; the file has too few digits to tell them apart"
            );
            return Err(text.line_error(line, problem));
        }
        if r > outer {
            let problem =
                format!("the radius grows from {outer:e} to {r:e} cm, expected zones from the surface to the center");
            return Err(text.line_error(line, problem));
        }
        outer = r;
    }
    Ok([center].into_iter().chain(radii.iter().rev().copied()).collect())
}

/// Refuses enclosed masses that grow inwards: rows are then out of order, or the numbers are not masses.
///
/// # Errors
/// [`crate::FormatError::Input`] with the line.
pub fn check_masses(text: &Text, sheet: &Sheet, masses: &[f64]) -> Result<()> {
    for (pair, &line) in masses.windows(2).zip(sheet.lines.iter().skip(1)) {
        if let [outer, inner] = pair
            && inner > outer
        {
            let problem = format!("the enclosed mass grows inwards, from {outer:e} to {inner:e} g");
            return Err(text.line_error(line, problem));
        }
    }
    Ok(())
}

/// Outer faces, surface first, from the mass within each and the density between: `r^3` grows by
/// `3 dm / (4 pi rho)` from zone to zone outwards.
///
/// # Errors
/// [`crate::FormatError::Input`] with the line where the mass does not grow outwards or the density is not positive.
pub fn rebuild(
    text: &Text,
    sheet: &Sheet,
    masses: &[f64],
    density: &[f64],
    (center_radius, center_mass): (f64, f64),
) -> Result<Vec<f64>> {
    let mut cube = center_radius.powi(3);
    let mut inner = center_mass;
    let mut radii = Vec::with_capacity(masses.len());
    for ((&m, &rho), &line) in masses.iter().zip(density).zip(&sheet.lines).rev() {
        let fault = |what: &str, value: f64, expected: &str| {
            let problem = format!(
                "there is no radius, and it cannot be rebuilt: {what} is {value:e}, expected {expected}; \
                 write the profile with the column radius or logR"
            );
            text.line_error(line, problem)
        };
        if !(m.is_finite() && m > inner) {
            return Err(fault("the enclosed mass", m, &format!("more than the {inner:e} g of the zone within")));
        }
        if !(rho.is_finite() && rho > 0.0) {
            return Err(fault("the density", rho, "a positive one"));
        }
        cube += 3.0 * (m - inner) / (4.0 * PI * rho);
        radii.push(cube.cbrt());
        inner = m;
    }
    radii.reverse();
    Ok(radii)
}
