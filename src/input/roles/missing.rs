//! Variables of which some values are missing.

use super::assign::Assignment;
use crate::scene::Role;
use sph_formats::RawField;

/// Warns of variables that are left out because some of their values are missing or no numbers: of those whose meaning is known.
pub fn warn_of_missing(field: &RawField, assignments: &mut [Assignment]) {
    for a in assignments.iter_mut().filter(|a| a.role.is_some_and(|role| role != Role::Density)) {
        let Some(variable) = field.variables.iter().find(|v| v.name == a.variable) else { continue };
        let (.., bad) = variable.values.range();
        if bad > 0 {
            a.add_note(format!(
                "is left out: {bad} of its {} values are missing or not finite (`missing: zero` sets missing ones to 0)",
                variable.values.len()
            ));
            a.is_warning = true;
        }
    }
}
