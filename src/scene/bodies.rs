//! Several bodies in one scene, and the orbit of two of them.

use super::{
    AttractorInput, BalanceInput, CollisionlessInput, DomainInput, DustInput, FieldsInput, Input, MaterialLayer,
    Polish, Quantity, ResolutionInput, Switch, Thermal, TurbulenceInput,
};
use crate::error::{Error, Result};
use crate::seeding::Seeding;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sph_formats::UnitDimension;
use sph_formats::common::particle_names as names;

/// A body: what a scene of its own would say of it, and where it goes. What is left out is as in the scene that it is part of.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BodyInput {
    /// Name in messages and in the report; by default its number, from 1.
    #[schemars(example = &"primary")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    pub input: Input,
    /// Mass of a single particle, instead of an input: a companion, a core, a black hole.
    #[schemars(extend("x-unit" = "mass"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point_mass: Option<Quantity>,
    /// Of a point mass: the distance at which its softened attraction becomes that of a point, as that of a core: 2 hsoft in Phantom.
    #[schemars(extend("x-unit" = "length"), example = &"5 Rsun")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub softening_radius: Option<Quantity>,
    /// Accretion radius of a point mass, if the code has such particles (Phantom's sinks).
    #[schemars(extend("x-unit" = "length"), example = &"0.1 Rsun")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accretion_radius: Option<Quantity>,
    /// Particle type of a point mass in files of GADGET's kind, 1 to 5; 1 (dark matter) by default.
    #[schemars(range(min = 1, max = 5), example = 1)]
    #[serde(rename = "type", skip_serializing_if = "Option::is_none")]
    pub part_type: Option<u8>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resolution: Option<ResolutionInput>,
    pub domain: DomainInput,
    /// Number of its particles: by default its share of the scene's particles, so that all have the same mass.
    #[schemars(schema_with = "super::schema::optional_count", example = &"50k")]
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "super::count::optional_count")]
    pub particles: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seeding: Option<Seeding>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polish: Option<Polish>,
    #[serde(skip_serializing_if = "Switch::is_unset")]
    pub balance: Switch<BalanceInput>,
    /// Bodies around its center whose gravity acts on this body, but which are not particles of the file.
    #[schemars(example = serde_json::json!([{"point_mass": 1.0}]))]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gravity_of: Vec<AttractorInput>,
    /// What its particles carry beside their mass, as expressions.
    #[schemars(example = serde_json::json!({"velocity": ["-y", "x", 0]}))]
    #[serde(skip_serializing_if = "FieldsInput::is_empty")]
    pub fields: FieldsInput,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turbulence: Option<TurbulenceInput>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thermal: Option<Thermal>,
    /// Makes its particles collisionless: `true`, or its keys.
    #[schemars(schema_with = "super::schema::switch_or_keys::<CollisionlessInput>", example = true)]
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "super::switch::switch_or_keys")]
    pub collisionless: Option<CollisionlessInput>,
    /// Dust as particles of its own beside its gas.
    #[schemars(example = serde_json::json!({"ratio": 0.01, "particles": "20k"}))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dust: Option<DustInput>,
    /// Its materials by distance from its center.
    #[schemars(example = serde_json::json!([{"id": 402, "radius": 0.5}, {"id": 400}]))]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub material: Vec<MaterialLayer>,
    /// Degrees by which it is turned about its center of mass, about the axes x, y and z, in this order; in 2-D one number. Positions,
    /// velocities and other vectors turn; `velocity` and `spin` are along the axes of the scene.
    #[schemars(schema_with = "super::schema::one_or_many::<f64>", example = serde_json::json!([0, 0, 30]))]
    #[serde(skip_serializing_if = "Vec::is_empty", deserialize_with = "super::yaml::one_or_many_numbers")]
    pub orientation: Vec<f64>,
    /// Position of its center of mass; the origin by default.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub position: Vec<Quantity>,
    /// Velocity of the body as a whole, added to its own velocities.
    #[schemars(extend("x-unit" = "velocity"))]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub velocity: Vec<Quantity>,
    /// Angular velocity about the center of mass: three components, or one in 2-D.
    #[schemars(extend("x-unit" = "angular velocity"))]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub spin: Vec<Quantity>,
}

/// The orbit of two bodies about their center of mass, which is at rest in the origin; in the plane of x and y, counterclockwise.
///
/// Either an ellipse (`semi_major_axis`) or an encounter (`impact_parameter`).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OrbitInput {
    /// Semi-major axis of an elliptic orbit.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub semi_major_axis: Option<Quantity>,
    /// Eccentricity of an elliptic orbit, from 0 (a circle) to less than 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub eccentricity: f64,
    /// Time since the pericenter in units of the period.
    pub phase: f64,
    /// Whether both bodies rotate once per period, like a rigid body if the orbit is a circle.
    pub corotation: bool,
    /// Sine of the angle between the line of centers and the velocity when the bodies touch.
    #[schemars(example = 0.5)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub impact_parameter: Option<f64>,
    /// Relative speed when the bodies touch.
    #[schemars(extend("x-unit" = "velocity"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity_at_contact: Option<Quantity>,
    /// The same in units of the mutual escape velocity there.
    #[schemars(example = 1.0)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity_over_escape: Option<f64>,
    /// Relative speed at infinite distance.
    #[schemars(extend("x-unit" = "velocity"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity_at_infinity: Option<Quantity>,
    /// Initial distance between the centers.
    #[schemars(extend("x-unit" = "length"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distance: Option<Quantity>,
}

impl BodyInput {
    /// As messages name it; `index` counts from 0.
    pub fn title(&self, index: usize) -> String {
        self.name.clone().unwrap_or_else(|| (index + 1).to_string())
    }

    /// Radii of a point: names of their columns, keys and values.
    pub(crate) fn radii(&self) -> impl Iterator<Item = (&'static str, &'static str, &Quantity)> {
        let softening = (names::SOFTENING_RADIUS, "softening_radius", &self.softening_radius);
        let accretion = (names::ACCRETION_RADIUS, "accretion_radius", &self.accretion_radius);
        [softening, accretion].into_iter().filter_map(|(column, key, radius)| Some((column, key, radius.as_ref()?)))
    }

    /// Checks a body that is a point.
    pub(super) fn validate_point(&self, mass: &Quantity, title: &str) -> Result<()> {
        let key = |name: &str| format!("bodies[{title}].{name}");
        mass.check_positive(&key("point_mass"), UnitDimension::MASS)?;
        for (_, name, radius) in self.radii() {
            radius.check_positive(&key(name), UnitDimension::LENGTH)?;
        }
        let allowed = Self {
            name: self.name.clone(),
            point_mass: self.point_mass.clone(),
            softening_radius: self.softening_radius.clone(),
            accretion_radius: self.accretion_radius.clone(),
            part_type: self.part_type,
            position: self.position.clone(),
            velocity: self.velocity.clone(),
            ..Self::default()
        };
        if *self != allowed {
            let problem = "is that of a single particle, which has a name, radii, a type, a position and a velocity; leave the rest out";
            return Err(Error::scene(key("point_mass"), problem));
        }
        match self.part_type {
            Some(t) if !(1..=5).contains(&t) => {
                Err(Error::scene(key("type"), format!("is {t}, expected 1 to 5; 0 is gas")))
            }
            _ => Ok(()),
        }
    }
}

impl OrbitInput {
    /// Keys, values and dimensions of what has one.
    pub(super) fn quantities(&self) -> Vec<(&'static str, &Quantity, UnitDimension)> {
        let (length, speed) = (UnitDimension::LENGTH, UnitDimension::VELOCITY);
        [
            ("orbit.semi_major_axis", &self.semi_major_axis, length),
            ("orbit.velocity_at_contact", &self.velocity_at_contact, speed),
            ("orbit.velocity_at_infinity", &self.velocity_at_infinity, speed),
            ("orbit.distance", &self.distance, length),
        ]
        .into_iter()
        .filter_map(|(key, quantity, dimension)| Some((key, quantity.as_ref()?, dimension)))
        .collect()
    }

    pub(super) fn validate(&self) -> Result<()> {
        for (key, quantity, dimension) in self.quantities() {
            if key == "orbit.velocity_at_infinity" {
                quantity.check(key, dimension)?;
                if quantity.number() < 0.0 {
                    return Err(Error::scene(key, format!("is {quantity}, expected none below 0")));
                }
            } else {
                quantity.check_positive(key, dimension)?;
            }
        }
        if !(0.0..1.0).contains(&self.eccentricity) {
            let problem = format!("is {}, expected 0 to less than 1", self.eccentricity);
            return Err(Error::scene("orbit.eccentricity", problem));
        }
        if !self.phase.is_finite() {
            return Err(Error::scene("orbit.phase", format!("is {}, expected a fraction of the period", self.phase)));
        }
        let speeds = [
            self.velocity_at_contact.is_some(),
            self.velocity_over_escape.is_some(),
            self.velocity_at_infinity.is_some(),
        ];
        let speeds = speeds.into_iter().filter(|given| *given).count();
        match (&self.semi_major_axis, self.impact_parameter) {
            (Some(_), Some(_)) => {
                return Err(Error::scene("orbit", "has both a semi_major_axis and an impact_parameter; give one"));
            }
            (None, None) => {
                return Err(Error::scene("orbit", "has neither a semi_major_axis nor an impact_parameter; give one"));
            }
            (Some(_), None) if speeds > 0 || self.distance.is_some() => {
                let problem = "has a semi_major_axis, which settles velocities and distance; leave these out";
                return Err(Error::scene("orbit", problem));
            }
            (None, Some(_)) if self.eccentricity != 0.0 => {
                let problem = format!(
                    "is {} beside an impact_parameter, with which the velocity settles the orbit; leave one out",
                    self.eccentricity
                );
                return Err(Error::scene("orbit.eccentricity", problem));
            }
            (None, Some(b)) => {
                if !(0.0..=1.0).contains(&b) {
                    return Err(Error::scene(
                        "orbit.impact_parameter",
                        format!("is {b}, expected 0 (head-on) to 1 (grazing)"),
                    ));
                }
                if speeds != 1 {
                    let problem = format!(
                        "has {speeds} of velocity_at_contact, velocity_over_escape and velocity_at_infinity; expected one"
                    );
                    return Err(Error::scene("orbit", problem));
                }
                if let Some(v) = self.velocity_over_escape.filter(|v| !(v.is_finite() && *v >= 1.0)) {
                    let problem = format!("is {v}, expected at least 1: slower bodies come from no infinity");
                    return Err(Error::scene("orbit.velocity_over_escape", problem));
                }
                if self.distance.is_none() {
                    return Err(Error::scene("orbit.distance", "is missing: where the encounter begins"));
                }
                if self.corotation {
                    return Err(Error::scene("orbit.corotation", "means nothing in an encounter; leave it out"));
                }
            }
            _ => {}
        }
        Ok(())
    }
}

/// An error of one body's scene, with its name.
pub(crate) fn in_body(title: &str, error: Error) -> Error {
    match error {
        Error::Scene { key, problem } => Error::Scene { key: format!("bodies[{title}].{key}"), problem },
        Error::Field { name, problem } => Error::Field { name, problem: format!("{problem} (body {title})") },
        other => other,
    }
}
