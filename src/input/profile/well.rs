//! The mass of others within a radius, looked up where it is asked for often.

use crate::input::weight::Beside;

/// Radii at which it is known: the lines between them, in logarithms, are off by some 1e-7.
const NODES: usize = 20_000;
/// The smallest, as a part of the largest.
const INNERMOST: f64 = 1e-14;

/// Masses by the logarithm of the radius, up to an outer one.
pub(super) struct Well {
    outer: f64,
    /// Empty where there are no others.
    masses: Vec<f64>,
}

impl Well {
    pub fn new(beside: &Beside, outer: f64) -> Self {
        let at = |i: usize| beside.enclosed_mass(outer * INNERMOST.powf(1.0 - i as f64 / (NODES - 1) as f64));
        let nodes = if beside.is_empty() { 0 } else { NODES };
        Self { outer, masses: (0..nodes).map(at).collect() }
    }

    pub fn is_empty(&self) -> bool {
        self.masses.is_empty()
    }

    /// That within a radius above 0.
    pub fn mass(&self, r: f64) -> f64 {
        if self.masses.is_empty() {
            return 0.0;
        }
        let place = (1.0 - (r / self.outer).ln() / INNERMOST.ln()) * (NODES - 1) as f64;
        let i = (place.max(0.0) as usize).min(NODES - 2);
        let (a, b) = (self.masses[i], self.masses[i + 1]);
        let share = place - i as f64;
        if a > 0.0 { a * (b / a).powf(share) } else { a + share.clamp(0.0, 1.0) * (b - a) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sph::point_mass::{PointMass, Softening};

    #[test]
    fn masses_are_those_of_what_attracts() {
        let soft = PointMass { center: [0.0], mass: 3.0, radius: 0.5, softening: Softening::CubicSpline };
        let hard = PointMass { radius: 0.0, mass: 1.0, ..soft };
        let beside = Beside { spheres: Vec::new(), points: vec![soft, hard] };
        let well = Well::new(&beside, 4.0);
        for i in 0..1000 {
            let r = 4.0 * 1e-9_f64.powf(f64::from(i) / 1000.0);
            let ratio = well.mass(r) / beside.enclosed_mass(r);
            assert!((ratio - 1.0).abs() < 1e-6, "{ratio} at {r}");
        }
        assert_eq!(Well::new(&Beside::default(), 1.0).mass(0.5), 0.0);
    }
}
