//! Sums over neighbors: densities with their gradients, the support radii that belong to a neighbor number, forces, and other sums that
//! relaxation needs.
//!
//! Each is compiled in this crate for one to three dimensions, all kernels and the precisions that it is needed in.

mod closest;
mod density;
mod nearest;
mod parting;
mod push;
mod registers;
mod scatter;
mod support;
mod viscosity;

pub use closest::{Away, away_from_closest};
pub use density::{DensitySums, density};
pub use nearest::{Near, nearest};
pub use parting::{Apart, Parting, partings};
pub use push::{Bias, Push, Pushes, Weight, push_weight, pushes};
pub use scatter::{Actors, Vector, scatter_gradient};
pub use support::{Search, Solved, largest_support, solve_support_radii, solve_within_reach, support_guess};
pub use viscosity::{CHANNELS as SHEAR_CHANNELS, Shear, shear};
