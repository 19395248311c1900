//! Particles as a table: one row each, the header's facts in comments.

use super::layout::{is_middle_radius, is_radius};
use super::schema::NAME;
use super::sheet::Sheet;
use crate::common::assemble::{self, Named};
use crate::common::facts::{Facts, escaped, texts, unescaped};
use crate::common::text::Text;
use crate::error::{FormatError, Result};
use crate::model::{Column, ParticleFile, Species, Values};
use crate::particle_names as names;
use crate::registry::{WriteOptions, plain_name};
use crate::units::Unit;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Bytes gathered before they are written.
const BUFFER: usize = 1 << 16;
/// Comment that tells the number of rows.
const COUNT: &str = "particles";
/// Integers up to here survive a table, whose numbers are read as f64.
const MAX_WHOLE: i64 = 1 << 53;

/// Whether a table holds particles: coordinates and masses, and no radius, beside which a lone x is something else, unless the table is one of ours.
pub fn are_particles(sheet: &Sheet) -> bool {
    let columns = || sheet.columns.iter().map(|c| c.heading.name.as_str());
    let is_ours = sheet.comments.iter().any(|c| c.split_once(": ").is_some_and(|(key, _)| key == COUNT));
    let has_radius = || columns().map(plain_name).any(|n| is_radius(&n) || is_middle_radius(&n));
    assemble::are_particles(columns()) && (is_ours || !has_radius())
}

/// # Errors
/// [`FormatError::Input`] where columns contradict each other.
pub fn read(text: &Text, path: &Path, sheet: Sheet) -> Result<ParticleFile> {
    let count = sheet.lines.len();
    let comments: Vec<(&str, String)> =
        sheet.comments.iter().filter_map(|c| c.split_once(": ")).map(|(k, v)| (k, unescaped(v))).collect();
    if let Some((_, rows)) = comments.iter().find(|(k, _)| *k == COUNT)
        && (rows.trim().parse() != Ok(count) || !text.is_ended())
    {
        let problem = format!("has {count} whole rows, expected {rows} by its comments; the file is truncated");
        return Err(text.error("content", problem));
    }
    let mut facts = Facts::new(comments.iter().map(|(k, v)| (*k, v.as_str())));
    if !sheet.texts.is_empty() {
        facts.provenance.push(("not read".into(), format!("columns of texts: {}", sheet.texts.join(", "))));
    }
    let mut arrays: Vec<Named> = Vec::new();
    for column in sheet.columns {
        let unit = column.heading.unit.as_deref().and_then(Unit::parse);
        if let (None, Some(symbol)) = (&unit, &column.heading.unit) {
            facts.provenance.push(("unit not understood".into(), format!("'{symbol}' of '{}'", column.heading.name)));
        }
        let (name, values) = (column.heading.name, column.values);
        match arrays.last_mut().filter(|last| name == component_name(&last.name, last.components)) {
            Some(last) => append(last, values),
            None => {
                let name = name.strip_suffix("_0").map_or(name.clone(), str::to_owned);
                arrays.push(Named { name, components: 1, values: Values::F64(values), unit });
            }
        }
    }
    arrays.iter_mut().filter(|a| a.components > 1).for_each(|a| interleave(a, count));
    assemble::particles(count, arrays, facts).map_err(|(at, problem)| FormatError::input(path, NAME, at, problem))
}

fn component_name(name: &str, component: usize) -> String {
    format!("{name}_{component}")
}

/// Puts a further component behind those before; [`interleave`] sorts them.
fn append(array: &mut Named, values: Vec<f64>) {
    if let Values::F64(v) = &mut array.values {
        v.extend(values);
        array.components += 1;
    }
}

fn interleave(array: &mut Named, count: usize) {
    let n = array.components;
    let rows = (0..count * n).map(|flat| array.values.get((flat % n) * count + flat / n));
    array.values = Values::F64(rows.collect());
}

/// Writes particles: commas for `.csv`, tabs for `.tsv` and `.tab`, else blanks.
///
/// # Errors
/// [`FormatError::Output`] where there are no particles or integers do not survive, [`FormatError::Io`].
pub fn write(path: &Path, file: &ParticleFile, options: WriteOptions) -> Result<()> {
    let refuse = |problem: String| FormatError::Output { path: path.into(), format: NAME, problem };
    let species: Vec<&Species> = file.species.iter().filter(|s| s.table.count > 0).collect();
    if species.is_empty() {
        return Err(refuse("there are no particles, and a table has at least one row".into()));
    }
    let separator = match path.extension().and_then(|e| e.to_str()) {
        Some("csv") | None => ",",
        Some("tsv" | "tab") => "\t",
        Some(_) => "  ",
    };
    let mut columns: Vec<&Column> = Vec::new();
    for column in species.iter().flat_map(|s| &s.table.columns) {
        match columns.iter().find(|c| c.name == column.name) {
            Some(known) if known.components != column.components => {
                return Err(refuse(format!("column '{}' has different numbers of components", column.name)));
            }
            Some(_) => {}
            None => columns.push(column),
        }
        if let Values::I64(v) = &column.values
            && let Some(i) = v.iter().find(|i| i.unsigned_abs() > MAX_WHOLE as u64)
        {
            return Err(refuse(format!("column '{}' has {i}, which readers of tables round; write HDF5", column.name)));
        }
    }
    let typed = species.len() > 1 || species.iter().any(|s| s.part_type != 0);
    let mut text = String::new();
    for (key, value) in texts(&file.header) {
        let _ = writeln!(text, "# {key}: {}", escaped(&value));
    }
    let _ = writeln!(text, "# {COUNT}: {}", species.iter().map(|s| s.table.count).sum::<usize>());
    let mut heads: Vec<String> = columns.iter().flat_map(|c| headings(c, file)).collect();
    heads.extend(typed.then(|| names::PARTICLE_TYPE.to_owned()));
    let commented = if separator == "," { "" } else { "# " };
    let _ = writeln!(text, "{commented}{}", heads.join(separator));
    let created = File::create(path).map_err(|e| FormatError::io(path, "create", e))?;
    let mut out = BufWriter::new(created);
    for s in species {
        let own: Vec<(Option<&Column>, usize)> =
            columns.iter().map(|c| (s.table.column(&c.name), c.components)).collect();
        for i in 0..s.table.count {
            let mut first = true;
            for (column, components) in &own {
                for k in 0..*components {
                    if !std::mem::take(&mut first) {
                        text.push_str(separator);
                    }
                    number(&mut text, *column, i * components + k, options.double_precision);
                }
            }
            if typed {
                let _ = write!(text, "{separator}{}", s.part_type);
            }
            text.push('\n');
            if text.len() >= BUFFER {
                out.write_all(text.as_bytes()).map_err(|e| FormatError::io(path, "write", e))?;
                text.clear();
            }
        }
    }
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(|e| FormatError::io(path, "write", e))
}

/// `x [cm]`, `Masses [g]`, `Tensor_0`; a name that could be mistaken for several is quoted.
fn headings(column: &Column, file: &ParticleFile) -> Vec<String> {
    let symbol = file.header.units.symbol(column.dimension);
    let unit = if symbol.is_empty() { String::new() } else { format!(" [{symbol}]") };
    let plain = column.name.replace(['"', ',', '\t', '[', ']'], "_");
    let name = |k: usize| match (column.name.as_str(), ["x", "y", "z"].get(k)) {
        (names::COORDINATES, Some(axis)) => (*axis).to_owned(),
        (names::VELOCITIES, Some(axis)) => format!("v{axis}"),
        _ if column.components == 1 => plain.clone(),
        _ => component_name(&plain, k),
    };
    (0..column.components).map(|k| format!("{}{unit}", name(k))).collect()
}

/// The shortest digits that give the same number again; positions keep f64.
fn number(text: &mut String, column: Option<&Column>, i: usize, double: bool) {
    let _ = match column.map(|c| (&c.values, double || c.name == names::COORDINATES, c)) {
        None => text.write_str("nan"),
        Some((Values::I64(v), ..)) => match v.get(i) {
            Some(v) => write!(text, "{v}"),
            None => text.write_str("nan"),
        },
        Some((values, true, _)) if values.get(i).is_finite() => write!(text, "{:e}", values.get(i)),
        Some((values, false, _)) if (values.get(i) as f32).is_finite() && is_normal(values.get(i)) => {
            write!(text, "{:e}", values.get(i) as f32)
        }
        Some((values, ..)) if values.get(i).is_nan() => text.write_str("nan"),
        Some((values, ..)) => write!(text, "{:e}", values.get(i)),
    };
}

/// Whether f32 keeps a number's magnitude.
fn is_normal(v: f64) -> bool {
    v == 0.0 || (v as f32).is_normal()
}
