//! Positions and velocities of two bodies on their orbit around each other.

use crate::error::{Error, Result};

/// The second body as the first sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relative {
    pub position: [f64; 2],
    pub velocity: [f64; 2],
    /// 2 pi over the period; 0 where there is none.
    pub mean_motion: f64,
    /// Least distance of the centers on the way.
    pub pericenter: f64,
}

/// Newton's iterations for Kepler's equation, at most; it takes a handful.
const ITERATIONS: usize = 60;

/// On an ellipse, `phase` periods after the pericenter, which lies on the side of positive x. `strength` is G (m1 + m2).
pub fn ellipse(strength: f64, semi_major_axis: f64, eccentricity: f64, phase: f64) -> Relative {
    let (a, e) = (semi_major_axis, eccentricity);
    let mean_motion = (strength / a.powi(3)).sqrt();
    let mean = std::f64::consts::TAU * (phase - phase.round());
    let anomaly = eccentric_anomaly(mean, e);
    let (sin, cos) = anomaly.sin_cos();
    let (minor, rate) = ((1.0 - e * e).sqrt(), mean_motion / (1.0 - e * cos));
    Relative {
        position: [a * (cos - e), a * minor * sin],
        velocity: [-a * sin * rate, a * minor * cos * rate],
        mean_motion,
        pericenter: a * (1.0 - e),
    }
}

/// E of E - e sin E = M, for M from -pi to pi.
fn eccentric_anomaly(mean: f64, e: f64) -> f64 {
    // From pi, or from M for small e, Newton's method converges from one side.
    let mut anomaly = if e > 0.8 { std::f64::consts::PI.copysign(mean) } else { mean };
    for _ in 0..ITERATIONS {
        let step = (anomaly - e * anomaly.sin() - mean) / (1.0 - e * anomaly.cos());
        anomaly -= step;
        if step.abs() < 1e-15 {
            break;
        }
    }
    anomaly
}

/// On the way to a contact at the distance `contact` of the centers, with the relative speed `speed` there, of which the part
/// `sine` is across the line of centers. They are still `distance` apart, on the side of positive x.
///
/// # Errors
/// A distance less than that of contact, or one that bodies as slow never reach.
pub fn encounter(strength: f64, contact: f64, speed: f64, sine: f64, distance: f64) -> Result<Relative> {
    if !(distance > contact) {
        let problem = format!(
            "is {distance:.6e}, which is too small: the bodies touch at {contact:.6e}; choose a \
                               larger value"
        );
        return Err(Error::scene("orbit.distance", problem));
    }
    let momentum = sine * contact * speed;
    let energy = 0.5 * speed * speed - strength / contact;
    let square = 2.0 * (energy + strength / distance) - (momentum / distance).powi(2);
    if !(square > 0.0) {
        let problem = format!(
            "is {distance:.6e}, farther than bodies of this speed ({speed:.6e} at contact) come; choose less, or a larger speed"
        );
        return Err(Error::scene("orbit.distance", problem));
    }
    // Of the conic section with this energy and angular momentum.
    let latus = momentum * momentum / strength;
    let pericenter = latus / (1.0 + (1.0 + 2.0 * energy * latus / strength).max(0.0).sqrt());
    Ok(Relative {
        position: [distance, 0.0],
        velocity: [-square.sqrt(), momentum / distance],
        mean_motion: 0.0,
        pericenter,
    })
}

/// Mutual escape velocity at a distance.
pub fn escape_velocity(strength: f64, distance: f64) -> f64 {
    (2.0 * strength / distance).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn energy(strength: f64, orbit: &Relative) -> f64 {
        let [x, v] = [orbit.position, orbit.velocity].map(|c| c[0].hypot(c[1]));
        0.5 * v * v - strength / x
    }

    fn momentum(orbit: &Relative) -> f64 {
        orbit.position[0] * orbit.velocity[1] - orbit.position[1] * orbit.velocity[0]
    }

    #[test]
    fn ellipses_keep_energy_and_angular_momentum_and_keplers_law() {
        let (strength, a) = (3.0, 2.0);
        for e in [0.0, 0.3, 0.9, 0.999] {
            for phase in [-0.3, 0.0, 0.1, 0.25, 0.5, 0.77, 12.4] {
                let orbit = ellipse(strength, a, e, phase);
                assert!((energy(strength, &orbit) / (-strength / (2.0 * a)) - 1.0).abs() < 1e-9, "{e} {phase}");
                let expected = (strength * a * (1.0 - e * e)).sqrt();
                assert!((momentum(&orbit) / expected - 1.0).abs() < 1e-10, "{e} {phase}");
                assert!((orbit.mean_motion.powi(2) * a.powi(3) / strength - 1.0).abs() < 1e-14);
            }
        }
        let start = ellipse(strength, a, 0.5, 0.0);
        assert!((start.position[0] - 1.0).abs() < 1e-15 && start.position[1] == 0.0 && start.velocity[1] > 0.0);
        let middle = ellipse(strength, a, 0.5, 0.5);
        assert!((middle.position[0] + 3.0).abs() < 1e-14 && middle.position[1].abs() < 1e-14);
    }

    /// A parabola: at contact with the escape velocity, the energy is 0.
    #[test]
    fn encounters_reach_contact_with_the_speed_and_angle_asked_for() {
        let (strength, contact, sine) = (5.0, 2.0, 0.7);
        let speed = escape_velocity(strength, contact);
        let orbit = encounter(strength, contact, speed, sine, 9.0).unwrap();
        assert!(energy(strength, &orbit).abs() < 1e-14);
        assert!((momentum(&orbit) - sine * contact * speed).abs() < 1e-13);
        assert!(orbit.velocity[0] < 0.0);
        // A parabola's pericenter is h^2 / (2 G M).
        assert!((orbit.pericenter - momentum(&orbit).powi(2) / (2.0 * strength)).abs() < 1e-13);
        let inside = encounter(strength, contact, speed, sine, 1.9).unwrap_err().to_string();
        assert!(inside.contains("too small") && inside.contains("orbit.distance"), "{inside}");
        let slow = encounter(strength, contact, 0.5 * speed, sine, 9.0).unwrap_err().to_string();
        assert!(slow.contains("farther than"), "{slow}");
    }
}
