//! `sph-prep convert`: particles from one format to another. The new file is read back to find what its format cannot hold, so that the list
//! describes what actually happened.

use super::args::ConvertArgs;
use super::files::{particles, particles_in};
use super::progress::Progress;
use crate::error::{Error, Result};
use crate::input::support::support_radii;
use crate::run::destination::meet_corner;
use crate::run::destination::{refuse_replacing, refuse_units_that_look_pure};
use crate::scene::system_of;
use sph_formats::common::particle_names as names;
use sph_formats::model::{COSMOLOGY_KEY, DOUBT_KEY, FILES_KEY, LACKS_KEY};
use sph_formats::{Column, FormatSpec, ParticleFile, Species, UnitSystem, registry};

/// Relative change of a column that is more than the rounding to f32.
const ROUNDING: f64 = 1e-6;

/// Converts a particle file; returns what there is to say about it.
///
/// # Errors
/// What the reader and the writer say; a file that holds a field; units or a box that make no sense.
pub fn convert(formats: &[FormatSpec], args: &ConvertArgs) -> Result<Vec<String>> {
    let target = registry::detect_output(formats, &args.to, args.to_format.as_deref())?;
    registry::writer(target, &args.to)?;
    let mut notes = Vec::new();
    for path in registry::output_files(target, &args.to, args.files)? {
        refuse_replacing("the new file", &path, &args.from)?;
        if path.exists() {
            notes.push(format!("an older '{}' was replaced", path.display()));
        }
        sph_formats::output::probe(&path)?;
    }
    let progress = Progress::new(false);
    progress.begin("read");
    let mut file = particles_in(formats, &args.from, args.format.as_deref(), args.open)?;
    notes.extend(file.header.take(DOUBT_KEY));
    notes.extend(file.header.take(COSMOLOGY_KEY));
    file.header.take(LACKS_KEY);
    notes.extend(take_types(&mut file, &args.types)?);
    name_units(&mut file.header.units, args)?;
    if let Some(name) = &args.units {
        refuse_units_that_look_pure(target, "--units", name)?;
        file.change_units(system_of("--units", name)?);
    }
    if let Some(edge) = args.box_size {
        if !(edge.is_finite() && edge > 0.0) {
            return Err(Error::scene("--box", format!("is {edge}, expected a positive length")));
        }
        let d = file.header.dimension;
        file.header.box_size.iter_mut().take(d).for_each(|l| *l = edge);
    }
    notes.extend(no_numbers(&file));
    notes.extend(no_masses(&file));
    notes.extend(meet_corner(&mut file, target));
    progress.begin("support radii");
    notes.extend(support_radii(&args.from, &mut file));
    let options = args.encoding.options();
    progress.begin("write");
    let written = sph_formats::write_files(formats, &args.to, Some(target.name), &file, args.files, options)?;
    let told = written.first().unwrap_or(&args.to);
    if let ([first, .., last], true) = (written.as_slice(), written.len() > 1) {
        notes.push(format!("{} files were written: '{}' to '{}'", written.len(), first.display(), last.display()));
    }
    progress.begin("compare");
    let own_reader = (target.capabilities.read_particles && target.read.is_some()).then_some(target.name);
    match particles(formats, told, own_reader) {
        Ok(back) => notes.extend(losses(target.name, &file, back)),
        Err(e) => notes.push(format!("what '{}' holds could not be checked: {e}", args.to.display())),
    }
    Ok(notes)
}

/// Leaves the particles of other types out, where some are named; what is said of that.
///
/// # Errors
/// A type of which there are no particles.
fn take_types(file: &mut ParticleFile, types: &[u8]) -> Result<Option<String>> {
    let counts = |species: &[Species]| {
        let told: Vec<String> = species.iter().map(|s| format!("{} of type {}", s.table.count, s.part_type)).collect();
        told.join(" and ")
    };
    if let Some(absent) = types.iter().find(|t| !file.species.iter().any(|s| s.part_type == **t)) {
        let problem = format!("names {absent}, but the file has {}", counts(&file.species));
        return Err(Error::scene("--types", problem));
    }
    if types.is_empty() {
        return Ok(None);
    }
    let left_out: Vec<Species> = file.species.extract_if(.., |s| !types.contains(&s.part_type)).collect();
    Ok((!left_out.is_empty()).then(|| format!("left out, as --types says: {}", counts(&left_out))))
}

/// Notes of columns with values that are no numbers, which few codes survive.
fn no_numbers(file: &ParticleFile) -> Vec<String> {
    let columns = file.species.iter().flat_map(|s| &s.table.columns);
    let counted = columns.map(|c| (c, (0..c.values.len()).filter(|&i| !c.values.get(i).is_finite()).count()));
    let told = |(c, bad): (&Column, usize)| {
        format!("'{}' has {bad} values of {} that are no finite numbers", c.name, c.values.len())
    };
    counted.filter(|(_, bad)| *bad > 0).map(told).collect()
}

/// Types of particles without masses, which tables with other types show as no numbers.
fn no_masses(file: &ParticleFile) -> Vec<String> {
    let lacking = file.species.iter().filter(|s| s.table.column(names::MASSES).is_none());
    lacking.map(|s| format!("the {} particles of type {} have no masses", s.table.count, s.part_type)).collect()
}

/// Gives a file without units those that are asked for. Pure numbers cannot be expressed in others.
fn name_units(units: &mut UnitSystem, args: &ConvertArgs) -> Result<()> {
    let is_pure = *units == UnitSystem::CODE;
    match (&args.input_units, &args.units) {
        (Some(_), _) if !is_pure => {
            Err(Error::scene("--input-units", "is for files without units, and this one states its own; leave it out"))
        }
        (Some(name), _) => {
            *units = system_of("--input-units", name)?;
            Ok(())
        }
        (None, Some(name)) if is_pure && name != "code" => {
            let problem = format!(
                "is {name}, but '{}' states no units, or units of 1, which pure numbers have; say with --input-units what they are in",
                args.from.display()
            );
            Err(Error::scene("--units", problem))
        }
        _ => Ok(()),
    }
}

fn same_units(a: &UnitSystem, b: &UnitSystem) -> bool {
    let factors = |u: &UnitSystem| [u.length, u.mass, u.time, u.temperature];
    factors(a).iter().zip(factors(b)).all(|(a, b)| (a - b).abs() <= 1e-9 * a.abs())
}

/// What the new file lacks of the old one.
fn losses(format: &str, file: &ParticleFile, mut back: ParticleFile) -> Vec<String> {
    let mut lost = Vec::new();
    let stated = back.header.units;
    if stated != UnitSystem::CODE {
        // The same numbers in other units are no loss.
        back.change_units(file.header.units);
        if !same_units(&stated, &file.header.units) {
            let UnitSystem { length, mass, time, .. } = stated;
            lost.push(format!(
                "{format} holds the numbers in units of its own: {length:.6e} cm, {mass:.6e} g and {time:.6e} s"
            ));
        }
    }
    for species in file.species.iter().filter(|s| s.table.count > 0) {
        let t = species.part_type;
        let Some(new) = back.species.iter().find(|s| s.part_type == t) else {
            lost.push(format!("{format} does not keep particles of type {t}"));
            continue;
        };
        for column in &species.table.columns {
            match new.table.column(&column.name.replace('/', "_")) {
                None => lost.push(format!("{format} does not hold column '{}' of type {t}", column.name)),
                Some(stored) => {
                    let change = change(column, stored);
                    if change > ROUNDING {
                        lost.push(format!(
                            "{format} holds column '{}' of type {t} with other values, by up to {change:.1e} of the largest",
                            column.name
                        ));
                    }
                }
            }
        }
    }
    let (old, new) = (&file.header, &back.header);
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * a.abs();
    let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| close(*a, *b));
    let checks = [
        ("the unit system", same_units(&old.units, &new.units)),
        ("the box", same(&old.box_size, &new.box_size)),
        ("where the box lies", old.box_corner.is_none_or(|c| same(&c, &new.box_corner.unwrap_or_default()))),
        ("which axes are periodic", old.periodic == new.periodic),
        ("the dimension", old.dimension == new.dimension),
        ("the time", close(old.time, new.time)),
        ("the kernel", old.kernel == new.kernel && close(old.kernel_neighbors, new.kernel_neighbors)),
        // Which files the particles came from is no fact of their own.
        ("the provenance", old.provenance.iter().all(|fact| fact.0 == FILES_KEY || new.provenance.contains(fact))),
    ];
    lost.extend(checks.iter().filter(|(_, kept)| !kept).map(|(what, _)| format!("{format} does not hold {what}")));
    lost
}

/// Largest difference between two columns, over the largest value.
fn change(old: &Column, new: &Column) -> f64 {
    if old.components != new.components || old.values.len() != new.values.len() {
        return 1.0;
    }
    let range = (0..old.values.len()).map(|i| old.values.get(i).abs()).filter(|v| v.is_finite()).fold(0.0, f64::max);
    let difference = |i: usize| (old.values.get(i) - new.values.get(i)).abs();
    let largest = (0..old.values.len()).map(difference).filter(|v| v.is_finite()).fold(0.0, f64::max);
    if largest == 0.0 { 0.0 } else { largest / range.max(f64::MIN_POSITIVE) }
}
