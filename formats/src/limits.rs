//! Caps on sizes that a file declares, checked before anything is allocated.

/// Most bytes that one variable may take once decoded (64 GiB); larger declarations are refused.
pub const MAX_VARIABLE_BYTES: u64 = 64 << 30;

/// A compressed block may expand by this factor at most (deflate's own limit is about 1030).
pub const MAX_EXPANSION: u64 = 1100;

/// Largest text file (8 GiB): some 1e8 points with three coordinates and a value. Larger fields belong in a binary format.
pub const MAX_TEXT_BYTES: u64 = 8 << 30;
