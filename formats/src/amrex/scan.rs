//! Splits AMReX's text files into words; brackets and commas only separate numbers.

use super::schema::NAME;
use crate::error::{FormatError, Result};
use std::path::Path;
use std::str::FromStr;

/// A text from which words are taken one by one.
pub struct Scan<'a> {
    path: &'a Path,
    words: Box<dyn Iterator<Item = &'a str> + 'a>,
}

impl<'a> Scan<'a> {
    pub fn new(path: &'a Path, text: &'a str) -> Self {
        let is_separator = |c: char| c.is_whitespace() || matches!(c, '(' | ')' | ',');
        Self { path, words: Box::new(text.split(is_separator).filter(|word| !word.is_empty())) }
    }

    /// The next word.
    ///
    /// # Errors
    /// The end of the text.
    pub fn word(&mut self, what: &str) -> Result<&'a str> {
        let ends = || FormatError::input(self.path, NAME, what, "the text ends before it; the file is incomplete");
        self.words.next().ok_or_else(ends)
    }

    /// The next word, as a number.
    ///
    /// # Errors
    /// The end of the text, or another word.
    pub fn number<T: FromStr>(&mut self, what: &str) -> Result<T> {
        let word = self.word(what)?;
        let kind = if std::any::type_name::<T>() == "f64" { "a number" } else { "a whole number" };
        word.parse().map_err(|_| FormatError::input(self.path, NAME, what, format!("is '{word}', expected {kind}")))
    }

    /// One number per axis; `rest` beyond the last.
    ///
    /// # Errors
    /// As [`Self::number`].
    pub fn axes<T: FromStr + Copy>(&mut self, what: &str, dimension: usize, rest: T) -> Result<[T; 3]> {
        let mut all = [rest; 3];
        for slot in all.iter_mut().take(dimension) {
            *slot = self.number(what)?;
        }
        Ok(all)
    }

    /// A box of cells: its first and last cell along each axis, and the kind of its indices, which must be cells.
    ///
    /// # Errors
    /// As [`Self::number`]; a box of nodes, without cells or of more than can be counted.
    pub fn cells(&mut self, what: &str, dimension: usize) -> Result<Cells> {
        let (lo, last) = (self.axes(what, dimension, 0_i64)?, self.axes(what, dimension, 0)?);
        let wrong = |problem: String| Err(FormatError::input(self.path, NAME, what, problem));
        const FAR: i64 = 1 << 45;
        if (0..3).any(|k| lo[k] > last[k] || lo[k].abs() > FAR || last[k].abs() > FAR) {
            return wrong(format!("is a box from cell {lo:?} to {last:?}, expected some cells"));
        }
        let hi = last.map(|x| x + 1);
        match self.axes(what, dimension, 0)? {
            [0, 0, 0] => Ok(Cells { lo, hi }),
            kind => wrong(format!("is a box of kind {kind:?}, expected one of cells (0)")),
        }
    }
}

/// A box of cells: the first along each axis, and the one behind the last; 0 and 1 along axes that there are not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cells {
    pub lo: [i64; 3],
    pub hi: [i64; 3],
}

impl Cells {
    pub fn count(&self) -> u64 {
        self.sizes().iter().fold(1, |n, &size| n.saturating_mul(size))
    }

    pub fn sizes(&self) -> [u64; 3] {
        std::array::from_fn(|k| self.hi[k].saturating_sub(self.lo[k]).max(0) as u64)
    }

    pub fn within(&self, other: &Self) -> Self {
        Self {
            lo: std::array::from_fn(|k| self.lo[k].max(other.lo[k])),
            hi: std::array::from_fn(|k| self.hi[k].min(other.hi[k])),
        }
    }

    pub fn shifted(&self, by: [i64; 3]) -> Self {
        Self { lo: std::array::from_fn(|k| self.lo[k] - by[k]), hi: std::array::from_fn(|k| self.hi[k] - by[k]) }
    }
}
