//! The findings of a check.

use serde::Serialize;
use sph_formats::Species;

/// How much something matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// As it should be, or a figure to know.
    Good,
    /// The code runs, but not on what was meant.
    Warning,
    /// The code stops, or runs on nonsense.
    Error,
}

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    pub level: Level,
    pub what: String,
    /// What was found, what is expected, and the remedy.
    pub text: String,
}

/// A column as findings call it: of gas by its name, of others with their type.
pub(super) fn named(species: &Species, column: &str) -> String {
    match species.part_type {
        0 => column.to_owned(),
        t => format!("PartType{t}/{column}"),
    }
}

pub(super) fn add(findings: &mut Vec<Finding>, level: Level, what: &str, text: impl Into<String>) {
    findings.push(Finding { level, what: what.to_owned(), text: text.into() });
}
