//! The angular velocity of bodies that orbit each other under their mutual gravity alone.

use nalgebra::Vector3;

/// Share of the moment of inertia that is the bodies' on their way, from which on they go round each other, and do not turn as one.
const APART: f64 = 0.5;

/// A body as a whole, about the center of mass of all.
#[derive(Debug, Clone, Copy, Default)]
struct Whole {
    mass: f64,
    /// Sums of m x and m a.
    moment: Vector3<f64>,
    force: Vector3<f64>,
}

/// Mass, place about the center of mass of all, and acceleration.
pub(super) type Part = (f64, [f64; 3], [f64; 3]);

/// The angular velocity about `axis`, a unit vector, of a rigid rotation in which the bodies as wholes keep their distances:
/// omega^2 = -sum F . R / sum M R^2, with R across the axis. Each part comes with the number of its body, from 0 on. `None` where
/// there is one body, where they are not apart, and where they push each other away.
pub(super) fn balanced(axis: &[f64; 3], parts: impl Iterator<Item = (usize, Part)>) -> Option<f64> {
    let axis = Vector3::from(*axis);
    let across = |x: Vector3<f64>| x - axis * axis.dot(&x);
    let (mut bodies, mut inertia): (Vec<Whole>, f64) = (Vec::new(), 0.0);
    for (body, (mass, x, a)) in parts {
        if bodies.len() <= body {
            bodies.resize(body + 1, Whole::default());
        }
        let whole = &mut bodies[body];
        whole.mass += mass;
        whole.moment += mass * Vector3::from(x);
        whole.force += mass * Vector3::from(a);
        inertia += mass * across(Vector3::from(x)).norm_squared();
    }
    let present = bodies.iter().filter(|b| b.mass > 0.0);
    let (mut own, mut pull) = (0.0, 0.0);
    for whole in present.clone() {
        let place = across(whole.moment / whole.mass);
        own += whole.mass * place.norm_squared();
        pull -= whole.force.dot(&place);
    }
    (present.count() > 1 && own > APART * inertia && pull > 0.0).then(|| (pull / own).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two points in each other's pull, and one part of the heavier beside it.
    fn parts(apart: f64) -> Vec<(usize, Part)> {
        let (m, n) = (3.0, 1.0);
        let pull = 1.0 / (apart * apart);
        let of = |x: f64, a: f64| ([x, 0.0, 0.0], [a, 0.0, 0.0]);
        let (x, a) = of(apart * n / (m + n), -n * pull);
        let (y, b) = of(-apart * m / (m + n), m * pull);
        // Halves of the heavier pull on each other, which cancels.
        let half = |z: f64| (0, (0.5 * m, [x[0], 0.0, z], [a[0], 0.0, -50.0 * z]));
        vec![half(0.1), half(-0.1), (1, (n, y, b))]
    }

    #[test]
    fn two_points_keep_keplers_law() {
        let spin = balanced(&[0.0, 0.0, 1.0], parts(2.0).into_iter()).unwrap();
        assert!((spin * spin - 4.0 / 8.0).abs() < 1e-14, "{spin}");
    }

    #[test]
    fn bodies_that_are_not_apart_turn_as_one() {
        let alone = parts(2.0).into_iter().map(|(_, part)| (0, part));
        assert_eq!(balanced(&[0.0, 0.0, 1.0], alone), None);
        // About an axis along which they lie.
        assert_eq!(balanced(&[1.0, 0.0, 0.0], parts(2.0).into_iter()), None);
        let away = parts(2.0).into_iter().map(|(body, (m, x, a))| (body, (m, x, a.map(|a| -a))));
        assert_eq!(balanced(&[0.0, 0.0, 1.0], away), None);
    }
}
