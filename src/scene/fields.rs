//! The `fields` section of a scene: columns that particles carry in addition to their mass, from expressions or from files.

use super::InterpolationName;
use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Direction of the polar axis, in three components.
pub const AXIS: &str = "axis";

/// Expressions and files by the names of what they are of.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct FieldsInput(pub BTreeMap<String, FieldValue>);

/// A number or an expression, one for each component, or a variable of a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected a number, an expression, a list of them, one for each component, or {file: F, variable: V} with `unit` and `format` at will"
)]
pub enum FieldValue {
    One(Term),
    Each(Vec<Term>),
    File(FieldFile),
}

/// A variable of a file, by its place: a grid, a mesh, a profile about the center or a snapshot, in the coordinates of the input.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FieldFile {
    pub file: PathBuf,
    /// Its name in the file, or one name for each component; by default the variable that is one of the field, or the only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variable: Option<VariableNames>,
    /// What its numbers are in; by default what the file says, else the scene's units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// By default what the file's name and content say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub format: Option<String>,
    /// Between the values of a grid, or the particles of a snapshot; by default linear between nodes, and constant in each cell.
    #[schemars(example = &"linear")]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interpolation: Option<InterpolationName>,
}

/// A name, or one for each component.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected the name of a variable, or a list of them, one for each component")]
pub enum VariableNames {
    One(String),
    Each(Vec<String>),
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
    /// The texts of all components; none of a file.
    pub fn texts(&self) -> Vec<String> {
        match self {
            Self::One(term) => vec![term.text()],
            Self::Each(terms) => terms.iter().map(Term::text).collect(),
            Self::File(_) => Vec::new(),
        }
    }

    /// Whether it is a number that is 0 or less.
    pub(crate) fn is_never_positive(&self) -> bool {
        matches!(self, Self::One(term) if term.text().trim().parse().is_ok_and(|v: f64| v <= 0.0))
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

    /// Files that it names.
    pub(super) fn files_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        self.0.values_mut().filter_map(|value| if let FieldValue::File(of) = value { Some(&mut of.file) } else { None })
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
