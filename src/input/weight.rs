//! The weight that pressure supports in a radial body at rest, with G = 1.

use crate::field::quadrature::integrate;
use crate::field::{RadialProfile, RadialSource};
use sph::gravity::strength;
use sph::point_mass::PointMass;

/// Bodies about the same center that attract, but are not among the particles.
#[derive(Debug, Clone, Default)]
pub(crate) struct Beside {
    /// Profiles, and the radii at which they are cut.
    pub spheres: Vec<(RadialProfile, f64)>,
    pub points: Vec<PointMass<1>>,
}

impl Beside {
    pub fn is_empty(&self) -> bool {
        self.spheres.is_empty() && self.points.is_empty()
    }

    /// Their mass that attracts at the radius `r` above 0.
    pub fn enclosed_mass(&self, r: f64) -> f64 {
        let spheres: f64 = self.spheres.iter().map(|(profile, end)| profile.enclosed_mass(r.min(*end))).sum();
        spheres + self.points.iter().map(|point| point.enclosed_mass(r)).sum::<f64>()
    }
}

/// S_d G M(r) / r^(d-1): Gauss's law with M counted over full sheets, rings and shells, the part of a point mass in the center
/// that attracts, and what is `beside`.
pub(crate) fn attraction<const D: usize>(
    radial: &RadialSource<D>,
    (core, beside): (Option<&PointMass<D>>, &Beside),
    r: f64,
) -> f64 {
    let core = core.map_or(0.0, |point| point.enclosed_mass(r));
    let others = if beside.is_empty() { 0.0 } else { beside.enclosed_mass(r) };
    strength(D) * (radial.profile.enclosed_mass(r) + core + others) / r.powi(D as i32 - 1)
}

/// P(r) = int_r^R rho g dr from the surface inward, zero there.
pub(crate) struct AtRest<const D: usize> {
    radial: RadialSource<D>,
    core: Option<PointMass<D>>,
    beside: Beside,
    radii: Vec<f64>,
    pressure: Vec<f64>,
}

/// Cells of the table; within one, density and gravity are integrated anew.
const CELLS: usize = 2048;
/// Gauss points per cell.
const ORDER: usize = 4;

impl<const D: usize> AtRest<D> {
    pub fn new(radial: &RadialSource<D>, core: Option<PointMass<D>>, beside: &Beside) -> Self {
        let outer = radial.profile.outer_radius();
        // Half of the cells count radius, half of them mass: neither a core nor an envelope is missed.
        let mass = radial.profile.total_mass().value;
        let mut radii: Vec<f64> = (0..=CELLS / 2).map(|i| outer * i as f64 / (CELLS / 2) as f64).collect();
        radii.extend((1..CELLS / 2).map(|i| radial.profile.radius_of_mass(mass * i as f64 / (CELLS / 2) as f64)));
        if let Some(point) = &core {
            // And where the softened point holds gas that is a small part of the body.
            radii.extend((1..=CELLS / 4).map(|i| point.radius * i as f64 / (CELLS / 4) as f64).filter(|r| *r < outer));
        }
        radii.sort_by(f64::total_cmp);
        radii.dedup();
        let mut body =
            Self { radial: radial.clone(), core, beside: beside.clone(), pressure: vec![0.0; radii.len()], radii };
        for i in (0..body.radii.len() - 1).rev() {
            body.pressure[i] = body.pressure[i + 1] + body.weight(body.radii[i], body.radii[i + 1]);
        }
        body
    }

    pub fn pressure(&self, r: f64) -> f64 {
        let above = self.radii.partition_point(|&e| e <= r);
        if above >= self.radii.len() {
            return 0.0;
        }
        self.pressure[above] + self.weight(r, self.radii[above])
    }

    /// Weight per area of the layer between two radii.
    fn weight(&self, a: f64, b: f64) -> f64 {
        let pull =
            |r: f64| self.radial.profile.density(r) * attraction(&self.radial, (self.core.as_ref(), &self.beside), r);
        integrate(ORDER, a, b, &|r| if r > 0.0 { pull(r) } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::RadialProfile;
    use std::sync::Arc;

    /// Central pressure of a uniform body with M = 1, R = 1 under its own gravity.
    fn central_pressure<const D: usize>() -> f64 {
        let density = 1.0 / sph::geometry::unit_ball_volume(D);
        let profile = Arc::new(RadialProfile::from_nodes(D, &[0.0, 0.3, 1.0], &[density; 3]));
        let radial = RadialSource { profile, center: [0.0; D] };
        let body = AtRest::new(&radial, None, &Beside::default());
        assert_eq!(body.pressure(1.0), 0.0);
        let half = body.pressure(0.5) / body.pressure(0.0);
        assert!((half - 0.75).abs() < 1e-12, "the pressure falls as 1 - r^2: {half}");
        body.pressure(0.0)
    }

    #[test]
    fn uniform_bodies_at_rest_have_the_known_central_pressure() {
        let pi = std::f64::consts::PI;
        assert!((central_pressure::<1>() / (0.5 * pi) - 1.0).abs() < 1e-12);
        assert!((central_pressure::<2>() * pi - 1.0).abs() < 1e-12);
        assert!((central_pressure::<3>() / (3.0 / (8.0 * pi)) - 1.0).abs() < 1e-12);
    }
}
