//! All quantities of a scene, with their keys and physical dimensions.

use super::{Conversion, EquationOfState, OriginInput, Quantity, Scene};
use crate::error::{Error, Result};
use sph_formats::UnitDimension;

/// Key, value and dimension.
type Entry<'a> = (String, &'a Quantity, UnitDimension);

fn each<'a>(
    key: &'a str,
    quantities: &'a [Quantity],
    dimension: UnitDimension,
) -> impl Iterator<Item = Entry<'a>> + 'a {
    quantities.iter().enumerate().map(move |(i, q)| (format!("{key}[{i}]"), q, dimension))
}

fn one<'a>(key: &str, quantity: impl Into<Option<&'a Quantity>>, dimension: UnitDimension) -> Option<Entry<'a>> {
    Some((key.to_owned(), quantity.into()?, dimension))
}

impl Scene {
    fn quantities(&self) -> Vec<Entry<'_>> {
        let (length, speed) = (UnitDimension::LENGTH, UnitDimension::VELOCITY);
        let mut all: Vec<Entry<'_>> = Vec::new();
        all.extend(one("input.planet_radius", self.input.planet_radius.as_ref(), length));
        if let Some(core) = &self.input.core {
            all.extend(one("input.core.radius", &core.radius, length));
            all.extend(one("input.core.mass", core.mass.as_ref(), UnitDimension::MASS));
        }
        if let Some(profile) = &self.input.profile {
            let of = profile.quantities(self.input.dimension.unwrap_or(3)).into_iter();
            all.extend(of.map(|(name, q, d)| (format!("input.profile.{}.{name}", profile.name()), q, d)));
        }
        for (name, corner) in ["domain.box[0]", "domain.box[1]"].into_iter().zip(self.domain.bounds.iter().flatten()) {
            all.extend(each(name, corner, length));
        }
        if let Some(ball) = &self.domain.ball {
            all.extend(each("domain.ball.center", &ball.center, length));
            all.extend(one("domain.ball.radius", &ball.radius, length));
            all.extend(one("domain.ball.inner_radius", &ball.inner_radius, length));
        }
        if let Some(cylinder) = &self.domain.cylinder {
            all.extend(each("domain.cylinder.center", &cylinder.center, length));
            all.extend(one("domain.cylinder.radius", &cylinder.radius, length));
            all.extend(one("domain.cylinder.inner_radius", &cylinder.inner_radius, length));
            all.extend(one("domain.cylinder.length", &cylinder.length, length));
        }
        all.extend(one("walls.spacing", self.walls.as_ref().and_then(|w| w.spacing.as_ref()), length));
        all.extend(self.orbit.iter().flat_map(|o| o.quantities()).map(|(key, q, d)| (key.to_owned(), q, d)));
        if let Some(OriginInput::Point(point)) = &self.output.origin {
            all.extend(each("output.origin", point, length));
        }
        all.extend(one("particle_mass", self.particle_mass.as_ref(), UnitDimension::MASS));
        all.extend(self.refine.iter().flat_map(|r| r.quantities()));
        let turbulent = self.turbulence.as_ref().and_then(|t| t.rms_velocity.as_ref());
        all.extend(one("turbulence.rms_velocity", turbulent, speed));
        let displaced = self.displacement.as_ref();
        all.extend(one("displacement.rms", displaced.and_then(|d| d.rms.as_ref()), length));
        let factor = displaced.and_then(|d| d.velocity_factor.as_ref());
        all.extend(one("displacement.velocity_factor", factor, UnitDimension::RATE));
        all.extend(each("motion.bulk", &self.motion.bulk, speed));
        all.extend(each("motion.rotation", &self.motion.rotation, UnitDimension::RATE));
        let energy = self.thermal.internal_energy.as_ref();
        all.extend(one("thermal.internal_energy", energy, UnitDimension::SPECIFIC_ENERGY));
        let radii = self.material.iter().enumerate().filter_map(|(i, m)| Some((i, m.radius.as_ref()?)));
        all.extend(radii.map(|(i, r)| (format!("material[{i}].radius"), r, length)));
        if let Some(EquationOfState::Isothermal { sound_speed }) =
            self.balance.on().and_then(|b| b.equation_of_state.as_ref())
        {
            all.extend(one("balance.equation_of_state.sound_speed", sound_speed, speed));
        }
        all
    }

    /// Does something with each quantity of the domain's shapes.
    fn of_shapes(&self, each: &dyn Fn(&str, &Quantity, UnitDimension) -> Result<()>) -> Result<()> {
        let own = self.domain.shape();
        let mut all = Vec::new();
        own.iter().for_each(|shape| shape.quantities("domain", &mut all));
        if let Some(walls) = &self.walls {
            walls.around.iter().for_each(|shape| shape.quantities("walls.around", &mut all));
            walls.without.iter().for_each(|shape| shape.quantities("walls.without", &mut all));
        }
        all.iter().try_for_each(|(key, quantity, dimension)| each(key, quantity, *dimension))
    }

    /// Whether all quantities are numbers, with units that fit where they have units.
    ///
    /// # Errors
    /// [`Error::Scene`] with the first that is not.
    pub(super) fn check_quantities(&self) -> Result<()> {
        self.quantities().iter().try_for_each(|(key, quantity, dimension)| quantity.check(key, *dimension))?;
        self.of_shapes(&|key, quantity, dimension| quantity.check(key, dimension))?;
        // Radii in units alike can be compared at once, others when the input's units are known.
        self.check_layers(&Conversion::NONE).or_else(|error| {
            let radii = || self.material.iter().filter_map(|layer| layer.radius.as_ref());
            let all_plain = radii().all(|r| matches!(r, Quantity::Plain(_)));
            let ordered = radii().all(|r| r.number() > 0.0) && self.has_radii_but_for_the_last();
            if all_plain || !ordered { Err(error) } else { Ok(()) }
        })
    }

    /// Whether a quantity of the scene has a unit.
    pub(crate) fn has_quantities_with_units(&self) -> bool {
        let (own, mut shapes) = (self.domain.shape(), Vec::new());
        own.iter().for_each(|shape| shape.quantities("domain", &mut shapes));
        let all = self.quantities();
        let mut quantities = all.iter().map(|entry| entry.1).chain(shapes.iter().map(|entry| entry.1));
        quantities.any(|quantity| quantity.dimension().is_some())
    }

    /// Whether all quantities can be converted, and those that depend on each other fit together.
    ///
    /// # Errors
    /// [`Error::Scene`] with the first that does not.
    pub(crate) fn check_units(&self, conversion: &Conversion) -> Result<()> {
        for (key, quantity, dimension) in self.quantities() {
            quantity.value(&key, dimension, conversion)?;
        }
        self.of_shapes(&|key, quantity, dimension| quantity.value(key, dimension, conversion).map(|_| ()))?;
        self.check_layers(conversion)
    }

    fn has_radii_but_for_the_last(&self) -> bool {
        let last = self.material.len().saturating_sub(1);
        self.material.iter().enumerate().all(|(i, layer)| layer.radius.is_some() != (i == last))
    }

    fn check_layers(&self, conversion: &Conversion) -> Result<()> {
        let mut inner = 0.0;
        for (i, layer) in self.material.iter().enumerate() {
            let last = i + 1 == self.material.len();
            let key = format!("material[{i}].radius");
            let radius = layer.radius.as_ref().map(|r| r.value(&key, UnitDimension::LENGTH, conversion)).transpose()?;
            match radius {
                None if last => {}
                Some(r) if !last && r > inner => inner = r,
                _ => {
                    let found = layer.radius.as_ref().map_or("no radius".to_owned(), |r| format!("radius {r}"));
                    let problem = format!(
                        "layer {} has {found}, expected outer radii that ascend from the center, and none for the last layer",
                        i + 1
                    );
                    return Err(Error::scene("material", problem));
                }
            }
        }
        Ok(())
    }
}
