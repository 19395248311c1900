//! Counts of a scene as people write them: `100000`, `1e5`, `100_000`, `100k`, `2M`.

use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer};

/// Reads a count.
///
/// # Errors
/// What it is not: a number, whole, or small enough.
pub fn parse_count(text: &str) -> Result<usize, String> {
    let plain = text.trim().replace('_', "");
    // As an exponent, so that 2.3k is 2300 and not a rounding error less.
    let powers = [('k', "e3"), ('K', "e3"), ('M', "e6"), ('G', "e9")];
    let power = powers.iter().find_map(|(letter, power)| Some([plain.strip_suffix(*letter)?, power].concat()));
    let number =
        power.unwrap_or(plain).parse().map_err(|_| format!("'{text}' is no number; write 100000, 1e5 or 100k"))?;
    whole(number)
}

/// Past this f64 does not hold every whole number.
const LARGEST: f64 = 9_007_199_254_740_992.0;

fn whole(number: f64) -> Result<usize, String> {
    if number >= 0.0 && number.fract() == 0.0 && number <= LARGEST {
        Ok(number as usize)
    } else {
        Err(format!("{number} is no count; expected a whole number, at least 0"))
    }
}

struct Count(usize);

impl<'de> Deserialize<'de> for Count {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(CountVisitor).map(Count)
    }
}

struct CountVisitor;

impl Visitor<'_> for CountVisitor {
    type Value = usize;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a whole number such as 100000, 1e5 or 100k")
    }

    fn visit_u64<E: de::Error>(self, v: u64) -> Result<usize, E> {
        usize::try_from(v).map_err(E::custom)
    }

    fn visit_i64<E: de::Error>(self, v: i64) -> Result<usize, E> {
        usize::try_from(v).map_err(|_| E::custom(format!("{v} is no count; expected a whole number, at least 0")))
    }

    fn visit_f64<E: de::Error>(self, v: f64) -> Result<usize, E> {
        whole(v).map_err(E::custom)
    }

    fn visit_str<E: de::Error>(self, v: &str) -> Result<usize, E> {
        parse_count(v).map_err(E::custom)
    }
}

/// For `#[serde(deserialize_with)]` of a count.
pub(super) fn count<'de, D: Deserializer<'de>>(deserializer: D) -> Result<usize, D::Error> {
    Count::deserialize(deserializer).map(|c| c.0)
}

/// For `#[serde(deserialize_with)]` of a count that may be left out.
pub(super) fn optional_count<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<usize>, D::Error> {
    Option::<Count>::deserialize(deserializer).map(|c| c.map(|c| c.0))
}

#[cfg(test)]
mod tests {
    use super::parse_count;

    #[test]
    fn counts_are_read_as_people_write_them() {
        for (text, count) in [("100_000", 100_000), ("1e5", 100_000), ("0.1M", 100_000), ("2.3k", 2300)] {
            assert_eq!(parse_count(text), Ok(count), "{text}");
        }
        for text in ["1.5", "-3", "many", "1e30", "k", "", "nan", "1kk"] {
            assert!(parse_count(text).is_err(), "{text}");
        }
    }
}
