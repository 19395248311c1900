//! SPH kernels W(r, H) = sigma_d / H^d K(r/H) with support radius H.
//!
//! Shapes, norms and the ratio H/h (h = twice the kernel's standard deviation) are those of Dehnen & Aly
//! 2012, MNRAS 425, 1068, Table 1.

mod name;
mod neighbors;
mod shape;
mod shapes;

pub use crate::with_kernel;
pub use name::KernelName;
pub use neighbors::{
    default_kernel_neighbors, makes_pairs, most_neighbors_without_pairs, own_count, support_over_smoothing_length,
    support_over_spacing,
};
pub use shape::{Kernel, evaluate};
pub use shapes::{CubicSpline, Quartic, Quintic, Sinc6, WendlandC2, WendlandC4, WendlandC6};
