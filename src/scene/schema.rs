//! Schemas of keys that can be written in several ways; all other schemas follow from the types and their comments.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, forward_to_deserialize_any};
use serde_json::{Map, Value};
use sph::kernel::KernelName;

/// By what a schema notes the other names of a key or a choice, until [`with_aliases`] writes them out.
pub(super) const ALIASES: &str = "x-aliases";

/// The names that a schema notes.
pub(super) fn aliases(schema: &Value) -> Vec<String> {
    let names = schema[ALIASES].as_array().into_iter().flatten();
    names.filter_map(Value::as_str).map(str::to_owned).collect()
}

/// Writes out the other names that schemas note: as keys beside the first, and as alternatives beside the first.
pub(super) fn with_aliases(schema: &mut Value) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(with_aliases),
        Value::Object(words) => {
            if let Some(Value::Object(keys)) = words.get_mut("properties") {
                add_keys(keys);
            }
            if let Some(Value::Array(all)) = words.get_mut("oneOf") {
                let more: Vec<Value> = all.iter().flat_map(other_choices).collect();
                all.extend(more);
            }
            words.remove(ALIASES);
            words.values_mut().for_each(with_aliases);
        }
        _ => {}
    }
}

fn add_keys(keys: &mut Map<String, Value>) {
    let mut more = Vec::new();
    for (name, schema) in keys.iter() {
        for alias in aliases(schema) {
            let mut other = schema.clone();
            other["description"] = Value::String(format!("Another name of `{name}`."));
            more.push((alias, other));
        }
    }
    keys.extend(more);
}

/// A choice, a word or a key with its value, under its other names.
fn other_choices(choice: &Value) -> Vec<Value> {
    let renamed = |alias: String| {
        let mut other = choice.clone();
        if other.get("const").is_some() {
            other["const"] = Value::String(alias);
            return other;
        }
        let name = choice["required"][0].as_str().unwrap_or("").to_owned();
        if let Some(value) = other["properties"].as_object_mut().and_then(|p| p.remove(&name)) {
            other["properties"][&alias] = value;
            other["required"] = Value::Array(vec![Value::String(alias)]);
        }
        // They are of the first name.
        other.as_object_mut().map(|words| words.remove("examples"));
        other
    };
    aliases(choice).into_iter().map(renamed).collect()
}

/// A number, perhaps with a unit.
pub(super) const NUMBER: &str = "^ *[+-]?([0-9]|\\.[0-9]|\\.?inf|\\.?nan)";
/// A whole number, perhaps with an exponent or k, M or G behind it.
const COUNT: &str = "^ *[0-9][0-9_]*(\\.[0-9]+)?([eE]\\+?[0-9]+|[kKMG])? *$";

/// A count as people write it.
pub(super) fn count(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "anyOf": [{ "type": "number", "minimum": 0, "multipleOf": 1 }, { "type": "string", "pattern": COUNT }] })
}

/// A count that may be left out.
pub(super) fn optional_count(_: &mut SchemaGenerator) -> Schema {
    json_schema!({
        "anyOf": [{ "type": "number", "minimum": 0, "multipleOf": 1 }, { "type": "string", "pattern": COUNT }, { "type": "null" }]
    })
}

/// A kernel that may be left out.
pub(super) fn optional_kernel(_: &mut SchemaGenerator) -> Schema {
    let names: Vec<&str> = KernelName::ALL.iter().map(|k| k.name()).collect();
    json_schema!({ "anyOf": [{ "type": "string", "enum": names }, { "type": "null" }] })
}

/// One word, or one for each axis.
pub(super) fn one_or_many<T: JsonSchema>(generator: &mut SchemaGenerator) -> Schema {
    let one = generator.subschema_for::<T>();
    json_schema!({ "anyOf": [one, { "type": "array", "items": one }] })
}

/// `true`, `false`, or the keys of the section.
pub(super) fn switch_or_keys<T: JsonSchema>(generator: &mut SchemaGenerator) -> Schema {
    let keys = generator.subschema_for::<T>();
    json_schema!({ "anyOf": [{ "type": "boolean" }, keys, { "type": "null" }] })
}

/// One of the words of an enumeration that says no more of itself.
pub(super) fn choice<T: for<'de> Deserialize<'de>>(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "type": "string", "enum": words::<T>() })
}

/// The words of an enumeration, as it asks for them when it is read.
fn words<T: for<'de> Deserialize<'de>>() -> Vec<&'static str> {
    T::deserialize(Asked).err().map(|words| words.0).unwrap_or_default()
}

/// Reads nothing, and fails with the words that were asked for.
struct Asked;

#[derive(Debug)]
struct Words(Vec<&'static str>);

impl std::fmt::Display for Words {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0.join(", "))
    }
}

impl std::error::Error for Words {}

impl de::Error for Words {
    fn custom<T: std::fmt::Display>(_: T) -> Self {
        Self(Vec::new())
    }
}

impl<'de> Deserializer<'de> for Asked {
    type Error = Words;

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        words: &'static [&'static str],
        _: V,
    ) -> Result<V::Value, Words> {
        Err(Words(words.to_vec()))
    }

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Words> {
        Err(Words(Vec::new()))
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map struct identifier ignored_any
    }
}
