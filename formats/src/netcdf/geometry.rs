//! The axes of a field: nodes, bounds, and the space that they span.

use super::axes::{self, Role, Steps};
use super::decode;
use super::file::{File, unit};
use crate::common::curvilinear::{Along, complete, coordinates};
use crate::error::Result;
use crate::model::{Coordinates, Geometry, GridAxis, Values};
use crate::registry::FieldRequest;
use crate::units::Unit;
use netcdf_reader::NcVariable;

/// Global attributes that may state the radius from which depth or height counts, in that axis's unit.
const PLANET_RADIUS: &[&str] = &["planet_radius", "earth_radius", "reference_radius"];

/// One dimension of the field in space.
pub struct Axis {
    pub dimension: String,
    pub role: Role,
    pub grid: GridAxis,
    /// The file's order runs against `grid.nodes`.
    pub backward: bool,
}

/// Reads the coordinate variable of a dimension.
///
/// # Errors
/// [`crate::FormatError::Input`] naming the axis and the index at which it is wrong.
pub fn read_axis(file: &File, dimension: &str, role: Role, notes: &mut Vec<String>) -> Result<Axis> {
    let location = format!("axis '{dimension}'");
    let Some(variable) = file.coordinate(dimension) else {
        return Err(file.input(
            &location,
            format!("there is no coordinate variable '{dimension}({dimension})', which says where the values are"),
        ));
    };
    if !decode::is_numeric(variable.dtype()) {
        return Err(file.input(&location, "its coordinates are not numbers"));
    }
    let nodes = decode::read(file, variable, &[None])?.values.to_f64();
    if nodes.len() < 2 {
        return Err(file.input(&location, format!("it has {} nodes, expected at least 2", nodes.len())));
    }
    // Layered models repeat a depth where the density jumps.
    let outward = matches!(role, Role::Radius | Role::Depth | Role::Height);
    let steps = if outward { Steps::Jumps } else { Steps::Strict };
    let (nodes, backward) = axes::ascending(nodes, steps).map_err(|problem| file.input(&location, problem))?;
    let bounds = read_bounds(file, variable, &nodes, backward, notes)?;
    // Degrees are what the role says already, and no unit of the kind that scales a length.
    let stated = axes::text(variable, "units").unwrap_or_default().to_lowercase();
    let angle = matches!(role, Role::Longitude | Role::Latitude);
    if angle && stated.starts_with("rad") {
        return Err(file.unsupported(format!("{location} in radians; convert it to degrees")));
    }
    let is_turned = role.along().is_some_and(Along::is_angle);
    let unit = if angle || is_turned { None } else { unit(file, variable, notes) };
    let mut grid = GridAxis { name: dimension.to_owned(), unit, nodes, bounds };
    if is_turned && stated.starts_with("deg") {
        grid.nodes.iter_mut().chain(grid.bounds.iter_mut().flatten()).for_each(|angle| *angle = angle.to_radians());
    }
    Ok(Axis { dimension: dimension.to_owned(), role, grid, backward })
}

/// CF bounds where they are contiguous and enclose their nodes.
fn read_bounds(
    file: &File,
    variable: &NcVariable,
    nodes: &[f64],
    backward: bool,
    notes: &mut Vec<String>,
) -> Result<Option<Vec<f64>>> {
    let Some(name) = axes::text(variable, "bounds") else {
        return Ok(None);
    };
    let found = file.variables()?.iter().find(|v| v.name() == name);
    let pairs = match found {
        Some(v) if v.shape() == [nodes.len() as u64, 2] && decode::is_numeric(v.dtype()) => {
            decode::read(file, v, &[None, None])?.values
        }
        _ => Values::F64(Vec::new()),
    };
    let mut cells: Vec<(f64, f64)> =
        pairs.to_f64().chunks_exact(2).map(|pair| (pair[0].min(pair[1]), pair[0].max(pair[1]))).collect();
    if backward {
        cells.reverse();
    }
    // In single precision neighbors may disagree about where they meet by the last digit of the place.
    let digits = |x: f64| 2.0 * f64::from(f32::EPSILON) * x.abs();
    let meet = |w: &[(f64, f64)]| {
        let (end, start, step) = (w[0].1, w[1].0, w[0].1 - w[0].0);
        (end - start).abs() <= (1e-6 * step.abs()).max(digits(end)).min(1e-2 * step.abs())
    };
    let touch = cells.windows(2).all(meet);
    let enclose = cells.iter().zip(nodes).all(|(cell, x)| cell.0 < cell.1 && cell.0 <= *x && *x <= cell.1);
    if cells.len() != nodes.len() || !touch || !enclose {
        notes.push(format!("ignored the bounds '{name}', which do not tile the axis '{}'", variable.name()));
        return Ok(None);
    }
    let mut bounds: Vec<f64> = cells.iter().map(|c| c.0).collect();
    bounds.extend(cells.last().map(|c| c.1));
    Ok(Some(bounds))
}

/// The space that the axes span; puts them into its order.
///
/// # Errors
/// [`crate::FormatError::Unsupported`] where they span none that particles could fill.
pub fn geometry(
    file: &File,
    density: &NcVariable,
    axes: &mut [Axis],
    asked: &FieldRequest,
    notes: &mut Vec<String>,
) -> Result<Geometry> {
    let has = |axes: &[Axis], role: Role| axes.iter().any(|a| a.role == role);
    let spherical = has(axes, Role::Longitude) && has(axes, Role::Latitude);
    for axis in axes.iter_mut() {
        match axis.role {
            Role::Depth | Role::Height => outward(file, axis, asked, spherical, notes)?,
            _ => {}
        }
    }
    axes.sort_by_key(|a| a.role);
    for pair in axes.windows(2) {
        if pair[0].role == pair[1].role {
            return Err(file.input(
                &format!("variable '{}'", density.name()),
                format!(
                    "dimensions '{}' and '{}' are both the {} axis",
                    pair[0].dimension,
                    pair[1].dimension,
                    pair[0].role.name()
                ),
            ));
        }
    }
    let roles: Vec<Role> = axes.iter().map(|a| a.role).collect();
    let grids = |axes: &[Axis]| axes.iter().map(|a| a.grid.clone()).collect();
    match roles.as_slice() {
        [Role::Radius] => {
            let axis = &axes[0];
            let first = axis.grid.nodes.first().copied().unwrap_or(0.0);
            if first < 0.0 {
                return Err(file.input(
                    &format!("axis '{}'", axis.dimension),
                    format!("it starts at {first}, expected radii from 0 on"),
                ));
            }
            Ok(Geometry::Radial { nodes: axis.grid.nodes.clone(), unit: axis.grid.unit.clone() })
        }
        [Role::Radius, Role::Longitude, Role::Latitude] => {
            axes.rotate_left(1);
            Ok(Geometry::Grid { coordinates: Coordinates::Geographic, axes: grids(axes) })
        }
        [_, ..] if roles.iter().all(|r| *r <= Role::Z) => {
            Ok(Geometry::Grid { coordinates: Coordinates::Cartesian, axes: grids(axes) })
        }
        [_, ..] if is_curvilinear(&roles) => {
            let known = |a: &Axis| Some((a.role.along()?, a.grid.clone()));
            let (coordinates, cells, more) = complete(axes.iter().filter_map(known).collect())
                .map_err(|(name, problem)| file.input(&format!("axis '{name}'"), problem))?;
            notes.extend(more);
            axes.sort_by_key(|a| cells.iter().position(|c| c.name == a.grid.name));
            Ok(Geometry::Grid { coordinates, axes: cells })
        }
        _ => {
            let names: Vec<_> = roles.iter().map(|r| r.name()).collect();
            Err(file.unsupported(format!(
                "variable '{}' on the axes {}; expected a radius, one to three of x, y, z, radius with theta or phi, radius and z, or longitude, latitude and radius, which fill a volume",
                density.name(),
                names.join(", ")
            )))
        }
    }
}

fn is_curvilinear(roles: &[Role]) -> bool {
    let along: Option<Vec<Along>> = roles.iter().map(|r| r.along()).collect();
    along.is_some_and(|along| coordinates(&along).is_some())
}

/// A radius that is asked for, in the unit of the axis.
fn in_unit_of(file: &File, axis: &Axis, planet: f64, unit: Option<&Unit>) -> Result<f64> {
    let Some(unit) = unit else { return Ok(planet) };
    match axis.grid.unit.as_ref().filter(|own| own.dimension == unit.dimension) {
        Some(own) => Ok(planet * (unit.to_cgs / own.to_cgs)),
        None => Err(file.input(
            &format!("axis '{}'", axis.dimension),
            format!(
                "states no unit of length, so that a planet's radius in {} cannot be used; give input.planet_radius as a plain number, in what the axis counts",
                unit.symbol
            ),
        )),
    }
}

/// Turns depth or height into a radius, where the planet's is given or stated in the file.
fn outward(file: &File, axis: &mut Axis, asked: &FieldRequest, spherical: bool, notes: &mut Vec<String>) -> Result<()> {
    let global =
        |name: &&str| file.nc.global_attribute(name).ok().and_then(|a| Some((a.name.clone(), a.value.as_f64()?)));
    let given = match asked.planet_radius {
        Some(planet) => Some(in_unit_of(file, axis, planet, asked.planet_radius_unit.as_ref())?),
        None => None,
    };
    let given = given.map(|planet| ("input.planet_radius".to_owned(), planet));
    let stated = || PLANET_RADIUS.iter().find_map(global).map(|(n, v)| (format!("the global attribute {n}"), v));
    let Some((name, planet)) = given.or_else(stated) else {
        return Err(file.unsupported(format!(
            "{} from a surface whose radius is not stated{}; set input.planet_radius in the scene or a global attribute planet_radius, in the unit of axis '{}'",
            axis.role.name(),
            if spherical { "" } else { ", without longitude and latitude" },
            axis.dimension
        )));
    };
    let sign = if axis.role == Role::Depth { -1.0 } else { 1.0 };
    let turn = |values: &mut Vec<f64>| {
        values.iter_mut().for_each(|x| *x = planet + sign * *x);
        if sign < 0.0 {
            values.reverse();
        }
    };
    turn(&mut axis.grid.nodes);
    if let Some(bounds) = &mut axis.grid.bounds {
        turn(bounds);
    }
    if sign < 0.0 {
        axis.backward = !axis.backward;
    }
    let innermost = axis.grid.nodes.first().copied().unwrap_or(0.0);
    if !(planet.is_finite() && innermost >= 0.0) {
        return Err(file.input(
            &format!("axis '{}'", axis.dimension),
            format!("with {name} {planet} it reaches radius {innermost}, expected 0 or more; check its unit"),
        ));
    }
    notes.push(format!("turned {} into radius with {name} = {planet}", axis.role.name()));
    axis.role = Role::Radius;
    Ok(())
}
