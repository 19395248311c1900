//! The numbers of a table.

use super::layout::{Delimiter, Heading, Layout, comment};
use crate::common::text::{Text, parse_number};
use crate::error::Result;

/// A column of numbers.
#[derive(Debug)]
pub struct NumberColumn {
    pub heading: Heading,
    pub values: Vec<f64>,
}

/// A table as written.
#[derive(Debug)]
pub struct Sheet {
    pub columns: Vec<NumberColumn>,
    /// Names of the columns that hold texts.
    pub texts: Vec<String>,
    /// Line of each row.
    pub lines: Vec<usize>,
    pub comments: Vec<String>,
}

/// A column on the way: what it holds is known with its first row.
struct Pending {
    column: NumberColumn,
    is_text: bool,
}

impl Sheet {
    /// # Errors
    /// [`crate::FormatError::Input`] where a row does not have one field per column, or a field is not a number.
    pub fn parse(text: &Text, layout: Layout) -> Result<Self> {
        let mut pending: Vec<Pending> = Vec::with_capacity(layout.headings.len());
        for heading in layout.headings {
            if pending.iter().any(|p| p.column.heading.name == heading.name) {
                let problem = "names two columns; give each its own name";
                return Err(text.error(format!("column '{}'", heading.name), problem));
            }
            pending.push(Pending { column: NumberColumn { heading, values: Vec::new() }, is_text: false });
        }
        let mut lines = Vec::new();
        for (line, row) in text.lines().skip_while(|(line, _)| *line < layout.first_row) {
            if comment(row).is_none() {
                push_row(text, layout.delimiter, &mut pending, line, row, lines.is_empty())?;
                lines.push(line);
            }
        }
        text.check_last_line()?;
        let (texts, columns): (Vec<_>, Vec<_>) = pending.into_iter().partition(|p| p.is_text);
        Ok(Self {
            columns: columns.into_iter().map(|p| p.column).collect(),
            texts: texts.into_iter().map(|p| p.column.heading.name).collect(),
            lines,
            comments: layout.comments,
        })
    }
}

fn push_row(
    text: &Text,
    delimiter: Delimiter,
    pending: &mut [Pending],
    line: usize,
    row: &str,
    is_first: bool,
) -> Result<()> {
    let numbers = row.split_once('#').map_or(row, |(numbers, _)| numbers);
    let fields = delimiter.split(numbers);
    if fields.len() != pending.len() {
        let problem = format!("has {} columns, the header names {}", fields.len(), pending.len());
        return Err(text.line_error(line, problem));
    }
    for (p, field) in pending.iter_mut().zip(fields) {
        let name = &p.column.heading.name;
        if is_first && !field.is_empty() && parse_number(field).is_none() {
            p.is_text = true;
        } else if p.is_text {
            // A number below a text is a damaged column, not a label; a label may well look like a number (2000A).
            if parse_number(field).is_some_and(|v| !v.is_nan()) {
                let problem = format!("found the number '{field}' in a column that begins with a text");
                return Err(text.error(format!("line {line}, column '{name}'"), problem));
            }
        } else {
            let value = text.number(line, name, field)?;
            p.column.values.push(value);
        }
    }
    Ok(())
}
