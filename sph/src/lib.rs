//! The core of smoothed particle hydrodynamics (SPH): kernels, domains with their periodic and mirror images, trees, and
//! sums over neighbors in vector registers, in one to three dimensions and with any spread of spacings.
//!
//! Results do not depend on the number of threads: each particle gathers for itself, in an order that the positions alone
//! decide, and totals are summed in fixed chunks.
//!
//! ```
//! use sph_core::domain::{Axis, Domain, Region};
//! use sph_core::kernel::KernelName;
//! use sph_core::neighbors::{Reach, Sources, Tree};
//! use sph_core::sums::{Search, solve_support_radii};
//!
//! // A cubic lattice in a periodic box.
//! let n = 10_usize;
//! let position = |i: usize| (i as f64 + 0.5) / n as f64;
//! let along = |k: u32| (0..n * n * n).map(|i| position(i / n.pow(k) % n)).collect();
//! let positions: [Vec<f64>; 3] = [along(0), along(1), along(2)];
//! let domain = Domain::new([0.0; 3], [1.0; 3], [Axis::Periodic; 3], Region::Box)?;
//!
//! // Support radii with 64 kernel neighbors, and the number density at them, in the order of the tree.
//! let tree = Tree::build(&positions);
//! let guess = vec![0.25; tree.len()];
//! let sources = [Sources::<3, 0>::new(&tree, &guess, [], Reach::Target)];
//! let solved = solve_support_radii::<3, 0, f32>(KernelName::WendlandC4, &domain, &sources, (64.0, Search::EXACT), 1.0);
//! assert!(solved.iter().all(|s| (s.sums.number_density / 1000.0 - 1.0).abs() < 0.02));
//! # Ok::<(), sph_core::domain::DomainError>(())
//! ```

#![forbid(unsafe_code)]

pub mod domain;
pub mod exchange;
pub mod geometry;
pub mod gravity;
pub mod kernel;
pub mod lanes;
pub mod nearest;
pub mod neighbors;
pub(crate) mod pack;
pub mod parallel;
pub mod point_mass;
pub mod random;
pub mod reduce;
pub mod sums;

/// An array of `f(k)`: as `std::array::from_fn`, of which every use is compiled for itself, but a loop that is part of its caller.
#[inline(always)]
pub fn array<T: Copy + Default, const N: usize>(mut f: impl FnMut(usize) -> T) -> [T; N] {
    let mut values = [T::default(); N];
    let mut k = 0;
    while k < N {
        values[k] = f(k);
        k += 1;
    }
    values
}
