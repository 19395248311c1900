//! From the columns of a text file to the variables that were asked for.

use crate::common::text::Text;
use crate::error::Result;
use crate::model::{Location, Values, Variable};
use crate::registry::FieldRequest;
use crate::units::Unit;

/// A variable together with the name of the column that it comes from.
#[derive(Debug)]
pub struct Candidate {
    pub column: String,
    pub variable: Variable,
}

impl Candidate {
    /// A scalar. `unit` is a symbol of [`Unit::parse`]; one that is not understood leaves the unit open.
    pub fn new(column: &str, name: &str, unit: Option<&str>, location: Location, values: Vec<f64>) -> Self {
        let variable = Variable {
            name: name.to_owned(),
            description: None,
            unit: unit.and_then(Unit::parse),
            location,
            components: 1,
            values: Values::F64(values),
        };
        Self { column: column.to_owned(), variable }
    }

    fn answers_to(&self, name: &str) -> bool {
        self.variable.name == name || self.column == name
    }
}

/// The variables that `request` names, by their own or by their column's name, and the name of the density:
/// the requested one, else `guess`.
///
/// # Errors
/// [`crate::FormatError::Input`] with the list of columns where a requested name does not exist.
pub fn select(
    text: &Text,
    request: &FieldRequest,
    candidates: Vec<Candidate>,
    guess: Option<String>,
) -> Result<(Vec<Variable>, Option<String>)> {
    let missing = |name: &str, purpose: &str| {
        let known: Vec<_> = candidates.iter().map(|c| c.variable.name.as_str()).collect();
        let problem = format!("there is no such column{purpose}; the file has {}", known.join(", "));
        text.error(format!("variable '{name}'"), problem)
    };
    let find = |name: &str| candidates.iter().find(|c| c.answers_to(name));
    let density = match &request.density {
        Some(name) => Some(find(name).ok_or_else(|| missing(name, " for the density"))?.variable.name.clone()),
        None => guess,
    };
    if let Some(absent) = request.carry.iter().flatten().find(|name| find(name).is_none()) {
        return Err(missing(absent, ""));
    }
    let wanted = |c: &Candidate| {
        density.as_ref() == Some(&c.variable.name)
            || request.carry.as_ref().is_none_or(|names| names.iter().any(|n| c.answers_to(n)))
    };
    let chosen = candidates.into_iter().filter(wanted).map(|c| c.variable).collect();
    Ok((chosen, density))
}
