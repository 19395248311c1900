//! The layout of a profile: header entries and columns, as written.

use super::schema::is_numbering;
use crate::common::text::{Text, parse_number};
use crate::error::Result;

/// A profile's numbers, surface first.
#[derive(Debug)]
pub struct Sheet {
    /// Names and values of the header.
    pub header: Vec<(String, String)>,
    pub names: Vec<String>,
    /// One per name.
    pub columns: Vec<Vec<f64>>,
    /// Line of each zone in the file.
    pub lines: Vec<usize>,
}

impl Sheet {
    /// # Errors
    /// [`crate::FormatError::Input`] where lines are missing, do not have as many fields as there are names, or hold
    /// something else than numbers, and where the zones are not as many as the header says.
    pub fn parse(text: &Text) -> Result<Self> {
        let mut lines = text.lines();
        let mut next = |what: &str| {
            lines.next().ok_or_else(|| text.error("content", format!("ends before {what}; the file is truncated")))
        };
        let header =
            parse_header(text, [next("the header")?, next("the header's names")?, next("the header's values")?])?;
        let numbering = next("the numbers of the columns")?;
        if !is_numbering(numbering.1) {
            return Err(text.line_error(numbering.0, "expected the numbers of the columns, 1 2 3 ..."));
        }
        let (name_line, names) = next("the names of the columns")?;
        let names: Vec<String> = names.split_whitespace().map(str::to_owned).collect();
        let count = numbering.1.split_whitespace().count();
        if names.len() != count {
            let problem = format!("has {} names for {count} columns", names.len());
            return Err(text.line_error(name_line, problem));
        }
        let mut sheet = Self { header, columns: vec![Vec::new(); names.len()], names, lines: Vec::new() };
        lines.try_for_each(|(line, row)| sheet.push_row(text, line, row))?;
        sheet.check(text)?;
        Ok(sheet)
    }

    fn push_row(&mut self, text: &Text, line: usize, row: &str) -> Result<()> {
        let fields: Vec<&str> = row.split_whitespace().collect();
        if fields.len() != self.names.len() {
            let problem = format!("has {} columns, expected {}", fields.len(), self.names.len());
            return Err(text.line_error(line, problem));
        }
        for ((column, name), field) in self.columns.iter_mut().zip(&self.names).zip(fields) {
            column.push(text.number(line, name, field)?);
        }
        self.lines.push(line);
        Ok(())
    }

    fn check(&self, text: &Text) -> Result<()> {
        if self.names.iter().any(|n| n == "model_number") {
            let problem = "is a column, so each line is a model: this is a MESA history, expected a profile";
            return Err(text.error("variable 'model_number'", problem));
        }
        if self.lines.is_empty() {
            return Err(text.error("content", "has no zones"));
        }
        let zones = self.lines.len();
        if let Some(stated) = self.number("num_zones").filter(|stated| *stated != zones as f64) {
            let problem = format!("has {zones} zones, num_zones states {stated}; the file is truncated");
            return Err(text.error("content", problem));
        }
        text.check_last_line()
    }

    /// A number of the header.
    pub fn number(&self, name: &str) -> Option<f64> {
        let (_, value) = self.header.iter().find(|(n, _)| n == name)?;
        parse_number(value)
    }
}

fn parse_header(text: &Text, lines: [(usize, &str); 3]) -> Result<Vec<(String, String)>> {
    let [(first, numbering), (second, names), (third, values)] = lines;
    if !is_numbering(numbering) {
        return Err(text.line_error(first, "expected the numbers of the header's entries, 1 2 3 ..."));
    }
    let count = numbering.split_whitespace().count();
    let names: Vec<&str> = names.split_whitespace().collect();
    let values = split_quoted(values);
    for (line, found, what) in [(second, names.len(), "names"), (third, values.len(), "values")] {
        if found != count {
            return Err(text.line_error(line, format!("has {found} {what} for {count} entries of the header")));
        }
    }
    Ok(names.into_iter().map(str::to_owned).zip(values).collect())
}

/// Fields between white space; those in double quotes may hold white space.
fn split_quoted(line: &str) -> Vec<String> {
    let mut fields = Vec::new();
    let mut rest = line.trim();
    while !rest.is_empty() {
        let (field, after) = match rest.strip_prefix('"') {
            Some(quoted) => quoted.split_once('"').unwrap_or((quoted, "")),
            None => rest.split_once(char::is_whitespace).unwrap_or((rest, "")),
        };
        fields.push(field.trim().to_owned());
        rest = after.trim_start();
    }
    fields
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quoted_texts_are_one_field() {
        assert_eq!(split_quoted(r#" 1.5 "r24.08.1" "two words " "" 7"#), ["1.5", "r24.08.1", "two words", "", "7"]);
        assert_eq!(split_quoted(r#""open"#), ["open"]);
        assert!(split_quoted("  ").is_empty());
    }
}
