//! A key that is switched on, with or without keys of its own, or off; if it is left out, the plan decides.

use super::schema;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::marker::PhantomData;

/// A section that may be stated as `true`, `false`, or its keys.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Switch<T> {
    /// The plan decides.
    #[default]
    Unset,
    /// Not even where it would be chosen.
    Off,
    On(T),
}

impl<T> Switch<T> {
    /// The section, where it is on.
    pub fn on(&self) -> Option<&T> {
        match self {
            Self::On(section) => Some(section),
            Self::Unset | Self::Off => None,
        }
    }

    /// The same, to be changed.
    pub fn on_mut(&mut self) -> Option<&mut T> {
        match self {
            Self::On(section) => Some(section),
            Self::Unset | Self::Off => None,
        }
    }

    pub fn is_on(&self) -> bool {
        matches!(self, Self::On(_))
    }

    pub fn is_off(&self) -> bool {
        matches!(self, Self::Off)
    }

    pub fn is_unset(&self) -> bool {
        matches!(self, Self::Unset)
    }

    /// This one, or the other where nothing is said.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        if self.is_unset() { other } else { self }
    }
}

impl<T: Serialize> Serialize for Switch<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Unset => serializer.serialize_none(),
            Self::Off => serializer.serialize_bool(false),
            Self::On(section) => section.serialize(serializer),
        }
    }
}

impl<'de, T: Deserialize<'de> + Default> Deserialize<'de> for Switch<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        switch(deserializer)
    }
}

impl<T: JsonSchema> JsonSchema for Switch<T> {
    fn schema_name() -> Cow<'static, str> {
        format!("Switch_{}", T::schema_name()).into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        schema::switch_or_keys::<T>(generator)
    }
}

/// The keys of a section that `true` switches on and `false` does not.
pub(super) fn switch_or_keys<'de, D, T>(deserializer: D) -> std::result::Result<Option<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de> + Default,
{
    Ok(match switch(deserializer)? {
        Switch::On(section) => Some(section),
        Switch::Unset | Switch::Off => None,
    })
}

/// `true`, `false`, or the keys of a section.
pub(super) fn switch<'de, D, T>(deserializer: D) -> std::result::Result<Switch<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de> + Default,
{
    struct SwitchOrKeys<T>(PhantomData<T>);
    impl<'de, T: Deserialize<'de> + Default> Visitor<'de> for SwitchOrKeys<T> {
        type Value = Switch<T>;

        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("true, false, or keys as in {evaluations: 200}")
        }

        fn visit_bool<E: de::Error>(self, on: bool) -> std::result::Result<Self::Value, E> {
            Ok(if on { Switch::On(T::default()) } else { Switch::Off })
        }

        fn visit_str<E: de::Error>(self, word: &str) -> std::result::Result<Self::Value, E> {
            match word.to_ascii_lowercase().as_str() {
                "yes" | "on" => self.visit_bool(true),
                "no" | "off" => self.visit_bool(false),
                _ => Err(E::invalid_type(de::Unexpected::Str(word), &self)),
            }
        }

        fn visit_unit<E: de::Error>(self) -> std::result::Result<Self::Value, E> {
            Ok(Switch::Unset)
        }

        fn visit_map<A: MapAccess<'de>>(self, keys: A) -> std::result::Result<Self::Value, A::Error> {
            T::deserialize(MapAccessDeserializer::new(keys)).map(Switch::On)
        }
    }
    deserializer.deserialize_any(SwitchOrKeys(PhantomData))
}
