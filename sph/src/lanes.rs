//! Vector arithmetic over [`pulp`], for f32 and f64 alike, so that one source serves both precisions.

use crate::pack::{self, EIGHT, SIXTEEN};
use pulp::Simd;

/// A float type that neighbor buffers may hold.
pub trait Real: Copy + Send + Sync + Default + 'static {
    /// Vector register of this type.
    type Vector<S: Simd>: Copy;

    /// Whether it is f64.
    const DOUBLE: bool;

    fn from_f64(x: f64) -> Self;
    fn to_f64(self) -> f64;
    /// Square of the distance from the interval of `half` on both sides of `center`, added to `sum`.
    fn add_gap2(self, center: Self, half: Self, sum: Self) -> Self;
    fn splat<S: Simd>(simd: S, x: Self) -> Self::Vector<S>;
    /// Whole registers of `slice`; what is left over is not included.
    fn vectors<S: Simd>(slice: &[Self]) -> &[Self::Vector<S>];
    fn add<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    fn sub<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    fn mul<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    fn div<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    /// `a * b + c`, fused where that is fast.
    fn mul_add<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>, c: Self::Vector<S>) -> Self::Vector<S>;
    fn max<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    fn sqrt<S: Simd>(simd: S, a: Self::Vector<S>) -> Self::Vector<S>;
    fn sum<S: Simd>(simd: S, a: Self::Vector<S>) -> f64;
    /// Bit j is set where `values[j]` is below `limit`.
    fn below<S: Simd>(simd: S, values: [Self; EIGHT], limit: Self) -> u8;
    /// Those of `values` whose bits are set, in their order; what comes after them is anything.
    fn packed<S: Simd>(simd: S, values: [Self; EIGHT], bits: u8) -> [Self; EIGHT];
    /// [`Self::below`] of twice as many.
    fn below_sixteen<S: Simd>(simd: S, values: &[Self; SIXTEEN], limit: Self) -> u16;
    /// [`Self::packed`] of twice as many, into the first of `out`, which has room for all.
    fn pack_sixteen<S: Simd>(simd: S, values: &[Self; SIXTEEN], bits: u16, out: &mut [Self]);
}

/// Registers hold at most this many f32, so buffers are padded to a multiple of it.
pub const MAX_LANES: usize = 16;

macro_rules! real {
    ($t:ty, $v:ident, $splat:ident, $as:ident, $add:ident, $sub:ident, $mul:ident, $div:ident, $fma:ident, $max:ident, $sqrt:ident, $sum:ident, $below:ident, $packed:ident, $below_sixteen:ident, $pack_sixteen:ident) => {
        impl Real for $t {
            type Vector<S: Simd> = S::$v;

            const DOUBLE: bool = size_of::<$t>() == 8;

            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn add_gap2(self, center: Self, half: Self, sum: Self) -> Self {
                let gap = ((self - center).abs() - half).max(0.0);
                sum + gap * gap
            }
            #[inline(always)]
            fn splat<S: Simd>(simd: S, x: Self) -> S::$v {
                simd.$splat(x)
            }
            #[inline(always)]
            fn vectors<S: Simd>(slice: &[Self]) -> &[S::$v] {
                S::$as(slice).0
            }
            #[inline(always)]
            fn add<S: Simd>(simd: S, a: S::$v, b: S::$v) -> S::$v {
                simd.$add(a, b)
            }
            #[inline(always)]
            fn sub<S: Simd>(simd: S, a: S::$v, b: S::$v) -> S::$v {
                simd.$sub(a, b)
            }
            #[inline(always)]
            fn mul<S: Simd>(simd: S, a: S::$v, b: S::$v) -> S::$v {
                simd.$mul(a, b)
            }
            #[inline(always)]
            fn div<S: Simd>(simd: S, a: S::$v, b: S::$v) -> S::$v {
                simd.$div(a, b)
            }
            #[inline(always)]
            fn mul_add<S: Simd>(simd: S, a: S::$v, b: S::$v, c: S::$v) -> S::$v {
                simd.$fma(a, b, c)
            }
            #[inline(always)]
            fn max<S: Simd>(simd: S, a: S::$v, b: S::$v) -> S::$v {
                simd.$max(a, b)
            }
            #[inline(always)]
            fn sqrt<S: Simd>(simd: S, a: S::$v) -> S::$v {
                simd.$sqrt(a)
            }
            #[inline(always)]
            fn sum<S: Simd>(simd: S, a: S::$v) -> f64 {
                f64::from(simd.$sum(a))
            }
            #[inline(always)]
            fn below<S: Simd>(simd: S, values: [Self; EIGHT], limit: Self) -> u8 {
                pack::$below(simd, values, limit)
            }
            #[inline(always)]
            fn packed<S: Simd>(simd: S, values: [Self; EIGHT], bits: u8) -> [Self; EIGHT] {
                pack::$packed(simd, values, bits)
            }
            #[inline(always)]
            fn below_sixteen<S: Simd>(simd: S, values: &[Self; SIXTEEN], limit: Self) -> u16 {
                pack::$below_sixteen(simd, values, limit)
            }
            #[inline(always)]
            fn pack_sixteen<S: Simd>(simd: S, values: &[Self; SIXTEEN], bits: u16, out: &mut [Self]) {
                pack::$pack_sixteen(simd, values, bits, out)
            }
        }
    };
}

real!(
    f32,
    f32s,
    splat_f32s,
    as_simd_f32s,
    add_f32s,
    sub_f32s,
    mul_f32s,
    div_f32s,
    mul_add_e_f32s,
    max_f32s,
    sqrt_f32s,
    reduce_sum_f32s,
    below_f32s,
    packed_f32s,
    below_sixteen_f32s,
    pack_sixteen_f32s
);
real!(
    f64,
    f64s,
    splat_f64s,
    as_simd_f64s,
    add_f64s,
    sub_f64s,
    mul_f64s,
    div_f64s,
    mul_add_e_f64s,
    max_f64s,
    sqrt_f64s,
    reduce_sum_f64s,
    below_f64s,
    packed_one_by_one,
    below_sixteen_f64s,
    pack_sixteen_f64s
);
