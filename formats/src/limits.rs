//! Caps on sizes that a file declares, checked before anything is allocated.

// A build of few formats has no use for some of them.
#![cfg_attr(not(feature = "default"), allow(dead_code))]

use crate::error::{FormatError, Result};
use std::cell::Cell;
use std::path::Path;

/// Most bytes that one variable may take once decoded (64 GiB); larger declarations are refused.
pub const MAX_VARIABLE_BYTES: u64 = 64 << 30;

/// A compressed block may expand by this factor at most (deflate's own limit is about 1030).
pub const MAX_EXPANSION: u64 = 1100;

/// Largest text file (8 GiB): some 1e8 points with three coordinates and a value. Larger fields belong in a binary format.
pub const MAX_TEXT_BYTES: u64 = 8 << 30;

/// What any file may take once decoded, however small it is (256 MiB).
const FREE_BYTES: u64 = 256 << 20;

/// Beyond [`FREE_BYTES`], a file may take as many times its own size. Compressed fields seldom shrink by more than 10.
const MAX_GROWTH: u64 = 64;

/// How much memory what a file holds may take in all: a small file may not ask for much, however well it is compressed.
#[derive(Debug)]
pub struct Budget {
    file_bytes: u64,
    left: Cell<u64>,
}

impl Budget {
    /// For a file of so many bytes.
    pub fn new(file_bytes: u64) -> Self {
        Self { file_bytes, left: Cell::new(file_bytes.saturating_mul(MAX_GROWTH).saturating_add(FREE_BYTES)) }
    }

    /// What is left of it.
    pub fn left(&self) -> u64 {
        self.left.get()
    }

    /// Takes `bytes` for what is at `location`.
    ///
    /// # Errors
    /// [`FormatError::Limit`] where there are not as many left.
    pub fn take(&self, path: &Path, format: &'static str, location: &str, bytes: u64) -> Result<()> {
        let left = self.left.get();
        if bytes > left.min(MAX_VARIABLE_BYTES) {
            return Err(FormatError::Limit {
                path: path.into(),
                format,
                location: location.into(),
                declared: format!("{bytes} bytes once decoded"),
                allowed: format!(
                    "the {left} that are left to a file of {} bytes (store it uncompressed if it is that large)",
                    self.file_bytes
                ),
            });
        }
        self.left.set(left - bytes);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_file_cannot_take_much_in_all() {
        let budget = Budget::new(1_000_000);
        let take = |bytes| budget.take(Path::new("a"), "b", "c", bytes);
        assert!(take(200 << 20).is_ok() && take(100 << 20).is_ok());
        assert!(matches!(take(100 << 20), Err(FormatError::Limit { .. })));
        assert!(take(budget.left()).is_ok() && take(1).is_err() && take(0).is_ok());
        assert!(Budget::new(u64::MAX).take(Path::new("a"), "b", "c", MAX_VARIABLE_BYTES + 1).is_err());
    }
}
