//! The `resolution` section of a scene.

use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A resolution field: one of the four.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ResolutionInput {
    /// Expression for the spacing, up to a factor.
    #[schemars(example = &"1 + r")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing: Option<String>,
    /// Expression for the number density, up to a factor.
    #[schemars(example = &"exp(-r)")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub number_density: Option<String>,
    /// Variable for the spacing, up to a factor.
    #[schemars(example = &"dx")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing_variable: Option<String>,
    /// Variable for the number density, up to a factor.
    #[schemars(example = &"n")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub number_density_variable: Option<String>,
    /// File of the variable, where it is not the input.
    #[schemars(example = &"resolution.nc")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
}

impl ResolutionInput {
    /// The expression, if it is one.
    pub fn expression(&self) -> Option<&str> {
        self.spacing.as_deref().or(self.number_density.as_deref())
    }

    /// The variable, if it is one.
    pub fn variable(&self) -> Option<&str> {
        self.spacing_variable.as_deref().or(self.number_density_variable.as_deref())
    }

    pub(super) fn validate(&self) -> Result<()> {
        let given = [&self.spacing, &self.number_density, &self.spacing_variable, &self.number_density_variable];
        match given.iter().filter(|g| g.is_some()).count() {
            1 => Ok(()),
            n => Err(Error::scene(
                "resolution",
                format!(
                    "has {n} of `spacing`, `number_density`, `spacing_variable`, `number_density_variable`; expected exactly one"
                ),
            )),
        }
    }
}
