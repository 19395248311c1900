//! Exit codes.

pub const SUCCESS: u8 = 0;
pub const FAILURE: u8 = 1;
pub const USAGE: u8 = 2;
/// The tolerance asked for was not reached, a region has not its mass, or an interrupt was to leave the best state.
pub const NOT_CONVERGED: u8 = 3;
