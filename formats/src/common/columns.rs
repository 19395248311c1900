//! Selects the requested variables from the columns of a text file.

use crate::common::text::Text;
use crate::error::{FormatError, Result};
use crate::model::{Location, Values, Variable};
use crate::nearest::did_you_mean;
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
}

/// The variables that `request` names, and the name of the density: the requested one, else `guess`. The density may
/// be requested by its column's name, which it then keeps.
///
/// # Errors
/// [`crate::FormatError::Input`] with the list of variables where a requested name does not exist.
pub fn select(
    text: &Text,
    request: &FieldRequest,
    mut candidates: Vec<Candidate>,
    guess: Option<String>,
) -> Result<(Vec<Variable>, Option<String>)> {
    let density = request.density.clone().or(guess);
    if let Some(name) = &request.density {
        let own = candidates.iter().position(|c| c.variable.name == *name);
        let by_column = || candidates.iter().position(|c| c.column == *name);
        match own.or_else(by_column).and_then(|i| candidates.get_mut(i)) {
            Some(found) => found.variable.name.clone_from(name),
            None => return Err(missing(text, &candidates, name)),
        }
    }
    let absent = |name: &&String| candidates.iter().all(|c| c.variable.name != **name);
    if let Some(name) = request.carry.iter().flatten().find(absent) {
        return Err(missing(text, &candidates, name));
    }
    let wanted = |v: &Variable| density.as_ref() == Some(&v.name) || request.takes(&v.name);
    let chosen = candidates.into_iter().map(|c| c.variable).filter(wanted).collect();
    Ok((chosen, density))
}

fn missing(text: &Text, candidates: &[Candidate], name: &str) -> FormatError {
    let problem = match candidates.iter().find(|c| c.column == name) {
        Some(c) => format!("the column of this name is read as '{}'; ask for that", c.variable.name),
        None => {
            let known: Vec<_> = candidates.iter().map(|c| c.variable.name.as_str()).collect();
            let hint = did_you_mean(name, known.iter().copied());
            format!("there is no such column; the file has {}{hint}", known.join(", "))
        }
    };
    text.error(format!("variable '{name}'"), problem)
}
