//! Numbers with a physical dimension: `1.5`, `1 Rsun`, `30 km/s`, `5e5 K`.
//!
//! A plain number is in the scene's `units`, which by default are those of the input. The rule is the same for every key.

use super::schema::NUMBER;
use crate::error::{Error, Result};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use sph_formats::{Unit, UnitDimension, UnitSystem};
use std::borrow::Cow;

/// A number, with its unit where one is written.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Quantity {
    /// In the scene's units.
    Plain(f64),
    /// As written; [`Quantity::check`] says whether it can be read.
    Text(String),
}

impl Default for Quantity {
    fn default() -> Self {
        Self::Plain(0.0)
    }
}

impl From<f64> for Quantity {
    fn from(number: f64) -> Self {
        Self::Plain(number)
    }
}

impl std::fmt::Display for Quantity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Plain(number) => write!(f, "{number}"),
            Self::Text(text) => write!(f, "'{text}'"),
        }
    }
}

impl<'de> Deserialize<'de> for Quantity {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        deserializer.deserialize_any(AnyNumber)
    }
}

struct AnyNumber;

impl Visitor<'_> for AnyNumber {
    type Value = Quantity;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a number, or a number with its unit such as '1 Rsun' or '30 km/s'")
    }

    fn visit_f64<E: de::Error>(self, v: f64) -> std::result::Result<Quantity, E> {
        Ok(Quantity::Plain(v))
    }

    fn visit_i64<E: de::Error>(self, v: i64) -> std::result::Result<Quantity, E> {
        Ok(Quantity::Plain(v as f64))
    }

    fn visit_u64<E: de::Error>(self, v: u64) -> std::result::Result<Quantity, E> {
        Ok(Quantity::Plain(v as f64))
    }

    fn visit_str<E: de::Error>(self, v: &str) -> std::result::Result<Quantity, E> {
        let text = v.trim();
        Ok(text.parse().map_or_else(|_| Quantity::Text(text.to_owned()), Quantity::Plain))
    }
}

impl JsonSchema for Quantity {
    fn schema_name() -> Cow<'static, str> {
        "Quantity".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A number in the scene's units, or a number with its unit, such as '1 Rsun' or '30 km/s'.",
            "anyOf": [{ "type": "number" }, { "type": "string", "pattern": NUMBER }]
        })
    }
}

/// What is wrong with a plain number beside others that have units.
pub(crate) fn beside_units(key: impl Into<String>, quantity: &Quantity) -> Error {
    let problem =
        format!("is {quantity} beside numbers with units; write its unit, or state `units`, as in `units: solar`");
    Error::scene(key, problem)
}

/// From what a scene's plain numbers are in to the units that somebody needs them in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conversion {
    /// What plain numbers are in; `None` where nobody has said it, so that they stay as they are.
    pub from: Option<UnitSystem>,
    pub to: UnitSystem,
    /// Whether nobody has said what plain numbers are in, although others have units: they are refused.
    pub is_unsaid: bool,
}

impl Conversion {
    /// Plain numbers as they are; numbers with units are refused.
    pub const NONE: Self = Self::new(None, UnitSystem::CODE);

    /// Of plain numbers that have these units.
    pub const fn new(from: Option<UnitSystem>, to: UnitSystem) -> Self {
        Self { from, to, is_unsaid: false }
    }

    /// By what a plain number of `dimension` is multiplied.
    pub fn factor(&self, dimension: UnitDimension) -> f64 {
        self.from.map_or(1.0, |from| from.to_cgs(dimension) / self.to.to_cgs(dimension))
    }
}

impl Quantity {
    /// What its unit measures; `None` where it is no number before the name of a known unit, such as `2.5`, `2*pi` or `1/s`.
    pub(crate) fn dimension(&self) -> Option<UnitDimension> {
        let Self::Text(text) = self else { return None };
        let (_, unit) = split(text).filter(|(_, unit)| unit.starts_with(char::is_alphabetic))?;
        Some(Unit::parse(unit)?.dimension)
    }

    /// The number before the unit, which has the sign of the quantity; NaN where there is none.
    pub fn number(&self) -> f64 {
        match self {
            Self::Plain(number) => *number,
            Self::Text(text) => split(text).map_or(f64::NAN, |(number, _)| number),
        }
    }

    /// The quantity in the units of `conversion.to`; `key` is where it stands in the scene.
    ///
    /// # Errors
    /// [`Error::Scene`] as for [`Quantity::check`], and for a unit in a scene whose plain numbers have none.
    pub fn value(&self, key: &str, dimension: UnitDimension, conversion: &Conversion) -> Result<f64> {
        let Some((number, unit)) = self.parsed(key, dimension)? else {
            // None of something is none in any unit.
            if conversion.is_unsaid && self.number() != 0.0 && dimension != UnitDimension::NONE {
                return Err(beside_units(key, self));
            }
            return Ok(self.number() * conversion.factor(dimension));
        };
        if conversion.from.is_none() {
            let problem = format!(
                "is {self}, but the input states no units that it could be converted to; state what its numbers are in, as in `units: solar` \
                 (cgs, si, solar, planetary, galactic), or leave the unit out"
            );
            return Err(Error::scene(key, problem));
        }
        Ok(number * (unit.to_cgs / conversion.to.to_cgs(dimension)))
    }

    /// Whether the number is finite, and its unit, if there is one, a unit of `dimension`.
    ///
    /// # Errors
    /// [`Error::Scene`] with the key, the value, and the units of that dimension.
    pub fn check(&self, key: &str, dimension: UnitDimension) -> Result<()> {
        self.parsed(key, dimension).map(|_| ())
    }

    /// [`Quantity::check`], and whether it is more than 0.
    ///
    /// # Errors
    /// As for [`Quantity::check`].
    pub fn check_positive(&self, key: &str, dimension: UnitDimension) -> Result<()> {
        self.check(key, dimension)?;
        match self.number() > 0.0 {
            true => Ok(()),
            false => Err(Error::scene(key, format!("is {self}, expected {} of more than 0", named(dimension)))),
        }
    }

    fn parsed(&self, key: &str, dimension: UnitDimension) -> Result<Option<(f64, Unit)>> {
        let Self::Text(text) = self else {
            return match self.number().is_finite() {
                true => Ok(None),
                false => Err(Error::scene(key, format!("is {self}, expected a finite number"))),
            };
        };
        let expected = || {
            let known = Unit::known(dimension);
            let examples = if known.is_empty() { String::new() } else { format!(" (units: {})", known.join(", ")) };
            format!("expected {} such as {}{examples}", named(dimension), example(dimension))
        };
        let Some((number, symbol)) = split(text) else {
            return Err(Error::scene(key, format!("is '{text}', {}", expected())));
        };
        if !number.is_finite() {
            return Err(Error::scene(key, format!("is '{text}', expected a finite number")));
        }
        let Some(unit) = Unit::parse(symbol) else {
            let better = Unit::nearest(symbol).filter(|s| Unit::parse(s).is_some_and(|u| u.dimension == dimension));
            let hint = better.map_or_else(String::new, |s| format!("; did you mean '{number} {s}'?"));
            return Err(Error::scene(
                key,
                format!("is '{text}', whose unit '{symbol}' is not known: {}{hint}", expected()),
            ));
        };
        if unit.dimension != dimension {
            let what = unit.dimension.name().map_or_else(String::new, |name| format!(" which is {name},"));
            return Err(Error::scene(key, format!("is '{text}',{what} {}", expected())));
        }
        Ok(Some((number, unit)))
    }
}

/// The values of several in the units of `conversion.to`.
///
/// # Errors
/// As for [`Quantity::value`], with the index in the key.
pub fn values(
    key: &str,
    quantities: &[Quantity],
    dimension: UnitDimension,
    conversion: &Conversion,
) -> Result<Vec<f64>> {
    let one = |(i, q): (usize, &Quantity)| q.value(&format!("{key}[{i}]"), dimension, conversion);
    quantities.iter().enumerate().map(one).collect()
}

/// The values of a vector, with as many components as there are dimensions; 0 where there are none.
///
/// # Errors
/// As for [`values`], and for another number of components.
pub(crate) fn vector<const D: usize>(
    key: &str,
    quantities: &[Quantity],
    dimension: UnitDimension,
    conversion: &Conversion,
) -> Result<[f64; D]> {
    match values(key, quantities, dimension, conversion)?.as_slice() {
        [] => Ok([0.0; D]),
        all if all.len() == D => Ok(sph::array(|k| all[k])),
        all => Err(Error::scene(key, format!("has {} coordinates, expected {D}", all.len()))),
    }
}

/// [`Quantity::check`] of several.
///
/// # Errors
/// As for [`Quantity::check`], with the index in the key.
pub fn check_all(key: &str, quantities: &[Quantity], dimension: UnitDimension) -> Result<()> {
    quantities.iter().enumerate().try_for_each(|(i, q)| q.check(&format!("{key}[{i}]"), dimension))
}

/// `1.5e3 km/s` and `30km/s` into number and unit; `None` where either is missing.
fn split(text: &str) -> Option<(f64, &str)> {
    let parse = |head: &str| head.trim_end().replace('_', "").parse::<f64>().ok();
    // The longest head that is a number, so that the e of `1e5 cm` is taken for an exponent.
    let ends = text.char_indices().map(|(i, _)| i).skip(1).take(40).collect::<Vec<_>>();
    let (end, number) = ends.into_iter().rev().find_map(|end| Some((end, parse(text.get(..end)?)?)))?;
    let unit = text.get(end..)?.trim();
    (!unit.is_empty() && text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))).then_some((number, unit))
}

fn named(dimension: UnitDimension) -> &'static str {
    dimension.name().unwrap_or("a number")
}

/// An example of what the schema calls so; `None` for what is a plain number.
pub(super) fn example_of(unit: &str) -> Option<String> {
    let dimension = match unit {
        "length" => UnitDimension::LENGTH,
        "mass" => UnitDimension::MASS,
        "time" => UnitDimension::TIME,
        "velocity" => UnitDimension::VELOCITY,
        "angular velocity" => UnitDimension::RATE,
        "specific energy" => UnitDimension::SPECIFIC_ENERGY,
        "pressure" => UnitDimension::PRESSURE,
        "density" => UnitDimension::mass_density(3),
        "temperature" => UnitDimension::TEMPERATURE,
        _ => return None,
    };
    Some(example(dimension).trim_matches('\'').to_owned())
}

fn example(dimension: UnitDimension) -> String {
    let usual = match dimension {
        UnitDimension::LENGTH => "1 Rsun",
        UnitDimension::MASS => "1 Msun",
        UnitDimension::TIME => "1 Myr",
        UnitDimension::VELOCITY => "30 km/s",
        UnitDimension::TEMPERATURE => "5e5 K",
        UnitDimension::RATE => "2 rad/day",
        UnitDimension::MAGNETIC_FIELD => "1e-6 G",
        other => match Unit::known(other).first() {
            Some(unit) => return format!("'1 {unit}'"),
            None => return "1".into(),
        },
    };
    format!("'{usual}'")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Quantity {
        serde_saphyr::from_str(text).unwrap()
    }

    fn solar() -> Conversion {
        Conversion::new(Some(UnitSystem::solar()), UnitSystem::solar())
    }

    #[test]
    fn numbers_with_and_without_units_are_read_in_every_spelling() {
        let cgs = Conversion::new(Some(UnitSystem::solar()), UnitSystem::cgs());
        let (l, v, t) = (UnitDimension::LENGTH, UnitDimension::VELOCITY, UnitDimension::TEMPERATURE);
        for (text, dimension, expected) in [
            ("1", l, 6.957e10),
            ("'2.5'", l, 2.5 * 6.957e10),
            ("1 Rsun", l, 6.957e10),
            ("'1 Rsun'", l, 6.957e10),
            ("1e-3 pc", l, 3.085_677_581_491_367_3e15),
            ("100km", l, 1e7),
            ("1_000 km", l, 1e8),
            ("-30 km/s", v, -3e6),
            ("30km s^-1", v, 3e6),
            ("5e5 K", t, 5e5),
            ("3 au", l, 3.0 * 1.495_978_707e13),
            ("1e5", UnitDimension::NONE, 1e5),
        ] {
            let found = parse(text).value("key", dimension, &cgs).unwrap();
            assert!((found / expected - 1.0).abs() < 1e-14, "{text}: {found:e}, expected {expected:e}");
        }
    }

    #[test]
    fn a_plain_number_in_the_units_it_is_needed_in_keeps_its_bits() {
        for number in [0.1, 1.0 / 3.0, 1e-300, 7e22] {
            let found = Quantity::Plain(number).value("key", UnitDimension::VELOCITY, &solar()).unwrap();
            assert_eq!(found.to_bits(), number.to_bits());
            let found = Quantity::Plain(number).value("key", UnitDimension::VELOCITY, &Conversion::NONE).unwrap();
            assert_eq!(found.to_bits(), number.to_bits());
        }
    }

    #[test]
    fn velocities_follow_the_units_of_length_and_time() {
        let to = UnitSystem::galactic();
        let found = parse("220 km/s").value("key", UnitDimension::VELOCITY, &Conversion::new(Some(to), to)).unwrap();
        assert!((found - 220.0).abs() < 1e-10, "{found}");
    }

    #[test]
    fn what_is_no_such_quantity_is_refused_with_key_value_units_and_a_guess() {
        for (text, dimension, parts) in [
            ("1 Rsn", UnitDimension::LENGTH, &["'1 Rsn'", "'Rsn' is not known", "kpc", "did you mean '1 Rsun'"][..]),
            ("30 Km/s", UnitDimension::VELOCITY, &["did you mean '30 km/s'"]),
            ("30 km/s", UnitDimension::LENGTH, &["which is a velocity", "expected a length such as '1 Rsun'", "au"]),
            ("large", UnitDimension::LENGTH, &["is 'large'", "expected a length"]),
            ("'Rsun'", UnitDimension::LENGTH, &["is 'Rsun'", "expected a length"]),
            ("1 furlong", UnitDimension::LENGTH, &["'furlong' is not known"]),
            (".nan", UnitDimension::LENGTH, &["is NaN", "finite"]),
            ("1e999 km", UnitDimension::LENGTH, &["finite"]),
            ("", UnitDimension::LENGTH, &["expected a length"]),
            ("'1 km '' x'", UnitDimension::LENGTH, &["not known"]),
        ] {
            let Ok(quantity) = serde_saphyr::from_str::<Quantity>(text) else { continue };
            let error = quantity.check("domain.ball.radius", dimension).unwrap_err().to_string();
            for part in parts.iter().chain(&["scene, domain.ball.radius: "]) {
                assert!(error.contains(part), "{text}: {error} lacks {part}");
            }
        }
    }

    #[test]
    fn a_unit_without_units_to_convert_to_is_refused_with_the_remedy() {
        let error = parse("1 Rsun").value("key", UnitDimension::LENGTH, &Conversion::NONE).unwrap_err().to_string();
        assert!(error.contains("states no units") && error.contains("units: solar"), "{error}");
    }

    #[test]
    fn vectors_name_the_component_that_is_wrong() {
        let vector: Vec<Quantity> = serde_saphyr::from_str("[30 km/s, 0, 1 pc]").unwrap();
        let error = values("motion.bulk", &vector, UnitDimension::VELOCITY, &solar()).unwrap_err().to_string();
        assert!(error.contains("motion.bulk[2]") && error.contains("a length"), "{error}");
        check_all("motion.bulk", &vector[..2], UnitDimension::VELOCITY).unwrap();
    }

    #[test]
    fn what_is_printed_reads_back_the_same() {
        for text in ["1 Rsun", "2.5", "1e-300", "-3", "30 km/s"] {
            let quantity = parse(text);
            assert_eq!(parse(&serde_saphyr::to_string(&quantity).unwrap()), quantity, "{text}");
        }
    }
}
