//! Initial positions: exactly N of them, all where the target admits particles. [`METHODS`] lists the methods.

mod beside;
mod bisection;
mod blocks;
mod cumulative;
mod dealt;
mod glass;
mod gravity;
mod integers;
mod kronecker;
mod lattice;
mod low_discrepancy;
mod methods;
mod name;
mod parting;
mod pattern;
mod place;
mod quaquaversal;
mod random;
mod seeded;
mod shells;
mod stretch;
mod sublattice;
mod sublattice_search;
mod symmetry;

pub use blocks::{Block, Blockwise, blocks, seed_block};
pub use methods::{METHODS, Method, Targets};
pub use name::Seeding;
pub use parting::Parting;
pub use place::seed;
pub use seeded::Seeded;
pub use stretch::MassMap;
pub use symmetry::{discontinuity_share, is_radial, is_uniform, shifted_share};
