//! Neighbor passes: sums over all particles within a support radius, the heart of every stage.
//!
//! Particles are kept in leaves of a k-d tree of nearly equal size. A few leaves of one subtree look together for the
//! leaves near them. A pass takes one leaf at a time, gathers every particle (and image) that any target of the leaf can see
//! into structure-of-arrays buffers relative to the leaf's center, picks out of these what eight targets close together can
//! see, and lets each target run over that with vector instructions chosen at run time.
//! The tree adapts to any spacing ratio; a pass costs O(N). Buffers in single precision resolve about 1e-7 of a support radius.
//!
//! Targets only gather: each writes to itself alone, and sources are visited in tree order, so results do not
//! depend on the number of threads.

mod batch;
pub mod brute_force;
mod buffers;
mod compiled;
mod ghost_tree;
mod groups;
mod halo;
mod near;
mod reached;
mod sources;
mod tree;

pub use batch::{Batch, BatchUnit, LeafPass, for_each_in_chosen_leaves, for_each_target};
pub(crate) use compiled::{Compiled, Shape, compiled, in_shape};
pub use ghost_tree::GhostTree;
pub use groups::Groups;
pub use halo::{Halo, Sees, Sights};
pub use reached::Seeing;
pub use sources::{Reach, Sources};
pub use tree::{LEAF_SIZE, Tree};
