//! The columns of a model as written, from the innermost cell outwards.

use super::schema::{is_header, is_row};
use crate::common::text::{Text, parse_number};
use crate::error::Result;
use crate::registry::plain_name;

/// Columns of numbers, and what was not read.
#[derive(Debug)]
pub struct Sheet {
    pub columns: Vec<Column>,
    /// Line of each cell.
    pub lines: Vec<usize>,
    /// What stands above the names, without comment signs.
    pub header: Vec<String>,
    /// Names of columns of words, or of nothing but dashes.
    pub left_out: Vec<String>,
    /// First words of lines behind the cells.
    pub footer: Vec<String>,
}

/// A column on the way.
#[derive(Debug)]
pub struct Column {
    pub name: String,
    /// Letters and digits of the name.
    pub plain: String,
    /// `None`: a dash.
    pub values: Vec<Option<f64>>,
    is_text: bool,
}

impl Column {
    /// An isotope such as `h1`, `ni56`, `He4`, or neutrons and protons by KEPLER's names.
    pub fn is_isotope(&self) -> bool {
        let letters = self.plain.find(|c: char| c.is_ascii_digit()).unwrap_or(0);
        let (element, nucleons) = self.plain.split_at(letters);
        let is_nucleus =
            (1..=2).contains(&element.len()) && nucleons.parse::<u16>().is_ok_and(|n| (1..400).contains(&n));
        is_nucleus || ["neutrons", "protons"].contains(&self.plain.as_str())
    }

    /// Whether words may stand in it.
    fn may_be_text(&self) -> bool {
        !self.plain.starts_with("cell") && !self.is_isotope()
    }
}

impl Sheet {
    /// # Errors
    /// [`crate::FormatError::Input`] where no line names the columns, cells do not have a value for each, are out of order, or
    /// hold something else than numbers.
    pub fn parse(text: &Text) -> Result<Self> {
        let mut sheet = Self {
            columns: Vec::new(),
            lines: Vec::new(),
            header: Vec::new(),
            left_out: Vec::new(),
            footer: Vec::new(),
        };
        for (line, content) in text.lines() {
            if is_row(content) {
                sheet.push_row(text, line, content)?;
            } else if !sheet.lines.is_empty() {
                let word = content.split_whitespace().next().unwrap_or_default();
                sheet.footer.extend((!word.starts_with('#')).then(|| word.to_owned()));
            } else if is_header(content) {
                sheet.columns = names(content).into_iter().map(Column::new).collect();
            } else if sheet.columns.is_empty() {
                let fact = content.trim_start_matches(['#', ' ']).trim();
                sheet.header.extend((!fact.is_empty()).then(|| fact.to_owned()));
            } else {
                sheet.check_units(text, line, content)?;
            }
        }
        if sheet.lines.is_empty() {
            return Err(text.error("content", "has no cells below the names of the columns"));
        }
        if sheet.footer.is_empty() {
            text.check_last_line()?;
        }
        sheet.check_names(text)?;
        sheet.drop_empty();
        Ok(sheet)
    }

    fn push_row(&mut self, text: &Text, line: usize, row: &str) -> Result<()> {
        let fields: Vec<&str> = row.split_whitespace().collect();
        if let Some(word) = self.footer.first() {
            let problem = format!("is a cell behind the line '{word} ...', which ends them");
            return Err(text.line_error(line, problem));
        }
        if self.columns.is_empty() {
            let problem = "expected a line above that names the columns: cell outer radius, cell density and others";
            return Err(text.line_error(line, problem));
        }
        // Some headers do not name the cells' numbers.
        if self.lines.is_empty() && fields.len() == self.columns.len() + 1 && self.columns[0].plain != "grid" {
            self.columns.insert(0, Column::new("grid".into()));
        }
        if fields.len() != self.columns.len() {
            let problem = format!("has {} columns, the header names {}", fields.len(), self.columns.len());
            return Err(text.line_error(line, problem));
        }
        for (column, field) in self.columns.iter_mut().zip(fields) {
            let field = if column.plain == "grid" { field.trim_end_matches(':') } else { field };
            let is_missing = field.bytes().all(|b| b == b'-');
            if column.is_text || !is_missing && column.may_be_text() && parse_number(field).is_none() {
                column.is_text = true;
            } else {
                let value = if is_missing { None } else { Some(text.number(line, &column.name, field)?) };
                column.values.push(value);
            }
        }
        self.lines.push(line);
        Ok(())
    }

    /// A line of units says cgs, or something that is not read here.
    fn check_units(&self, text: &Text, line: usize, content: &str) -> Result<()> {
        let mut words = content.trim_start_matches(['#', ' ']).split_whitespace();
        let is_units = words.next().is_some_and(|word| plain_name(word).starts_with("unit"));
        let all: Vec<&str> = words.collect();
        if is_units && !(all.contains(&"cm") && all.contains(&"g/cm**3")) {
            let problem = "states units other than cm and g/cm**3; name the format table, which takes units as stated";
            return Err(text.line_error(line, problem));
        }
        Ok(())
    }

    fn check_names(&self, text: &Text) -> Result<()> {
        for (i, column) in self.columns.iter().enumerate() {
            if self.columns.iter().take(i).any(|other| other.plain == column.plain) {
                return Err(text.error(format!("column '{}'", column.name), "names two columns"));
            }
        }
        Ok(())
    }

    /// Takes out columns of words and of dashes alone.
    fn drop_empty(&mut self) {
        let is_number = |c: &Column| !c.is_text && c.values.iter().any(Option::is_some);
        self.left_out = self.columns.iter().filter(|c| !is_number(c)).map(|c| c.name.clone()).collect();
        self.columns.retain(is_number);
    }

    /// The column of one of these plain names.
    pub fn column(&self, names: &[&str]) -> Option<&Column> {
        self.columns.iter().find(|c| names.contains(&c.plain.as_str()))
    }

    /// Where a value of a column stands.
    pub fn place(&self, cell: usize, column: &str) -> String {
        format!("line {}, column '{column}'", self.lines.get(cell).copied().unwrap_or_default())
    }
}

impl Column {
    fn new(name: String) -> Self {
        Self { plain: plain_name(&name), name, values: Vec::new(), is_text: false }
    }
}

/// The names in a header line: two blanks or more, tabs or brackets with numbers stand between them.
fn names(line: &str) -> Vec<String> {
    let line = line.trim_start_matches(['#', ' ']).replace(['[', ']', '\t'], "  ");
    let parts = line.split("  ").map(str::trim).filter(|part| !part.is_empty());
    parts.filter(|part| !part.bytes().all(|b| b.is_ascii_digit())).map(without_number).collect()
}

/// `03 cell outer total mass`, as it stands in brackets, without the number.
fn without_number(name: &str) -> String {
    match name.split_once(' ') {
        Some((number, rest)) if number.bytes().all(|b| b.is_ascii_digit()) => rest.to_owned(),
        _ => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_in_headers_of_all_kinds() {
        let expected = ["grid", "cell mass", "cell outer radius", "'fe'"];
        for line in [
            "# grid    cell mass        cell outer radius   'fe'",
            "  grid  cell mass\tcell outer radius  'fe'",
            "# [01               grid]   [02 cell mass]   [03  cell outer radius]   [04 'fe']",
        ] {
            assert_eq!(names(line), expected, "{line}");
        }
    }

    #[test]
    fn isotopes_are_told_from_words() {
        let is_isotope = |name: &str| Column::new(name.into()).is_isotope();
        assert!(["h1", "He4", "ni56", "nt1", "pn1", "neutrons"].into_iter().all(is_isotope));
        assert!(!["stability", "cell A_bar", "'fe'", "grid", "NETWORK", "x1000"].into_iter().any(is_isotope));
    }
}
