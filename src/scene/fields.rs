//! The `fields` section of a scene: what particles carry beside their mass, as expressions.

use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Direction of the polar axis, in three components.
pub const AXIS: &str = "axis";

/// Expressions by the names of what they are of.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct FieldsInput(pub BTreeMap<String, FieldValue>);

/// A number or an expression, or one for each component.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, an expression, or a list of them, one for each component")]
pub enum FieldValue {
    One(Term),
    Each(Vec<Term>),
}

/// A number or an expression.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number or an expression")]
pub enum Term {
    Number(f64),
    Text(String),
}

impl Term {
    /// As the text of an expression.
    pub fn text(&self) -> String {
        match self {
            Self::Number(value) => format!("{value:?}"),
            Self::Text(text) => text.clone(),
        }
    }
}

impl FieldValue {
    /// The texts of all components.
    pub fn texts(&self) -> Vec<String> {
        match self {
            Self::One(term) => vec![term.text()],
            Self::Each(terms) => terms.iter().map(Term::text).collect(),
        }
    }
}

impl FieldsInput {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All but the axis.
    pub fn stated(&self) -> impl Iterator<Item = (&str, &FieldValue)> {
        self.0.iter().map(|(name, value)| (name.as_str(), value)).filter(|(name, _)| *name != AXIS)
    }

    /// The polar axis, of length 1: z by default.
    ///
    /// # Errors
    /// What is no direction.
    pub fn axis(&self) -> Result<[f64; 3]> {
        let Some(value) = self.0.get(AXIS) else { return Ok([0.0, 0.0, 1.0]) };
        let wrong = || Error::scene("fields.axis", "is no direction, expected three numbers such as [0, 0, 1]");
        let FieldValue::Each(terms) = value else { return Err(wrong()) };
        let number = |term: &Term| if let Term::Number(v) = term { Ok(*v) } else { Err(wrong()) };
        let numbers = terms.iter().map(number).collect::<Result<Vec<f64>>>()?;
        let given = <[f64; 3]>::try_from(numbers).map_err(|_| wrong())?;
        let largest = given.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        if !(largest.is_finite() && largest > 0.0) {
            return Err(wrong());
        }
        let scaled = given.map(|v| v / largest);
        let length = scaled.iter().map(|v| v * v).sum::<f64>().sqrt();
        Ok(scaled.map(|v| v / length))
    }

    pub(super) fn validate(&self) -> Result<()> {
        self.axis()?;
        let is_name = |name: &str| {
            let mut letters = name.chars();
            letters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
                && letters.all(|c| c.is_ascii_alphanumeric() || c == '_')
        };
        match self.stated().find(|(name, _)| !is_name(name)) {
            Some((name, _)) => {
                Err(Error::scene("fields", format!("has a name '{name}'; expected letters, digits and underscores")))
            }
            None => Ok(()),
        }
    }
}
