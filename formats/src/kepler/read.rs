//! Reader of KEPLER models.

use super::cells::Cells;
use super::schema::NAME;
use super::sheet::{Column, Sheet};
use crate::common::columns::{Candidate, select};
use crate::common::text::Text;
use crate::error::Result;
use crate::model::{Location, RawField};
use crate::registry::{FieldRequest, FileContent};
use std::path::Path;

/// Plain names of columns, the variables they become, and their units; entropies are in k_B per baryon.
const KNOWN: &[(&str, &str, Option<&str>)] = &[
    ("cellouterradius", "radius", Some("cm")),
    ("celloutertotalmass", "enclosed_mass", Some("g")),
    ("outertotalmass", "enclosed_mass", Some("g")),
    ("celloutervelocity", "velocity", Some("cm/s")),
    ("celldensity", "density", Some("g/cm^3")),
    ("celltemperature", "temperature", Some("K")),
    ("cellpressure", "pressure", Some("dyn/cm^2")),
    ("cellspecintenergy", "internal_energy", Some("erg/g")),
    ("cellspecificenergy", "internal_energy", Some("erg/g")),
    ("cellspecificinternalenergy", "internal_energy", Some("erg/g")),
    ("cellspecificentropy", "specific_entropy", None),
    ("cellangularvelocity", "angular_velocity", Some("rad/s")),
];
/// Columns that number the cells or restate their size.
const BOOKKEEPING: [&str; 2] = ["grid", "cellmass"];
/// Lines of the header that are handed on.
const MAX_FACTS: usize = 100;

/// Reads a model.
///
/// # Errors
/// [`crate::FormatError::Input`] with line and column where it is damaged, incomplete or no star; [`crate::FormatError::Io`].
pub fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let text = Text::read(path, NAME)?;
    let sheet = Sheet::parse(&text)?;
    let mut notes = vec![
        "radius, mass and velocity belong to the outer faces of the cells, everything else to their inside".to_owned(),
    ];
    let cells = Cells::new(&text, &sheet, &mut notes)?;
    let candidates = candidates(&sheet, &cells, &mut notes);
    if !sheet.left_out.is_empty() {
        notes.push(format!("columns of words or dashes were left out: {}", sheet.left_out.join(", ")));
    }
    if let Some(word) = sheet.footer.first() {
        let count = sheet.footer.len();
        notes.push(format!("{count} line(s) below the cells were left out, from '{word}' on"));
    }
    let selected = select(&text, request, candidates, Some("density".into()))?;
    let facts = sheet.header.into_iter().take(MAX_FACTS);
    Ok(FileContent::Field(RawField::stellar(
        (path, NAME),
        cells.faces,
        selected,
        facts.map(|fact| ("comment".to_owned(), fact)).collect(),
        notes,
    )))
}

/// Every column that is more than bookkeeping.
fn candidates(sheet: &Sheet, cells: &Cells, notes: &mut Vec<String>) -> Vec<Candidate> {
    let mut found = Vec::new();
    let mut networks = Vec::new();
    for column in sheet.columns.iter().filter(|c| !BOOKKEEPING.contains(&c.plain.as_str())) {
        let known = KNOWN.iter().find(|(plain, _, _)| *plain == column.plain);
        let (name, unit) = known.map_or((column.name.as_str(), None), |(_, name, unit)| (*name, *unit));
        let unit = if column.is_isotope() { Some("1") } else { unit };
        let candidate = |location, values| Candidate::new(&column.name, name, unit, location, values);
        match name {
            "radius" => {}
            "enclosed_mass" => found.extend(cells.enclosed.clone().map(|m| candidate(Location::Node, m))),
            "density" => found.push(candidate(Location::Cell, cells.density.clone())),
            _ => {
                if column.is_isotope() && column.values.iter().any(Option::is_none) {
                    networks.push(column.name.as_str());
                }
                let (location, values) = values(column);
                found.push(candidate(location, values));
            }
        }
    }
    if !networks.is_empty() {
        notes.push(format!(
            "mass fractions are 0 in cells whose network does not have the isotope: {}",
            networks.join(", ")
        ));
    }
    if sheet.column(&["cellspecificentropy"]).is_some() {
        notes.push("specific_entropy is in k_B per baryon; its numbers are left as they are".into());
    }
    found
}

/// A column's place and values: what is called `outer` is of the faces, with a value at the innermost one, which is 0 for
/// what vanishes in the center.
fn values(column: &Column) -> (Location, Vec<f64>) {
    let missing = if column.is_isotope() { 0.0 } else { f64::NAN };
    let mut values: Vec<f64> = column.values.iter().map(|v| v.unwrap_or(missing)).collect();
    if !column.plain.contains("outer") {
        return (Location::Cell, values);
    }
    let vanishes = ["mass", "velocity", "luminosity"].iter().any(|what| column.plain.contains(what));
    values.insert(0, if vanishes { 0.0 } else { values[0] });
    (Location::Node, values)
}
