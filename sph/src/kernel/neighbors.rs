//! Neighbor numbers of kernels: customary numbers, the self-contribution of a particle, and the largest number without pairing.

use super::name::KernelName;
use super::shape::{Kernel, evaluate};
use crate::geometry::unit_ball_volume;
use crate::with_kernel;

/// The most neighbors with which particles that come to rest in a constant pressure stay apart; `None` where any number
/// does. B-splines make pairs where their knots are farther apart than the particles by more than a measured ratio (with
/// 4000 particles and 240 evaluations: the cubic one from 55 neighbors in 3-D on, the quartic from 100, the quintic from 180).
/// Their Fourier transform is negative there, which that of Wendland's kernels never is (Dehnen & Aly 2012, sec. 2.4). The sinc
/// kernel, which has no knots, pairs as a spline would whose knots are this far apart: from 130 on.
pub fn most_neighbors_without_pairs(kernel: KernelName, d: usize) -> Option<f64> {
    const WIDEST_KNOTS: f64 = 1.15;
    let knots = match kernel {
        KernelName::CubicSpline => 2.0,
        KernelName::Quartic => 2.5,
        KernelName::Quintic => 3.0,
        KernelName::Sinc6 => 2.75,
        KernelName::WendlandC2 | KernelName::WendlandC4 | KernelName::WendlandC6 => return None,
    };
    Some(unit_ball_volume(d) * f64::powi(WIDEST_KNOTS * knots, d as i32))
}

/// Whether particles at rest form pairs with so many neighbors, see [`most_neighbors_without_pairs`].
pub fn makes_pairs(kernel: KernelName, d: usize, kernel_neighbors: f64) -> bool {
    most_neighbors_without_pairs(kernel, d).is_some_and(|most| kernel_neighbors > most)
}

/// What a particle counts of its own N_H neighbors: V_d W(0) at unit support.
pub fn own_count(kernel: KernelName, d: usize) -> f64 {
    fn peak<K: Kernel>(kernel: K, d: usize) -> f64 {
        let (value, _) = match d {
            1 => evaluate::<K, 1>(kernel, 0.0),
            2 => evaluate::<K, 2>(kernel, 0.0),
            _ => evaluate::<K, 3>(kernel, 0.0),
        };
        K::SIGMA[d - 1] * value
    }
    with_kernel!(kernel, kernel => peak(kernel, d)) * unit_ball_volume(d)
}

/// Support radius over smoothing length h, which is twice the kernel's standard deviation (Dehnen & Aly 2012, eq. 8 and table
/// 1), in `d` dimensions.
pub fn support_over_smoothing_length(kernel: KernelName, d: usize) -> f64 {
    fn moments<K: Kernel, const D: usize>(kernel: K) -> f64 {
        // Simpson's rule; its error of 1e-12 comes from the knots, which lie at its nodes.
        const INTERVALS: u32 = 3000;
        let term = |i: u32| {
            let q = f64::from(i) / f64::from(INTERVALS);
            let weight = if i == 0 || i == INTERVALS { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
            let mass = weight * evaluate::<K, D>(kernel, q).0 * q.powi(D as i32 - 1);
            [mass, mass * q * q]
        };
        let [mass, second] = (0..=INTERVALS).map(term).fold([0.0; 2], |[a, b], [x, y]| [a + x, b + y]);
        0.5 * (D as f64 * mass / second).sqrt()
    }
    with_kernel!(kernel, kernel => match d {
        1 => moments::<_, 1>(kernel),
        2 => moments::<_, 2>(kernel),
        _ => moments::<_, 3>(kernel),
    })
}

/// Kernel neighbors V_d n H^d that are customary with 64 in 3-D: the same ratio of support to spacing in
/// fewer dimensions (4.96, 19.3, 64).
pub fn default_kernel_neighbors(d: usize) -> f64 {
    unit_ball_volume(d) * (64.0 / unit_ball_volume(3)).powf(d as f64 / 3.0)
}

/// Support radius over spacing n^(-1/d) for a neighbor number N_H = V_d n H^d.
pub fn support_over_spacing(d: usize, kernel_neighbors: f64) -> f64 {
    (kernel_neighbors / unit_ball_volume(d)).powf(1.0 / d as f64)
}
