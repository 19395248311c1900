//! The use of each variable of the input, for the report: its role, and where it is written.

use crate::input::roles::Assignment;
use crate::scene::Role;
use serde::Serialize;
use sph_formats::common::particle_names as names;
use sph_formats::{Columns, FormatSpec, ParticleFile, ParticleTable, UnitSystem};
use std::fmt::Write;

/// One variable of the input.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct VariableReport {
    /// As the file has it.
    pub name: String,
    /// What it is taken for.
    pub role: Option<Role>,
    /// The column of the output that it is, or is a part of.
    pub written_as: Option<String>,
    /// What was assumed, or why it is not written.
    pub note: Option<String>,
}

/// The variables with what became of them, and what a user should be warned of.
pub fn variables(
    assignments: &[Assignment],
    table: &ParticleTable,
    format: Option<(&str, Columns)>,
) -> (Vec<VariableReport>, Vec<String>) {
    let mut warnings = Vec::new();
    let mut reports = Vec::new();
    for a in assignments {
        let mut report =
            VariableReport { name: a.variable.clone(), role: a.role, written_as: None, note: a.note.clone() };
        if a.is_warning {
            warnings.extend(a.note.as_ref().map(|note| format!("variable '{}' {note}", a.variable)));
        }
        let column = if a.role == Some(Role::Density) { names::DENSITY } else { a.column.as_str() };
        let found = table.column(column).or_else(|| table.column(&names::apart(column)));
        match (found, format) {
            (None, _) if report.note.is_none() => report.note = Some("is not carried".into()),
            (None, _) => {}
            (Some(found), Some((format, held))) => match held.loses(&found.name, found.components) {
                Some(why) => {
                    let note = format!("is not written: {why} ({format})");
                    warnings.push(format!("variable '{}' {note}", a.variable));
                    report.note = Some(report.note.map_or(note.clone(), |before| format!("{before}; {note}")));
                }
                None => report.written_as = Some(found.name.clone()),
            },
            (Some(found), None) => report.written_as = Some(found.name.clone()),
        }
        reports.push(report);
    }
    (reports, warnings)
}

/// What placement gives every format, each of which has a place for it or makes its own of it.
const OWN: [&str; 9] = [
    names::COORDINATES,
    names::VELOCITIES,
    names::MASSES,
    names::SUPPORT_RADIUS,
    names::SMOOTHING_LENGTH,
    names::DENSITY,
    names::INTERNAL_ENERGY,
    names::PARTICLE_IDS,
    names::PARTICLE_TYPE,
];

/// Columns that a format does not hold, beside what is `told` of already: what a scene states, or makes.
pub fn lost(file: &ParticleFile, told: &[VariableReport], (format, columns): (&str, Columns)) -> Vec<String> {
    let is_told = |name: &str| {
        told.iter().any(|v| v.note.is_some() && (v.name == name || names::standard(&v.name) == Some(name)))
    };
    let mut lost = Vec::new();
    for column in file.species.iter().flat_map(|species| &species.table.columns) {
        let name = column.name.as_str();
        if let Some(why) = columns.loses(name, column.components).filter(|_| !OWN.contains(&name) && !is_told(name)) {
            lost.push(format!("'{name}' is not written: {why} ({format})"));
        }
    }
    lost.sort_unstable();
    lost.dedup();
    lost
}

/// In which units the magnetic field is, where there is one that is written.
pub fn magnetic_units(file: &ParticleFile, format: Option<&FormatSpec>, units: &UnitSystem) -> Option<String> {
    let field = file.species.iter().find_map(|s| s.table.column(names::MAGNETIC_FIELD))?;
    let can = format.map(|f| f.capabilities).unwrap_or_default();
    let is_held = can.columns.loses(names::MAGNETIC_FIELD, field.components).is_none();
    is_held.then(|| format!("the magnetic field is in {}", can.magnetic.describe(units)))
}

/// The variables as lines of a report: those that are taken for something, and the names of the others.
///
/// # Errors
/// Those of `out`.
pub fn write_variables(out: &mut String, variables: &[VariableReport]) -> std::fmt::Result {
    let mut label = "variables";
    let mut plain = Vec::new();
    for v in variables {
        let written = v.written_as.as_ref().map_or_else(|| "not written".to_owned(), |column| format!("-> {column}"));
        match (v.role, &v.written_as) {
            (None, Some(column)) if v.note.is_none() && *column == v.name => plain.push(v.name.as_str()),
            (role, _) => {
                let role = role.map_or_else(|| "no role".to_owned(), |role| role.name().to_owned());
                let note = v.note.as_ref().map_or_else(String::new, |note| format!("; {note}"));
                writeln!(out, "  {label:<16} {} {written} ({role}){note}", v.name)?;
                label = "";
            }
        }
    }
    if !plain.is_empty() {
        writeln!(out, "  {label:<16} carried as they are: {}", plain.join(", "))?;
    }
    Ok(())
}
