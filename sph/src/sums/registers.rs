//! Positions and displacements in vector registers, shared by the passes.

use crate::lanes::Real;
use pulp::Simd;

/// A position in every lane. A loop, since a closure would be compiled without the vector instructions.
#[inline(always)]
pub fn splat<const D: usize, R: Real, S: Simd>(simd: S, x: &[R; D]) -> [R::Vector<S>; D] {
    let mut out = [R::splat(simd, x[0]); D];
    for k in 1..D {
        out[k] = R::splat(simd, x[k]);
    }
    out
}

/// Displacement from the target and q = r / H of register `j`.
#[inline(always)]
pub fn separation<const D: usize, R: Real, S: Simd>(
    simd: S,
    xs: &[&[R::Vector<S>]; D],
    target: &[R::Vector<S>; D],
    inverse_support: R::Vector<S>,
    j: usize,
) -> ([R::Vector<S>; D], R::Vector<S>) {
    let (d, r2) = displacement::<D, R, S>(simd, xs, target, j);
    (d, R::mul(simd, R::sqrt(simd, r2), inverse_support))
}

/// Squared distance of register `j` from the target.
#[inline(always)]
pub fn squared_distance<const D: usize, R: Real, S: Simd>(
    simd: S,
    xs: &[&[R::Vector<S>]; D],
    target: &[R::Vector<S>; D],
    j: usize,
) -> R::Vector<S> {
    displacement::<D, R, S>(simd, xs, target, j).1
}

#[inline(always)]
fn displacement<const D: usize, R: Real, S: Simd>(
    simd: S,
    xs: &[&[R::Vector<S>]; D],
    target: &[R::Vector<S>; D],
    j: usize,
) -> ([R::Vector<S>; D], R::Vector<S>) {
    let mut d = *target;
    for k in 0..D {
        d[k] = R::sub(simd, xs[k][j], target[k]);
    }
    let mut r2 = R::mul(simd, d[0], d[0]);
    for &dk in &d[1..] {
        r2 = R::mul_add(simd, dk, dk, r2);
    }
    (d, r2)
}
