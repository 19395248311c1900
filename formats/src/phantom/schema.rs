//! What begins a dump.

pub const NAME: &str = "phantom";

/// First integer of every dump.
pub const CAPTURE: i32 = 60769;
