//! What each variable of an input is taken for, in one place: [`assign`] decides by names, units and company, and
//! [`apply`] renames scalars and joins components to Cartesian vectors. What is a momentum or a total energy becomes a velocity and
//! an internal energy on the way.

mod apply;
mod assign;
mod energy;
mod missing;
mod spelling;
mod units;

pub use apply::apply;
pub use assign::{Assignment, assign};
pub use energy::{divide_momenta, reduce_energies, restore_names};
pub use missing::warn_of_missing;
pub use spelling::field_key;
pub use units::adopt_units;
