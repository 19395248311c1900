//! Caps on sizes that a file declares, checked before anything is allocated.

/// Most bytes that one variable may take once decoded (64 GiB); larger declarations are refused.
pub const MAX_VARIABLE_BYTES: u64 = 64 << 30;

/// A compressed block may expand by this factor at most (deflate's own limit is about 1030).
pub const MAX_EXPANSION: u64 = 1100;
