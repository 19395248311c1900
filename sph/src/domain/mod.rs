//! The region that particles may occupy, and the only code that wraps, mirrors or confines positions.

mod bounds;
mod edges;
mod ghosts;
mod region;

pub use bounds::{Axis, AxisImage, Domain, DomainError};
pub use ghosts::Ghosts;
pub use region::{Hull, Region, Round, Wall};
