//! Decides the role of each variable: the scene's statement or, without one, its name, provided that its unit and the other variables agree.

use super::spelling::{Spelling, momentum, spelling};
use crate::error::{Error, Result};
use crate::scene::{Part, Role, Vector};
use serde::Serialize;
use sph_formats::common::particle_names as names;
use sph_formats::{Coordinates, Geometry, RawField, UnitDimension, Variable, did_you_mean};
use std::collections::BTreeMap;

/// What a variable is taken for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Assignment {
    /// As the file has it.
    pub variable: String,
    /// What it is taken for; none where it is carried as it is.
    pub role: Option<Role>,
    /// The column of particles that it is, or is a part of.
    pub column: String,
    /// Why it is not taken for what its name says, or what is assumed.
    pub note: Option<String>,
    /// Whether the note is a warning.
    pub is_warning: bool,
    /// A component along an axis that the run does not have: no column, but a part of the kinetic energy.
    pub is_beyond: bool,
    /// Whether its vector lacks components, which are taken to be 0.
    pub is_partial: bool,
}

impl Assignment {
    fn new(variable: &Variable) -> Self {
        let name = variable.name.clone();
        Self {
            variable: name.clone(),
            role: None,
            column: name,
            note: None,
            is_warning: false,
            is_beyond: false,
            is_partial: false,
        }
    }

    pub(super) fn take(&mut self, role: Role) {
        self.role = Some(role);
        self.column = column_of(role).map_or_else(|| self.variable.clone(), str::to_owned);
    }

    /// Says more of it.
    pub(super) fn add_note(&mut self, more: String) {
        self.note = Some(self.note.take().map_or(more.clone(), |note| format!("{note}; {more}")));
    }

    /// Carried under its own name, and why.
    fn leave(&mut self, why: impl Into<String>) {
        self.role = None;
        self.column.clone_from(&self.variable);
        self.note = Some(why.into());
        self.is_warning = true;
    }
}

/// The column in which a role is written; none for roles that keep the variable's own name.
fn column_of(role: Role) -> Option<&'static str> {
    Some(match role {
        Role::Density => names::DENSITY,
        Role::Vector(Vector::Velocity, _) => names::VELOCITIES,
        Role::Vector(Vector::MagneticField, _) => names::MAGNETIC_FIELD,
        Role::InternalEnergy => names::INTERNAL_ENERGY,
        Role::Temperature => names::TEMPERATURE,
        Role::Pressure => names::PRESSURE,
        Role::Material => names::MATERIAL_IDS,
        _ => return None,
    })
}

/// Kinds of space, by the directions that components in it can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Space {
    Cartesian(usize),
    Radial,
    Geographic,
    /// Cells along r, theta, phi or R, phi, z, in a run of so many dimensions.
    Curvilinear(Coordinates, usize),
}

impl Space {
    fn of(geometry: &Geometry, dimension: usize) -> Self {
        match geometry {
            Geometry::Radial { .. } => Self::Radial,
            Geometry::Grid { coordinates: Coordinates::Geographic, .. } => Self::Geographic,
            Geometry::Grid { coordinates, .. } if coordinates.is_curvilinear() => {
                Self::Curvilinear(*coordinates, dimension)
            }
            _ => Self::Cartesian(dimension),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Cartesian(_) => "on Cartesian coordinates",
            Self::Radial => "in a radial profile",
            Self::Geographic => "on longitude, latitude and radius",
            Self::Curvilinear(Coordinates::Spherical, _) => "on r, theta and phi",
            Self::Curvilinear(..) => "on R, phi and z",
        }
    }

    /// The direction of component 1, 2 or 3 along the axes.
    fn numbered(self, place: usize) -> Option<Part> {
        match self {
            Self::Cartesian(_) => [Part::X, Part::Y, Part::Z].get(place).copied(),
            Self::Radial => (place == 0).then_some(Part::R),
            Self::Geographic => None,
            Self::Curvilinear(coordinates, _) => along(coordinates).get(place).copied(),
        }
    }

    /// The direction of `u`, `v` and `w` (CF: eastward, northward, upward).
    fn wind(self, place: usize) -> Option<Part> {
        match self {
            Self::Cartesian(_) => [Part::X, Part::Y, Part::Z].get(place).copied(),
            Self::Radial | Self::Curvilinear(..) => None,
            Self::Geographic => [Part::Phi, Part::North, Part::R].get(place).copied(),
        }
    }

    /// Whether components of that direction have a Cartesian vector at every place without a guess.
    fn admits(self, part: Part) -> bool {
        match self {
            Self::Cartesian(d) => match part {
                Part::Whole | Part::X => true,
                Part::Y => d > 1,
                Part::Z => d > 2,
                _ => false,
            },
            Self::Radial => matches!(part, Part::R | Part::Whole),
            Self::Geographic => !matches!(part, Part::Whole | Part::Cylindrical),
            Self::Curvilinear(_, 2) if part == Part::Z => false,
            Self::Curvilinear(coordinates, _) => part == Part::Whole || along(coordinates).contains(&part),
        }
    }
}

/// Directions of the axes of curvilinear coordinates, in their order.
pub(super) fn along(coordinates: Coordinates) -> [Part; 3] {
    match coordinates {
        Coordinates::Polar => [Part::Cylindrical, Part::Phi, Part::Z],
        Coordinates::Cylindrical => [Part::Cylindrical, Part::Z, Part::Phi],
        _ => [Part::R, Part::Theta, Part::Phi],
    }
}

/// What each variable of `field` is taken for in `dimension` dimensions; `map` overrules names.
///
/// # Errors
/// A mapping of a variable that is not there, of several to one role, or of one whose unit is another quantity's.
pub fn assign(field: &RawField, dimension: usize, map: &BTreeMap<String, Role>) -> Result<Vec<Assignment>> {
    let mut all: Vec<Assignment> = field.variables.iter().map(Assignment::new).collect();
    let space = Space::of(&field.geometry, dimension);
    let is_mesh = matches!(field.geometry, Geometry::Mesh { .. });
    let mapped = check_map(field, map)?;
    let spellings: Vec<Spelling> = field
        .variables
        .iter()
        .zip(&mapped)
        .map(|(v, mapped)| mapped.map_or_else(|| spelling(&v.name), Spelling::Role))
        .collect();
    for (i, variable) in field.variables.iter().enumerate() {
        let is_density = field.density.as_deref() == Some(variable.name.as_str());
        if is_density {
            all[i].take(Role::Density);
            continue;
        }
        let found = match spellings[i] {
            Spelling::Role(role) => Some(role),
            // Codes on curved grids write their meshes in x, y, z, but components along the grid.
            Spelling::Numbered(..) if is_mesh => None,
            Spelling::Numbered(vector, place) => space.numbered(place).map(|part| Role::Vector(vector, part)),
            Spelling::Wind(place) => wind(space, place, variable, field),
            Spelling::Other(what) => {
                all[i].leave(format!("looks like {what}; it is carried under its own name"));
                None
            }
            Spelling::Unknown => None,
        };
        match (found, spellings[i]) {
            (Some(role), _) => judge(&mut all[i], role, variable, space, mapped[i].is_some()),
            (None, Spelling::Numbered(vector, place)) if is_mesh => {
                let axis = Role::Vector(vector, [Part::X, Part::Y, Part::Z][place.min(2)]).name();
                all[i].leave(format!(
                    "is Cartesian or along a curved grid, which a mesh does not say: --map {}={axis} takes it for the former",
                    variable.name
                ));
            }
            (None, Spelling::Numbered(..)) => {
                all[i].leave(format!("numbered components have no known direction {}", space.name()));
            }
            (None, Spelling::Wind(_)) if variable.name.eq_ignore_ascii_case("v") && space == Space::Radial => {
                judge(&mut all[i], Role::Vector(Vector::Velocity, Part::R), variable, space, false);
            }
            _ => {}
        }
    }
    one_each(&mut all, &mapped);
    complete(&mut all, space, &mapped);
    warn_of_momenta(&mut all, map);
    Ok(all)
}

/// `u`, `v` and `w` are a velocity if those of all dimensions are there, and `u` or `v` as a vector is one; `u` alone is an energy.
fn wind(space: Space, place: usize, variable: &Variable, field: &RawField) -> Option<Role> {
    let count = match space {
        Space::Cartesian(d) => d,
        Space::Geographic => 2,
        Space::Radial | Space::Curvilinear(..) => 1,
    };
    // A vector of that name has all components by itself.
    if variable.components > 1 && place < 2 {
        return Some(Role::Vector(Vector::Velocity, Part::Whole));
    }
    let has = |letter: &str| field.variables.iter().any(|v| v.name.eq_ignore_ascii_case(letter) && v.components == 1);
    let company = count > 1 && ["u", "v", "w"].iter().take(count).all(|letter| has(letter));
    if company {
        return space.wind(place).map(|part| Role::Vector(Vector::Velocity, part));
    }
    (variable.name.eq_ignore_ascii_case("u") && !has("v")).then_some(Role::InternalEnergy)
}

/// The mapped role of each variable.
/// Says so of momenta that are mapped to velocities.
fn warn_of_momenta(all: &mut [Assignment], map: &BTreeMap<String, Role>) {
    let is_velocity = |a: &&mut Assignment| matches!(map.get(&a.variable), Some(Role::Vector(Vector::Velocity, _)));
    for a in all.iter_mut().filter(is_velocity).filter(|a| momentum(&a.variable).is_some()) {
        a.add_note(
            "is named like a momentum, but is used as a velocity without conversion; without the mapping it is \
             divided by the density"
                .into(),
        );
        a.is_warning = true;
    }
}

fn check_map(field: &RawField, map: &BTreeMap<String, Role>) -> Result<Vec<Option<Role>>> {
    for (name, role) in map {
        let Some(variable) = field.variable(name) else {
            let known = || field.variables.iter().map(|v| v.name.as_str());
            let list = known().collect::<Vec<_>>().join(", ");
            let hint = did_you_mean(name, known());
            return Err(Error::scene(
                "map",
                format!("names '{name}', which is not read from the file; it has {list}{hint}"),
            ));
        };
        if let Some(other) = map.iter().take_while(|(n, _)| *n != name).find(|(_, r)| *r == role && is_single(*role)) {
            let problem = format!("gives both '{}' and '{name}' the role {}; leave one out", other.0, role.name());
            return Err(Error::scene("map", problem));
        }
        if let Some(unit) = variable.unit.as_ref().filter(|u| !fits(*role, u.dimension)) {
            let problem = format!("gives '{name}' the role {}, but its unit is {}", role.name(), unit.symbol);
            return Err(Error::scene("map", problem));
        }
        let is_whole = matches!(role, Role::Vector(_, Part::Whole));
        if variable.components > 1 && !is_whole && *role != Role::None && is_single(*role) {
            let problem =
                format!("gives '{name}' the role {}, but it has {} components", role.name(), variable.components);
            return Err(Error::scene("map", problem));
        }
    }
    Ok(field.variables.iter().map(|v| map.get(&v.name).copied()).collect())
}

/// Whether one variable at most can have the role.
fn is_single(role: Role) -> bool {
    !matches!(role, Role::Composition | Role::VectorPotential | Role::None)
}

fn fits(role: Role, dimension: UnitDimension) -> bool {
    let density = role == Role::Density && (1..=3).any(|d| dimension == UnitDimension::mass_density(d));
    density || dimension == UnitDimension::NONE || role.dimension().is_none_or(|d| d == dimension)
}

fn judge(assignment: &mut Assignment, role: Role, variable: &Variable, space: Space, is_mapped: bool) {
    if role == Role::None {
        return;
    }
    if let Some(unit) = variable.unit.as_ref().filter(|u| !fits(role, u.dimension)) {
        return assignment.leave(format!("is named like {}, but its unit is {}", article(role), unit.symbol));
    }
    match role {
        Role::Density => assignment.leave("is named like a density, but another variable is taken for it"),
        // The radius of a cylinder's coordinates is the distance from the axis.
        Role::Vector(vector, Part::R)
            if matches!(space, Space::Curvilinear(c, _) if c != Coordinates::Spherical) && !is_mapped =>
        {
            judge(assignment, Role::Vector(vector, Part::Cylindrical), variable, space, is_mapped);
        }
        Role::Vector(_, part) => {
            let is_scalar = variable.components == 1;
            if part == Part::Whole && is_scalar && !matches!(space, Space::Radial | Space::Cartesian(1)) {
                assignment.leave(format!(
                    "is named like {}, but is a scalar: its direction is unknown (--map {}=velocity-x)",
                    article(role),
                    variable.name
                ));
            } else if part == Part::Whole && space == Space::Geographic {
                assignment.leave(format!("is {}, whose directions are not known {}", article(role), space.name()));
            } else if matches!((role, space), (Role::Vector(Vector::MagneticField, _), Space::Radial)) {
                assignment.leave("a magnetic field has no direction in a radial profile");
            } else if let (Space::Cartesian(d), Part::Y | Part::Z, false)
            | (Space::Curvilinear(_, d @ 2), Part::Z, false) = (space, part, space.admits(part))
            {
                assignment.leave(format!("is named like {}, but points out of the {d}-D space", article(role)));
                assignment.is_beyond = matches!(role, Role::Vector(Vector::Velocity, _));
                // Codes write three components in fewer dimensions, too.
                assignment.is_warning = variable.values.range() != (0.0, 0.0, 0);
            } else if !space.admits(part) && !is_mapped {
                let remedy = match space {
                    Space::Cartesian(_) => format!(
                        "the center is a guess; --map {}={} uses the origin of coordinates as the center",
                        variable.name,
                        role.name()
                    ),
                    _ => "it has no direction there".to_owned(),
                };
                assignment.leave(format!("is named like {}, but {}: {remedy}", article(role), space.name()));
            } else if !space.admits(part) && !matches!(space, Space::Cartesian(2 | 3)) {
                assignment.leave(format!("{} has no direction {}", article(role), space.name()));
            } else {
                let role = match (role, space) {
                    (Role::Vector(vector, Part::Whole), Space::Cartesian(1)) if is_scalar => {
                        Role::Vector(vector, Part::X)
                    }
                    _ if part == Part::Whole && is_scalar => radial(role),
                    _ => role,
                };
                assignment.take(role);
            }
        }
        // What else is in it comes off when all variables are known.
        Role::TotalEnergy | Role::TotalEnergyDensity | Role::InternalEnergyDensity => assignment.role = Some(role),
        Role::SmoothingLength | Role::Softening | Role::Id => {
            assignment.role = Some(role);
            assignment.note = Some("belongs to the particles of the file, not to a place".into());
        }
        _ if variable.components > 1 && column_of(role).is_some() => {
            assignment.leave(format!("is named like {}, but has {} components", article(role), variable.components));
        }
        _ => assignment.take(role),
    }
}

fn radial(role: Role) -> Role {
    match role {
        Role::Vector(vector, _) => Role::Vector(vector, Part::R),
        other => other,
    }
}

fn article(role: Role) -> String {
    let name = role.name().replace('-', " ");
    match role {
        Role::InternalEnergy | Role::InternalEnergyDensity | Role::Entropy | Role::Id => format!("an {name}"),
        Role::Composition | Role::Metallicity => name,
        _ => format!("a {name}"),
    }
}

/// Of several variables with one role the mapped one is taken, else that under the standard name, else the first.
fn one_each(all: &mut [Assignment], mapped: &[Option<Role>]) {
    for i in 0..all.len() {
        let Some(role) = all[i].role.filter(|role| is_single(*role) && column_of(*role).is_some()) else { continue };
        let rivals: Vec<usize> = (0..all.len()).filter(|&j| all[j].role == Some(role)).collect();
        let standard = |j: &&usize| all[**j].variable == all[**j].column;
        let best = rivals.iter().find(|j| mapped[**j].is_some()).or_else(|| rivals.iter().find(standard));
        let Some(&best) = best.or(rivals.first()) else { continue };
        let taken = all[best].variable.clone();
        for j in rivals.into_iter().filter(|j| *j != best) {
            all[j].leave(format!("is named like {}, but '{taken}' is taken for it", article(role)));
        }
    }
    // A vector that is whole makes components superfluous.
    for vector in [Vector::Velocity, Vector::MagneticField] {
        let whole = all.iter().position(|a| a.role == Some(Role::Vector(vector, Part::Whole)));
        let Some(taken) = whole.map(|i| all[i].variable.clone()) else { continue };
        for a in
            all.iter_mut().filter(|a| matches!(a.role, Some(Role::Vector(v, p)) if v == vector && p != Part::Whole))
        {
            a.leave(format!("'{taken}' is taken for the whole vector"));
        }
    }
}

/// Sets of components that make a vector, and those that are missing.
fn complete(all: &mut [Assignment], space: Space, mapped: &[Option<Role>]) {
    for vector in [Vector::Velocity, Vector::MagneticField] {
        let has = |all: &[Assignment], part: Part| all.iter().any(|a| a.role == Some(Role::Vector(vector, part)));
        let sets: &[&[Part]] = match space {
            Space::Cartesian(1) => &[&[Part::X]],
            Space::Cartesian(2) => &[&[Part::X, Part::Y], &[Part::R, Part::Phi], &[Part::Cylindrical, Part::Phi]],
            Space::Cartesian(_) => &[
                &[Part::X, Part::Y, Part::Z],
                &[Part::R, Part::Theta, Part::Phi],
                &[Part::Cylindrical, Part::Phi, Part::Z],
            ],
            Space::Radial => &[&[Part::R]],
            Space::Curvilinear(Coordinates::Spherical, _) => &[&[Part::R, Part::Theta, Part::Phi]],
            Space::Curvilinear(_, 2) => &[&[Part::Cylindrical, Part::Phi]],
            Space::Curvilinear(..) => &[&[Part::Cylindrical, Part::Phi, Part::Z]],
            Space::Geographic => {
                &[&[Part::X, Part::Y, Part::Z], &[Part::R, Part::Theta, Part::Phi], &[Part::R, Part::North, Part::Phi]]
            }
        };
        if has(all, Part::Whole) || !sets.iter().flat_map(|s| s.iter()).any(|part| has(all, *part)) {
            continue;
        }
        let found = |set: &&&[Part]| set.iter().filter(|part| has(all, **part)).count();
        // The first of equals is Cartesian.
        let best = sets.iter().rev().max_by_key(found).copied().unwrap_or(&[]);
        let missing: Vec<&str> =
            best.iter().filter(|part| !has(all, **part)).map(|part| Role::Vector(vector, *part).name()).collect();
        for i in 0..all.len() {
            let Some(Role::Vector(v, part)) = all[i].role else { continue };
            if v != vector {
                continue;
            }
            if !best.contains(&part) {
                all[i].leave("does not belong to the components that are taken for the vector");
            } else if !missing.is_empty() && mapped[i].is_none() {
                all[i].note = Some(format!("has no {} beside it, which is taken to be 0", missing.join(" nor ")));
                all[i].is_warning = true;
                all[i].is_partial = true;
            }
        }
    }
}
