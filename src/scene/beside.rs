//! Collisionless particles, dust, and bodies that act only by gravity: each as a separate scene, with its checks.

use super::{
    AttractorInput, CheckpointInput, CollisionlessInput, DustInput, FieldValue, Input, OriginInput, OriginName, Output,
    Scene, Switch, Term, Thermal, VelocityName,
};
use crate::error::{Error, Result};
use sph_formats::UnitDimension;

/// Name of the field that holds the ratio at each particle of dust.
pub(crate) const RATIO: &str = "dust_to_gas_ratio";
/// Gas particles for one of dust, where the scene does not say how many there are.
const GAS_FOR_ONE: usize = 5;
impl Scene {
    /// Checks collisionless particles, and what stands beside them.
    pub(super) fn check_collisionless(&self) -> Result<()> {
        let dimension = self.input.dimension.unwrap_or(3);
        if !self.gravity_of.is_empty() && dimension != 3 {
            return Err(Error::scene("gravity_of", format!("is of bodies in 3-D, but the scene is in {dimension}-D")));
        }
        for (i, attractor) in self.gravity_of.iter().enumerate() {
            self.validate_attractor(attractor, &format!("gravity_of[{i}]"))?;
        }
        let Some(collisionless) = &self.collisionless else { return Ok(()) };
        if !(1..=5).contains(&collisionless.part_type) {
            let problem = format!("is {}, expected 1 to 5; 0 is gas", collisionless.part_type);
            return Err(Error::scene("collisionless.type", problem));
        }
        if dimension != 3 && collisionless.velocities != VelocityName::None {
            let problem = format!("are drawn in 3-D, but the scene is in {dimension}-D; expected none");
            return Err(Error::scene("collisionless.velocities", problem));
        }
        let of_gas = [
            ("balance", self.balance.is_on()),
            ("certify", self.certify.is_some()),
            ("settle", self.settle.is_some()),
            ("thermal.internal_energy", self.thermal.internal_energy.is_some()),
            ("material", !self.material.is_empty()),
            ("input.core", self.input.core.is_some()),
            ("walls", self.walls.is_some()),
            ("turbulence", self.turbulence.is_some()),
            ("displacement", self.displacement.is_some()),
        ];
        match of_gas.iter().find(|(_, is_given)| *is_given) {
            Some((key, _)) => Err(Error::scene(*key, "is of gas, but the particles are collisionless; leave one out")),
            None => Ok(()),
        }
    }

    /// The scene of a body beside it by itself, with what numbers mean in this one.
    pub(crate) fn of_attractor(&self, attractor: &AttractorInput) -> Self {
        Self {
            input: attractor.input.clone(),
            domain: attractor.domain.clone(),
            gravity_of: attractor.gravity_of.clone(),
            units: self.units.clone(),
            target_code: self.target_code.clone(),
            balance: self.balance.clone(),
            output: Output { units: self.output.units.clone(), ..Output::default() },
            ..Self::default()
        }
    }

    fn validate_attractor(&self, attractor: &AttractorInput, key: &str) -> Result<()> {
        let of = |name: &str| format!("{key}.{name}");
        match (&attractor.point_mass, &attractor.softening_radius) {
            (Some(mass), radius) => {
                mass.check_positive(&of("point_mass"), UnitDimension::MASS)?;
                radius.as_ref().map_or(Ok(()), |r| r.check_positive(&of("softening_radius"), UnitDimension::LENGTH))?;
                let is_alone = attractor.input == Input::default()
                    && attractor.domain.is_empty()
                    && attractor.gravity_of.is_empty();
                match is_alone {
                    true => Ok(()),
                    false => Err(Error::scene(of("point_mass"), "stands beside an input; leave one out")),
                }
            }
            (None, Some(_)) => Err(Error::scene(of("softening_radius"), "is of a point_mass, which is missing")),
            (None, None) => {
                if !attractor.gravity_of.is_empty() && attractor.input.hydrostatic().is_none() {
                    let problem = "is of what follows from the gravity of others (`profile: hydrostatic`), and this input does not; leave it out";
                    return Err(Error::scene(of("gravity_of"), problem));
                }
                if attractor.input.core.is_some() || attractor.input.others.is_some() {
                    let problem = "has a `core` or `others`; only what its own density makes counts here: leave them out, and state a point mass by itself";
                    return Err(Error::scene(of("input"), problem));
                }
                self.of_attractor(attractor).validate().map_err(|error| match error {
                    Error::Scene { key: inner, problem } => Error::Scene { key: of(&inner), problem },
                    other => other,
                })
            }
        }
    }

    /// The scene of the dust by itself, beside so many particles of gas, for a file of a format in units of a name.
    ///
    /// # Errors
    /// A format of a code without dust.
    pub(crate) fn of_dust(&self, gas: usize, format: Option<&str>, units: Option<String>) -> Result<Option<Self>> {
        let Some(dust) = &self.dust else { return Ok(None) };
        let part_type = dust.part_type(format)?;
        let mut alone = Self {
            dust: None,
            collisionless: Some(CollisionlessInput { part_type, velocities: VelocityName::None }),
            particles: Some(dust.particles.unwrap_or((gas / GAS_FOR_ONE).max(1))),
            // Of another arrangement, so that no dust is where gas is.
            seed: self.seed.wrapping_add(1),
            balance: Switch::Unset,
            certify: None,
            settle: None,
            thermal: Thermal::default(),
            material: Vec::new(),
            checkpoint: CheckpointInput::default(),
            ..self.clone()
        };
        alone.input.factor = Some(dust.ratio.clone());
        alone.fields.0.extend(dust.fields.0.clone());
        alone.fields.0.insert(RATIO.into(), FieldValue::One(dust.ratio.clone()));
        alone.output = Output {
            units,
            format: self.output.format.clone(),
            origin: Some(OriginInput::Named(OriginName::Corner)),
            box_factor: self.output.box_factor,
            target_density: self.output.target_density,
            on_interrupt: self.output.on_interrupt,
            ..Output::default()
        };
        Ok(Some(alone))
    }

    /// Checks dust.
    pub(super) fn check_dust(&self) -> Result<()> {
        if let Some(Term::Number(factor)) = self.input.factor
            && !(factor.is_finite() && factor > 0.0)
        {
            return Err(Error::scene(
                "input.factor",
                format!("is {factor}, expected a positive number or an expression"),
            ));
        }
        self.dust.as_ref().map_or(Ok(()), |dust| self.validate_dust(dust))
    }

    fn validate_dust(&self, dust: &DustInput) -> Result<()> {
        if let Term::Number(ratio) = dust.ratio
            && !(ratio.is_finite() && ratio > 0.0)
        {
            return Err(Error::scene("dust.ratio", format!("is {ratio}, expected a positive number or an expression")));
        }
        if dust.particles == Some(0) {
            return Err(Error::scene("dust.particles", "is 0, expected at least 1"));
        }
        if let Some(found) = dust.part_type.filter(|t| !(1..=5).contains(t)) {
            return Err(Error::scene("dust.type", format!("is {found}, expected 1 to 5; 0 is gas")));
        }
        let beside = [
            ("collisionless", self.collisionless.is_some()),
            ("displacement", self.displacement.is_some()),
            ("turbulence", self.turbulence.is_some()),
            ("input.core", self.input.core.is_some()),
            ("input.others", self.input.others.is_some()),
            ("walls", self.walls.is_some()),
        ];
        if let Some((key, _)) = beside.iter().find(|(_, is_given)| *is_given) {
            return Err(Error::scene("dust", format!("cannot stand beside `{key}`; leave one out")));
        }
        dust.fields.validate()
    }
}
