//! Faces and cells of a model.

use super::sheet::{Column, Sheet};
use crate::common::points::{self, Series};
use crate::common::text::Text;
use crate::error::Result;
use std::f64::consts::PI;

const RADIUS: &[&str] = &["cellouterradius"];
const ENCLOSED: &[&str] = &["celloutertotalmass", "outertotalmass"];
const CELL_MASS: &[&str] = &["cellmass"];
const DENSITY: &[&str] = &["celldensity"];
/// What of the innermost cell's mass may be rounding.
const ROUNDING: f64 = 1e-6;

/// Faces from the inner boundary outwards, and the densities between them.
pub struct Cells {
    pub faces: Vec<f64>,
    /// Mass within each face, where the file has it.
    pub enclosed: Option<Vec<f64>>,
    pub density: Vec<f64>,
}

impl Cells {
    /// # Errors
    /// [`crate::FormatError::Input`] with line and column where radii do not ascend, masses shrink outwards, a value of them or
    /// of the density is missing or cannot be.
    pub fn new(text: &Text, sheet: &Sheet, notes: &mut Vec<String>) -> Result<Self> {
        let radii = needed(text, sheet, RADIUS)?;
        let density = needed(text, sheet, DENSITY)?;
        let place = |names: &'static [&str]| {
            let name = sheet.column(names).map(|c| c.name.as_str()).unwrap_or_default();
            move |cell: usize| sheet.place(cell, name)
        };
        let mut inner = 0.0;
        for (cell, &r) in radii.iter().enumerate() {
            if !r.is_finite() || r <= inner {
                let problem = format!("the outer radius is {r:e} cm, expected a finite one beyond {inner:e} cm");
                return Err(text.error(place(RADIUS)(cell), problem));
            }
            inner = r;
        }
        points::check_density(text, &Series { values: &density, place: &place(DENSITY) })?;
        let masses = match sheet.column(ENCLOSED) {
            Some(_) => Some(needed(text, sheet, ENCLOSED)?),
            None => None,
        };
        if let Some(masses) = &masses {
            points::check_masses(text, &Series { values: masses, place: &place(ENCLOSED) })?;
        }
        let (center, within) = inner_boundary(sheet, &radii, masses.as_deref(), &density, notes);
        let with_center = |first: f64, rest: Vec<f64>| std::iter::once(first).chain(rest).collect::<Vec<f64>>();
        let cells = Self {
            faces: with_center(center, radii),
            enclosed: masses.map(|masses| with_center(within, masses)),
            density,
        };
        notes.extend(cells.disagreement());
        Ok(cells)
    }

    /// Says so where densities and enclosed masses differ.
    fn disagreement(&self) -> Option<String> {
        let shell = |r: &[f64], rho: f64| 4.0 * PI / 3.0 * (r[1].powi(3) - r[0].powi(3)) * rho;
        let sum = self.faces.windows(2).zip(&self.density).map(|(r, rho)| shell(r, *rho)).sum();
        let enclosed = self.enclosed.as_ref()?;
        points::disagreement(sum, enclosed.last()? - enclosed.first()?)
    }
}

/// Every value of a column.
fn needed(text: &Text, sheet: &Sheet, names: &[&str]) -> Result<Vec<f64>> {
    let Some(Column { name, values, .. }) = sheet.column(names) else {
        let known: Vec<&str> = sheet.columns.iter().map(|c| c.name.as_str()).collect();
        let problem = format!("there is no column '{}'; the file has {}", names[0], known.join(", "));
        return Err(text.error("columns", problem));
    };
    let value = |(cell, value): (usize, &Option<f64>)| {
        value.ok_or_else(|| text.error(sheet.place(cell, name), "found a dash, expected a number"))
    };
    values.iter().enumerate().map(value).collect()
}

/// Radius and mass within the innermost cell: 0 unless that cell holds less than is enclosed.
fn inner_boundary(
    sheet: &Sheet,
    radii: &[f64],
    masses: Option<&[f64]>,
    density: &[f64],
    notes: &mut Vec<String>,
) -> (f64, f64) {
    let own = sheet.column(CELL_MASS).and_then(|c| c.values.first().copied().flatten());
    let (Some(own), Some(&enclosed)) = (own, masses.and_then(<[f64]>::first)) else { return (0.0, 0.0) };
    let within = enclosed - own;
    if own <= 0.0 || !own.is_finite() || within <= ROUNDING * enclosed {
        return (0.0, 0.0);
    }
    let cube = radii[0].powi(3) - 3.0 * own / (4.0 * PI * density[0]);
    let center = if cube > 0.0 { cube.cbrt() } else { 0.0 };
    notes.push(format!("the model begins at {center:e} cm, with {within:e} g within"));
    (center, within)
}
