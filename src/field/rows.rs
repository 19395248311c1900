//! Represents a radial file as rows, and converts rows back to nodes and cells.

use super::build_input::Input;
use super::options::Staggering;
use super::staggering::{Budget, Closure, Rows, closure, faces_of_masses, infer, middle_faces};
use crate::error::Result;
use sph_formats::{Location, UnitDimension, Values, Variable, plain_name};

/// Names of an enclosed mass by their letters and digits.
const ENCLOSED: [&str; 14] = [
    "enclosedmass",
    "mass",
    "m",
    "mr",
    "massgrams",
    "menc",
    "menclosed",
    "massenclosed",
    "interiormass",
    "masscoordinate",
    "massr",
    "mouter",
    "massouter",
    "outermass",
];
/// The same of a zone's own mass.
const OF_ZONES: [&str; 6] = ["dm", "dmass", "cellmass", "zonemass", "shellmass", "deltam"];
/// The same of the share of all mass that is enclosed.
const FRACTIONS: [&str; 4] = ["q", "moverm", "enclosedmassfraction", "relativemass"];
/// What else belongs to faces where radii do.
const AT_FACES: [&str; 11] =
    ["v", "velocity", "vel", "vr", "velr", "radialvelocity", "velocityr", "luminosity", "l", "lum", "lr"];

/// Columns by which the rows are placed: asked for even where they are not carried.
pub(crate) fn mass_columns() -> impl Iterator<Item = &'static str> {
    ENCLOSED.into_iter().chain(OF_ZONES).chain(FRACTIONS)
}

/// What a column states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mass {
    Enclosed,
    OfZones,
    Fraction,
}

impl Mass {
    const ALL: [Self; 3] = [Self::Enclosed, Self::OfZones, Self::Fraction];

    fn is(self, variable: &Variable) -> bool {
        let (names, dimension): (&[&str], _) = match self {
            Self::Enclosed => (&ENCLOSED, UnitDimension::MASS),
            Self::OfZones => (&OF_ZONES, UnitDimension::MASS),
            Self::Fraction => (&FRACTIONS, UnitDimension::NONE),
        };
        variable.components == 1
            && names.contains(&plain_name(&variable.name).as_str())
            && variable.unit.as_ref().is_none_or(|u| u.dimension == dimension)
    }
}

/// Whether a variable is the mass within a radius, by its name and its unit.
pub(super) fn is_enclosed_mass(variable: &Variable) -> bool {
    Mass::Enclosed.is(variable)
}

/// The mass that the file states; `None` where no column is one, with a note where one only has the name.
pub(crate) fn budget(
    variables: &[Variable],
    density: &Variable,
    nodes: &[f64],
    length_cgs: Option<f64>,
    notes: &mut Vec<String>,
) -> Option<Budget> {
    let (kind, mass) = Mass::ALL.iter().find_map(|k| Some((*k, variables.iter().find(|v| k.is(v))?)))?;
    let is_staggered = density.location == Location::Cell;
    let has_start = is_staggered && mass.location == Location::Node;
    let rows: Vec<f64> = (usize::from(has_start)..mass.values.len()).map(|i| mass.values.get(i)).collect();
    let zones: Vec<f64> = if kind == Mass::OfZones {
        rows
    } else {
        let start = if has_start { mass.values.get(0) } else { 0.0 };
        let before = std::iter::once(start).chain(rows.iter().copied());
        rows.iter().zip(before).map(|(m, before)| m - before).collect()
    };
    if zones.len() + usize::from(is_staggered) != nodes.len() || !zones.iter().all(|m| *m >= 0.0 && m.is_finite()) {
        notes.push(format!("'{}' is no mass that grows outwards and says nothing of where the rows lie", mass.name));
        return None;
    }
    let (unit, is_stated) = match (&mass.unit, &density.unit, length_cgs) {
        _ if kind == Mass::Fraction => (None, false),
        (Some(m), Some(rho), Some(length)) => (Some(rho.to_cgs * length.powi(3) / m.to_cgs), true),
        (None, None, None) => (Some(1.0), false),
        _ => (None, false),
    };
    Some(Budget { name: mass.name.clone(), zones, is_of_rows: kind == Mass::OfZones, unit, is_stated })
}

/// The rows of a radial geometry.
fn rows(nodes: &[f64], density: &Variable) -> Rows {
    let values = density.values.to_f64();
    match density.location {
        Location::Node => Rows { radii: nodes.to_vec(), density: values, start: 0.0, read_as: Staggering::Nodes },
        Location::Cell => {
            let (radii, start) = (nodes[1..].to_vec(), nodes[0]);
            Rows { radii, density: values, start, read_as: Staggering::OuterFaces }
        }
    }
}

/// The nodes, and the input's variables on them, with the rows where the scene, else the stated mass has them; a note
/// says which that is.
///
/// # Errors
/// A stated mass that fits no way to read the rows.
pub(crate) fn placed<const D: usize>(
    input: &mut Input<'_, D>,
    nodes: Vec<f64>,
    budget: Option<&Budget>,
) -> Result<Vec<f64>> {
    let rows = rows(&nodes, &input.density);
    let found = match (input.options.staggering, budget) {
        (Some(wished), Some(budget)) => closure(&rows, budget, wished),
        (None, Some(budget)) if D == 3 => infer(&rows, budget)?,
        // The mass of a star, or that of a disc: either may be in a file that is used in fewer dimensions.
        (None, Some(budget)) => infer(&rows, budget).unwrap_or(None),
        (_, None) => None,
    };
    let chosen = input.options.staggering.or(found.map(|c| c.staggering)).unwrap_or(rows.read_as);
    if let Some((budget, closure)) = budget.zip(found.as_ref()) {
        input.notes.push(note(&rows, budget, closure));
    }
    if chosen == rows.read_as {
        return Ok(nodes);
    }
    let place = Place { chosen, has_start: rows.read_as == Staggering::OuterFaces, at_center: rows.radii[0] == 0.0 };
    place.change(&mut input.density);
    input.others.iter_mut().for_each(|v| place.change(v));
    Ok(nodes_of(&rows, chosen, budget.zip(found.as_ref())))
}

fn note(rows: &Rows, budget: &Budget, closure: &Closure) -> String {
    let place = match closure.staggering {
        Staggering::Nodes => "points, to which radius, density and mass belong",
        Staggering::OuterFaces => "zones: radius and mass belong to their outer faces, the density to their inside",
        Staggering::InnerFaces => "zones: radius and mass belong to their inner faces, the density to their inside",
        Staggering::Centers => "zones: the radius belongs to their middle, the density to their inside",
    };
    let why = if closure.staggering == rows.read_as { "" } else { ", which the names of columns do not say" };
    let factor = match budget.unit {
        Some(unit) if (closure.factor / unit - 1.0).abs() < 1e-9 => String::new(),
        Some(_) => format!(" (but for a factor of {:.6e}; units are not stated)", closure.factor),
        None => " (in shape; units do not say more)".to_owned(),
    };
    format!("rows are {place}{why}; with '{}' their masses agree to {closure}{factor}", budget.name)
}

fn nodes_of(rows: &Rows, chosen: Staggering, budget: Option<(&Budget, &Closure)>) -> Vec<f64> {
    match chosen {
        Staggering::Nodes | Staggering::InnerFaces => rows.radii.clone(),
        Staggering::OuterFaces if rows.radii[0] == 0.0 => rows.radii.clone(),
        Staggering::OuterFaces => std::iter::once(rows.start).chain(rows.radii.iter().copied()).collect(),
        Staggering::Centers => {
            let by_mass = budget.and_then(|(budget, closure)| faces_of_masses(rows, budget, closure));
            by_mass.unwrap_or_else(|| middle_faces(rows))
        }
    }
}

/// How variables move from the rows as read to those chosen.
struct Place {
    chosen: Staggering,
    /// Whether those at nodes begin with a value at the inner boundary.
    has_start: bool,
    /// Whether the first row is the center.
    at_center: bool,
}

impl Place {
    fn change(&self, variable: &mut Variable) {
        let stored = variable.values.len() / variable.components.max(1);
        let first = usize::from(self.has_start && variable.location == Location::Node);
        let all = || (first..stored).map(Some);
        let is_at_face = self.is_at_face(variable);
        let (location, taken): (Location, Vec<Option<usize>>) = match self.chosen {
            Staggering::Nodes => (Location::Node, all().collect()),
            Staggering::OuterFaces if self.at_center && is_at_face => (Location::Node, all().collect()),
            Staggering::OuterFaces if self.at_center => (Location::Cell, all().skip(1).collect()),
            Staggering::InnerFaces if is_at_face => (Location::Node, all().collect()),
            Staggering::InnerFaces => (Location::Cell, all().take(stored - first - 1).collect()),
            Staggering::OuterFaces | Staggering::Centers if is_at_face => {
                // Masses, velocities and luminosities vanish at the center.
                (Location::Node, std::iter::once(None).chain(all()).collect())
            }
            Staggering::OuterFaces | Staggering::Centers => (Location::Cell, all().collect()),
        };
        variable.values = entries(&variable.values, variable.components, &taken);
        variable.location = location;
    }

    fn is_at_face(&self, variable: &Variable) -> bool {
        if self.has_start {
            return variable.location == Location::Node;
        }
        Mass::Enclosed.is(variable)
            || Mass::Fraction.is(variable)
            || AT_FACES.contains(&plain_name(&variable.name).as_str())
    }
}

/// The given entries, and 0 where there is none.
fn entries(values: &Values, components: usize, taken: &[Option<usize>]) -> Values {
    fn picked<T: Copy + Default>(values: &[T], components: usize, taken: &[Option<usize>]) -> Vec<T> {
        let entry = |row: Option<usize>, k: usize| row.and_then(|i| values.get(i * components + k).copied());
        taken.iter().flat_map(|row| (0..components).map(move |k| entry(*row, k).unwrap_or_default())).collect()
    }
    match values {
        Values::F32(v) => Values::F32(picked(v, components, taken)),
        Values::F64(v) => Values::F64(picked(v, components, taken)),
        Values::I64(v) => Values::I64(picked(v, components, taken)),
    }
}

#[cfg(test)]
#[path = "rows_tests.rs"]
mod tests;
