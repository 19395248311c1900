//! Text files: whole-file reading under a cap, numbered lines, and numbers as C, Fortran and people write them.

use crate::error::{FormatError, Result};
use crate::limits::MAX_TEXT_BYTES;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

const CHUNK: u64 = 1 << 20;

/// A text file in memory, with what its error messages need.
#[derive(Debug)]
pub struct Text {
    path: PathBuf,
    format: &'static str,
    content: String,
}

/// Lines by whose width a file is one of fixed width.
const LINES: usize = 24;

impl Text {
    /// Reads a whole file. A byte-order mark is dropped.
    ///
    /// # Errors
    /// [`FormatError::Io`]; [`FormatError::Limit`] past [`MAX_TEXT_BYTES`]; [`FormatError::Input`] where the file is
    /// empty, holds zero bytes (a binary file), or is not UTF-8.
    pub fn read(path: &Path, format: &'static str) -> Result<Self> {
        let io = |e| FormatError::io(path, "read", e);
        let mut file = File::open(path).map_err(|e| FormatError::io(path, "open", e))?;
        let mut bytes = Vec::new();
        loop {
            let start = bytes.len();
            let read = file.by_ref().take(CHUNK).read_to_end(&mut bytes).map_err(io)?;
            if read == 0 {
                break;
            }
            if bytes.get(start..).is_some_and(|new| new.contains(&0)) {
                let problem = "holds zero bytes, expected text; this is a binary file";
                return Err(FormatError::input(path, format, "content", problem));
            }
            if bytes.len() as u64 > MAX_TEXT_BYTES {
                return Err(FormatError::Limit {
                    path: path.into(),
                    format,
                    location: "size".into(),
                    declared: format!("more than {} bytes", bytes.len()),
                    allowed: format!("{MAX_TEXT_BYTES} bytes of text"),
                });
            }
        }
        let content = String::from_utf8(bytes).map_err(|e| {
            let good = e.utf8_error().valid_up_to();
            let line = 1 + e.as_bytes().iter().take(good).filter(|&&b| b == b'\n').count();
            let problem = "holds bytes that are not UTF-8 text; convert it, for example with iconv";
            FormatError::input(path, format, format!("line {line}"), problem)
        })?;
        let content = match content.strip_prefix('\u{feff}') {
            Some(rest) => rest.to_owned(),
            None => content,
        };
        let text = Self { path: path.into(), format, content };
        if text.content.trim().is_empty() {
            return Err(text.error("content", "is empty, expected a header and rows of numbers"));
        }
        Ok(text)
    }

    /// All of it.
    pub fn content(&self) -> &str {
        &self.content
    }

    /// Lines with their numbers, from 1, without line ends; blank ones are left out.
    pub fn lines(&self) -> impl Iterator<Item = (usize, &str)> {
        let numbered = self.content.lines().enumerate();
        numbered.map(|(i, line)| (i + 1, line)).filter(|(_, line)| !line.trim().is_empty())
    }

    /// An error at a place of this file.
    pub fn error(&self, location: impl Into<String>, problem: impl Into<String>) -> FormatError {
        FormatError::input(&self.path, self.format, location, problem)
    }

    /// An error at a line of this file.
    pub fn line_error(&self, line: usize, problem: impl Into<String>) -> FormatError {
        self.error(format!("line {line}"), problem)
    }

    /// A number at a line and column (named) of this file.
    ///
    /// # Errors
    /// [`FormatError::Input`] with line, column and text.
    pub fn number(&self, line: usize, column: &str, text: &str) -> Result<f64> {
        parse_number(text).ok_or_else(|| {
            let shown: String = text.chars().take(40).collect();
            let problem = match shown.as_str() {
                "" => "the field is empty, expected a number (write NaN where there is none)".to_owned(),
                s if s.bytes().all(|b| b == b'*') => {
                    format!("found '{s}', a number too wide for its Fortran format; write the file with a wider one")
                }
                s => format!("found '{s}', expected a number"),
            };
            self.error(format!("line {line}, column '{column}'"), problem)
        })
    }

    /// Whether the last line has its end.
    pub fn is_ended(&self) -> bool {
        self.content.ends_with('\n')
    }

    /// Refuses a file of fixed-width lines whose last line is cut off: without a line end and shorter than some
    /// lines before, all of one width. The number of fields alone does not show it.
    ///
    /// # Errors
    /// [`FormatError::Input`].
    pub fn check_last_line(&self) -> Result<()> {
        if self.content.ends_with('\n') {
            return Ok(());
        }
        let width = |line: &str| line.trim_end().len();
        let mut last = self.content.lines().rev().filter(|line| !line.trim().is_empty());
        let Some(end) = last.next() else { return Ok(()) };
        let mut all: Vec<&str> = last.take(LINES).collect();
        if (3..LINES).contains(&all.len()) {
            // The first may be a header.
            all.pop();
        }
        let Some(before) = all.first() else { return Ok(()) };
        if all.iter().all(|line| width(line) == width(before)) && width(end) < width(before) {
            let problem = format!(
                "the last line has {} characters and no line end, those before have {}; the file is truncated",
                width(end),
                width(before)
            );
            return Err(self.line_error(self.content.lines().count(), problem));
        }
        Ok(())
    }
}

/// A number: Rust's own spellings (including `nan`, `inf`), Fortran's `1.0D+3` and `1.234-101`, and C's `nan` signs.
pub fn parse_number(text: &str) -> Option<f64> {
    let text = text.trim();
    if let Ok(value) = text.parse() {
        return Some(value);
    }
    // Only digits, signs, points and one exponent letter may be rewritten: 'd' occurs in words too.
    let numeric = |b: u8| b.is_ascii_digit() || b"+-.dDeEqQ".contains(&b);
    if text.is_empty() || text.len() > 64 || !text.bytes().all(numeric) {
        return None;
    }
    let mut rewritten = String::with_capacity(text.len() + 1);
    let mut exponent = false;
    let mut previous = ' ';
    for c in text.chars() {
        match c {
            'd' | 'D' | 'q' | 'Q' => {
                exponent = true;
                rewritten.push('e');
            }
            '+' | '-' if !exponent && (previous.is_ascii_digit() || previous == '.') => {
                exponent = true;
                rewritten.push('e');
                rewritten.push(c);
            }
            _ => {
                exponent |= c == 'e' || c == 'E';
                rewritten.push(c);
            }
        }
        previous = c;
    }
    rewritten.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fortran_and_c_numbers_are_understood() {
        for (text, value) in [
            ("1.0D+3", 1e3),
            ("1.0d3", 1e3),
            ("-2.5E-02", -0.025),
            ("1.234-101", 1.234e-101),
            ("1.+101", 1e101),
            ("1.5Q2", 150.0),
            (" .5 ", 0.5),
            ("7", 7.0),
            ("1e400", f64::INFINITY),
        ] {
            assert_eq!(parse_number(text), Some(value), "{text}");
        }
        assert!(parse_number("NaN").is_some_and(f64::is_nan));
        assert!(parse_number("-nan").is_some_and(f64::is_nan));
    }

    #[test]
    fn words_and_halves_are_no_numbers() {
        for text in ["", "-", "dd", "d", "1.2.3", "1,5", "0x10", "****", "1e", "1.0E+", "add", "1-2-3", "12-"] {
            assert_eq!(parse_number(text), None, "{text}");
        }
    }

    #[test]
    fn a_cut_last_line_of_a_fixed_width_file_is_seen() {
        let check = |content: &str| {
            Text { path: "x".into(), format: "table", content: content.into() }.check_last_line().is_ok()
        };
        assert!(check("1.0 2.00\n3.0 4.00\n5.0 6.00"));
        assert!(check("1.0 2.00\n3.0 4.00\n5.0 6.0\n"));
        assert!(check("1 2\n30 4\n5 6"));
        assert!(!check("1.0 2.00\n3.0 4.00\n5.0 6.0"));
        assert!(!check("radius rho\n1.0 2.00\n3.0 4.00\n5.0 6.0"));
        // Numbers as short as they can be.
        let rows: Vec<String> =
            (1..=100).map(|i| format!("{} {}", f64::from(i) / 100.0, 1.0 - f64::from(i) / 100.0)).collect();
        assert!(check(&rows.join("\n")));
    }
}
