//! The medium about bodies as a scene by itself, and what cannot stand beside it.

use super::{AmbientInput, DomainInput, Input, MatchName, ResolutionInput, Scene};
use crate::error::{Error, Result};

impl Scene {
    /// The medium by itself as a scene, without the bodies, for as many particles as fill the box.
    pub(crate) fn of_ambient(&self, ambient: &AmbientInput, dimension: usize, particles: Option<usize>) -> Self {
        let even = ResolutionInput { number_density: Some("1".into()), ..ResolutionInput::default() };
        let mut alone = Self {
            input: Input { expression: Some(ambient.density.text()), dimension: Some(dimension), ..Input::default() },
            resolution: (ambient.matching == MatchName::Spacing).then_some(even),
            particles,
            fields: ambient.fields.clone(),
            balance: None,
            certify: None,
            ..self.without_bodies()
        };
        alone.output.box_factor = 1.0;
        alone
    }

    /// Checks the medium, and whether there are bodies and a box that it could be between.
    pub(super) fn check_ambient(&self) -> Result<()> {
        let Some(ambient) = &self.ambient else { return Ok(()) };
        let refuse = |problem: &str| Err(Error::scene("ambient", problem));
        let DomainInput { bounds, .. } = &self.domain;
        let Some([corner, _]) = bounds else {
            return refuse(
                "fills a box, which is missing: state domain.box, with domain.boundary where it is periodic",
            );
        };
        if self.bodies.is_empty() {
            return refuse(
                "is the medium around `bodies`, of which there are none; state the density of one medium as input.expression",
            );
        }
        if self.orbit.is_some() {
            return refuse(
                "cannot stand beside an orbit, whose center of mass the medium would move; give bodies positions and velocities",
            );
        }
        if self.certify.is_some() {
            return refuse("stands beside `certify`, which follows bodies by themselves; leave one out");
        }
        if self.settle.is_some() {
            return refuse(
                "stands beside `settle`, whose gravity and open space are not those of a box; leave one out",
            );
        }
        let in_ambient = |error: Error| match error {
            Error::Scene { key, problem } if key.starts_with("input") => Error::scene("ambient.density", problem),
            Error::Scene { key, problem } if key.starts_with("fields") => {
                Error::Scene { key: format!("ambient.{key}"), problem }
            }
            other => other,
        };
        self.of_ambient(ambient, corner.len(), None).validate().map_err(in_ambient)
    }
}
