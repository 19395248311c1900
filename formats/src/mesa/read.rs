//! Reader of MESA profiles.

use super::faces;
use super::quantities::{DENSITY, MASS, Place, QUANTITIES, Quantity, RADIUS, Scale, is_mass_fraction};
use super::schema::NAME;
use super::sheet::Sheet;
use crate::common::columns::{Candidate, select};
use crate::common::text::Text;
use crate::error::Result;
use crate::model::{Location, RawField};
use crate::registry::{FieldRequest, FileContent};
use crate::units::{SOLAR_MASS_CGS, SOLAR_RADIUS_CGS};
use std::path::Path;

/// Nominal solar luminosity of IAU 2015 B3, erg/s.
const SOLAR_LUMINOSITY_CGS: f64 = 3.828e33;
/// Mass (g) and radius (cm) of the Sun in MESA before it took over the nominal values.
const OLD_SUN: (f64, f64) = (1.989_2e33, 6.959_8e10);

/// Columns that only number, or restate the zone's own mass or place.
const BOOKKEEPING: [&str; 3] = ["zone", "rmid", "q"];

/// Solar units of a file, in cgs.
#[derive(Debug, Clone, Copy)]
struct Solar {
    mass: f64,
    radius: f64,
    luminosity: f64,
}

pub fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let text = Text::read(path, NAME)?;
    let sheet = Sheet::parse(&text)?;
    let mut notes = Vec::new();
    let solar = solar_units(&sheet, &mut notes);
    let center = inner_boundary(&sheet, solar, &mut notes);
    let nodes = radial_nodes(&text, &sheet, solar, center, &mut notes)?;

    let candidates = candidates(&sheet, solar, center.1);
    let guess = quantity(&sheet, DENSITY).map(|_| DENSITY.to_owned());
    let selected = select(&text, request, candidates, guess)?;
    notes.push(
        "radius, mass, velocity and luminosity belong to the outer faces of the zones, everything else to their inside"
            .into(),
    );
    Ok(FileContent::Field(RawField::stellar((path, NAME), nodes, selected, sheet.header, notes)))
}

/// The best column for a variable, and its place among the columns.
fn quantity(sheet: &Sheet, name: &str) -> Option<(&'static Quantity, usize)> {
    QUANTITIES.iter().filter(|q| q.name == name).find_map(|q| Some((q, position(sheet, q.column)?)))
}

fn position(sheet: &Sheet, column: &str) -> Option<usize> {
    sheet.names.iter().position(|n| n.eq_ignore_ascii_case(column))
}

/// Column `i` in the cgs unit of its quantity, surface first.
fn in_cgs(sheet: &Sheet, (quantity, i): (&Quantity, usize), solar: Solar) -> Vec<f64> {
    let factor = match quantity.scale {
        Scale::Cgs => 1.0,
        Scale::Times(factor) => factor,
        Scale::SolarRadius => solar.radius,
        Scale::SolarMass => solar.mass,
        Scale::SolarLuminosity => solar.luminosity,
    };
    let linear = |v: &f64| factor * if quantity.log { 10_f64.powf(*v) } else { *v };
    sheet.columns.get(i).into_iter().flatten().map(linear).collect()
}

/// The header's `msun`, `rsun`, `lsun`; without them the pair of MESA's constants with which the shells have the
/// stated mass.
fn solar_units(sheet: &Sheet, notes: &mut Vec<String>) -> Solar {
    let stated = |name: &str, nominal: f64| sheet.number(name).filter(|v| (v / nominal - 1.0).abs() < 0.01);
    let luminosity = stated("lsun", SOLAR_LUMINOSITY_CGS).unwrap_or(SOLAR_LUMINOSITY_CGS);
    if let (Some(mass), Some(radius)) = (stated("msun", SOLAR_MASS_CGS), stated("rsun", SOLAR_RADIUS_CGS)) {
        notes.push(format!("solar units from the header: {mass:e} g and {radius:e} cm"));
        return Solar { mass, radius, luminosity };
    }
    let nominal = Solar { mass: SOLAR_MASS_CGS, radius: SOLAR_RADIUS_CGS, luminosity };
    let old = Solar { mass: OLD_SUN.0, radius: OLD_SUN.1, luminosity };
    let error = |solar: Solar| {
        let column = |name| quantity(sheet, name).map(|found| in_cgs(sheet, found, solar));
        let ratio = faces::shells_over_stated(&column(RADIUS)?, &column(MASS)?, &column(DENSITY)?)?;
        Some((ratio - 1.0).abs())
    };
    let (chosen, why) = match (error(nominal), error(old)) {
        (Some(new), Some(old_error)) if old_error < new => {
            (old, format!("those of older MESA, with which density and mass agree to {old_error:.0e}"))
        }
        (Some(new), Some(_)) => {
            (nominal, format!("the nominal ones of the IAU, with which density and mass agree to {new:.0e}"))
        }
        _ => (nominal, "the nominal ones of the IAU".to_owned()),
    };
    notes.push(format!(
        "the header states no solar units: taken are {:e} g and {:e} cm, {why}",
        chosen.mass, chosen.radius
    ));
    chosen
}

/// Radius (cm) and mass (g) at the inner boundary, 0 for a whole star. Headers give them in cgs or solar units.
fn inner_boundary(sheet: &Sheet, solar: Solar, notes: &mut Vec<String>) -> (f64, f64) {
    let stated = |names: [&str; 2], name: &str, unit: f64| {
        let value = names.iter().find_map(|n| sheet.number(n)).filter(|v| v.is_finite() && *v > 0.0)?;
        let innermost = *in_cgs(sheet, quantity(sheet, name)?, solar).last()?;
        // A solar unit is so large that only one of the two readings lies within the innermost face.
        [value * unit, value].into_iter().find(|v| *v < innermost)
    };
    let radius = stated(["R_center", "r_center"], RADIUS, solar.radius).unwrap_or(0.0);
    let mass = stated(["M_center", "m_center"], MASS, solar.mass).unwrap_or(0.0);
    if radius > 0.0 || mass > 0.0 {
        notes.push(format!("the model begins at {radius:e} cm, with {mass:e} g within"));
    }
    (radius, mass)
}

fn radial_nodes(
    text: &Text,
    sheet: &Sheet,
    solar: Solar,
    center: (f64, f64),
    notes: &mut Vec<String>,
) -> Result<Vec<f64>> {
    if let Some(found) = quantity(sheet, RADIUS) {
        if let Some(mass) = quantity(sheet, MASS) {
            faces::check_masses(text, sheet, &in_cgs(sheet, mass, solar))?;
        }
        return faces::nodes(text, sheet, &in_cgs(sheet, found, solar), center.0);
    }
    let (Some(mass), Some(density)) = (quantity(sheet, MASS), quantity(sheet, DENSITY)) else {
        let problem = format!(
            "there is no radius or logR, nor mass and density to rebuild it from; the columns are {}",
            sheet.names.join(", ")
        );
        return Err(text.error("variable 'radius'", problem));
    };
    let masses = in_cgs(sheet, mass, solar);
    let radii = faces::rebuild(text, sheet, &masses, &in_cgs(sheet, density, solar), center)?;
    notes.push("there is no radius: it was rebuilt from mass and density, zone by zone".into());
    faces::nodes(text, sheet, &radii, center.0)
}

/// Every column that is more than bookkeeping, from the center outwards.
fn candidates(sheet: &Sheet, solar: Solar, center_mass: f64) -> Vec<Candidate> {
    let mut found = Vec::new();
    for (i, column) in sheet.names.iter().enumerate() {
        if BOOKKEEPING.contains(&column.as_str()) {
            continue;
        }
        let Some(known) = QUANTITIES.iter().find(|q| q.column.eq_ignore_ascii_case(column)) else {
            let values: Vec<f64> = sheet.columns.get(i).into_iter().flatten().rev().copied().collect();
            let unit = is_mass_fraction(column).then_some("1");
            found.push(Candidate::new(column, column, unit, Location::Cell, values));
            continue;
        };
        // A second column for the same variable says nothing new, and the radius is the geometry.
        if known.name == RADIUS || quantity(sheet, known.name).is_none_or(|(_, best)| best != i) {
            continue;
        }
        let mut values = in_cgs(sheet, (known, i), solar);
        let location = match known.place {
            Place::Inside => Location::Cell,
            Place::FaceFromZero => {
                values.push(if known.name == MASS { center_mass } else { 0.0 });
                Location::Node
            }
            Place::FaceFlat => {
                values.extend(values.last().copied());
                Location::Node
            }
        };
        values.reverse();
        found.push(Candidate::new(column, known.name, Some(known.unit), location, values));
    }
    found
}
