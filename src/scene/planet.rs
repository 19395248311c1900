//! The `planet` of an input's profile: layers of materials in hydrostatic equilibrium.

use super::Quantity;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sph_formats::UnitDimension;
use std::borrow::Cow;
use std::path::PathBuf;

/// A planet. Of its mass, its radius and the boundaries between its layers all but one are stated; that one follows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlanetInput {
    /// Mass of the whole planet.
    #[schemars(extend("x-unit" = "mass"))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<Quantity>,
    /// Radius of the planet's surface.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<Quantity>,
    /// From the inside outward.
    #[schemars(example = serde_json::json!([{"material": "tillotson-iron", "mass_fraction": 0.3}, {"material": "tillotson-granite"}]))]
    pub layers: Vec<LayerInput>,
    /// Temperature at the surface. Required if the pressure of a layer depends on temperature.
    #[schemars(extend("x-unit" = "temperature"))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface_temperature: Option<Quantity>,
    /// Pressure at the surface, 0 by default.
    #[schemars(extend("x-unit" = "pressure"))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface_pressure: Option<Quantity>,
    /// Temperature profile of all layers that state none; adiabatic by default.
    #[schemars(example = &"adiabatic")]
    #[serde(default)]
    pub state: ThermalState,
}

/// One material, up to a radius, a mass within, or the mass of the layer as a part of the planet's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayerInput {
    /// Material of the layer: a name, or an equation of state with its constants.
    #[schemars(example = &"tillotson-iron")]
    pub material: MaterialInput,
    /// Outer radius.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<Quantity>,
    /// Mass of the layer.
    #[schemars(extend("x-unit" = "mass"))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<Quantity>,
    /// The same over the mass of the planet.
    #[schemars(range(min = 0.0, max = 1.0), example = 0.3)]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_fraction: Option<f64>,
    /// Temperature profile within the layer, if it differs from the planet's `state`.
    #[schemars(example = &"isothermal")]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<ThermalState>,
    /// Material number in files (`MaterialIDs`), if the material has none or should have a different one.
    #[schemars(example = 402)]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<i32>,
}

/// How temperature follows depth within a layer; between layers it is continuous.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ThermalState {
    /// Constant entropy.
    #[default]
    Adiabatic,
    /// One temperature.
    Isothermal,
    /// T grows as this power of the density.
    #[schemars(example = serde_json::json!({"power": 0.5}))]
    Power(f64),
}

/// A material by name, or by an equation of state with its constants.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum MaterialInput {
    /// Iron with Tillotson's equation of state.
    #[schemars(extend("x-aliases" = ["tillotson_iron", "Til_iron"]))]
    #[serde(alias = "tillotson_iron", alias = "Til_iron")]
    TillotsonIron,
    /// Granite, the same.
    #[schemars(extend("x-aliases" = ["tillotson_granite", "Til_granite"]))]
    #[serde(alias = "tillotson_granite", alias = "Til_granite")]
    TillotsonGranite,
    /// Water, the same.
    #[schemars(extend("x-aliases" = ["tillotson_water", "Til_water"]))]
    #[serde(alias = "tillotson_water", alias = "Til_water")]
    TillotsonWater,
    /// Basalt, the same.
    #[schemars(extend("x-aliases" = ["tillotson_basalt", "Til_basalt"]))]
    #[serde(alias = "tillotson_basalt", alias = "Til_basalt")]
    TillotsonBasalt,
    /// Ice, the same.
    #[schemars(extend("x-aliases" = ["tillotson_ice", "Til_ice"]))]
    #[serde(alias = "tillotson_ice", alias = "Til_ice")]
    TillotsonIce,
    /// P = (gamma - 1) rho u, u by temperature and mean molecular weight.
    #[schemars(extend("x-aliases" = ["ideal_gas"]))]
    #[serde(alias = "ideal_gas")]
    IdealGas {
        /// Adiabatic index.
        #[schemars(example = 1.4)]
        #[serde(default = "five_thirds")]
        gamma: f64,
        /// In units of the mass of hydrogen.
        #[schemars(example = 2.3)]
        mean_molecular_weight: f64,
    },
    /// P = sound_speed^2 rho.
    Isothermal {
        /// Sound speed, uniform.
        #[schemars(extend("x-unit" = "velocity"))]
        sound_speed: Quantity,
    },
    /// P = constant rho^gamma, in the scene's units.
    Polytrope {
        /// K, in the scene's units.
        #[schemars(example = 1.0)]
        constant: f64,
        /// 1 + 1/n.
        #[schemars(example = 2.0)]
        gamma: f64,
    },
    /// P = bulk_modulus/exponent ((rho/density)^exponent - 1); Cole's water has the exponent 7.
    Murnaghan {
        /// Value at zero pressure.
        #[schemars(extend("x-unit" = "density"))]
        density: Quantity,
        /// Value at zero pressure.
        #[schemars(extend("x-unit" = "pressure"))]
        bulk_modulus: Quantity,
        /// Exponent of the density.
        #[serde(default = "seven")]
        exponent: f64,
    },
    /// A table in SWIFT's and WoMa's format for SESAME and ANEOS.
    Table {
        /// Path, from the scene's folder.
        #[schemars(example = &"ANEOS_forsterite_S19.txt")]
        file: PathBuf,
    },
}

fn five_thirds() -> f64 {
    5.0 / 3.0
}

fn seven() -> f64 {
    7.0
}

impl PlanetInput {
    /// Tables of materials.
    pub(super) fn files_mut(&mut self) -> Vec<&mut PathBuf> {
        let tables = self.layers.iter_mut().map(|layer| &mut layer.material);
        tables.filter_map(|m| if let MaterialInput::Table { file } = m { Some(file) } else { None }).collect()
    }

    /// Names, values and dimensions of what has one.
    pub(super) fn quantities(&self) -> Vec<(Cow<'static, str>, &Quantity, UnitDimension)> {
        let own = [
            ("mass", &self.mass, UnitDimension::MASS),
            ("radius", &self.radius, UnitDimension::LENGTH),
            ("surface_temperature", &self.surface_temperature, UnitDimension::TEMPERATURE),
            ("surface_pressure", &self.surface_pressure, UnitDimension::PRESSURE),
        ];
        let mut all: Vec<_> = own.into_iter().filter_map(|(name, q, d)| Some((name.into(), q.as_ref()?, d))).collect();
        for (i, layer) in self.layers.iter().enumerate() {
            let of_material: Vec<(&str, Option<&Quantity>, UnitDimension)> = match &layer.material {
                MaterialInput::Isothermal { sound_speed } => {
                    vec![("material.sound_speed", Some(sound_speed), UnitDimension::VELOCITY)]
                }
                MaterialInput::Murnaghan { density, bulk_modulus, .. } => vec![
                    ("material.density", Some(density), UnitDimension::mass_density(3)),
                    ("material.bulk_modulus", Some(bulk_modulus), UnitDimension::PRESSURE),
                ],
                _ => Vec::new(),
            };
            let ends = [
                ("radius", layer.radius.as_ref(), UnitDimension::LENGTH),
                ("mass", layer.mass.as_ref(), UnitDimension::MASS),
            ];
            let stated = ends.into_iter().chain(of_material);
            all.extend(stated.filter_map(|(name, q, d)| Some((format!("layers[{i}].{name}").into(), q?, d))));
        }
        all
    }
}
