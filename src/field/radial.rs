//! Radial profiles as fields of 1 (sheets), 2 (rings) or 3 (shells) dimensions.

use super::curve::Curve;
use super::{CarriedField, CarriedInfo, Level, MassEstimate, RadialProfile, ScalarField, Trace};
use sph::domain::{Axis, Domain, Region};
use sph::geometry::distance;
use std::sync::Arc;

pub(crate) struct RadialDensity<const D: usize> {
    pub(crate) profile: Arc<RadialProfile>,
    pub(crate) center: [f64; D],
    /// Radii at which a material ends.
    pub(crate) borders: Vec<f64>,
}

/// Radii of a profile are those of its nodes but for rounding.
const ROUNDING: f64 = 1e-12;

impl<const D: usize> ScalarField<D> for RadialDensity<D> {
    fn value(&self, x: &[f64; D]) -> f64 {
        self.profile.density(distance(x, &self.center))
    }

    /// The profile's layer: 1 from the center to the first discontinuity, 2 beyond it; 0 outside and where it is empty.
    fn piece(&self, x: &[f64; D]) -> u64 {
        let r = distance(x, &self.center);
        if self.profile.density(r) > 0.0 { self.profile.layer(r) as u64 + 1 } else { 0 }
    }

    fn keeps_apart(&self, a: u64, b: u64) -> bool {
        let ends = self.profile.discontinuities();
        let is_border = |end: &f64| self.borders.iter().any(|border| (border - end).abs() <= ROUNDING * end);
        let between = |layer: u64| ends.get(layer as usize - 1).is_some_and(is_border);
        a > 0 && b > 0 && (a.min(b)..a.max(b)).any(between)
    }

    fn trace(&self, x: &[f64; D]) -> Trace {
        let value = distance(x, &self.center);
        let (layer, [lo, hi]) = self.profile.layer_within(value);
        let mut trace = Trace::new(self.piece(x), layer as u64);
        trace.push(Level { value, lo, hi });
        trace
    }

    fn has_parts(&self) -> bool {
        true
    }

    fn is_piecewise(&self) -> bool {
        !self.profile.discontinuities().is_empty()
    }

    fn center(&self) -> Option<[f64; D]> {
        Some(self.center)
    }

    fn integral(&self, domain: &Domain<D>) -> Option<MassEstimate> {
        let total = self.profile.total_mass();
        let [inner, outer] = self.radii_within(domain)?;
        if inner == 0.0 && outer.is_infinite() {
            return Some(total);
        }
        let value = self.profile.enclosed_mass(outer) - self.profile.enclosed_mass(inner);
        Some(MassEstimate { value, error: total.error })
    }

    fn piece_integrals(&self, domain: &Domain<D>) -> Option<Vec<(u64, MassEstimate)>> {
        let [inner, outer] = self.radii_within(domain)?;
        let error = self.profile.total_mass().error;
        let mut ends = self.profile.discontinuities();
        ends.push(f64::INFINITY);
        let mut from = 0.0;
        let mut pieces = Vec::new();
        for (layer, to) in ends.into_iter().enumerate() {
            let enclosed = |r: f64| self.profile.enclosed_mass(r.clamp(inner, outer));
            let value = enclosed(to) - enclosed(from);
            if value > 0.0 {
                pieces.push((layer as u64 + 1, MassEstimate { value, error }));
            }
            from = to;
        }
        Some(pieces)
    }
}

impl<const D: usize> RadialDensity<D> {
    /// The radii between which `domain` holds all of the profile; `None` where it cuts shells.
    fn radii_within(&self, domain: &Domain<D>) -> Option<[f64; 2]> {
        let outer = self.profile.outer_radius();
        let tiny = 1e-12 * outer;
        match &domain.region {
            Region::Ball { center, inner_radius, radius, .. } => {
                (distance(center, &self.center) <= tiny).then_some([*inner_radius, *radius])
            }
            Region::Box => {
                let holds_all = (0..D).all(|k| {
                    domain.axes[k] != Axis::Periodic
                        && domain.lo[k] <= self.center[k] - outer + tiny
                        && domain.hi[k] >= self.center[k] + outer - tiny
                });
                holds_all.then_some([0.0, f64::INFINITY])
            }
            Region::Cylinder { .. } | Region::Hull(..) => None,
        }
    }
}

/// How a radial variable becomes a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Direction {
    Scalar,
    /// A velocity along the radius: a vector away from the center.
    Outward,
}

pub(crate) struct RadialCarried<const D: usize> {
    pub(crate) info: CarriedInfo,
    pub(crate) curve: Curve,
    pub(crate) center: [f64; D],
    pub(crate) direction: Direction,
}

impl<const D: usize> RadialCarried<D> {
    /// A scalar through values at radii.
    pub(crate) fn scalar(info: CarriedInfo, (nodes, values): (&[f64], &[f64]), center: [f64; D]) -> Self {
        Self { info, curve: Curve::through(nodes, values), center, direction: Direction::Scalar }
    }
}

impl<const D: usize> CarriedField<D> for RadialCarried<D> {
    fn info(&self) -> &CarriedInfo {
        &self.info
    }

    fn evaluate(&self, x: &[f64; D], out: &mut [f64]) {
        let r = distance(x, &self.center);
        let v = self.curve.evaluate(r);
        match self.direction {
            Direction::Scalar => out[0] = v,
            Direction::Outward => {
                for k in 0..D {
                    out[k] = if r > 0.0 { v * (x[k] - self.center[k]) / r } else { 0.0 };
                }
            }
        }
    }
}

/// Radii that halve the volume of each cell: where cell averages of carried variables are placed.
pub(crate) fn volume_midpoints(d: usize, nodes: &[f64]) -> Vec<f64> {
    let power = d as f64;
    nodes
        .windows(2)
        .map(|w| {
            if w[1] <= 0.0 {
                return w[1];
            }
            let ratio = w[0] / w[1];
            // Rounding must not carry a midpoint of a thin cell out of it.
            (w[1] * (0.5 * (1.0 + ratio.powf(power))).powf(1.0 / power)).clamp(w[0], w[1])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn midpoints_halve_the_volume() {
        for d in 1..=3 {
            let m = volume_midpoints(d, &[0.0, 1.0, 2.0, 2.0]);
            let p = d as i32;
            assert!((m[0].powi(p) - 0.5).abs() < 1e-14);
            assert!((m[1].powi(p) - 0.5 * (1.0 + 2f64.powi(p))).abs() < 1e-13);
            assert_eq!(m[2], 2.0);
        }
    }

    #[test]
    fn layers_are_pieces() {
        let field = |nodes: &[f64], values: &[f64]| {
            let profile = Arc::new(RadialProfile::from_nodes(3, nodes, values).scaled(10.0, 2.0));
            RadialDensity::<3> { profile, center: [1.0, 0.0, 0.0], borders: Vec::new() }
        };
        let nodes = [0.0, 1.0, 1.0, 1.5, 1.5, 2.0, 2.0, 3.0, 3.0, 4.0];
        let layered = field(&nodes, &[9.0, 8.0, 3.0, 2.5, 2.5, 2.0, 0.0, 0.0, 1.0, 1.0]);
        assert!(layered.is_piecewise());
        let pieces = [0.0, 9.9, 10.1, 14.9, 15.1, 19.9, 25.0, 30.1, 39.9, 40.1].map(|r| layered.piece(&[1.0, r, 0.0]));
        assert_eq!(pieces, [1, 1, 2, 2, 2, 2, 0, 4, 4, 0]);
        let sphere = |r: f64| 4.0 / 3.0 * std::f64::consts::PI * r.powi(3);
        let shells = field(&[0.0, 1.0, 1.0, 2.0, 2.0, 3.0], &[9.0, 9.0, 3.0, 3.0, 1.0, 1.0]);
        let mut domain = Domain::ball([1.0, 0.0, 0.0], 40.0, sph::domain::Wall::Open).unwrap();
        let masses = |domain: &Domain<3>| -> Vec<(u64, f64)> {
            shells.piece_integrals(domain).unwrap().into_iter().map(|p| (p.0, p.1.value)).collect()
        };
        let close = |found: &[(u64, f64)], expected: &[(u64, f64)]| {
            found.len() == expected.len()
                && found.iter().zip(expected).all(|(a, b)| a.0 == b.0 && (a.1 / b.1 - 1.0).abs() < 1e-12)
        };
        let [one, two, three] = [10.0, 20.0, 30.0].map(sphere);
        assert!(close(&masses(&domain), &[(1, 18.0 * one), (2, 6.0 * (two - one)), (3, 2.0 * (three - two))]));
        if let Region::Ball { inner_radius, radius, .. } = &mut domain.region {
            (*inner_radius, *radius) = (12.0, 18.0);
        }
        assert!(close(&masses(&domain), &[(2, 6.0 * (sphere(18.0) - sphere(12.0)))]));
        assert!(!field(&[0.0, 1.0, 1.0, 2.0], &[4.0, 3.0, 3.0, 1.0]).is_piecewise(), "a node given twice");
        assert!(!field(&[0.0, 0.0, 1.0, 1.0], &[4.0, 3.0, 1.0, 0.0]).is_piecewise(), "center and surface");
    }

    #[test]
    fn radial_velocities_point_outward() {
        let field = RadialCarried::<2> {
            info: CarriedInfo { name: "velocity".into(), unit: None, components: 2 },
            curve: Curve::through(&[0.0, 10.0], &[0.0, 10.0]),
            center: [1.0, 0.0],
            direction: Direction::Outward,
        };
        let mut out = [0.0; 2];
        field.evaluate(&[4.0, 4.0], &mut out);
        assert!((out[0] - 3.0).abs() < 1e-14 && (out[1] - 4.0).abs() < 1e-14);
        field.evaluate(&[1.0, 0.0], &mut out);
        assert_eq!(out, [0.0; 2]);
    }
}
