//! The point of the result that is placed at the origin.

use super::{Quantity, check_all};
use crate::error::{Error, Result};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::{SeqAccessDeserializer, StrDeserializer};
use serde::de::{self, IntoDeserializer, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use sph_formats::UnitDimension;
use std::borrow::Cow;

/// Points that have a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OriginName {
    /// The lower corner of the box, in whose middle a body in vacuum is.
    Corner,
    /// The middle of the box.
    Center,
    /// The center of mass of the particles, without walls.
    CenterOfMass,
    /// That of the input: coordinates stay what they are there.
    Input,
}

/// A point that has a name, or one in the coordinates of the input.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum OriginInput {
    Named(OriginName),
    Point(Vec<Quantity>),
}

impl OriginInput {
    pub(super) fn validate(&self) -> Result<()> {
        let Self::Point(point) = self else { return Ok(()) };
        if !(1..=3).contains(&point.len()) {
            let problem = format!("has {} coordinates, expected one for each dimension", point.len());
            return Err(Error::scene("output.origin", problem));
        }
        check_all("output.origin", point, UnitDimension::LENGTH)
    }
}

impl std::fmt::Display for OriginInput {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Named(OriginName::Corner) => f.write_str("corner"),
            Self::Named(OriginName::Center) => f.write_str("center"),
            Self::Named(OriginName::CenterOfMass) => f.write_str("center-of-mass"),
            Self::Named(OriginName::Input) => f.write_str("input"),
            Self::Point(point) => {
                let point: Vec<String> = point.iter().map(Quantity::to_string).collect();
                write!(f, "[{}]", point.join(", "))
            }
        }
    }
}

impl<'de> Deserialize<'de> for OriginInput {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        deserializer.deserialize_any(NameOrPoint)
    }
}

struct NameOrPoint;

impl<'de> Visitor<'de> for NameOrPoint {
    type Value = OriginInput;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("corner, center, center-of-mass, input, or a point as in [0.5, 0.5, 0.5]")
    }

    fn visit_str<E: de::Error>(self, word: &str) -> std::result::Result<Self::Value, E> {
        let word: StrDeserializer<'_, E> = word.into_deserializer();
        OriginName::deserialize(word).map(OriginInput::Named)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> std::result::Result<Self::Value, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(list)).map(OriginInput::Point)
    }
}

impl JsonSchema for OriginInput {
    fn schema_name() -> Cow<'static, str> {
        "OriginInput".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let (name, number) = (generator.subschema_for::<OriginName>(), generator.subschema_for::<Quantity>());
        json_schema!({
            "description": "A point that has a name, or one in the coordinates of the input.",
            "anyOf": [name, { "type": "array", "items": number, "minItems": 1, "maxItems": 3 }]
        })
    }
}
