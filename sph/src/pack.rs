//! Compacts eight values at a time: the selected ones are moved next to each other.
//!
//! Neighbors are picked out of the leaves of a tree this way. One by one they took longer than all that is summed over them.

use pulp::Simd;
#[cfg(target_arch = "x86_64")]
use pulp::x86::{V3, V4};
#[cfg(target_arch = "x86_64")]
use std::any::Any;
#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::_CMP_LT_OQ;

/// How many values are looked at together.
pub const EIGHT: usize = 8;
/// How many at most.
pub const SIXTEEN: usize = 16;

/// See [`Real::below`].
///
/// [`Real::below`]: crate::lanes::Real::below
#[inline(always)]
pub fn below_f64s<S: Simd>(simd: S, values: [f64; EIGHT], limit: f64) -> u8 {
    #[cfg(target_arch = "x86_64")]
    {
        if let Some(v4) = (&simd as &dyn Any).downcast_ref::<V4>() {
            let limits = v4.avx512f._mm512_set1_pd(limit);
            return v4.avx512f._mm512_cmp_pd_mask::<_CMP_LT_OQ>(pulp::cast(values), limits);
        }
        if let Some(v3) = (&simd as &dyn Any).downcast_ref::<V3>() {
            let limits = v3.avx._mm256_set1_pd(limit);
            let [low, high]: [[f64; EIGHT / 2]; 2] = pulp::cast(values);
            let low = v3.avx._mm256_movemask_pd(v3.avx._mm256_cmp_pd::<_CMP_LT_OQ>(pulp::cast(low), limits));
            let high = v3.avx._mm256_movemask_pd(v3.avx._mm256_cmp_pd::<_CMP_LT_OQ>(pulp::cast(high), limits));
            return (low | high << (EIGHT / 2)) as u8;
        }
    }
    let _ = simd;
    compared(values, limit)
}

/// See [`Real::below`].
///
/// [`Real::below`]: crate::lanes::Real::below
#[inline(always)]
pub fn below_f32s<S: Simd>(simd: S, values: [f32; EIGHT], limit: f32) -> u8 {
    #[cfg(target_arch = "x86_64")]
    {
        if let Some(v4) = (&simd as &dyn Any).downcast_ref::<V4>() {
            let limits = v4.avx._mm256_set1_ps(limit);
            return v4.avx512f._mm256_cmp_ps_mask::<_CMP_LT_OQ>(pulp::cast(values), limits);
        }
        if let Some(v3) = (&simd as &dyn Any).downcast_ref::<V3>() {
            let below = v3.avx._mm256_cmp_ps::<_CMP_LT_OQ>(pulp::cast(values), v3.avx._mm256_set1_ps(limit));
            return v3.avx._mm256_movemask_ps(below) as u8;
        }
    }
    let _ = simd;
    compared(values, limit)
}

#[inline(always)]
fn compared<T: PartialOrd + Copy>(values: [T; EIGHT], limit: T) -> u8 {
    let mut bits = 0;
    for j in 0..EIGHT {
        bits |= u8::from(values[j] < limit) << j;
    }
    bits
}

/// See [`Real::packed`].
///
/// [`Real::packed`]: crate::lanes::Real::packed
#[inline(always)]
pub fn packed_f32s<S: Simd>(simd: S, values: [f32; EIGHT], bits: u8) -> [f32; EIGHT] {
    #[cfg(target_arch = "x86_64")]
    {
        if let Some(v4) = (&simd as &dyn Any).downcast_ref::<V4>() {
            return pulp::cast(v4.avx512f._mm256_maskz_compress_ps(bits, pulp::cast(values)));
        }
        if let Some(v3) = (&simd as &dyn Any).downcast_ref::<V3>() {
            let places = pulp::cast(PLACES[usize::from(bits)]);
            return pulp::cast(v3.avx2._mm256_permutevar8x32_ps(pulp::cast(values), places));
        }
    }
    packed_one_by_one(simd, values, bits)
}

/// [`packed_f32s`], of anything and without vector instructions.
#[inline(always)]
pub fn packed_one_by_one<S: Simd, T: Copy>(_: S, mut values: [T; EIGHT], bits: u8) -> [T; EIGHT] {
    let mut used = 0;
    for j in 0..EIGHT {
        // Never behind the place that is read.
        values[used] = values[j];
        used += usize::from(bits >> j & 1);
    }
    values
}

/// [`below_f32s`] of twice as many.
#[inline(always)]
pub fn below_sixteen_f32s<S: Simd>(simd: S, values: &[f32; SIXTEEN], limit: f32) -> u16 {
    #[cfg(target_arch = "x86_64")]
    if let Some(v4) = (&simd as &dyn Any).downcast_ref::<V4>() {
        return v4.avx512f._mm512_cmp_ps_mask::<_CMP_LT_OQ>(pulp::cast(*values), v4.avx512f._mm512_set1_ps(limit));
    }
    let [low, high]: [[f32; EIGHT]; 2] = pulp::cast(*values);
    u16::from(below_f32s(simd, low, limit)) | u16::from(below_f32s(simd, high, limit)) << EIGHT
}

/// [`packed_f32s`] of twice as many, into the first of `out`.
#[inline(always)]
pub fn pack_sixteen_f32s<S: Simd>(simd: S, values: &[f32; SIXTEEN], bits: u16, out: &mut [f32]) {
    #[cfg(target_arch = "x86_64")]
    if let Some(v4) = (&simd as &dyn Any).downcast_ref::<V4>() {
        let packed: [f32; SIXTEEN] = pulp::cast(v4.avx512f._mm512_maskz_compress_ps(bits, pulp::cast(*values)));
        out[..SIXTEEN].copy_from_slice(&packed);
        return;
    }
    let ([first, second], low): ([[f32; EIGHT]; 2], _) = (pulp::cast(*values), bits as u8);
    let used = low.count_ones() as usize;
    out[..EIGHT].copy_from_slice(&packed_f32s(simd, first, low));
    out[used..used + EIGHT].copy_from_slice(&packed_f32s(simd, second, (bits >> EIGHT) as u8));
}

/// [`below_f64s`] of twice as many.
#[inline(always)]
pub fn below_sixteen_f64s<S: Simd>(simd: S, values: &[f64; SIXTEEN], limit: f64) -> u16 {
    let [low, high]: [[f64; EIGHT]; 2] = pulp::cast(*values);
    u16::from(below_f64s(simd, low, limit)) | u16::from(below_f64s(simd, high, limit)) << EIGHT
}

/// [`packed_one_by_one`] of twice as many, into the first of `out`.
#[inline(always)]
pub fn pack_sixteen_f64s<S: Simd>(_: S, values: &[f64; SIXTEEN], bits: u16, out: &mut [f64]) {
    let mut used = 0;
    for (j, value) in values.iter().enumerate() {
        out[used] = *value;
        used += usize::from(bits >> j & 1);
    }
}

/// Where the values come from whose bits are set.
#[cfg(target_arch = "x86_64")]
const PLACES: [[u32; EIGHT]; 256] = {
    let mut places = [[0; EIGHT]; 256];
    let mut bits = 0;
    while bits < 256 {
        let (mut used, mut j) = (0, 0);
        while j < EIGHT {
            if bits >> j & 1 == 1 {
                places[bits][used] = j as u32;
                used += 1;
            }
            j += 1;
        }
        bits += 1;
    }
    places
};
