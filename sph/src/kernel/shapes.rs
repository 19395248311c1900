//! Kernel shapes as polynomials in `(a - q)_+`, valid for scalars and vectors.

use super::shape::Kernel;
use crate::lanes::Real;
use pulp::Simd;

/// `max(a - q, 0)`.
#[inline(always)]
fn ramp<R: Real, S: Simd>(simd: S, a: f64, q: R::Vector<S>) -> R::Vector<S> {
    let zero = R::splat(simd, R::from_f64(0.0));
    R::max(simd, R::sub(simd, R::splat(simd, R::from_f64(a)), q), zero)
}

/// Polynomial in `q` by Horner's rule, highest coefficient first.
#[inline(always)]
fn polynomial<R: Real, S: Simd, const N: usize>(simd: S, q: R::Vector<S>, coefficients: [f64; N]) -> R::Vector<S> {
    let mut sum = R::splat(simd, R::from_f64(coefficients[0]));
    for &c in &coefficients[1..] {
        sum = R::mul_add(simd, sum, q, R::splat(simd, R::from_f64(c)));
    }
    sum
}

/// `x^n` for the powers that the kernels need (1 to 7), without recursion so that it inlines.
#[inline(always)]
fn power<R: Real, S: Simd>(simd: S, x: R::Vector<S>, n: u32) -> R::Vector<S> {
    let square = R::mul(simd, x, x);
    match n {
        1 => x,
        2 => square,
        3 => R::mul(simd, square, x),
        4 => R::mul(simd, square, square),
        5 => R::mul(simd, R::mul(simd, square, square), x),
        6 => R::mul(simd, R::mul(simd, square, square), square),
        7 => R::mul(simd, R::mul(simd, square, square), R::mul(simd, square, x)),
        _ => unreachable!("no kernel has this power"),
    }
}

macro_rules! wendland {
    ($name:ident, $text:literal, $sigma:expr, line: $n1:literal $p1:expr, $g1:expr; space: $n3:literal $p3:expr, $g3:expr) => {
        #[doc = concat!($text, " kernel.")]
        #[derive(Debug, Clone, Copy)]
        pub struct $name;

        impl Kernel for $name {
            const NAME: &'static str = $text;
            const SIGMA: [f64; 3] = $sigma;

            #[inline(always)]
            fn shape<const D: usize, R: Real, S: Simd>(self, simd: S, q: R::Vector<S>) -> (R::Vector<S>, R::Vector<S>) {
                let u = ramp::<R, S>(simd, 1.0, q);
                if D == 1 {
                    let slope = power::<R, S>(simd, u, $n1 - 1);
                    let value = R::mul(simd, slope, u);
                    (
                        R::mul(simd, value, polynomial::<R, S, _>(simd, q, $p1)),
                        R::mul(simd, slope, polynomial::<R, S, _>(simd, q, $g1)),
                    )
                } else {
                    let slope = power::<R, S>(simd, u, $n3 - 1);
                    let value = R::mul(simd, slope, u);
                    (
                        R::mul(simd, value, polynomial::<R, S, _>(simd, q, $p3)),
                        R::mul(simd, slope, polynomial::<R, S, _>(simd, q, $g3)),
                    )
                }
            }
        }
    };
}

use std::f64::consts::PI;

wendland!(WendlandC2, "Wendland C2", [1.25, 7.0 / PI, 21.0 / (2.0 * PI)],
    line: 3 [3.0, 1.0], [12.0];
    space: 4 [4.0, 1.0], [20.0]);
wendland!(WendlandC4, "Wendland C4", [1.5, 9.0 / PI, 495.0 / (32.0 * PI)],
    line: 5 [8.0, 5.0, 1.0], [56.0, 14.0];
    space: 6 [35.0 / 3.0, 6.0, 1.0], [280.0 / 3.0, 56.0 / 3.0]);
wendland!(WendlandC6, "Wendland C6", [55.0 / 32.0, 78.0 / (7.0 * PI), 1365.0 / (64.0 * PI)],
    line: 7 [21.0, 19.0, 7.0, 1.0], [210.0, 108.0, 18.0];
    space: 8 [32.0, 25.0, 8.0, 1.0], [352.0, 154.0, 22.0]);

/// Smallest `q` by which the spline slopes are divided: below it the pair force is zero to rounding.
const TINY: f64 = 1e-5;

macro_rules! spline {
    ($name:ident, $text:literal, $n:literal, $sigma:expr, [$($knot:expr => $weight:expr),+]) => {
        #[doc = concat!($text, " kernel.")]
        #[derive(Debug, Clone, Copy)]
        pub struct $name;

        impl Kernel for $name {
            const NAME: &'static str = $text;
            const SIGMA: [f64; 3] = $sigma;

            #[inline(always)]
            fn shape<const D: usize, R: Real, S: Simd>(self, simd: S, q: R::Vector<S>) -> (R::Vector<S>, R::Vector<S>) {
                let mut value = R::splat(simd, R::from_f64(0.0));
                let mut slope = value;
                $(
                    let u = ramp::<R, S>(simd, $knot, q);
                    let lower = power::<R, S>(simd, u, $n - 1);
                    let weight = R::splat(simd, R::from_f64($weight));
                    slope = R::mul_add(simd, weight, lower, slope);
                    value = R::mul_add(simd, weight, R::mul(simd, lower, u), value);
                )+
                let n = R::splat(simd, R::from_f64($n as f64));
                let safe = R::max(simd, q, R::splat(simd, R::from_f64(TINY)));
                (value, R::div(simd, R::mul(simd, n, slope), safe))
            }
        }
    };
}

spline!(CubicSpline, "cubic spline", 3, [8.0 / 3.0, 80.0 / (7.0 * PI), 16.0 / PI], [1.0 => 1.0, 0.5 => -4.0]);
spline!(Quartic, "quartic spline", 4, [3125.0 / 768.0, 46875.0 / (2398.0 * PI), 15625.0 / (512.0 * PI)],
    [1.0 => 1.0, 0.6 => -5.0, 0.2 => 10.0]);
spline!(Quintic, "quintic spline", 5, [243.0 / 40.0, 15309.0 / (478.0 * PI), 2187.0 / (40.0 * PI)],
    [1.0 => 1.0, 2.0 / 3.0 => -6.0, 1.0 / 3.0 => 15.0]);

/// sinc(pi u)^6 over (1 - u^2)^6, as the sixth root of it in powers of u^2, highest first: the product over k > 1 of 1 - u^2/k^2, right to 3e-17.
const SINC: [f64; 12] = [
    -5.430_959_336_924_064e-14,
    3.293_823_941_674_826e-12,
    -1.683_600_235_565_395e-10,
    7.136_351_798_661_236e-9,
    -2.459_853_886_150_415e-7,
    6.729_888_273_041_339e-6,
    -1.416_989_047_580_296_6e-4,
    2.204_382_130_697_794e-3,
    -2.394_346_568_695_700_6e-2,
    1.668_083_584_351_272e-1,
    -6.449_340_668_482_264e-1,
    1.0,
];

/// Coefficients of the derivative of a polynomial, highest first.
const fn derivative<const N: usize, const M: usize>(of: [f64; N]) -> [f64; M] {
    let mut out = [0.0; M];
    let mut i = 0;
    while i < M {
        out[i] = of[i] * (N - 1 - i) as f64;
        i += 1;
    }
    out
}

/// The kernel sinc(pi q)^6 of SPH-EXA and SPHYNX (Cabezón, García-Senz & Relaño 2008, J. Comput. Phys. 227, 8523).
#[derive(Debug, Clone, Copy)]
pub struct Sinc6;

impl Kernel for Sinc6 {
    const NAME: &'static str = "sinc^6";
    const SIGMA: [f64; 3] = [1.818_409_602_299_74, 3.362_839_966_994_05, 6.323_596_715_458_423];

    #[inline(always)]
    fn shape<const D: usize, R: Real, S: Simd>(self, simd: S, q: R::Vector<S>) -> (R::Vector<S>, R::Vector<S>) {
        const SLOPE: [f64; 11] = derivative(SINC);
        let rest = ramp::<R, S>(simd, 1.0, R::mul(simd, q, q));
        // q^2, and 1 beyond the support, where powers of it could overflow.
        let square = R::sub(simd, R::splat(simd, R::from_f64(1.0)), rest);
        let factor = polynomial::<R, S, _>(simd, square, SINC);
        let root = R::mul(simd, rest, factor);
        let fifth = power::<R, S>(simd, root, 5);
        let change = R::sub(simd, factor, R::mul(simd, rest, polynomial::<R, S, _>(simd, square, SLOPE)));
        let slope = R::mul(simd, R::mul(simd, fifth, change), R::splat(simd, R::from_f64(12.0)));
        (R::mul(simd, fifth, root), slope)
    }
}
