//! The materials of a body with their equations of state, from its profile or from their material numbers.

use crate::eos::{EquationOfState, Material};
use crate::error::{Error, Result};
use crate::field::{CarriedField, ScalarField};
use crate::input::internal_units::Prepared;
use crate::input::profile;
use crate::scene::{ProfileInput, Scene};
use crate::target::{MaterialState, Materials};
use sph_formats::UnitDimension;
use sph_formats::common::particle_names as names;

/// Name of the scheme of a code that has such equations of state.
const PLANETARY: &str = "planetary";

/// Materials as functions of position.
pub(crate) struct BodyMaterials<'a, const D: usize> {
    pub materials: Materials,
    /// Number of each material; none where there is only one.
    ids: Vec<f64>,
    id: Option<&'a dyn CarriedField<D>>,
    density: &'a dyn ScalarField<D>,
    /// Specific energy, and its unit over the internal one.
    energy: (&'a dyn CarriedField<D>, f64),
}

impl<'a, const D: usize> BodyMaterials<'a, D> {
    /// `None` where the scene's code makes an ideal gas of all, the input has no energies or no materials, or its units are not
    /// known. `scale` is internal density and energy in cgs.
    ///
    /// # Errors
    /// A material that is not known here.
    pub fn new(
        scene: &Scene,
        prepared: &'a Prepared<D>,
        (units_known, scale): (bool, [f64; 2]),
        samples: &[[f64; D]],
    ) -> Result<Option<Self>> {
        let planet = match &scene.input.profile {
            Some(ProfileInput::Planet(_)) => Some(profile::materials(scene)?),
            _ => None,
        };
        let applies = scene.code().map_or(planet.is_some(), |code| code.scheme.name == PLANETARY);
        let field = |name: &str| prepared.source.carried.iter().map(AsRef::as_ref).find(|f| f.info().name == name);
        let (id, energy) = (field(names::MATERIAL_IDS), field(names::INTERNAL_ENERGY));
        let Some(energy) = energy.filter(|e| applies && units_known && e.info().components == 1) else {
            return Ok(None);
        };
        let unit = energy.info().unit.as_ref().filter(|u| u.dimension == UnitDimension::SPECIFIC_ENERGY);
        let Some(unit) = unit.map(|u| u.to_cgs / scale[1]) else { return Ok(None) };
        let mut ids: Vec<f64> = Vec::new();
        match id {
            Some(id) => {
                for x in samples {
                    let mut found = [0.0];
                    id.evaluate(x, &mut found);
                    if !ids.contains(&found[0]) {
                        ids.push(found[0]);
                    }
                }
            }
            None if planet.as_ref().is_some_and(|p| p.len() == 1) => {}
            None => return Ok(None),
        }
        let known = |id: f64| -> Result<EquationOfState> {
            let own = planet.iter().flatten().find(|m| m.id.is_some_and(|own| f64::from(own) == id));
            let found = own.cloned().or_else(|| if planet.is_none() { Material::of_id(id as i32) } else { None });
            found.map(|m| m.equation).ok_or_else(|| {
                let problem = format!(
                    "has the material {id}, whose equation of state is unknown: expected 0 (an ideal gas) or 100 to \
                     104 (Tillotson's iron, \
                     granite, water, basalt, ice); a planet of input.profile reads others from tables"
                );
                Error::field(names::MATERIAL_IDS, problem)
            })
        };
        let equations = match (&planet, ids.is_empty()) {
            (Some(layers), true) => layers.iter().map(|m| m.equation.clone()).collect(),
            _ => ids.iter().map(|id| known(*id)).collect::<Result<_>>()?,
        };
        let materials = Materials::new(equations, scale[0], scale[1]);
        Ok(Some(Self { materials, ids, id, density: prepared.source.density.as_ref(), energy: (energy, unit) }))
    }

    /// The material at a place, with the target's density and energy.
    pub fn state(&self, x: &[f64; D]) -> MaterialState {
        let value = |field: &dyn CarriedField<D>| {
            let mut out = [0.0];
            field.evaluate(x, &mut out);
            out[0]
        };
        let id = self.id.map(value);
        let kind = id.and_then(|id| self.ids.iter().position(|own| *own == id)).unwrap_or(0);
        let (energy, unit) = self.energy;
        MaterialState { kind, density: self.density.value(x), energy: unit * value(energy) }
    }

    pub fn pressure(&self, x: &[f64; D]) -> f64 {
        self.materials.pressure(&self.state(x))
    }
}
