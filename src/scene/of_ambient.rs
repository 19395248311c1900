//! The medium around bodies as a separate scene, and the keys that cannot be combined with it.

use super::{AmbientInput, BodyInput, BoundaryName, DomainInput, Input, MatchName, ResolutionInput, Scene, Switch};
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
            balance: Switch::Unset,
            certify: None,
            ..self.without_bodies()
        };
        alone.output.box_factor = 1.0;
        alone
    }

    /// Whether the box holds the medium about bodies by faces that are known to those who follow it: all of them periodic or walls, and none
    /// periodic where the matter attracts itself, since then all images do.
    pub(crate) fn holds_its_medium(&self) -> bool {
        let boundary = &self.domain.boundary;
        let is_closed = !boundary.is_empty() && !boundary.contains(&BoundaryName::Open);
        let is_periodic = boundary.contains(&BoundaryName::Periodic);
        self.ambient.is_some() && is_closed && !(is_periodic && self.own_gravity().is_some())
    }

    /// Along which axes the faces of the box about a medium are walls.
    pub(crate) fn walls_of_medium(&self, dimension: usize) -> [bool; 3] {
        let boundary = |k: usize| self.domain.boundary.get(k).or(self.domain.boundary.first());
        std::array::from_fn(|k| k < dimension && boundary(k) == Some(&BoundaryName::Reflecting))
    }

    /// Refuses to follow what the box does not hold, and to settle what would stand still then.
    fn check_what_follows_a_medium(&self, dimension: usize) -> Result<()> {
        let asked = [("settle", self.settle.is_some()), ("certify", self.certify.is_some())];
        let Some((key, _)) = asked.into_iter().find(|(_, is_asked)| *is_asked) else { return Ok(()) };
        let refuse = |problem: String| Err(Error::scene(key, problem));
        let attracts = self.own_gravity().is_some();
        if !self.holds_its_medium() {
            // Bodies that their own gravity holds are followed each by itself.
            if key == "certify" && attracts {
                return Ok(());
            }
            return refuse(match attracts && !self.domain.boundary.contains(&BoundaryName::Open) {
                true => "needs the gravity of all images of a periodic box, which is not known here; state domain.boundary: reflecting, or leave it out".into(),
                false => "would let the medium (`ambient`) flow out of open faces; state domain.boundary: periodic or reflecting, or leave it out".into(),
            });
        }
        if attracts && dimension < 3 {
            return refuse(format!(
                "knows gravity in 3-D, but the bodies attract each other in {dimension}-D; leave it out"
            ));
        }
        if self.orbit.is_some() && self.settle.is_some() {
            return refuse(
                "would end the orbit, since the medium (`ambient`) does not turn with the bodies; let them settle in a scene without the medium, or leave it out".into(),
            );
        }
        let other = |body: &BodyInput| body.collisionless.is_some() || body.dust.is_some();
        if let Some((i, body)) = self.bodies.iter().enumerate().find(|(_, body)| other(body)) {
            let what = if body.dust.is_some() { "dust" } else { "collisionless particles" };
            return refuse(format!(
                "follows gas and point masses beside the medium, but bodies[{}] has {what}; leave one out",
                body.title(i)
            ));
        }
        if self.adiabatic_index() != Some(self.thermal.gamma) {
            return refuse(
                "follows gas of one adiabatic index, but bodies and the medium have different ones (thermal.gamma); state one, or leave it out".into(),
            );
        }
        Ok(())
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
        self.check_what_follows_a_medium(corner.len())?;
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
