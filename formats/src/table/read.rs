//! Reader of tables: from named columns to a geometry and variables.

use super::fractions::{Beside, beside_radius};
use super::layout::{Heading, Layout, cartesian_axis, is_density, is_middle_radius, is_outer_radius, is_radius};
use super::points::{arrange, distinct};
use super::schema::NAME;
use super::sheet::Sheet;
use super::{particles, radial};
use crate::common::columns::{Candidate, select};
use crate::common::text::Text;
use crate::error::{FormatError, Result};
use crate::model::{Coordinates, Geometry, GridAxis, Location, RawField};
use crate::registry::{FieldRequest, FileContent, plain_name};
use crate::units::{Unit, UnitDimension};
use std::path::Path;

/// Comment lines that are handed on.
const MAX_COMMENTS: usize = 100;

/// A geometry and the columns that are no coordinates.
type Placed = (Geometry, Vec<(Heading, Location, Vec<f64>)>);

pub fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let text = Text::read(path, NAME)?;
    let layout = Layout::find(&text)?;
    let sheet = Sheet::parse(&text, layout)?;
    if particles::are_particles(&sheet) {
        return particles::read(&text, path, sheet).map(FileContent::Particles);
    }
    let mut notes = Vec::new();
    if !sheet.texts.is_empty() {
        notes.push(format!("columns of text were left out: {}", sheet.texts.join(", ")));
    }
    let comments = sheet.comments.iter().take(MAX_COMMENTS);
    let metadata = comments.map(|c| ("comment".to_owned(), c.clone())).collect();

    let (geometry, columns) = place(&text, path, sheet, &mut notes)?;
    let candidates: Vec<Candidate> = columns
        .into_iter()
        .map(|(heading, location, values)| candidate(heading, location, values, &mut notes))
        .collect();
    let mut densities = candidates.iter().filter(|c| is_density(&plain_name(&c.variable.name)));
    let guess = match (densities.next(), densities.next()) {
        (Some(one), None) => Some(one.variable.name.clone()),
        _ => None,
    };
    let (variables, density) = select(&text, request, candidates, guess)?;
    if let Geometry::Radial { nodes, unit } = &geometry {
        let found = variables.iter().find(|v| Some(&v.name) == density.as_ref());
        notes.extend(found.and_then(|v| radial::mean_density_note(nodes, unit.as_ref(), v)));
    }
    let field = RawField { path: path.into(), format: NAME, geometry, variables, density, metadata, notes };
    Ok(FileContent::Field(field))
}

fn candidate(heading: Heading, location: Location, values: Vec<f64>, notes: &mut Vec<String>) -> Candidate {
    if let Some(unit) = heading.unit.as_ref().filter(|u| Unit::parse(u).is_none()) {
        notes.push(format!(
            "the unit '{unit}' of '{}' is not understood; its numbers are left as they are",
            heading.name
        ));
    }
    Candidate::new(&heading.column, variable_name(&heading.name), heading.unit.as_deref(), location, values)
}

/// The usual name of a quantity that has an unusual one in KEPLER's and Phantom's files, or its own.
fn variable_name(column: &str) -> &str {
    match plain_name(column).as_str() {
        "celldensity" => "density",
        "celltemperature" => "temperature",
        "cellpressure" => "pressure",
        "celloutervelocity" => "velocity",
        "cellangularvelocity" => "angular_velocity",
        "cellspecificentropy" => "specific_entropy",
        "cellspecintenergy" | "eint" | "specificinternalenergy" => "internal_energy",
        "celloutertotalmass" | "outertotalmass" | "outermass" => "enclosed_mass",
        _ => column,
    }
}

/// Finds the coordinates among the columns.
fn place(text: &Text, path: &Path, sheet: Sheet, notes: &mut Vec<String>) -> Result<Placed> {
    let find = |wanted: &dyn Fn(&str) -> bool| sheet.columns.iter().position(|c| wanted(&plain_name(&c.heading.name)));
    let axes: Vec<Option<usize>> = (0..3).map(|axis| find(&|n| cartesian_axis(n) == Some(axis))).collect();
    let radius = find(&|n| is_radius(n) && !is_outer_radius(n)).or_else(|| find(&is_middle_radius));
    let outer = find(&is_outer_radius);
    if let Some(column) = radius.or(outer)
        && beside_radius(text, &sheet, column, &axes)? == Beside::Fractions
    {
        return place_radial(text, path, sheet, column, radius.is_none(), notes);
    }
    let found: Vec<usize> = axes.iter().map_while(|a| *a).collect();
    if found.is_empty() || found.len() != axes.iter().flatten().count() {
        let names: Vec<_> = sheet.columns.iter().map(|c| c.heading.name.as_str()).collect();
        let problem = format!(
            "expected a radius ('r', 'radius', 'outer radius') or x, x and y, or x, y and z; the columns are {}",
            names.join(", ")
        );
        return Err(text.error("coordinates", problem));
    }
    place_points(text, path, sheet, &found, notes)
}

fn place_radial(
    text: &Text,
    path: &Path,
    sheet: Sheet,
    radius: usize,
    is_outer: bool,
    notes: &mut Vec<String>,
) -> Result<Placed> {
    let unit = length_unit(path, sheet.columns.get(radius).map(|c| &c.heading))?;
    let profile = radial::profile(text, sheet, radius, is_outer, notes)?;
    Ok((Geometry::Radial { nodes: profile.nodes, unit }, profile.columns))
}

/// The unit of a coordinate: a length, none, or one that is not understood, which is refused because positions
/// would mean something else than the header says.
fn length_unit(path: &Path, heading: Option<&Heading>) -> Result<Option<Unit>> {
    let Some((heading, symbol)) = heading.and_then(|h| Some((h, h.unit.as_ref()?))) else { return Ok(None) };
    match Unit::parse(symbol) {
        Some(unit) if [UnitDimension::LENGTH, UnitDimension::NONE].contains(&unit.dimension) => {
            Ok(Some(unit).filter(|u| u.dimension == UnitDimension::LENGTH))
        }
        _ => {
            let what = format!("the unit '{symbol}' of '{}', expected a length such as cm, km, Rsun", heading.name);
            Err(FormatError::Unsupported { path: path.into(), format: NAME, what })
        }
    }
}

fn place_points(text: &Text, path: &Path, sheet: Sheet, axes: &[usize], notes: &mut Vec<String>) -> Result<Placed> {
    let headings: Vec<&Heading> = axes.iter().filter_map(|i| sheet.columns.get(*i)).map(|c| &c.heading).collect();
    let units = headings.iter().map(|h| length_unit(path, Some(h))).collect::<Result<Vec<_>>>()?;
    let unit = units.first().cloned().flatten();
    if units.iter().any(|u| u.as_ref().map(|u| u.to_cgs) != unit.as_ref().map(|u| u.to_cgs)) {
        let what = "coordinates with different units; give all of them in the same".to_owned();
        return Err(FormatError::Unsupported { path: path.into(), format: NAME, what });
    }
    let names: Vec<String> = headings.iter().map(|h| h.name.clone()).collect();
    let coordinates: Vec<&[f64]> =
        axes.iter().filter_map(|i| sheet.columns.get(*i)).map(|c| c.values.as_slice()).collect();
    for (name, values) in names.iter().zip(&coordinates) {
        if let Some(row) = values.iter().position(|v| !v.is_finite()) {
            let line = sheet.lines.get(row).copied().unwrap_or_default();
            return Err(text.error(format!("line {line}, column '{name}'"), "expected a finite coordinate"));
        }
    }
    // An axis on which all points agree spans nothing: a plane of z = 0 is two-dimensional.
    let flat: Vec<bool> = coordinates.iter().map(|v| distinct(v).len() < 2).collect();
    let spanned: Vec<usize> = (0..axes.len()).filter(|i| flat.get(*i) == Some(&false)).collect();
    if spanned.is_empty() {
        return Err(
            text.error("coordinates", "all rows have the same; expected points that span a line, plane or space")
        );
    }
    for (name, _) in names.iter().zip(&flat).filter(|(_, flat)| **flat) {
        notes.push(format!("'{name}' is the same in all rows and was dropped as an axis"));
    }
    let kept: Vec<&[f64]> = spanned.iter().filter_map(|i| coordinates.get(*i).copied()).collect();
    let others = |order: Option<&[usize]>| -> Vec<_> {
        let is_other = |(i, _): &(usize, _)| !axes.contains(i);
        let columns = sheet.columns.iter().enumerate().filter(is_other);
        columns.map(|(_, c)| (c.heading.clone(), Location::Node, reordered(&c.values, order))).collect()
    };
    if let Some(grid) = arrange(&kept) {
        let columns = others(Some(&grid.rows));
        let name = |i: usize| spanned.get(i).and_then(|s| names.get(*s)).cloned().unwrap_or_default();
        let nodes = grid.axes.into_iter().enumerate();
        let axes =
            nodes.map(|(i, nodes)| GridAxis { name: name(i), nodes, unit: unit.clone(), bounds: None }).collect();
        return Ok((Geometry::Grid { coordinates: Coordinates::Cartesian, axes }, columns));
    }
    let component = |axis: usize, row: usize| kept.get(axis).and_then(|v| v.get(row)).copied().unwrap_or(0.0);
    let points = (0..sheet.lines.len()).map(|row| std::array::from_fn(|axis| component(axis, row))).collect();
    Ok((Geometry::Cloud { dimension: kept.len(), points, unit }, others(None)))
}

fn reordered(values: &[f64], rows: Option<&[usize]>) -> Vec<f64> {
    match rows {
        Some(rows) => rows.iter().filter_map(|row| values.get(*row).copied()).collect(),
        None => values.to_vec(),
    }
}
