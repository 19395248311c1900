//! The `profile` of a scene's input: a body computed from its physics, instead of a file.

use super::Quantity;
use super::disc::DiscInput;
use super::hydrostatic::HydrostaticInput;
use super::planet::PlanetInput;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sph_formats::UnitDimension;
use std::borrow::Cow;
use std::path::PathBuf;

/// A model with what determines it. Masses are those within the outer radius; in fewer than three dimensions they are per
/// length or per area.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum ProfileInput {
    /// P = K rho^(1 + 1/n) under its own gravity, 0 <= n < 4.99; in 1, 2 or 3 dimensions.
    Polytrope {
        /// Polytropic index, from 0 to 4.99; 1.5 for a convective star, 3 for a radiative one.
        #[schemars(example = 1.5)]
        n: f64,
        /// Mass within the outer radius.
        #[schemars(extend("x-unit" = "mass"))]
        mass: Quantity,
        /// Outer radius.
        #[schemars(extend("x-unit" = "length"))]
        radius: Quantity,
    },
    /// Zones of polytropes of different indices, such as a core and an envelope, under their own gravity; pressure and temperature are
    /// continuous.
    CompositePolytrope {
        /// Mass within the outer radius.
        #[schemars(extend("x-unit" = "mass"))]
        mass: Quantity,
        /// Outer radius.
        #[schemars(extend("x-unit" = "length"))]
        radius: Quantity,
        /// From the center outward.
        #[schemars(example = serde_json::json!([{"n": 3, "mass_fraction": 0.3}, {"n": 1.5}]))]
        zones: Vec<PolytropeZone>,
    },
    /// P = c^2 rho under its own gravity, cut at the radius; the stable solution or, if there is none, the one closest to stability.
    Isothermal {
        /// Mass within the outer radius.
        #[schemars(extend("x-unit" = "mass"))]
        mass: Quantity,
        /// Outer radius.
        #[schemars(extend("x-unit" = "length"))]
        radius: Quantity,
        /// Sound speed of the gas, uniform.
        #[schemars(extend("x-unit" = "velocity"))]
        sound_speed: Quantity,
    },
    /// An isothermal sphere cut at xi = r sqrt(4 pi G rho_c) / c; by default the largest stable one.
    BonnorEbert {
        /// Mass within the outer radius.
        #[schemars(extend("x-unit" = "mass"))]
        mass: Quantity,
        /// Outer radius.
        #[schemars(extend("x-unit" = "length"))]
        radius: Quantity,
        /// Dimensionless outer radius.
        #[serde(default = "critical")]
        xi: f64,
    },
    /// (1 + r^2/a^2)^(-5/2).
    Plummer {
        /// Mass within the outer radius.
        #[schemars(extend("x-unit" = "mass"))]
        mass: Quantity,
        /// Scale radius a of the law.
        #[schemars(extend("x-unit" = "length"))]
        scale_radius: Quantity,
        /// Radius at which the body is cut.
        #[schemars(extend("x-unit" = "length"))]
        outer_radius: Quantity,
    },
    /// a / (r (r + a)^3).
    Hernquist {
        /// Mass within the outer radius.
        #[schemars(extend("x-unit" = "mass"))]
        mass: Quantity,
        /// Scale radius a of the law.
        #[schemars(extend("x-unit" = "length"))]
        scale_radius: Quantity,
        /// Radius at which the body is cut.
        #[schemars(extend("x-unit" = "length"))]
        outer_radius: Quantity,
    },
    /// 1 / (r (r + a)^2).
    Nfw {
        /// Mass within the outer radius.
        #[schemars(extend("x-unit" = "mass"))]
        mass: Quantity,
        /// Scale radius a of the law.
        #[schemars(extend("x-unit" = "length"))]
        scale_radius: Quantity,
        /// Radius at which the body is cut.
        #[schemars(extend("x-unit" = "length"))]
        outer_radius: Quantity,
    },
    /// King's (1962) density with a core and a tidal radius.
    King {
        /// Mass within the outer radius.
        #[schemars(extend("x-unit" = "mass"))]
        mass: Quantity,
        /// Radius of the core.
        #[schemars(extend("x-unit" = "length"))]
        core_radius: Quantity,
        /// Radius at which the density vanishes.
        #[schemars(extend("x-unit" = "length"))]
        tidal_radius: Quantity,
    },
    /// King's (1966) model of a cluster: an isothermal sphere whose stars are cut off at the energy of the tidal radius.
    #[serde(rename = "king-1966")]
    KingCluster {
        /// Mass within the tidal radius.
        #[schemars(extend("x-unit" = "mass"))]
        mass: Quantity,
        /// Radius at which the density vanishes.
        #[schemars(extend("x-unit" = "length"))]
        tidal_radius: Quantity,
        /// W_0, the depth of the potential in units of the squared dispersion of the center: up to 20.
        #[schemars(example = 6.0)]
        w0: f64,
    },
    /// (1 + r^2/r_c^2)^(-3 beta/2).
    BetaModel {
        /// Mass within the outer radius.
        #[schemars(extend("x-unit" = "mass"))]
        mass: Quantity,
        /// Radius of the core.
        #[schemars(extend("x-unit" = "length"))]
        core_radius: Quantity,
        /// Exponent beta of the law.
        #[serde(default = "two_thirds")]
        beta: f64,
        /// Radius at which the body is cut.
        #[schemars(extend("x-unit" = "length"))]
        outer_radius: Quantity,
    },
    /// 1/r with u = 0.05 G M/R (Evrard 1988): it collapses.
    Evrard {
        /// Mass within the outer radius.
        #[schemars(extend("x-unit" = "mass"))]
        mass: Quantity,
        /// Outer radius.
        #[schemars(extend("x-unit" = "length"))]
        radius: Quantity,
        /// u in units of G M/R.
        #[serde(default = "twentieth")]
        energy: f64,
    },
    /// r^-slope, in 1, 2 or 3 dimensions.
    PowerLaw {
        /// Mass within the outer radius.
        #[schemars(extend("x-unit" = "mass"))]
        mass: Quantity,
        /// Outer radius.
        #[schemars(extend("x-unit" = "length"))]
        radius: Quantity,
        /// Exponent of the power law r^-slope.
        #[schemars(example = 2.0)]
        slope: f64,
    },
    /// P = k rho^2 in the force -Omega^2 r: rho_c (1 - r^2/R^2), in 1, 2 or 3 dimensions.
    ToyStar {
        /// Mass within the outer radius.
        #[schemars(extend("x-unit" = "mass"))]
        mass: Quantity,
        /// Outer radius.
        #[schemars(extend("x-unit" = "length"))]
        radius: Quantity,
        /// k of P = k rho^2, in the scene's units.
        #[schemars(example = 0.25)]
        k: f64,
    },
    /// Degenerate electrons at any degree of relativity.
    WhiteDwarf {
        /// Mass within the outer radius.
        #[schemars(extend("x-unit" = "mass"))]
        mass: Quantity,
        /// Nucleons per electron, mu_e.
        #[serde(default = "two")]
        nucleons_per_electron: f64,
    },
    /// Layers of materials with their equations of state, under their own gravity.
    Planet(PlanetInput),
    /// Rotating gas around the central bodies of the scene, in equilibrium with their gravity and its own.
    Disc(DiscInput),
    /// Gas at rest in its own gravity and that of the bodies around its center, with a given temperature.
    Hydrostatic(HydrostaticInput),
}

/// A zone of a composite polytrope.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PolytropeZone {
    /// Polytropic index, 0 or more; that of the outermost zone is below 5.
    #[schemars(example = 1.5)]
    pub n: f64,
    /// Fraction of the body's mass within the outer boundary of the zone; not stated for the outermost zone.
    #[schemars(range(min = 0.0, max = 1.0), example = 0.3)]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_fraction: Option<f64>,
    /// Outer boundary of the zone as a fraction of the body's radius, instead of a fraction of the mass.
    #[schemars(range(min = 0.0, max = 1.0), example = 0.2)]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius_fraction: Option<f64>,
    /// Mean molecular weight mu, 1 by default. Where mu changes, the density changes in proportion.
    #[schemars(example = 0.6)]
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub mean_molecular_weight: f64,
}

fn one() -> f64 {
    1.0
}

fn is_one(value: &f64) -> bool {
    *value == 1.0
}

fn critical() -> f64 {
    6.451_05
}

fn two_thirds() -> f64 {
    2.0 / 3.0
}

fn twentieth() -> f64 {
    0.05
}

fn two() -> f64 {
    2.0
}

impl ProfileInput {
    /// Whether any of its numbers has a unit.
    pub(crate) fn has_units(&self, d: usize) -> bool {
        self.quantities(d).iter().any(|(_, quantity, _)| matches!(quantity, Quantity::Text(_)))
    }

    /// Names, values and dimensions of what has one, in a body of `d` dimensions.
    pub(crate) fn quantities(&self, d: usize) -> Vec<(Cow<'static, str>, &Quantity, UnitDimension)> {
        let of_mass = |q| ("mass", q, UnitDimension::new(d as i8 - 3, 1, 0, 0));
        let length = |name, q| (name, q, UnitDimension::LENGTH);
        let all: Vec<(&'static str, &Quantity, UnitDimension)> = match self {
            Self::Planet(planet) => return planet.quantities(),
            Self::Disc(disc) => disc.quantities(),
            Self::Hydrostatic(gas) => gas.quantities(),
            Self::Polytrope { mass, radius, .. }
            | Self::CompositePolytrope { mass, radius, .. }
            | Self::BonnorEbert { mass, radius, .. }
            | Self::Evrard { mass, radius, .. }
            | Self::PowerLaw { mass, radius, .. }
            | Self::ToyStar { mass, radius, .. } => vec![of_mass(mass), length("radius", radius)],
            Self::Isothermal { mass, radius, sound_speed } => {
                vec![of_mass(mass), length("radius", radius), ("sound_speed", sound_speed, UnitDimension::VELOCITY)]
            }
            Self::Plummer { mass, scale_radius, outer_radius }
            | Self::Hernquist { mass, scale_radius, outer_radius }
            | Self::Nfw { mass, scale_radius, outer_radius } => {
                vec![of_mass(mass), length("scale_radius", scale_radius), length("outer_radius", outer_radius)]
            }
            Self::King { mass, core_radius, tidal_radius } => {
                vec![of_mass(mass), length("core_radius", core_radius), length("tidal_radius", tidal_radius)]
            }
            Self::KingCluster { mass, tidal_radius, .. } => {
                vec![of_mass(mass), length("tidal_radius", tidal_radius)]
            }
            Self::BetaModel { mass, core_radius, outer_radius, .. } => {
                vec![of_mass(mass), length("core_radius", core_radius), length("outer_radius", outer_radius)]
            }
            Self::WhiteDwarf { mass, .. } => vec![of_mass(mass)],
        };
        all.into_iter().map(|(name, q, d)| (name.into(), q, d)).collect()
    }

    /// Whether its law is that of the density alone, so that its pressure is what carries the weight.
    pub(crate) fn carries_weight(&self) -> bool {
        matches!(
            self,
            Self::Plummer { .. }
                | Self::Hernquist { .. }
                | Self::Nfw { .. }
                | Self::King { .. }
                | Self::KingCluster { .. }
                | Self::BetaModel { .. }
                | Self::PowerLaw { .. }
        )
    }

    /// Files that it names.
    pub(crate) fn files_mut(&mut self) -> Vec<&mut PathBuf> {
        if let Self::Planet(planet) = self { planet.files_mut() } else { Vec::new() }
    }

    /// As in a scene.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Polytrope { .. } => "polytrope",
            Self::CompositePolytrope { .. } => "composite-polytrope",
            Self::Isothermal { .. } => "isothermal",
            Self::BonnorEbert { .. } => "bonnor-ebert",
            Self::Plummer { .. } => "plummer",
            Self::Hernquist { .. } => "hernquist",
            Self::Nfw { .. } => "nfw",
            Self::King { .. } => "king",
            Self::KingCluster { .. } => "king-1966",
            Self::BetaModel { .. } => "beta-model",
            Self::Evrard { .. } => "evrard",
            Self::PowerLaw { .. } => "power-law",
            Self::ToyStar { .. } => "toy-star",
            Self::WhiteDwarf { .. } => "white-dwarf",
            Self::Planet(_) => "planet",
            Self::Disc(_) => "disc",
            Self::Hydrostatic(_) => "hydrostatic",
        }
    }
}
