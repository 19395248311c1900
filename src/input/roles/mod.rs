//! What each variable of an input is taken for, in one place: [`assign`] decides by names, units and company, and
//! [`apply`] renames scalars and joins components to Cartesian vectors.

mod apply;
mod assign;
mod spelling;
mod units;

pub use apply::apply;
pub use assign::{Assignment, assign};
pub use units::adopt_units;
