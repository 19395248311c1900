//! The gravity of the central bodies that a disc orbits: each attracts with its mass within a radius.

use crate::field::quadrature::integrate;
use crate::input::weight::Beside;
use sph::point_mass::PointMass;

/// Rows of the potential, evenly in ln r, and their innermost radius as a part of the outermost.
const ROWS: usize = 4096;
const INNERMOST: f64 = 1e-7;
/// Gauss points from one row to the next; the integrand is smooth but for where bodies end.
const ORDER: usize = 4;

/// Bodies about the center, in the units of the input, and its constant of gravity.
pub(super) struct Well {
    beside: Beside,
    pub constant: f64,
    /// Mass of points that are not softened.
    bare: f64,
    /// Potential of all else.
    rows: Option<Rows>,
}

impl Well {
    /// `outer` is the largest radius that is looked at.
    pub fn new(beside: Beside, constant: f64, outer: f64) -> Self {
        let is_bare = |point: &PointMass<1>| point.radius == 0.0;
        let bare = beside.points.iter().filter(|p| is_bare(p)).map(|point| point.mass).sum();
        let softened: Vec<PointMass<1>> = beside.points.iter().filter(|p| !is_bare(p)).copied().collect();
        let enclosed = |r: f64| {
            let spheres = beside.spheres.iter().map(|(profile, end)| profile.enclosed_mass(r.min(*end)));
            spheres.sum::<f64>() + softened.iter().map(|point| point.enclosed_mass(r)).sum::<f64>()
        };
        let is_closed = beside.spheres.is_empty() && softened.is_empty();
        let rows = (!is_closed).then(|| Rows::new(&enclosed, outer));
        Self { beside, constant, bare, rows }
    }

    pub fn is_empty(&self) -> bool {
        self.beside.is_empty()
    }

    /// Whether it is one point that is not softened.
    pub fn is_a_point(&self) -> bool {
        self.beside.points.len() == 1 && self.rows.is_none()
    }

    /// G M(r) / r^2 at the radius `r` above 0.
    pub fn pull(&self, r: f64) -> f64 {
        self.constant * self.beside.enclosed_mass(r) / (r * r)
    }

    /// Phi(R, z) - Phi(R, 0).
    pub fn rise(&self, radius: f64, z: f64) -> f64 {
        let r = radius.hypot(z);
        // Closed for a point: most discs are about one.
        let bare = if self.bare > 0.0 { self.bare * z * z / ((r + radius) * radius * r) } else { 0.0 };
        self.constant * bare + self.others_rise(radius, z)
    }

    /// That of all but the points that are not softened.
    pub fn others_rise(&self, radius: f64, z: f64) -> f64 {
        let others = self.rows.as_ref().map_or(0.0, |rows| rows.potential(radius.hypot(z)) - rows.potential(radius));
        self.constant * others
    }

    /// Whether there is anything but points that are not softened.
    pub fn has_others(&self) -> bool {
        self.rows.is_some()
    }

    /// The integral of dPhi/dz (r/R)^(2 q) from the plane, of the points that are not softened: G M/R ((r/R)^(2 q - 1) - 1)/(2 q - 1).
    pub fn points_rise(&self, radius: f64, z: f64, q: f64) -> f64 {
        let (far, power) = (0.5 * (z / radius).powi(2).ln_1p(), 2.0 * q - 1.0);
        let part = if power == 0.0 { far } else { (power * far).exp_m1() / power };
        if self.bare > 0.0 { self.constant * self.bare / radius * part } else { 0.0 }
    }
}

/// A potential by radius with G = 1, from 0 in the innermost row, by cubics whose slopes are exact.
struct Rows {
    lowest: f64,
    step: f64,
    /// Potential, and its derivative by ln r.
    values: Vec<[f64; 2]>,
}

impl Rows {
    fn new(enclosed: &dyn Fn(f64) -> f64, outer: f64) -> Self {
        let lowest = (INNERMOST * outer).ln();
        let step = -INNERMOST.ln() / (ROWS - 1) as f64;
        let slope = |t: f64| enclosed(t.exp()) / t.exp();
        let mut values = vec![[0.0, slope(lowest)]];
        for i in 1..ROWS {
            let (from, to) = (lowest + (i - 1) as f64 * step, lowest + i as f64 * step);
            values.push([values[i - 1][0] + integrate(ORDER, from, to, &slope), slope(to)]);
        }
        Self { lowest, step, values }
    }

    fn potential(&self, r: f64) -> f64 {
        let place = ((r.ln() - self.lowest) / self.step).clamp(0.0, (ROWS - 1) as f64);
        let i = (place as usize).min(ROWS - 2);
        let (t, [a, from], [b, to]) = (place - i as f64, self.values[i], self.values[i + 1]);
        let u = 1.0 - t;
        a + (b - a) * t * t * (3.0 - 2.0 * t) + self.step * t * u * (from * u - to * t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::RadialProfile;
    use sph::point_mass::Softening;

    #[test]
    fn the_potential_of_points_and_spheres_rises_as_it_should() {
        let point = |mass, radius| PointMass { center: [0.0], mass, radius, softening: Softening::CubicSpline };
        let of = |spheres, points, constant| Well::new(Beside { spheres, points }, constant, 10.0);
        let well = of(Vec::new(), vec![point(3.0, 0.0)], 2.0);
        for (radius, z) in [(1.0, 0.1), (0.3, 2.0), (5.0, 0.05)] {
            let expected = 6.0 * (1.0 / radius - 1.0 / f64::hypot(radius, z));
            assert!((well.rise(radius, z) / expected - 1.0).abs() < 1e-9, "{radius} {z}");
            // What is felt along z, weighed by the warmth of gas, in small steps.
            for q in [0.0, 0.3, 0.5, 1.2] {
                let force =
                    |z: f64| 6.0 * z / f64::hypot(radius, z).powi(3) * (f64::hypot(radius, z) / radius).powf(2.0 * q);
                let steps = 1000;
                let step = z / f64::from(steps);
                let expected =
                    (0..steps).map(|i| integrate(4, f64::from(i) * step, f64::from(i + 1) * step, &force)).sum::<f64>();
                assert!((well.points_rise(radius, z, q) / expected - 1.0).abs() < 1e-9, "{radius} {z} {q}");
            }
        }
        // Softened, far inside of where it is looked at, and in full.
        let softened = of(Vec::new(), vec![point(1.0, 2.0)], 1.0);
        let potential = |r: f64| point(1.0, 2.0).pull(&[r]).potential;
        let found = softened.rise(0.5, 0.7);
        assert!((found / (potential(f64::hypot(0.5, 0.7)) - potential(0.5)) - 1.0).abs() < 1e-6, "{found}");
        // Within a uniform sphere of mass 1 and radius 1 Phi = r^2/2.
        let profile = RadialProfile::from_nodes(3, &[0.0, 0.5, 1.0], &[0.75 / std::f64::consts::PI; 3]);
        let sphere = of(vec![(profile, 1.0)], Vec::new(), 1.0);
        assert!((sphere.rise(0.0, 0.6) - 0.18).abs() < 1e-9, "{}", sphere.rise(0.0, 0.6));
        assert!((sphere.rise(0.3, 0.4) - 0.08).abs() < 1e-9);
        assert!((sphere.pull(0.5) - 0.5).abs() < 1e-12);
    }
}
