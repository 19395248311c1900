//! Builds a field from an output.

use super::amr::{self, Shape};
use super::blocks::{self, Box};
use super::descriptor;
use super::hydro::{self, Wanted};
use super::info::Info;
use super::octs::Octs;
use super::schema::NAME;
use crate::common::wanted::wanted;
use crate::error::{FormatError, Result};
use crate::model::{FIELD_ADIABATIC_INDEX, Geometry, Location, RawField, Values, Variable};
use crate::refined::{RefinedAxis, RefinedBlock, RefinedGrid};
use crate::registry::{FieldRequest, FileContent};
use crate::units::{Unit, UnitDimension, UnitSystem};
use std::path::Path;

/// What the faces of a cell hold, and what their mean is called here.
const FACES: [[&str; 3]; 6] = [
    ["B_x_left", "B_x_right", "magnetic_field_x"],
    ["B_y_left", "B_y_right", "magnetic_field_y"],
    ["B_z_left", "B_z_right", "magnetic_field_z"],
    ["B_left_x", "B_right_x", "magnetic_field_x"],
    ["B_left_y", "B_right_y", "magnetic_field_y"],
    ["B_left_z", "B_right_z", "magnetic_field_z"],
];

/// A variable of the field: its name, and the one or two of the file whose mean it is.
struct Source {
    name: String,
    of: Vec<usize>,
}

/// Reads the output whose info file is at `path`.
///
/// # Errors
/// [`FormatError::Input`] where files are missing, truncated, or contradict each other; [`FormatError::Unsupported`],
/// [`FormatError::Limit`], [`FormatError::Io`].
pub fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let info = Info::read(path)?;
    let (count, gamma) = hydro::variables(&info.file("hydro", 1)?, &info)?;
    let (names, note) = descriptor::names(path, info.dimension, count)?;
    let sources = sources(&names);
    let all: Vec<String> = sources.iter().map(|s| s.name.clone()).collect();
    let (chosen, density) = wanted(&all, request, &["density"])
        .map_err(|(location, problem)| FormatError::input(path, NAME, location, problem))?;
    let sources: Vec<Source> = sources.into_iter().filter(|s| chosen.contains(&s.name)).collect();
    let mut numbers: Vec<usize> = sources.iter().flat_map(|s| s.of.iter().copied()).collect();
    numbers.sort_unstable();
    let (shape, levels) = octs(&info, count, &numbers)?;
    let (grid, values) = grid(path, &info, &shape, levels, numbers.len())?;

    let mut notes = vec![summary(&grid, &info)];
    notes.extend(note);
    if info.units.is_none() {
        notes.push("all units of the info file are 1: the numbers are taken to be without units".into());
    }
    if sources.iter().any(|s| s.of.len() == 2) {
        notes.push("magnetic fields are the means of those of both faces of a cell".into());
    }
    let units = info.units.as_ref();
    let variables = sources.iter().map(|source| variable(source, units, &numbers, &values)).collect();
    Ok(FileContent::Field(RawField {
        path: path.into(),
        format: NAME,
        geometry: Geometry::Refined(grid),
        variables,
        density,
        metadata: vec![("time".into(), info.time.to_string()), (FIELD_ADIABATIC_INDEX.into(), gamma.to_string())],
        notes,
    }))
}

fn sources(names: &[String]) -> Vec<Source> {
    let place = |name: &str| names.iter().position(|n| n == name);
    let pairs = || FACES.iter().filter_map(|[left, right, mean]| Some((place(left)?, place(right)?, *mean)));
    let single = |(i, name): (usize, &String)| {
        let is_face = pairs().any(|(left, right, _)| i == left || i == right);
        (!is_face).then(|| Source { name: name.clone(), of: vec![i] })
    };
    let means = pairs().map(|(left, right, mean)| Source { name: mean.into(), of: vec![left, right] });
    names.iter().enumerate().filter_map(single).chain(means).collect()
}

/// The octs of all files by level, and the shape that these agree on.
fn octs(info: &Info, count: usize, numbers: &[usize]) -> Result<(Shape, Vec<Octs>)> {
    let mut levels: Vec<Octs> = (0..info.levels).map(|_| Octs::default()).collect();
    let mut first: Option<Shape> = None;
    for process in 1..=info.files {
        let path = info.file("amr", process)?;
        let (shape, owned) = amr::read(&path, info, process, &mut levels)?;
        if first.is_some_and(|first| first != shape) {
            let problem = format!("has {shape:?}, but the first file {first:?}; they are of different outputs");
            return Err(FormatError::input(&path, NAME, "the coarse grid", problem));
        }
        let wanted = Wanted { count, numbers, boundaries: shape.boundaries };
        hydro::read(&info.file("hydro", process)?, info, process, &owned, &wanted, &mut levels)?;
        first = first.or(Some(shape));
    }
    // An output has one file at least.
    let shape = first.unwrap_or(Shape { coarse: [1; 3], boundaries: 0 });
    Ok((shape, levels))
}

/// The grid, and the values of its cells for each variable of the files that is read.
fn grid(
    path: &Path,
    info: &Info,
    shape: &Shape,
    levels: Vec<Octs>,
    variables: usize,
) -> Result<(RefinedGrid, Vec<Vec<f64>>)> {
    let Some(within) = levels.first().and_then(Box::of) else {
        return Err(FormatError::input(path, NAME, "octs", "none of the files has one of level 1"));
    };
    let finest = levels.iter().rposition(|octs| !octs.first.is_empty()).map_or(1, |l| l + 1);
    let (mut blocks, mut values): (Vec<RefinedBlock>, _) = (Vec::new(), vec![Vec::new(); variables]);
    for (l, octs) in levels.into_iter().enumerate() {
        blocks::append(path, info, &within, l + 1, &octs, (&mut blocks, &mut values))?;
    }
    let axis = |k: usize| {
        let cells = within.hi[k] - within.lo[k];
        RefinedAxis {
            name: ["x", "y", "z"][k].into(),
            lo: 0.0,
            hi: info.coarse * cells as f64,
            cells,
            is_periodic: cells == shape.coarse[k],
        }
    };
    let grid = RefinedGrid {
        axes: (0..info.dimension).map(axis).collect(),
        unit: info.units.as_ref().map(|system| system.unit(UnitDimension::LENGTH)),
        ratios: (0..=finest).map(|level| 1 << level).collect(),
        blocks,
    };
    grid.validate().map_err(|(location, problem)| FormatError::input(path, NAME, location, problem))?;
    Ok((grid, values))
}

fn summary(grid: &RefinedGrid, info: &Info) -> String {
    let levels = grid.levels().into_iter().enumerate().filter(|(_, [_, cells])| *cells > 0);
    let levels: Vec<String> = levels.map(|(level, [_, cells])| format!("{cells} cells of level {level}")).collect();
    format!(
        "RAMSES output in {} files of each kind: {}, less those that hold finer ones",
        info.files,
        levels.join(", ")
    )
}

fn variable(source: &Source, units: Option<&UnitSystem>, numbers: &[usize], values: &[Vec<f64>]) -> Variable {
    let column = |number: &usize| numbers.iter().position(|n| n == number).map_or(&[][..], |place| &values[place]);
    let values = match source.of.as_slice() {
        [left, right] => column(left).iter().zip(column(right)).map(|(l, r)| 0.5 * l + 0.5 * r).collect(),
        [one, ..] => column(one).to_vec(),
        [] => Vec::new(),
    };
    Variable {
        name: source.name.clone(),
        description: None,
        unit: units.and_then(|system| unit(system, &source.name)),
        location: Location::Cell,
        components: 1,
        values: Values::F64(values),
    }
}

/// The unit of a variable, where its name tells.
fn unit(system: &UnitSystem, name: &str) -> Option<Unit> {
    let dimension = match name {
        "density" => UnitDimension::mass_density(3),
        "pressure" | "thermal_pressure" => UnitDimension::PRESSURE,
        "metallicity" => UnitDimension::NONE,
        _ if name.starts_with("velocity_") => UnitDimension::VELOCITY,
        _ if name.starts_with("magnetic_field_") => UnitDimension::MAGNETIC_FIELD,
        _ if name.starts_with("non_thermal_") => UnitDimension::PRESSURE,
        _ => return None,
    };
    Some(system.unit(dimension))
}
