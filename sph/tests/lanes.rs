//! Packing gives the same with every set of vector instructions.

use pulp::{Simd, WithSimd};
use sph_core::lanes::Real;

struct Packs;

impl WithSimd for Packs {
    type Output = Vec<(u8, Vec<f32>, Vec<f64>)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        (0..=u8::MAX)
            .map(|bits| {
                let below = std::array::from_fn(|j| if bits >> j & 1 == 1 { -1.0 - j as f32 } else { 3.0 });
                let found = f32::below(simd, below, 3.0);
                assert_eq!(found, f64::below(simd, below.map(f64::from), 3.0));
                let many = found.count_ones() as usize;
                let singles = f32::packed(simd, below, found)[..many].to_vec();
                (found, singles, f64::packed(simd, below.map(f64::from), found)[..many].to_vec())
            })
            .collect()
    }
}

#[test]
fn what_is_wanted_is_moved_to_the_front_in_its_order() {
    let plain = Packs.with_simd(pulp::Scalar::new());
    for (bits, (found, singles, doubles)) in plain.iter().enumerate() {
        let wanted: Vec<f32> = (0..8).filter(|j| bits >> j & 1 == 1).map(|j| -1.0 - j as f32).collect();
        assert_eq!((*found as usize, singles), (bits, &wanted));
        assert_eq!(*doubles, wanted.iter().map(|&x| f64::from(x)).collect::<Vec<_>>());
    }
    #[cfg(target_arch = "x86_64")]
    {
        if let Some(v3) = pulp::x86::V3::try_new() {
            assert!(Simd::vectorize(v3, Packs) == plain);
        }
        if let Some(v4) = pulp::x86::V4::try_new() {
            assert!(Simd::vectorize(v4, Packs) == plain);
        }
    }
    assert!(pulp::Arch::new().dispatch(Packs) == plain);
}

#[test]
fn nothing_is_below_that_is_no_number() {
    assert_eq!(f32::below(pulp::Scalar::new(), [f32::NAN; 8], 1.0), 0);
    assert_eq!(pulp::Arch::new().dispatch(Nans), 0);
}

struct Nans;

impl WithSimd for Nans {
    type Output = u8;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> u8 {
        f32::below(simd, [f32::NAN; 8], 1.0) | f64::below(simd, [f64::NAN; 8], 1.0)
    }
}
