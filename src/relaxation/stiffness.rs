//! The stiffness of WVT's displacements, which limits the length of a step.
//!
//! A wave of displacements with wave number k in a uniform arrangement is pushed back, in the continuum limit, by
//! mu N_H S(k) of itself in a step dx = mu H sum_j f r^_ij, with
//!
//! S(k) = d kH int_0^1 f(q) s(kH q) q^(d-1) dq (1 + g w(kH)),
//!
//! s being the mean of m sin(x m) over directions m (sin in 1-D, J_1 in 2-D, j_1 in 3-D), w the Fourier transform of
//! the kernel and g the gain of the density's feedback. Twice itself is too much: with Wendland C4 steps that suit 64
//! neighbors tear an arrangement with 128 apart. The largest S over k is what steps are measured by.

use sph::kernel::with_kernel;
use sph::kernel::{Kernel, KernelName, evaluate};

/// Samples of the radius, of directions, and of kH, whose largest value lies beyond the peak of S for every kernel.
const RADII: usize = 128;
const DIRECTIONS: usize = 24;
const WAVES: usize = 40;
const LARGEST_WAVE: f64 = 20.0;

/// N_H times the largest S(k) for f = K with feedback of gain `gain`, in `d` dimensions.
pub(super) fn stiffness(kernel: KernelName, d: usize, kernel_neighbors: f64, gain: f64) -> f64 {
    with_kernel!(kernel, kernel => match d {
        1 => peak::<_, 1>(kernel, gain),
        2 => peak::<_, 2>(kernel, gain),
        _ => peak::<_, 3>(kernel, gain),
    }) * kernel_neighbors
}

fn peak<K: Kernel, const D: usize>(kernel: K, gain: f64) -> f64 {
    let q = |i: usize| (i as f64 + 0.5) / RADII as f64;
    let shells: Vec<f64> = (0..RADII).map(|i| evaluate::<K, D>(kernel, q(i)).0 * q(i).powi(D as i32 - 1)).collect();
    let mass: f64 = shells.iter().sum();
    let at = |wave: f64| {
        let moments = (0..RADII).map(|i| (shells[i], directions::<D>(wave * q(i))));
        let (push, seen) = moments.fold((0.0, 0.0), |sum, (f, (sine, cosine))| (sum.0 + f * sine, sum.1 + f * cosine));
        D as f64 * wave * push / RADII as f64 * (1.0 + gain * seen / mass)
    };
    (1..=WAVES).map(|i| at(LARGEST_WAVE * i as f64 / WAVES as f64)).fold(0.0, f64::max)
}

/// Means of m sin(x m) and cos(x m) over all directions, m being the component along the wave.
fn directions<const D: usize>(x: f64) -> (f64, f64) {
    let sample = |i: usize| {
        let t = (i as f64 + 0.5) / DIRECTIONS as f64;
        match D {
            1 => 1.0,
            2 => (0.5 * std::f64::consts::PI * t).cos(),
            _ => t,
        }
    };
    let sum = (0..DIRECTIONS).map(sample).fold((0.0, 0.0), |sum, m| (sum.0 + m * (x * m).sin(), sum.1 + (x * m).cos()));
    (sum.0 / DIRECTIONS as f64, sum.1 / DIRECTIONS as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_over_directions_are_bessel_functions() {
        for x in [0.1_f64, 1.0, 5.0, 20.0] {
            let j1 = x.sin() / (x * x) - x.cos() / x;
            let (sine, cosine) = directions::<3>(x);
            assert!((sine - j1).abs() < 0.02 && (cosine - x.sin() / x).abs() < 0.02, "{x}: {sine} {cosine}");
        }
        // J_1(1) and J_0(1).
        let (sine, cosine) = directions::<2>(1.0);
        assert!((sine - 0.440_050_6).abs() < 1e-6 && (cosine - 0.765_197_7).abs() < 1e-6, "{sine} {cosine}");
        let (sine, cosine) = directions::<1>(1.5);
        assert!((sine - 1.5_f64.sin()).abs() < 1e-12 && (cosine - 1.5_f64.cos()).abs() < 1e-12, "{sine} {cosine}");
    }

    #[test]
    fn more_neighbors_and_wider_kernels_are_stiffer() {
        let of = |kernel, neighbors| stiffness(kernel, 3, neighbors, 2.0);
        let usual = of(KernelName::WendlandC4, 64.0);
        assert!((of(KernelName::WendlandC4, 128.0) / usual - 2.0).abs() < 1e-12);
        assert!(of(KernelName::WendlandC2, 64.0) > usual && of(KernelName::WendlandC6, 64.0) < usual);
    }
}
