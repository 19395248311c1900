//! Units of variables that state none, in a file that states units of length and density.

use super::assign::Assignment;
use crate::input::units::InputUnits;
use crate::scene::{Role, Vector};
use sph_formats::{RawField, Unit};

/// Gives variables without a unit that of cgs or SI where the file's length and density are in one of these, and says so of
/// all others that are written as they stand.
/// `of_scene` is the name of the scene's units, where the file's length and density are in these.
pub fn adopt_units(
    field: &mut RawField,
    assignments: &mut [Assignment],
    (input, of_scene): (&InputUnits, Option<&str>),
    magnetic: Option<&Unit>,
) {
    let system = input.system();
    let name =
        of_scene.map(|name| format!("the scene's units ({name})")).or_else(|| coherent(input).map(str::to_owned));
    let name = name.as_deref();
    for a in assignments {
        let Some(variable) = field.variables.iter_mut().find(|v| v.name == a.variable && v.unit.is_none()) else {
            continue;
        };
        if let (Some(Role::Vector(Vector::MagneticField, _)), Some(unit)) = (a.role, magnetic) {
            variable.unit = Some(unit.clone());
            a.add_note(format!("is in {}, as input.magnetic_field_unit says", unit.symbol));
            continue;
        }
        let warning = match (a.role, a.role.and_then(Role::dimension), name) {
            (Some(Role::Density), ..) | (None, ..) => continue,
            // Gauss, or units whose magnetic pressure is B^2/2: they differ by a factor of 3.5.
            (Some(Role::Vector(Vector::MagneticField, _)), ..) => {
                "states no unit, and its numbers are taken for those of the output's units in which the magnetic pressure is B^2/2; \
                 state its unit with input.magnetic_field_unit, as in '1e-6 G' or 'nT'"
                    .to_owned()
            }
            (Some(_), Some(dimension), Some(name)) => {
                variable.unit = Some(system.unit(dimension));
                format!("states no known unit, and is assumed to be in {name}, like the input's length and density")
            }
            (Some(_), Some(_), None) => {
                "states no unit that is known, and its numbers are written as they stand; `units` in place of `input.length_unit` and \
                 `input.density_unit` says what all numbers of such a file are in"
                    .to_owned()
            }
            _ => continue,
        };
        a.add_note(warning);
        a.is_warning = true;
    }
}

/// The system of which the units of length and density are units, and in which the others are then taken to be.
fn coherent(input: &InputUnits) -> Option<&'static str> {
    let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
    match (input.length, input.density) {
        (l, d) if near(l, 1.0) && near(d, 1.0) => Some("cgs"),
        (l, d) if near(l, 1e2) && near(d, 1e-3) => Some("SI"),
        _ => None,
    }
}
