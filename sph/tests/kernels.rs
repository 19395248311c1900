//! Kernels against their published norms, widths and slopes, and how many neighbors they bear.

use sph_core::geometry::unit_sphere_area;
use sph_core::kernel::{
    CubicSpline, Kernel, KernelName, Quartic, Quintic, Sinc6, WendlandC2, WendlandC4, WendlandC6, evaluate,
    makes_pairs, support_over_smoothing_length,
};

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
    check_all(Sinc6, [2.337202, 2.376269, 2.415481]);
}

#[test]
fn names_have_the_published_widths_too() {
    for (name, d, expected) in [
        (KernelName::CubicSpline, 3, 1.825742),
        (KernelName::CubicSpline, 1, 1.732051),
        (KernelName::Quintic, 2, 2.158131),
        (KernelName::WendlandC4, 3, 2.207940),
    ] {
        let found = support_over_smoothing_length(name, d);
        assert!((found / expected - 1.0).abs() < 1e-5, "{name:?} in {d}-D: {found}");
    }
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
    compare::<_, 3>(Sinc6);
}

#[test]
fn the_sinc_kernel_is_its_formula() {
    for i in 1..1000 {
        let q = f64::from(i) / 1000.0;
        let angle = std::f64::consts::PI * q;
        let error = evaluate::<_, 3>(Sinc6, q).0 - (angle.sin() / angle).powi(6);
        assert!(error.abs() < 1e-14, "at {q}: {error:e}");
    }
}

#[test]
fn splines_make_pairs_past_a_number_of_neighbors() {
    for (kernel, d, fewer, more) in [
        (KernelName::CubicSpline, 3, 48.0, 64.0),
        (KernelName::CubicSpline, 2, 15.0, 19.6),
        (KernelName::Quartic, 3, 96.0, 128.0),
        (KernelName::Quintic, 3, 170.0, 190.0),
        (KernelName::Sinc6, 3, 110.0, 150.0),
    ] {
        assert!(!makes_pairs(kernel, d, fewer) && makes_pairs(kernel, d, more), "{kernel:?}");
    }
    assert!(!makes_pairs(KernelName::WendlandC2, 3, 1e4));
}
