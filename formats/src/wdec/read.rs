//! Reader of WDEC models.

use super::schema::{ARRAYS, CARRIED, NAME, PER_LINE, points};
use crate::common::columns::{Candidate, select};
use crate::common::fixed_width::Lines;
use crate::common::points::{self as profile, Series};
use crate::common::text::Text;
use crate::error::Result;
use crate::model::{Location, RawField};
use crate::registry::{FieldRequest, FileContent};
use std::path::Path;

const RADIUS: usize = 0;
const MASS: usize = 1;
const DENSITY: usize = 4;
/// Lines before the arrays.
const HEADER_LINES: usize = 2;

/// Reads a model.
///
/// # Errors
/// [`crate::FormatError::Input`] with line and column where it is damaged, incomplete or no star; [`crate::FormatError::Io`].
pub fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let text = Text::read(path, NAME)?;
    let (header, arrays) = parse(&text)?;
    let place = |array: usize| {
        let count = arrays[RADIUS].len();
        move |point: usize| {
            let line = 1 + HEADER_LINES + array * count.div_ceil(PER_LINE) + point / PER_LINE;
            format!("line {line}, column '{}'", point % PER_LINE + 1)
        }
    };
    profile::check(
        &text,
        &Series { values: &arrays[RADIUS], place: &place(RADIUS) },
        &Series { values: &arrays[MASS], place: &place(MASS) },
        &Series { values: &arrays[DENSITY], place: &place(DENSITY) },
    )?;

    let mut notes = vec!["WDEC model: all arrays belong to the same radii".to_owned()];
    notes.extend(profile::jumps_note(&arrays[RADIUS]));
    notes.extend(profile::mass_note(&arrays[RADIUS], &arrays[MASS], &arrays[DENSITY]));
    let node = |name: &str, unit: &str, array: usize| {
        Candidate::new(name, name, Some(unit), Location::Node, arrays[array].clone())
    };
    let is_there = |array: usize| array == DENSITY || arrays[array].iter().any(|v| *v != 0.0);
    let absent: Vec<&str> =
        CARRIED.iter().filter(|(_, _, array)| !is_there(*array)).map(|(name, _, _)| *name).collect();
    if !absent.is_empty() {
        notes.push(format!("0 everywhere, and so left out: {}", absent.join(", ")));
    }
    let mut candidates = vec![node("enclosed_mass", "g", MASS)];
    let carried = CARRIED.iter().filter(|(_, _, array)| is_there(*array));
    candidates.extend(carried.map(|&(name, unit, array)| node(name, unit, array)));
    let selected = select(&text, request, candidates, Some("density".into()))?;
    Ok(FileContent::Field(RawField::stellar(
        (path, NAME),
        arrays[RADIUS].clone(),
        selected,
        header.into_iter().map(|line| ("header".to_owned(), line)).collect(),
        notes,
    )))
}

/// Both header lines, and the arrays.
fn parse(text: &Text) -> Result<(Vec<String>, Vec<Vec<f64>>)> {
    let mut lines = Lines::new(text);
    let first = lines.next("the model's line")?;
    let second = lines.next("the numbers of points")?;
    let Some(count) = points(second) else {
        let shown: String = second.trim().chars().take(60).collect();
        return Err(lines.error(format!("found '{shown}', expected the points as 'all = core + envelope'")));
    };
    if count < 2 {
        return Err(lines.error(format!("states {count} points, expected at least 2")));
    }
    lines.check_size(lines.line, count, ARRAYS)?;
    let mut arrays = Vec::with_capacity(ARRAYS);
    for array in 1..=ARRAYS {
        let mut values = Vec::new();
        let what = format!("all {count} values of array {array} of {ARRAYS}");
        lines.numbers(count, PER_LINE, &what, &mut values)?;
        arrays.push(values);
    }
    lines.check_end("the last array")?;
    Ok((vec![first.trim().to_owned(), second.trim().to_owned()], arrays))
}
