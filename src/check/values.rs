//! Checks values in the header and the columns that a simulation code cannot use.

use super::finding::{Finding, Level, add, named};
use crate::codes::{AS_PLANETARY, TargetCode};
use sph_formats::common::particle_names as names;
use sph_formats::model::{COSMOLOGY_KEY, DOUBT_KEY, FILES_KEY, ISOTHERMAL_KEY, LACKS_KEY};
use sph_formats::{Column, ParticleFile, RunHeader, Species, UnitSystem};

/// Masses that differ by more are not the same in single precision.
const SAME: f64 = 1e-6;

/// What the reader saw in the header that codes stop at, or read otherwise than it was meant.
pub(super) fn header(header: &RunHeader, code: &TargetCode, findings: &mut Vec<Finding>) {
    let of = |key: &'static str| header.provenance.iter().filter(move |fact| fact.0 == key).map(|fact| &fact.1);
    for doubt in of(DOUBT_KEY) {
        add(findings, Level::Error, "header", format!("{doubt}; expected one answer, write the right one"));
    }
    for cosmology in of(COSMOLOGY_KEY) {
        let text = format!("{cosmology}; {} has to be run with the same cosmology", code.sheet.title);
        add(findings, Level::Warning, "header", text);
    }
    if code.sheet.name == "swift" && of(FILES_KEY).next().is_some() {
        let text =
            "are several of one snapshot, but SWIFT starts from a single one; sph-prep convert FILE NEW joins them";
        add(findings, Level::Error, "files", text);
    }
    // The others take masses from the table.
    let is_read = |what: &&String| code.sheet.name == "swift" || !what.contains("MassTable");
    for lacking in of(LACKS_KEY).filter(is_read) {
        let text = format!("lacks {lacking}, but {} reads it and stops, or takes zeros; write it", code.sheet.title);
        add(findings, Level::Error, "header", text);
    }
}

/// Columns that a code needs of particles of a type.
pub(super) fn needed(part_type: u8, code: &TargetCode) -> &'static [&'static str] {
    match (code.sheet.name, part_type) {
        ("swift", 0) => &[
            names::COORDINATES,
            names::VELOCITIES,
            names::MASSES,
            names::INTERNAL_ENERGY,
            names::SUPPORT_RADIUS,
            names::PARTICLE_IDS,
        ],
        ("phantom", 0) => &[names::COORDINATES, names::MASSES, names::INTERNAL_ENERGY, names::SUPPORT_RADIUS],
        ("phantom" | "pysph" | "dualsphysics", _) => &[names::COORDINATES, names::MASSES],
        (_, 0) => &[names::COORDINATES, names::VELOCITIES, names::MASSES, names::INTERNAL_ENERGY, names::PARTICLE_IDS],
        _ => &[names::COORDINATES, names::VELOCITIES, names::MASSES, names::PARTICLE_IDS],
    }
}

/// Values of the columns that the code reads.
pub(super) fn values(species: &Species, (code, header): (&TargetCode, &RunHeader), findings: &mut Vec<Finding>) {
    let (table, title, d) = (&species.table, code.sheet.title, header.dimension);
    let is_isothermal = header.provenance.iter().any(|fact| fact.0 == ISOTHERMAL_KEY);
    let has = |name: &str| {
        table.column(name).is_some()
            || name == names::SUPPORT_RADIUS && table.column(names::SMOOTHING_LENGTH).is_some()
            || name == names::INTERNAL_ENERGY && is_isothermal
    };
    let is_planetary = AS_PLANETARY.contains(&code.scheme.name);
    let materials: &[&str] = if is_planetary && species.part_type == 0 { &[names::MATERIAL_IDS] } else { &[] };
    for name in needed(species.part_type, code).iter().chain(materials).filter(|name| !has(name)) {
        let text = format!("is missing, but {title} needs it: it would stop, or take zeros; write it");
        add(findings, Level::Error, &named(species, as_in_files(name)), text);
    }
    if table.materials().is_some() && !is_planetary {
        let text = format!("are not read by {title} ({}), which takes all of it for an ideal gas", code.scheme.name);
        add(findings, Level::Warning, &named(species, names::MATERIAL_IDS), text);
    }
    for column in &table.columns {
        if let Some((particle, value)) = first(column, |v| !v.is_finite()) {
            let text = format!("is {value} at particle {particle}, expected finite numbers");
            add(findings, Level::Error, &named(species, as_in_files(&column.name)), text);
        }
    }
    let is_single = |name: &str| {
        IN_SINGLE_PRECISION.contains(&code.sheet.name) && ![names::COORDINATES, names::PARTICLE_IDS].contains(&name)
    };
    for column in table.columns.iter().filter(|column| is_single(&column.name)) {
        let is_beyond = |v: f64| v.is_finite() && v.abs() > f64::from(f32::MAX);
        if let Some((particle, value)) = first(column, is_beyond) {
            let text = format!(
                "is {value:e} at particle {particle}, beyond the single precision (3.4e38) in which {title} keeps it by default: it becomes infinite; expected units in which it is nearer to 1"
            );
            add(findings, Level::Error, &named(species, as_in_files(&column.name)), text);
        }
    }
    positive(species, findings);
    if let Some(masses) = table.column(names::MASSES) {
        of_masses(species, masses, (code, d), findings);
    }
}

/// Codes that keep what particles have, but for their places, in single precision unless they are built otherwise.
const IN_SINGLE_PRECISION: [&str; 4] = ["swift", "gadget4", "gadget2", "gizmo"];

/// Velocities that no matter has.
pub(super) fn velocities(file: &ParticleFile, findings: &mut Vec<Finding>) {
    let units = &file.header.units;
    if *units == UnitSystem::CODE {
        return;
    }
    for species in &file.species {
        let Some(column) = species.table.column(names::VELOCITIES) else { continue };
        if let Some((particle, value)) = first(column, |v| v.abs() * units.length / units.time > LIGHT) {
            let text =
                format!("are {value:?} at particle {particle}, faster than light in the file's units; check them");
            add(findings, Level::Warning, &named(species, names::VELOCITIES), text);
        }
    }
}

/// The speed of light in cm/s.
const LIGHT: f64 = 2.997_924_58e10;

/// A column's name: codes call by their own what stands for the support radius.
pub(super) fn as_in_files(name: &str) -> &str {
    if name == names::SUPPORT_RADIUS { names::SMOOTHING_LENGTH } else { name }
}

/// Columns that have no meaning where they are not positive.
fn positive(species: &Species, findings: &mut Vec<Finding>) {
    let of_gas =
        [names::MASSES, names::INTERNAL_ENERGY, names::SUPPORT_RADIUS, names::SMOOTHING_LENGTH, names::DENSITY];
    let names = if species.part_type == 0 { &of_gas[..] } else { &of_gas[..1] };
    for column in names.iter().filter_map(|name| species.table.column(name)) {
        if let Some((particle, value)) = first(column, |v| v <= 0.0 && v.is_finite()) {
            let text =
                format!("is {value} at particle {particle}, expected positive numbers; codes end in NaN or hang");
            add(findings, Level::Error, &named(species, as_in_files(&column.name)), text);
        }
    }
}

/// The first particle with such a value, and the value.
fn first(column: &Column, is_such: impl Fn(f64) -> bool) -> Option<(usize, f64)> {
    let i = (0..column.values.len()).find(|&i| is_such(column.values.get(i)))?;
    Some((i / column.components.max(1), column.values.get(i)))
}

fn of_masses(species: &Species, masses: &Column, (code, d): (&TargetCode, usize), findings: &mut Vec<Finding>) {
    let (least, most, _) = masses.values.range();
    if let Some(contrast) = code.contrast(&masses.values, d).filter(|_| species.part_type == 0) {
        let level = if contrast.stops() { Level::Error } else { Level::Warning };
        let (title, outcome) = (code.sheet.title, contrast.outcome());
        let text = format!("go from {least:.4e} to {most:.4e}, and {title} {outcome}; expected nearly equal ones");
        add(findings, level, names::MASSES, text);
    }
    // Sinks have one each.
    let has_one = ["phantom", "dualsphysics"].contains(&code.sheet.name) && !species.table.is_of_points();
    if has_one && least > 0.0 && most - least > SAME * most {
        let text = format!(
            "go from {least:e} to {most:e}, but a file of {} has one mass for all particles of a type; make them of equal masses",
            code.sheet.title
        );
        add(findings, Level::Error, &named(species, names::MASSES), text);
    }
}

/// Numbers of particles, over all types.
pub(super) fn numbers(file: &ParticleFile, code: &TargetCode, findings: &mut Vec<Finding>) {
    let columns = || file.species.iter().filter_map(|s| s.table.column(names::PARTICLE_IDS));
    if let Some((particle, value)) = columns().find_map(|column| first(column, |v| v.fract() != 0.0)) {
        let text =
            format!("is {value} at particle {particle}, expected whole numbers; number the particles 1, 2, 3 ...");
        return add(findings, Level::Error, names::PARTICLE_IDS, text);
    }
    let mut ids: Vec<i64> = columns().flat_map(|c| (0..c.values.len()).map(|i| c.values.get(i) as i64)).collect();
    let count = ids.len();
    ids.sort_unstable();
    let (first, last) = (ids.first().copied().unwrap_or(1), ids.last().copied().unwrap_or(1));
    ids.dedup();
    if ids.len() < count {
        let text = format!(
            "{} of {count} are used twice, expected different ones; number the particles 1, 2, 3 ...",
            count - ids.len()
        );
        add(findings, Level::Error, names::PARTICLE_IDS, text);
    }
    if first < 1 {
        let (level, what) = match code.sheet.name {
            "swift" => (Level::Error, "which SWIFT does not take"),
            _ => (Level::Warning, "which has a meaning of its own in some builds"),
        };
        add(findings, level, names::PARTICLE_IDS, format!("begin at {first}, {what}; expected 1 or more"));
    }
    if last > i64::from(i32::MAX) && code.sheet.name != "swift" {
        let text = format!("go to {last}, but {} counts to 2^31 - 1 by default", code.sheet.title);
        add(findings, Level::Error, names::PARTICLE_IDS, text);
    }
}
