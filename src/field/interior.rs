//! A radial body whose density and carried fields are replaced within a given radius.

use super::radial::{RadialCarried, RadialDensity};
use super::{CarriedField, CarriedInfo, MassEstimate, RadialSource, Source};
use sph::geometry::distance;
use std::sync::Arc;

/// What scalars are within the radius.
pub(crate) enum Inside {
    /// What they are there.
    AtRadius,
    /// Their value there times a factor that goes with the distance from the center: by nodes, which go from 0 to the radius.
    Times(Vec<f64>),
}

impl<const D: usize> Source<D> {
    /// The same body with another density and other scalars within a radius: `nodes` ascend from 0 to it, and `inside` says of each
    /// field what it is there.
    pub(crate) fn with_interior(
        self,
        radial: &RadialSource<D>,
        (nodes, density): (&[f64], &[f64]),
        inside: &dyn Fn(&CarriedInfo) -> Inside,
    ) -> Self {
        let radius = nodes.last().copied().unwrap_or(0.0);
        let profile = Arc::new(radial.profile.with_interior(radius, nodes, density));
        let center = radial.center;
        let lost = radial.profile.enclosed_mass(radius) - profile.enclosed_mass(radius);
        let replaced = |field: Box<dyn CarriedField<D>>| -> Box<dyn CarriedField<D>> {
            if field.info().components != 1 {
                return field;
            }
            let mut value = [0.0];
            field.evaluate(&radial.at(radius), &mut value);
            let values: Vec<f64> = match inside(field.info()) {
                Inside::AtRadius => vec![value[0]; nodes.len()],
                Inside::Times(factors) => factors.iter().map(|f| f * value[0]).collect(),
            };
            let within = RadialCarried::scalar(field.info().clone(), (nodes, &values), center);
            Box::new(WithInterior { within, beyond: field, center, radius })
        };
        Self {
            density: Box::new(RadialDensity { profile: Arc::clone(&profile), center, borders: Vec::new() }),
            carried: self.carried.into_iter().map(replaced).collect(),
            mass: self.mass.map(|m| MassEstimate { value: m.value - lost, ..m }),
            radial: Some(RadialSource { profile, center }),
            ..self
        }
    }
}

/// One field within a radius, another beyond.
struct WithInterior<const D: usize> {
    within: RadialCarried<D>,
    beyond: Box<dyn CarriedField<D>>,
    center: [f64; D],
    radius: f64,
}

impl<const D: usize> CarriedField<D> for WithInterior<D> {
    fn info(&self) -> &CarriedInfo {
        &self.within.info
    }

    fn evaluate(&self, x: &[f64; D], out: &mut [f64]) {
        if distance(x, &self.center) < self.radius {
            self.within.evaluate(x, out);
        } else {
            self.beyond.evaluate(x, out);
        }
    }
}
