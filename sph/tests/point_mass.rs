//! Softened point masses: the pull of a point beyond their radius, that of their kernel within.

use sph_core::kernel::{CubicSpline, Kernel, WendlandC2, evaluate};
use sph_core::point_mass::{PointMass, Softening};

const BOTH: [Softening; 2] = [Softening::CubicSpline, Softening::WendlandC2];

/// Both are continuous at H with the point's, and at the spline's inner knot.
#[test]
fn pulls_are_those_of_a_point_from_the_softening_radius_on() {
    for softening in BOTH {
        let point = PointMass { center: [1.0, 0.0, -1.0], mass: 3.0, radius: 0.5, softening };
        for (r, tolerance) in [(0.5 - 1e-9, 1e-7), (0.5, 1e-14), (2.0, 1e-14)] {
            let pull = point.pull(&[1.0, r, -1.0]);
            assert!((pull.acceleration[1] * r * r / -3.0 - 1.0).abs() < tolerance, "{softening:?} {r}: {pull:?}");
            assert!((pull.potential * r / -3.0 - 1.0).abs() < tolerance);
            assert_eq!([pull.acceleration[0], pull.acceleration[2]], [0.0; 2]);
        }
        let at = |u: f64| {
            let x = [1.0, u * point.radius, -1.0];
            (softening.enclosed(u), point.pull(&x).potential)
        };
        let (a, b) = (at(0.5 - 1e-12), at(0.5 + 1e-12));
        assert!((a.0 - b.0).abs() < 1e-10 && (a.1 - b.1).abs() < 1e-10);
        assert_eq!(point.pull(&point.center).acceleration, [0.0; 3]);
    }
}

/// The mass within is the integral of the kernel, and the pull the slope of the potential.
#[test]
fn softened_masses_are_those_of_their_kernels() {
    for softening in BOTH {
        let value = |u: f64| match softening {
            Softening::CubicSpline => CubicSpline::SIGMA[2] * evaluate::<_, 3>(CubicSpline, u).0,
            Softening::WendlandC2 => WendlandC2::SIGMA[2] * evaluate::<_, 3>(WendlandC2, u).0,
        };
        let steps = 4000;
        let mut mass = 0.0;
        for i in 0..steps {
            let u = (f64::from(i) + 0.5) / f64::from(steps);
            mass += 4.0 * std::f64::consts::PI * u * u * value(u) / f64::from(steps);
            let end = f64::from(i + 1) / f64::from(steps);
            assert!((softening.enclosed(end) - mass).abs() < 1e-6, "{softening:?} {end}");
        }
        let point = PointMass::<3> { center: [0.0; 3], mass: 2.0, radius: 1.0, softening };
        for x in [0.1, 0.45, 0.55, 0.9, 1.3] {
            let phi = |x: f64| point.pull(&[x, 0.0, 0.0]).potential;
            let slope = (phi(x + 1e-5) - phi(x - 1e-5)) / 2e-5;
            assert!((slope + point.pull(&[x, 0.0, 0.0]).acceleration[0]).abs() < 1e-8);
        }
    }
}
