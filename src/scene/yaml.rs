//! The text of a scene, and its errors in the user's terms: where they are, what is wrong, and what to write instead.

use crate::error::{Error, Result};
use serde::de::value::{SeqAccessDeserializer, StrDeserializer};
use serde::de::{self, DeserializeOwned, IntoDeserializer, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_saphyr::Error as YamlError;
use sph_formats::nearest;
use std::marker::PhantomData;

/// Reads a scene; `name` is what messages call it, and `elsewhere` says where a key belongs that is not known where it stands.
///
/// # Errors
/// [`Error::Scene`] with line and column.
pub(super) fn parse<T: DeserializeOwned>(text: &str, name: &str, elsewhere: &dyn Fn(&str) -> Vec<String>) -> Result<T> {
    deserialized(text).map_err(|error| {
        let error = error.without_snippet();
        let problem = describe(error, elsewhere);
        match error.location().filter(|place| place.line() > 0) {
            Some(place) => {
                let (line, column) = (place.line(), place.column());
                let wants_keys =
                    matches!(error, YamlError::Unexpected { expected, .. } if *expected == "mapping start");
                let hint = wants_keys.then(|| file_hint(text, line, column)).flatten().unwrap_or_default();
                let shown = quoted(text, line, column);
                Error::scene(format!("{name}, line {line}, column {column}"), format!("{problem}{hint}{shown}"))
            }
            None => Error::scene(name, problem),
        }
    })
}

/// With `y` for what it is, as in `[x, y, z]`, where `yes`, `on` and such are not needed for true and false.
fn deserialized<T: DeserializeOwned>(text: &str) -> std::result::Result<T, YamlError> {
    let strict = serde_saphyr::options! { strict_booleans: true };
    match serde_saphyr::from_str_with_options(text, strict) {
        Err(error) if matches!(error.without_snippet(), YamlError::InvalidBooleanStrict { .. }) => {
            serde_saphyr::from_str(text).map_err(|_| error)
        }
        parsed => parsed,
    }
}

/// The keys that are known where the text has one that is not, in the order in which they are declared.
pub(super) fn known_keys<T: DeserializeOwned>(text: &str) -> Vec<String> {
    match serde_saphyr::from_str::<T>(text).err().as_ref().map(YamlError::without_snippet) {
        Some(YamlError::SerdeUnknownField { expected, .. }) => expected.iter().map(|k| (*k).to_owned()).collect(),
        Some(YamlError::SerdeUnknownVariant { expected, .. }) => expected.iter().map(|k| (*k).to_owned()).collect(),
        _ => Vec::new(),
    }
}

/// The line, with a mark below the column.
fn quoted(text: &str, line: u64, column: u64) -> String {
    let found = usize::try_from(line.saturating_sub(1)).ok().and_then(|at| text.lines().nth(at));
    let Some(found) = found.filter(|l| l.chars().count() <= 200) else { return String::new() };
    let margin = format!("{line:>5} | ");
    let gap: String =
        found.chars().take(column.saturating_sub(1) as usize).map(|c| if c == '\t' { c } else { ' ' }).collect();
    format!("\n{margin}{found}\n{:>width$}{gap}^", "| ", width = margin.len())
}

/// Keys of files, by name.
const WITH_FILES: [&str; 5] = ["input", "output", "resolution", "checkpoint", "surface"];

/// What to write where the name of a file stands in the place of keys.
fn file_hint(text: &str, line: u64, column: u64) -> Option<String> {
    let line = text.lines().nth(usize::try_from(line).ok()?.checked_sub(1)?)?;
    let (at, _) = line.char_indices().nth(usize::try_from(column).ok()?.checked_sub(1)?)?;
    let (before, value) = line.split_at(at);
    let quotes = ['"', '\''];
    let key = before.trim_end().strip_suffix(':')?.rsplit([' ', '{', ',']).next()?.trim_matches(quotes);
    let name = value.split(" #").next()?.split([',', '}']).next()?.trim().trim_matches(quotes);
    let is_name =
        name.chars().any(char::is_alphabetic) && name.chars().all(|c| c.is_alphanumeric() || "._-+/\\".contains(c));
    (WITH_FILES.contains(&key) && is_name).then(|| format!("; for a file write `{key}: {{file: {name}}}`"))
}

fn describe(error: &YamlError, elsewhere: &dyn Fn(&str) -> Vec<String>) -> String {
    let one_of = |what: &str, word: &str, known: &[&'static str], places: &[String]| {
        let hint = match (nearest(word, known.iter().copied()), places) {
            (Some(near), _) => format!("; did you mean '{near}'?"),
            (None, []) => String::new(),
            (None, places) => format!("; did you mean {}?", places.join(" or ")),
        };
        let known = known.join(", ");
        if hint.is_empty() {
            format!("{what}; expected one of {known}")
        } else {
            format!("{what}{hint} Known are {known}")
        }
    };
    match error {
        YamlError::SerdeUnknownField { field, expected, .. } => {
            let places: Vec<String> = elsewhere(field)
                .iter()
                .map(|path| format!("'{path}'{}", if path.contains('.') { "" } else { " at the top of the scene" }))
                .collect();
            one_of(&format!("there is no key '{field}' here"), field, expected, &places)
        }
        YamlError::SerdeUnknownVariant { variant, expected, .. } => {
            one_of(&format!("'{variant}' is no choice here"), variant, expected, &[])
        }
        YamlError::SerdeMissingField { field, .. } => format!("the key '{field}' is missing"),
        YamlError::DuplicateMappingKey { key: Some(key), .. } => format!("the key '{key}' comes twice; keep one"),
        YamlError::Unexpected { expected, .. } => match *expected {
            "sequence start" => "expected a list, as in [1, 2, 3]".to_owned(),
            "mapping start" => "expected keys with values, as in {key: value}".to_owned(),
            "string scalar" => "expected one word or text".to_owned(),
            "scalar" => "expected one value".to_owned(),
            other => format!("expected {other}"),
        },
        YamlError::InvalidScalar { ty, .. } => match *ty {
            "u64" | "u32" | "u8" | "usize" => "expected a whole number, at least 0".to_owned(),
            "i64" | "i32" => "expected a whole number".to_owned(),
            "f64" | "f32" | "floating point" => "expected a number".to_owned(),
            "bool" | "boolean" => "expected true or false".to_owned(),
            other => format!("expected a value of type {other}"),
        },
        YamlError::InvalidBooleanStrict { .. } => "expected true or false".to_owned(),
        YamlError::SerdeInvalidType { unexpected, expected, .. }
        | YamlError::SerdeInvalidValue { unexpected, expected, .. } => {
            format!("found {unexpected}, expected {expected}")
        }
        YamlError::SerdeInvalidLength { len, expected, .. } => format!("found {len} values, expected {expected}"),
        YamlError::Eof { .. } => "the scene is empty, or ends where a value is expected".to_owned(),
        YamlError::MultipleDocuments { .. } => "a second document begins here (---); expected one scene".to_owned(),
        YamlError::NonFiniteFloat { value, .. } => format!("is {value}, expected a finite number"),
        YamlError::Message { msg, .. } => msg.clone(),
        other => {
            // The place is said already.
            let text = other.to_string();
            let rest = text.split_once(": ").filter(|(place, _)| place.contains("line"));
            let rest = rest.map_or(text.as_str(), |(_, rest)| rest);
            let rest = rest.split(" at line ").next().unwrap_or(rest);
            if rest.contains("did not find expected key") {
                "this line does not belong where it stands: check its indentation against the lines above".into()
            } else if rest.contains("tagged enum") {
                "expected one word, or one key with its values; `sph-prep help scene` and the path of a key list the choices".into()
            } else {
                rest.to_owned()
            }
        }
    }
}

/// One choice as a plain word, or a list of them.
pub(super) fn one_or_many<'de, D, T>(deserializer: D) -> std::result::Result<Vec<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    struct OneOrMany<T>(PhantomData<T>);
    impl<'de, T: Deserialize<'de>> Visitor<'de> for OneOrMany<T> {
        type Value = Vec<T>;

        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("one word, or a list of one for each axis")
        }

        fn visit_str<E: de::Error>(self, word: &str) -> std::result::Result<Self::Value, E> {
            let one: StrDeserializer<'_, E> = word.into_deserializer();
            T::deserialize(one).map(|name| vec![name])
        }

        fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> std::result::Result<Self::Value, A::Error> {
            Vec::deserialize(SeqAccessDeserializer::new(list))
        }
    }
    deserializer.deserialize_any(OneOrMany(PhantomData))
}

/// One number, or a list of them.
pub(super) fn one_or_many_numbers<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> std::result::Result<Vec<f64>, D::Error> {
    struct Numbers;
    impl<'de> Visitor<'de> for Numbers {
        type Value = Vec<f64>;

        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("a number, or a list of one for each axis")
        }

        fn visit_f64<E: de::Error>(self, v: f64) -> std::result::Result<Self::Value, E> {
            Ok(vec![v])
        }

        fn visit_i64<E: de::Error>(self, v: i64) -> std::result::Result<Self::Value, E> {
            Ok(vec![v as f64])
        }

        fn visit_u64<E: de::Error>(self, v: u64) -> std::result::Result<Self::Value, E> {
            Ok(vec![v as f64])
        }

        fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> std::result::Result<Self::Value, A::Error> {
            Vec::deserialize(SeqAccessDeserializer::new(list))
        }
    }
    deserializer.deserialize_any(Numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_name_of_a_file_is_not_taken_for_one() {
        for (text, column) in [("input: 1 + x", 8), ("input: 3", 8), ("input: [star.nc]", 8), ("domain: star.nc", 9)] {
            assert_eq!(file_hint(text, 1, column), None, "{text}");
        }
    }
}
