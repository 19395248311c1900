//! SPH kernels W(r, H) = sigma_d / H^d K(r/H) with support radius H.
//!
//! Shapes, norms and the ratio H/h (h = twice the kernel's standard deviation) are those of Dehnen & Aly
//! 2012, MNRAS 425, 1068, Table 1.

mod shapes;

pub use shapes::{CubicSpline, Quartic, Quintic, WendlandC2, WendlandC4, WendlandC6};

use crate::neighbors::lanes::Real;
use crate::with_kernel;
use pulp::Simd;
use serde::{Deserialize, Serialize};

/// Volume of the unit ball: 2, pi, 4 pi/3.
pub fn unit_ball_volume(d: usize) -> f64 {
    match d {
        1 => 2.0,
        2 => std::f64::consts::PI,
        _ => 4.0 * std::f64::consts::PI / 3.0,
    }
}

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

/// The kernels by name, for scenes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum KernelName {
    CubicSpline,
    Quartic,
    Quintic,
    WendlandC2,
    #[default]
    WendlandC4,
    WendlandC6,
}

impl KernelName {
    /// The kernel's name in prose.
    pub fn title(self) -> &'static str {
        fn title<K: Kernel>(_: K) -> &'static str {
            K::NAME
        }
        with_kernel!(self, kernel => title(kernel))
    }

    /// Norm in `d` dimensions at unit support.
    pub fn sigma(self, d: usize) -> f64 {
        fn sigma<K: Kernel>(_: K, d: usize) -> f64 {
            K::SIGMA[d - 1]
        }
        with_kernel!(self, kernel => sigma(kernel, d))
    }
}

/// The most neighbors with which particles that come to rest in a constant pressure stay apart; `None` where any number
/// does. B-splines make pairs where their knots are farther apart than the particles by more than a measured ratio (with
/// 4000 particles and 240 evaluations: the cubic one from 55 neighbors in 3-D on, the quartic from 100, the quintic from 180).
/// Their Fourier transform is negative there, which that of Wendland's kernels never is (Dehnen & Aly 2012, sec. 2.4).
pub fn most_neighbors_without_pairs(kernel: KernelName, d: usize) -> Option<f64> {
    const WIDEST_KNOTS: f64 = 1.15;
    let knots = match kernel {
        KernelName::CubicSpline => 2.0,
        KernelName::Quartic => 2.5,
        KernelName::Quintic => 3.0,
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

/// Calls `$body` with `$k` bound to the kernel that `$name` names: the one place where the run-time choice
/// becomes a type.
#[macro_export]
macro_rules! with_kernel {
    ($name:expr, $k:ident => $body:expr) => {
        match $name {
            $crate::kernel::KernelName::CubicSpline => {
                let $k = $crate::kernel::CubicSpline;
                $body
            }
            $crate::kernel::KernelName::Quartic => {
                let $k = $crate::kernel::Quartic;
                $body
            }
            $crate::kernel::KernelName::Quintic => {
                let $k = $crate::kernel::Quintic;
                $body
            }
            $crate::kernel::KernelName::WendlandC2 => {
                let $k = $crate::kernel::WendlandC2;
                $body
            }
            $crate::kernel::KernelName::WendlandC4 => {
                let $k = $crate::kernel::WendlandC4;
                $body
            }
            $crate::kernel::KernelName::WendlandC6 => {
                let $k = $crate::kernel::WendlandC6;
                $body
            }
        }
    };
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Surface of the unit sphere: 2, 2 pi, 4 pi.
    fn unit_sphere_area(d: usize) -> f64 {
        d as f64 * unit_ball_volume(d)
    }

    fn integrate(f: impl Fn(f64) -> f64) -> f64 {
        let n = 20_000;
        let h = 1.0 / n as f64;
        (0..n).map(|i| f((i as f64 + 0.5) * h) * h).sum()
    }

    fn check<K: Kernel, const D: usize>(kernel: K, support_over_h: [f64; 3]) {
        let sigma = K::SIGMA[D - 1];
        let area = unit_sphere_area(D);
        let weight = |q: f64| area * q.powi(D as i32 - 1) * sigma * evaluate::<K, D>(kernel, q).0;
        let norm = integrate(weight);
        assert!((norm - 1.0).abs() < 1e-7, "{} in {D}-D integrates to {norm}", K::NAME);
        let variance = integrate(|q| weight(q) * q * q) / D as f64;
        let ratio = 1.0 / (2.0 * variance.sqrt());
        assert!((ratio / support_over_h[D - 1] - 1.0).abs() < 1e-5, "{} in {D}-D: H/h = {ratio}", K::NAME);
        for i in 1..200 {
            let q = i as f64 / 200.0;
            let e = 1e-6;
            let slope = (evaluate::<K, D>(kernel, q + e).0 - evaluate::<K, D>(kernel, q - e).0) / (2.0 * e);
            let given = -q * evaluate::<K, D>(kernel, q).1;
            assert!((slope - given).abs() < 1e-6, "{} in {D}-D at {q}: {slope} against {given}", K::NAME);
        }
        for q in [1.0, 1.0 + 1e-12, 2.0, 1e6] {
            assert_eq!(evaluate::<K, D>(kernel, q), (0.0, 0.0), "{} beyond its support", K::NAME);
        }
        assert!(evaluate::<K, D>(kernel, 0.0).1.is_finite());
    }

    fn check_all<K: Kernel>(kernel: K, support_over_h: [f64; 3]) {
        check::<K, 1>(kernel, support_over_h);
        check::<K, 2>(kernel, support_over_h);
        check::<K, 3>(kernel, support_over_h);
    }

    #[test]
    fn kernels_have_unit_integral_the_published_width_and_the_right_slope() {
        check_all(CubicSpline, [1.732051, 1.778002, 1.825742]);
        check_all(Quartic, [1.936492, 1.977173, 2.018932]);
        check_all(Quintic, [2.121321, 2.158131, 2.195775]);
        check_all(WendlandC2, [1.620185, 1.897367, 1.936492]);
        check_all(WendlandC4, [1.936492, 2.171239, 2.207940]);
        check_all(WendlandC6, [2.207940, 2.415230, 2.449490]);
    }

    #[test]
    fn single_precision_lanes_agree_with_double_scalars() {
        fn compare<K: Kernel, const D: usize>(kernel: K) {
            for i in 0..=120 {
                let q = i as f64 / 100.0;
                let wide = evaluate::<K, D>(kernel, q);
                let narrow = kernel.shape::<D, f32, pulp::Scalar>(pulp::Scalar::new(), q as f32);
                assert!((wide.0 - f64::from(narrow.0)).abs() < 2e-6, "{} at {q}", K::NAME);
                assert!((wide.1 - f64::from(narrow.1)).abs() * q < 2e-5, "{} at {q}", K::NAME);
            }
        }
        compare::<_, 1>(WendlandC4);
        compare::<_, 3>(WendlandC4);
        compare::<_, 2>(CubicSpline);
        compare::<_, 3>(Quintic);
    }

    #[test]
    fn splines_make_pairs_past_a_number_of_neighbors() {
        for (kernel, d, fewer, more) in [
            (KernelName::CubicSpline, 3, 48.0, 64.0),
            (KernelName::CubicSpline, 2, 15.0, 19.6),
            (KernelName::Quartic, 3, 96.0, 128.0),
            (KernelName::Quintic, 3, 170.0, 190.0),
        ] {
            assert!(!makes_pairs(kernel, d, fewer) && makes_pairs(kernel, d, more), "{kernel:?}");
        }
        assert!(!makes_pairs(KernelName::WendlandC2, 3, 1e4));
    }
}
