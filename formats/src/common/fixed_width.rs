//! Numbers in columns of a fixed width, as Fortran writes them: a negative one may touch the one before it.

use crate::common::text::{Text, parse_number};
use crate::error::{FormatError, Result};

/// Narrowest column that is cut by its width alone.
const LEAST_WIDTH: usize = 8;

/// Lines that are read one after the other, blank ones too, with their numbers from 1.
pub struct Lines<'a> {
    text: &'a Text,
    rest: std::str::Lines<'a>,
    /// Of the line that was read last.
    pub line: usize,
    /// Characters per number of the line before the last.
    width: Option<usize>,
}

impl<'a> Lines<'a> {
    pub fn new(text: &'a Text) -> Self {
        Self { text, rest: text.content().lines(), line: 0, width: None }
    }

    /// The next line.
    ///
    /// # Errors
    /// [`FormatError::Input`] at the end of the file; `what` is what is missing.
    pub fn next(&mut self, what: &str) -> Result<&'a str> {
        self.line += 1;
        self.rest.next().ok_or_else(|| self.text.error("content", format!("ends before {what}; the file is truncated")))
    }

    /// Refuses a size that the rest of the file cannot hold: a number takes a character at least.
    ///
    /// # Errors
    /// [`FormatError::Input`].
    pub fn check_size(&self, line: usize, points: usize, variables: usize) -> Result<()> {
        let held = self.text.content().len();
        if points.checked_mul(variables).is_none_or(|n| n > held) {
            let problem = format!(
                "states {points} points of {variables} variables, more than a file of {held} characters can hold; it is truncated or damaged"
            );
            return Err(self.text.line_error(line, problem));
        }
        Ok(())
    }

    /// Reads `count` numbers, `per_line` on every line but the last.
    ///
    /// # Errors
    /// [`FormatError::Input`] with line and column (the place within the line) of what is no number, and where lines are missing
    /// or cut off.
    pub fn numbers(&mut self, count: usize, per_line: usize, what: &str, values: &mut Vec<f64>) -> Result<()> {
        let mut left = count;
        while left > 0 {
            let own = left.min(per_line);
            let line = self.next(what)?.trim_end();
            self.check_cut(line, own)?;
            let Some(fields) = split(line, own) else {
                let found = line.split_whitespace().count();
                let problem = format!("has {} characters and {found} words, expected {own} numbers", line.len());
                return Err(self.text.line_error(self.line, problem));
            };
            for (i, field) in fields.iter().enumerate() {
                values.push(self.text.number(self.line, &(i + 1).to_string(), field.trim())?);
            }
            let width = line.len() / own;
            self.width = (width >= LEAST_WIDTH && line.len().is_multiple_of(own)).then_some(width);
            left -= own;
        }
        Ok(())
    }

    /// A last line without its end, shorter than its numbers are wide, is cut off within one.
    fn check_cut(&self, line: &str, numbers: usize) -> Result<()> {
        let expected = self.width.map(|width| width * numbers);
        let is_last = !self.text.is_ended() && self.rest.clone().next().is_none();
        if is_last && expected.is_some_and(|expected| line.len() < expected) {
            let problem = format!(
                "the last line has {} characters and no line end, expected {}; the file is truncated",
                line.len(),
                expected.unwrap_or_default()
            );
            return Err(self.text.line_error(self.line, problem));
        }
        Ok(())
    }

    /// Refuses lines that nothing announces.
    ///
    /// # Errors
    /// [`FormatError::Input`] with the first of them that is not blank.
    pub fn check_end(&mut self, what: &str) -> Result<()> {
        let first = self.line + 1;
        match self.rest.clone().position(|line| !line.trim().is_empty()) {
            Some(at) => Err(self.text.line_error(first + at, format!("follows {what}, where nothing is expected"))),
            None => Ok(()),
        }
    }

    /// An error at the line that was read last.
    pub fn error(&self, problem: String) -> FormatError {
        self.text.line_error(self.line, problem)
    }
}

/// Fields of a line of so many numbers: by the white space between them, else by their width.
pub fn split(line: &str, count: usize) -> Option<Vec<&str>> {
    let line = line.trim_end();
    let words: Vec<&str> = line.split_whitespace().take(count + 1).collect();
    if words.len() == count {
        return Some(words);
    }
    let width = line.len().checked_div(count).filter(|w| *w >= LEAST_WIDTH && line.len() == w * count)?;
    let fields: Option<Vec<&str>> = (0..count).map(|i| line.get(i * width..(i + 1) * width)).collect();
    // A cut through a number leaves a piece on either side of a blank.
    fields.filter(|fields| fields.iter().all(|f| !f.trim().is_empty() && !f.trim().contains(char::is_whitespace)))
}

/// Whether a line holds so many numbers.
pub fn is_numbers(line: &str, count: usize) -> bool {
    split(line, count).is_some_and(|fields| fields.iter().all(|f| parse_number(f).is_some()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_touch_are_told_apart_by_their_width() {
        let touching = "-4.581871796E+01-3.322677994E+01 5.845337600E+08-1.000000000-100 2.000000000+101";
        let fields = split(touching, 5).unwrap();
        assert_eq!(parse_number(fields[3]), Some(-1e-100));
        assert_eq!(parse_number(fields[4]), Some(2e101));
        assert_eq!(split(" 1 2   3", 3).unwrap(), ["1", "2", "3"]);
        assert!(is_numbers(touching, 5) && !is_numbers(touching, 4));
        // Cut by their width, these would be other numbers.
        assert_eq!(split("123456789 123456", 4), None);
        assert_eq!(split("", 3), None);
        // The middle of the line is within a letter of two bytes.
        assert_eq!(split("12345678é01234567", 2), None);
    }
}
