//! Reader of GYRE text models.

use super::schema::{NAME, column_count, header_version};
use crate::common::columns::{Candidate, select};
use crate::common::text::Text;
use crate::error::{FormatError, Result};
use crate::model::{Location, RawField};
use crate::registry::{FieldRequest, FileContent};
use std::path::Path;

/// Name, unit and column (from 0) of what is carried in every version.
const COMMON: [(&str, &str, usize); 6] = [
    ("luminosity", "erg/s", 3),
    ("pressure", "dyn/cm^2", 4),
    ("temperature", "K", 5),
    ("density", "g/cm^3", 6),
    ("nabla", "", 7),
    ("brunt_vaisala_squared", "s^-2", 8),
];
/// The same for the versions with a number.
const NUMBERED: [(&str, &str, usize); 5] = [
    ("gamma_1", "", 9),
    ("nabla_ad", "", 10),
    ("delta", "", 11),
    ("opacity", "cm^2/g", 12),
    ("energy_generation", "erg/g/s", 15),
];

struct Header {
    points: usize,
    /// Mass, radius, luminosity, as written.
    scalars: [String; 3],
    mass: f64,
    version: u32,
}

pub fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let text = Text::read(path, NAME)?;
    let header = read_header(&text, path)?;
    let columns = read_rows(&text, &header)?;
    text.check_last_line()?;
    let column = |i: usize| columns.get(i).cloned().unwrap_or_default();

    let mut notes = vec![format!("GYRE model, version {}: all columns belong to the same radii", header.version)];
    let nodes = column(1);
    let jumps = nodes.windows(2).filter(|w| w[0] == w[1]).count();
    if jumps > 0 {
        notes.push(format!("{jumps} repeated radii are taken as jumps"));
    }
    let mut enclosed = column(2);
    if header.version < 100 {
        // Stored as w = m / (M - m), which is infinite or huge where all the mass is enclosed.
        enclosed
            .iter_mut()
            .for_each(|w| *w = if w.is_infinite() { header.mass } else { header.mass * *w / (1.0 + *w) });
    }
    let node = |name: &str, unit: &str, values| Candidate::new(name, name, Some(unit), Location::Node, values);
    let mut candidates = vec![node("enclosed_mass", "g", enclosed)];
    candidates.extend(COMMON.iter().map(|&(name, unit, i)| node(name, unit, column(i))));
    if header.version > 1 {
        candidates.extend(NUMBERED.iter().map(|&(name, unit, i)| node(name, unit, column(i))));
        candidates.push(node("angular_velocity", "rad/s", columns.last().cloned().unwrap_or_default()));
    }
    let selected = select(&text, request, candidates, Some("density".into()))?;
    let [mass, radius, luminosity] = header.scalars;
    Ok(FileContent::Field(RawField::stellar(
        (path, NAME),
        nodes,
        selected,
        vec![
            ("mass (g)".into(), mass),
            ("photospheric radius (cm)".into(), radius),
            ("luminosity (erg/s)".into(), luminosity),
            ("version".into(), header.version.to_string()),
        ],
        notes,
    )))
}

fn read_header(text: &Text, path: &Path) -> Result<Header> {
    let Some((line, first)) = text.lines().next() else {
        return Err(text.error("content", "is empty, expected the header 'N M R L version'"));
    };
    let fields: Vec<&str> = first.split_whitespace().collect();
    let Some(version) = header_version(first) else {
        if let [_, _, _, _, version] = fields.as_slice()
            && version.parse().is_ok_and(|v| column_count(v).is_none())
        {
            let what = format!("version {version}; known are 19, 100, 101, 120 and files without a version");
            return Err(FormatError::Unsupported { path: path.into(), format: NAME, what });
        }
        let shown: String = first.trim().chars().take(60).collect();
        return Err(text.line_error(line, format!("found '{shown}', expected the header 'N M R L version'")));
    };
    let field = |i: usize| fields.get(i).copied().unwrap_or_default();
    let points = text.number(line, "N", field(0))? as usize;
    if points < 2 {
        return Err(text.line_error(line, format!("states {points} points, expected at least 2")));
    }
    let mass = text.number(line, "M", field(1))?;
    Ok(Header { points, scalars: [field(1).into(), field(2).into(), field(3).into()], mass, version })
}

/// The columns, index included; checks counts and order.
fn read_rows(text: &Text, header: &Header) -> Result<Vec<Vec<f64>>> {
    let width = column_count(header.version).unwrap_or_default();
    let mut columns = vec![Vec::new(); width];
    let mut rows = 0;
    let mut last_radius = 0.0;
    for (line, content) in text.lines().skip(1) {
        if rows == header.points {
            let problem = format!("there are more rows than the {} that the header states", header.points);
            return Err(text.line_error(line, problem));
        }
        let fields: Vec<&str> = content.split_whitespace().collect();
        if fields.len() != width {
            let problem = format!("has {} columns, expected {width} for version {}", fields.len(), header.version);
            return Err(text.line_error(line, problem));
        }
        for (i, (column, field)) in columns.iter_mut().zip(&fields).enumerate() {
            column.push(text.number(line, &(i + 1).to_string(), field)?);
        }
        rows += 1;
        let value = |i: usize| columns.get(i).and_then(|c| c.last()).copied().unwrap_or(f64::NAN);
        if value(0) != rows as f64 {
            let problem = format!("has index {}, expected {rows}; rows are missing or out of order", value(0));
            return Err(text.line_error(line, problem));
        }
        let radius = value(1);
        if radius.is_nan() || radius < last_radius {
            let problem = format!("the radius is {radius:e} after {last_radius:e}, expected it not to decrease");
            return Err(text.line_error(line, problem));
        }
        last_radius = radius;
    }
    if rows != header.points {
        let problem = format!("has {rows} rows, the header states {}; the file is truncated", header.points);
        return Err(text.error("content", problem));
    }
    Ok(columns)
}
