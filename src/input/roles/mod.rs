//! Assigns a role to each variable of an input, in one place: [`assign`] decides by names, units and the other variables, and [`apply`] renames
//! scalars and joins components to Cartesian vectors. Momenta are converted to velocities, and total energies to internal energies.

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
