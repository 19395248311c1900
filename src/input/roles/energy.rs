//! Energies that are not the specific internal energy, and momenta: what is subtracted or divided out, at each value of the file,
//! before anything is interpolated.
//!
//! | role | u |
//! |---|---|
//! | total energy per mass | e - v^2/2 |
//! | total energy per volume | E/rho - v^2/2 - B^2/(8 pi rho), with B^2/(2 rho) for a field without a unit, as codes write it |
//! | internal energy per volume | E/rho |
//!
//! A velocity is the momentum per volume over rho, where a file has momenta and no velocity (conserved variables of Athena++).

use super::assign::Assignment;
use super::spelling::{Spelling, momentum, spelling};
use crate::input::units::InputUnits;
use crate::scene::{Role, Vector};
use sph_formats::{RawField, Unit, UnitDimension, Values, Variable};
use std::f64::consts::PI;

/// Turns momenta into velocities, under the names of velocities; returns what the file called them.
pub fn divide_momenta(field: &mut RawField, is_mapped: impl Fn(&str) -> bool) -> Vec<(String, String)> {
    let is_velocity = |v: &Variable| match spelling(&v.name) {
        Spelling::Role(Role::Vector(vector, _)) | Spelling::Numbered(vector, _) => vector == Vector::Velocity,
        _ => false,
    };
    let mapped = field.variables.iter().any(|v| is_mapped(&v.name) && momentum(&v.name).is_some());
    let name = field.density.clone().unwrap_or_default();
    let Some(density) = field.variable(&name).cloned() else { return Vec::new() };
    if mapped || field.variables.iter().any(is_velocity) {
        return Vec::new();
    }
    let mut renamed = Vec::new();
    for v in field.variables.iter_mut().filter(|v| v.components == 1 && v.location == density.location) {
        let Some(place) = momentum(&v.name) else { continue };
        let unit = match (&v.unit, &density.unit) {
            (None, None) => None,
            (Some(m), Some(rho)) => {
                let (of, by) = (m.dimension, rho.dimension);
                let dimension = UnitDimension::new(
                    of.length.saturating_sub(by.length),
                    of.mass.saturating_sub(by.mass),
                    of.time.saturating_sub(by.time),
                    of.temperature.saturating_sub(by.temperature),
                );
                Some(Unit {
                    symbol: format!("{}/({})", m.symbol, rho.symbol),
                    to_cgs: m.to_cgs / rho.to_cgs,
                    dimension,
                })
            }
            // One is known and the other not: which numbers belong together is open.
            _ => continue,
        };
        if unit.as_ref().is_some_and(|u| u.dimension != UnitDimension::VELOCITY) {
            continue;
        }
        let quotient = |i: usize| if v.values.get(i) == 0.0 { 0.0 } else { v.values.get(i) / density.values.get(i) };
        v.values = Values::F64((0..v.values.len()).map(quotient).collect());
        v.unit = unit;
        let velocity = format!("velocity_{}", ["x1", "x2", "x3"][place]);
        renamed.push((velocity.clone(), std::mem::replace(&mut v.name, velocity)));
    }
    renamed
}

/// What a file calls the momenta that [`divide_momenta`] has divided, for reports.
pub fn restore_names(assignments: &mut [Assignment], renamed: &[(String, String)]) {
    for a in assignments {
        if let Some((_, own)) = renamed.iter().find(|(velocity, _)| *velocity == a.variable) {
            a.add_note("is a momentum, and was divided by the density".into());
            a.variable.clone_from(own);
        }
    }
}

/// Makes the internal energy of the first energy that is something else, unless the file has it already.
pub fn reduce_energies(field: &mut RawField, assignments: &mut [Assignment], input: Option<&InputUnits>) {
    let known = assignments.iter().find(|a| a.role == Some(Role::InternalEnergy)).map(|a| a.variable.clone());
    let mut known = known.map(|name| format!("'{name}' is the internal energy"));
    for role in [Role::InternalEnergyDensity, Role::TotalEnergy, Role::TotalEnergyDensity] {
        let Some(index) = assignments.iter().position(|a| a.role == Some(role)) else { continue };
        let name = assignments[index].variable.clone();
        if let Some(known) = &known {
            assignments[index].add_note(format!("{} and not needed: {known}", what(role)));
            continue;
        }
        match internal(field, assignments, (role, &name), input) {
            Ok((values, unit, parts)) => {
                if let Some(v) = field.variables.iter_mut().find(|v| v.name == name) {
                    (v.values, v.unit) = (Values::F64(values), unit);
                }
                known = Some(format!("'{name}' gives the internal energy"));
                assignments[index].take(Role::InternalEnergy);
                assignments[index].add_note(format!("{}: {parts} came off", what(role)));
            }
            Err(problem) => {
                let remedy = format!("map the internal energy, a pressure or a temperature, or --map {name}=none");
                let note = format!("{} and is not taken for the internal energy: {problem}; {remedy}", what(role));
                assignments[index].add_note(note);
                assignments[index].is_warning = true;
            }
        }
    }
}

fn what(role: Role) -> &'static str {
    match role {
        Role::TotalEnergy => "is internal and kinetic energy together",
        Role::TotalEnergyDensity => "looks like an energy per volume that has the kinetic and the magnetic one in it",
        _ => "looks like an energy per volume",
    }
}

type Reduced = (Vec<f64>, Option<Unit>, String);

/// The specific internal energy, its unit, and what came off; or why there is none.
fn internal(
    field: &RawField,
    assignments: &[Assignment],
    (role, name): (Role, &str),
    input: Option<&InputUnits>,
) -> Result<Reduced, String> {
    let of_vector = |vector: Vector| {
        let is = move |a: &&Assignment| matches!(a.role, Some(Role::Vector(v, _)) if v == vector);
        let beyond = move |a: &&Assignment| vector == Vector::Velocity && a.is_beyond;
        let found = assignments.iter().filter(move |a| is(a) || beyond(a));
        found.filter_map(|a| field.variable(&a.variable).map(|v| (a, v))).collect::<Vec<_>>()
    };
    let energy = field.variable(name).ok_or("it was not read")?;
    let (velocity, magnetic) = match role {
        Role::InternalEnergyDensity => (Vec::new(), Vec::new()),
        Role::TotalEnergy => (of_vector(Vector::Velocity), Vec::new()),
        _ => (of_vector(Vector::Velocity), of_vector(Vector::MagneticField)),
    };
    if role != Role::InternalEnergyDensity {
        let missing = velocity.iter().find_map(|(a, _)| a.note.as_ref().filter(|_| a.is_partial));
        match (velocity.is_empty(), missing) {
            (true, _) => {
                let at_rest = match role {
                    Role::TotalEnergy => Role::InternalEnergy,
                    _ => Role::InternalEnergyDensity,
                };
                return Err(format!(
                    "there is no velocity from which a kinetic energy could be subtracted (--map {name}={} if nothing \
                     moves)",
                    at_rest.name()
                ));
            }
            (_, Some(note)) => return Err(format!("its velocity {note}")),
            _ => {}
        }
    }
    let density = match role {
        Role::TotalEnergy => None,
        _ => Some(field.density.as_deref().and_then(|d| field.variable(d)).ok_or("the density is not known")?),
    };
    let all = || [energy].into_iter().chain(velocity.iter().map(|v| v.1)).chain(density);
    if let Some(other) = all().chain(magnetic.iter().map(|v| v.1)).find(|v| v.location != energy.location) {
        return Err(format!("it and '{}' are not given at the same places", other.name));
    }
    // The density's unit may be known from the scene alone.
    let of_input = |v: &Variable| input.filter(|_| Some(v.name.as_str()) == density.map(|d| d.name.as_str()));
    let has_unit = |v: &Variable| v.unit.is_some() || (of_input(v).is_some() && energy.unit.is_some());
    let is_known = energy.unit.is_some();
    if let Some(other) = all().find(|v| has_unit(v) != is_known) {
        return Err(format!("of '{name}' and '{}' one has a unit and the other none", other.name));
    }
    let cgs = |v: &Variable| match (&v.unit, is_known) {
        (Some(unit), true) => unit.to_cgs,
        (None, true) => of_input(v).map_or(1.0, |input| input.density),
        _ => 1.0,
    };
    let square = |v: &Variable, i: usize| {
        (0..v.components).map(|k| v.values.get(i * v.components + k)).map(|x| x * x).sum::<f64>()
    };
    let (of_energy, of_density) = (cgs(energy), density.map_or(1.0, cgs));
    let speeds: Vec<f64> = velocity.iter().map(|(_, v)| cgs(v).powi(2)).collect();
    // Of a field in Gauss the factor to cgs is that of its square.
    let fields: Vec<f64> =
        magnetic.iter().map(|(_, b)| b.unit.as_ref().map_or(0.5, |u| u.to_cgs / (8.0 * PI))).collect();
    if is_known && magnetic.iter().any(|(_, b)| b.unit.is_none()) {
        return Err("the magnetic field in it has no unit".into());
    }
    let value = |i: usize| {
        let per_volume = magnetic.iter().zip(&fields).map(|((_, b), f)| f * square(b, i)).sum::<f64>();
        let rho = density.map_or(1.0, |rho| rho.values.get(i) * of_density);
        let own = energy.values.get(i) * of_energy - per_volume;
        let kinetic = velocity.iter().zip(&speeds).map(|((_, v), f)| 0.5 * f * square(v, i)).sum::<f64>();
        // Where there is no matter there is no energy of it.
        if rho > 0.0 { own / rho - kinetic } else { 0.0 }
    };
    let values: Vec<f64> = (0..energy.values.len()).map(value).collect();
    let negative = values.iter().filter(|u| **u < 0.0).count();
    if negative > 0 {
        let n = values.len();
        return Err(format!("minus the kinetic energy it is negative at {negative} of {n} positions"));
    }
    let unit =
        is_known.then(|| Unit { symbol: "erg/g".into(), to_cgs: 1.0, dimension: UnitDimension::SPECIFIC_ENERGY });
    Ok((values, unit, came_off(&velocity, &magnetic, density)))
}

/// What came off, in words.
fn came_off(
    velocity: &[(&Assignment, &Variable)],
    magnetic: &[(&Assignment, &Variable)],
    density: Option<&Variable>,
) -> String {
    let list =
        |all: &[(&Assignment, &Variable)]| all.iter().map(|(_, v)| v.name.as_str()).collect::<Vec<_>>().join(", ");
    let mut parts = Vec::new();
    parts.extend(density.map(|d| format!("the density '{}', as a factor,", d.name)));
    parts.extend((!velocity.is_empty()).then(|| format!("the kinetic energy of {}", list(velocity))));
    parts.extend((!magnetic.is_empty()).then(|| format!("the magnetic energy of {}", list(magnetic))));
    parts.join(" and ")
}
