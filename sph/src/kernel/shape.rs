//! The definition of a kernel.

use crate::lanes::Real;
use pulp::Simd;

/// Shape of a kernel, chosen at compile time inside the loops.
pub trait Kernel: Copy + Send + Sync + 'static {
    const NAME: &'static str;
    /// Norms sigma for d = 1, 2, 3 at unit support.
    const SIGMA: [f64; 3];
    /// `K(q)` and `-K'(q)/q` for `q >= 0` in `D` dimensions; both exactly 0 for `q >= 1`.
    fn shape<const D: usize, R: Real, S: Simd>(self, simd: S, q: R::Vector<S>) -> (R::Vector<S>, R::Vector<S>);
}

/// Value `K(q)` and `-K'(q)/q` of a kernel as plain numbers.
pub fn evaluate<K: Kernel, const D: usize>(kernel: K, q: f64) -> (f64, f64) {
    kernel.shape::<D, f64, pulp::Scalar>(pulp::Scalar::new(), q)
}
