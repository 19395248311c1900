//! `sph-prep inspect`: the contents of a file.

use super::args::InspectArgs;
use crate::error::Result;
use crate::field::{Orientation, natural_dimension, surface_of};
use crate::input::roles::{Assignment, assign, divide_momenta, reduce_energies, restore_names};
use crate::input::stated_units;
use crate::scene::{Role, parse_mapping};
use sph_formats::{
    Column, FieldRequest, FileContent, FormatSpec, Geometry, GridAxis, Location, ParticleFile, RawField, RefinedAxis,
    RefinedGrid, Unit, UnitSystem, Values, Variable,
};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Describes a readable file.
///
/// # Errors
/// What the reader says.
pub fn inspect(formats: &[FormatSpec], args: &InspectArgs) -> Result<String> {
    let request =
        FieldRequest { density: args.density.clone(), carry: None, time: args.time, ..FieldRequest::default() };
    let progress = super::progress::Progress::new(false);
    progress.begin("read");
    let content = sph_formats::read(formats, &args.file, args.format.as_deref(), &request)?;
    drop(progress);
    let mut out = String::new();
    let map = args.map.iter().map(|text| parse_mapping(text)).collect::<Result<_>>()?;
    match content {
        FileContent::Field(field) => {
            let variables: Vec<String> = field.variables.iter().map(describe_variable).collect();
            let (field, roles) = as_run(field, &map)?;
            describe_field(&mut out, (&field, &variables), &roles)
        }
        FileContent::Particles(file) => describe_particles(&mut out, &args.file.display().to_string(), &file),
    }
    .expect("writing to a string cannot fail");
    Ok(out)
}

/// A field as a run takes it, with the roles of its variables.
fn as_run(mut field: RawField, map: &BTreeMap<String, Role>) -> Result<(RawField, Vec<Assignment>)> {
    let input = stated_units::of_field(&field);
    let divided = divide_momenta(&mut field, |name| map.contains_key(name));
    let mut roles = assign(&field, natural_dimension(&field), map)?;
    reduce_energies(&mut field, &mut roles, input.as_ref());
    restore_names(&mut roles, &divided);
    for (velocity, own) in divided {
        if let Some(v) = field.variables.iter_mut().find(|v| v.name == velocity) {
            v.name = own;
        }
    }
    Ok((field, roles))
}

/// What the file says of a variable.
fn describe_variable(v: &Variable) -> String {
    let place = if v.location == Location::Node { "node" } else { "cell" };
    let values = describe_values(&v.values);
    format!("{:<24} {place}, {} component(s), {values}{}", v.name, v.components, named(&v.unit))
}

fn describe_field(
    out: &mut String,
    (field, variables): (&RawField, &[String]),
    roles: &[Assignment],
) -> std::fmt::Result {
    writeln!(out, "{}: {}, {}", field.path.display(), field.format, field.geometry.kind())?;
    match &field.geometry {
        Geometry::Radial { nodes, unit } => {
            writeln!(
                out,
                "  radius           {} nodes, {:e} to {:e}{}",
                nodes.len(),
                first(nodes),
                last(nodes),
                named(unit)
            )?;
        }
        Geometry::Grid { axes, coordinates } => {
            writeln!(out, "  coordinates      {coordinates:?}")?;
            for GridAxis { name, nodes, unit, bounds } in axes {
                let kind = if bounds.is_some() { ", with cell bounds" } else { "" };
                writeln!(
                    out,
                    "  axis {name:<11} {} nodes, {:e} to {:e}{}{kind}",
                    nodes.len(),
                    first(nodes),
                    last(nodes),
                    named(unit)
                )?;
            }
        }
        Geometry::Refined(grid) => describe_refined(out, grid)?,
        Geometry::Mesh { dimension, points, cells, unit } => {
            writeln!(
                out,
                "  mesh             {dimension}-D, {} points, {} cells{}",
                points.len(),
                cells.types.len(),
                named(unit)
            )?;
        }
        Geometry::Surface { dimension, points, unit, facets } => {
            let count = facets.len() / dimension;
            writeln!(out, "  surface          {dimension}-D, {} points, {count} facets{}", points.len(), named(unit))?;
            describe_surface(out, field, *dimension)?;
        }
        Geometry::Cloud { dimension, points, unit } => {
            writeln!(out, "  cloud            {dimension}-D, {} points{}", points.len(), named(unit))?;
        }
    }
    for (v, described) in field.variables.iter().zip(variables) {
        let mark = match roles.iter().find(|a| a.variable == v.name) {
            Some(Assignment { role: Some(Role::Density), .. }) => "  <- density".to_owned(),
            Some(Assignment { role: Some(role), column, .. }) => format!("  <- {}, written as {column}", role.name()),
            _ => String::new(),
        };
        writeln!(out, "  {described}{mark}")?;
    }
    for a in roles {
        if let Some(note) = &a.note {
            let kind = if a.is_warning { "warning" } else { "note" };
            writeln!(out, "  {kind}: variable '{}' {note}", a.variable)?;
        }
    }
    if matches!(field.geometry, Geometry::Surface { .. }) {
        writeln!(out, "  the density inside is for --density to say: a number, or an expression in x, y, z and r")?;
    } else if field.density.is_none() {
        writeln!(out, "  no variable is taken for the density: name one with --density")?;
    }
    for (key, value) in &field.metadata {
        writeln!(out, "  {key} = {value}")?;
    }
    field.notes.iter().try_for_each(|note| writeln!(out, "  note: {note}"))
}

/// Axes, and what there is of each level.
fn describe_refined(out: &mut String, grid: &RefinedGrid) -> std::fmt::Result {
    for RefinedAxis { name, lo, hi, cells, is_periodic } in &grid.axes {
        let repeats = if *is_periodic { ", periodic" } else { "" };
        writeln!(out, "  axis {name:<11} {cells} cells of level 0, {lo:e} to {hi:e}{}{repeats}", named(&grid.unit))?;
    }
    for (level, [blocks, cells]) in grid.levels().into_iter().enumerate() {
        let widths = grid.axes.iter().enumerate().map(|(k, axis)| {
            let width = (axis.hi - axis.lo) / grid.cells_along(k, level as u8) as f64;
            format!("{width:e}")
        });
        let widths = widths.collect::<Vec<_>>().join(" x ");
        match cells {
            0 => writeln!(out, "  level {level:<10} none")?,
            _ => writeln!(out, "  level {level:<10} {cells} cells of {widths} in {blocks} block(s)")?,
        }
    }
    Ok(())
}

/// What the surface encloses, and what is repaired of it.
fn describe_surface(out: &mut String, field: &RawField, dimension: usize) -> std::fmt::Result {
    if dimension == 2 { enclosed::<2>(out, field) } else { enclosed::<3>(out, field) }
}

fn enclosed<const D: usize>(out: &mut String, field: &RawField) -> std::fmt::Result {
    match surface_of::<D>(&field.path, field.geometry.clone(), &Orientation::default()) {
        Ok((surface, notes)) => {
            let ([lo, hi], volume) = (surface.bounds(), surface.volume_estimate());
            writeln!(out, "  corners          {lo:?} and {hi:?}")?;
            writeln!(out, "  encloses         {:e}, known to {:.1e}", volume.value, volume.error / volume.value)?;
            notes.iter().try_for_each(|note| writeln!(out, "  note: {note}"))
        }
        Err(error) => writeln!(out, "  warning: {error}"),
    }
}

fn describe_particles(out: &mut String, path: &str, file: &ParticleFile) -> std::fmt::Result {
    let h = &file.header;
    writeln!(out, "{path}: particles in {}-D", h.dimension)?;
    writeln!(out, "  box              {:?}, periodic {:?}", h.box_size, h.periodic)?;
    match h.units == UnitSystem::CODE {
        true => writeln!(out, "  units            none stated, or all 1: pure numbers")?,
        false => writeln!(
            out,
            "  units in cgs     length {:e}, mass {:e}, time {:e}",
            h.units.length, h.units.mass, h.units.time
        )?,
    }
    for species in &file.species {
        writeln!(out, "  type {}           {} particles", species.part_type, species.table.count)?;
        for Column { name, components, values, .. } in &species.table.columns {
            writeln!(out, "    {name:<22} {components} component(s), {}", describe_values(values))?;
        }
    }
    h.provenance.iter().try_for_each(|(key, value)| writeln!(out, "  {key}: {value}"))
}

fn describe_values(values: &Values) -> String {
    let kind = match values {
        Values::F32(_) => "f32",
        Values::F64(_) => "f64",
        Values::I64(_) => "i64",
    };
    let (lo, hi, bad) = values.range();
    let missing = if bad > 0 { format!(", {bad} missing or not finite") } else { String::new() };
    if lo > hi { format!("{kind}, no finite value{missing}") } else { format!("{kind}, {lo:e} to {hi:e}{missing}") }
}

fn named(unit: &Option<Unit>) -> String {
    unit.as_ref().map_or(String::new(), |u| format!(" [{}]", u.symbol))
}

fn first(v: &[f64]) -> f64 {
    v.first().copied().unwrap_or(f64::NAN)
}

fn last(v: &[f64]) -> f64 {
    v.last().copied().unwrap_or(f64::NAN)
}
