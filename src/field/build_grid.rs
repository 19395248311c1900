//! Builds sources from rectilinear grids.

use super::build_input::{Input, Repeats, check_ascending};
use super::centering::{Known, SLACK, cell_axis, even_step, periodic_axis};
use super::check::point_text;
use super::curvilinear::{Curvilinear, check_faces};
use super::geographic::Geographic;
use super::grid::Grid;
use super::grid_axis::AxisTable;
use super::stepped::Stepped;
use super::{Centering, FieldOptions, Interpolation, Period, ScalarField, Source};
use crate::error::{Error, Result};
use sph_formats::common::particle_names as names;
use sph_formats::{Coordinates, GridAxis, Location, Values, Variable};
use std::sync::Arc;

pub(crate) fn cartesian<const D: usize>(mut input: Input<'_, D>, axes: &[GridAxis]) -> Result<Source<D>> {
    check_grid(&mut input, axes, D)?;
    let name = input.density.name.clone();
    let options = input.options;
    let centering = centering(&input, axes)?;
    let mut notes = Vec::new();
    let tables = |location: Location, notes: &mut Vec<String>| -> Result<Grid<D>> {
        let tables: Vec<AxisTable> = (0..D)
            .map(|k| {
                let axis = &axes[k];
                let is_open_question = location == Location::Node && axis.bounds.is_none();
                match (options.periodic[k], centering) {
                    // Nodes between cells end where these do.
                    (Some(Period::Auto), _) if is_open_question && input.density.location == Location::Cell => {
                        AxisTable::nodes(&axis.name, axis.nodes.clone(), Some(Period::Auto), true)
                    }
                    (Some(Period::Auto), centering) if is_open_question => {
                        let ends_agree = || ends_agree(&input.density, &input.others, axes, k);
                        let stated = options.stated_box.map(|[lo, hi]| [lo[k], hi[k]]);
                        let known = Known { centering, stated, ends_agree: &ends_agree };
                        let (table, note) = periodic_axis(&name, (&axis.name, &axis.nodes), &known)?;
                        notes.extend(note);
                        Ok(table)
                    }
                    (period, Centering::Cells) if is_open_question => cell_axis((&axis.name, &axis.nodes), period),
                    (None, Centering::Unknown) if is_open_question && is_box_of_cells(options, k, axis) => {
                        cell_axis((&axis.name, &axis.nodes), None)
                    }
                    (period, _) => axis_table(&name, axis, location, period),
                }
            })
            .collect::<Result<_>>()?;
        grid(&name, tables, (options.interpolation, Interpolation::PiecewiseLinear))
    };
    let sampler = tables(input.density.location, &mut notes)?;
    let sampler = Arc::new(sampler.keeping_shapes(&input.density.values));
    let domain = sampler.domain()?;
    let other = [Location::Node, Location::Cell].into_iter().find(|l| *l != input.density.location);
    let other = match other.filter(|l| input.others.iter().any(|v| v.location == *l)) {
        Some(location) => Some(Arc::new(tables(location, &mut Vec::new())?)),
        None => None,
    };
    notes.extend(ends_at_nodes(&input, axes, centering));
    input.notes.extend(notes);
    let of_cells = mass_of_cells(&input.density, axes);
    let own = Arc::clone(&sampler);
    let density = |density| match Stepped::of(density) {
        Ok(stepped) => Box::new(stepped) as Box<dyn ScalarField<D>>,
        Err(density) => Box::new(density),
    };
    let mut source =
        input.finish_as(sampler, domain, &|_| Ok(other.clone().unwrap_or_else(|| Arc::clone(&own))), &density)?;
    let off = of_cells.zip(source.mass).map(|(cells, mass)| mass.value / cells - 1.0);
    source.notes.extend(off.filter(|off| off.abs() > KEPT).map(|off| {
        format!(
            "interpolated between the middles of cells, the density has a mass that is {:+.3} % off that of the cells; `interpolation: piecewise-linear` keeps it",
            100.0 * off
        )
    }));
    Ok(source)
}

/// By how much interpolation may change the mass of cells without a word.
const KEPT: f64 = 1e-6;

/// The mass of a density that is known to be the mean of each cell of a grid.
fn mass_of_cells(density: &Variable, axes: &[GridAxis]) -> Option<f64> {
    let faces = |axis: &GridAxis| match density.location {
        Location::Cell => Some(axis.nodes.clone()),
        Location::Node => axis.bounds.clone(),
    };
    let widths: Vec<Vec<f64>> =
        axes.iter().map(|axis| Some(faces(axis)?.windows(2).map(|w| w[1] - w[0]).collect())).collect::<Option<_>>()?;
    let volume = |mut cell: usize| {
        let along = |widths: &Vec<f64>| {
            let width = widths[cell % widths.len()];
            cell /= widths.len();
            width
        };
        widths.iter().map(along).product::<f64>()
    };
    let mass: f64 = (0..density.values.len()).map(|i| density.values.get(i) * volume(i)).sum();
    (mass > 0.0).then_some(mass)
}

/// Whether the scene's box ends half a step beyond the nodes of an axis, as cells about them do.
fn is_box_of_cells<const D: usize>(options: &FieldOptions<D>, k: usize, axis: &GridAxis) -> bool {
    let (Some([lo, hi]), Some(step)) = (options.stated_box, even_step(&axis.nodes)) else { return false };
    let ends = [(lo[k], axis.nodes[0] - 0.5 * step), (hi[k], axis.nodes[axis.nodes.len() - 1] + 0.5 * step)];
    ends.iter().all(|(stated, face)| (stated - face).abs() <= SLACK * step)
}

/// What is said of values of which nobody says whether they are those of cells or of nodes, and which count as the latter.
fn ends_at_nodes<const D: usize>(input: &Input<'_, D>, axes: &[GridAxis], centering: Centering) -> Option<String> {
    let is_open = |k: usize| {
        let is_asked = input.options.periodic[k].is_none() && axes[k].bounds.is_none() && axes[k].nodes.len() > 1;
        is_asked && !is_box_of_cells(input.options, k, &axes[k])
    };
    let open: Vec<usize> = (0..D).filter(|&k| is_open(k)).collect();
    if centering != Centering::Unknown || input.density.location == Location::Cell || open.is_empty() {
        return None;
    }
    let remedy = match open.iter().all(|&k| even_step(&axes[k].nodes).is_some()) {
        true => "write `centering: cells`",
        false => "give the file bounds of its cells",
    };
    let names: Vec<&str> = open.iter().map(|&k| axes[k].name.as_str()).collect();
    Some(format!(
        "values are taken to be at nodes, and the domain to end at the first and the last of them along {}; if they are means of cells, which reach half a \
         step farther, {remedy} (input.centering)",
        names.join(", ")
    ))
}

/// What the scene and the file say of the values at nodes.
fn centering<const D: usize>(input: &Input<'_, D>, axes: &[GridAxis]) -> Result<Centering> {
    let has_cells = |v: &Variable| v.location == Location::Cell;
    let states_cells = has_cells(&input.density) || axes.iter().any(|axis| axis.bounds.is_some());
    match input.options.centering {
        Centering::Nodes if states_cells => Err(Error::scene(
            "input.centering",
            format!(
                "is nodes, but the file says that the values of '{}' belong to cells; leave it out",
                input.density.name
            ),
        )),
        // The nodes are the corners of the cells of other variables.
        Centering::Unknown | Centering::Points if !states_cells && input.others.iter().any(has_cells) => {
            Ok(Centering::Nodes)
        }
        stated => Ok(stated),
    }
}

pub(crate) fn geographic<const D: usize>(mut input: Input<'_, D>, axes: &[GridAxis]) -> Result<Source<D>> {
    check_grid(&mut input, axes, D)?;
    let name = input.density.name.clone();
    let interpolation = input.options.interpolation;
    let longitudes = &axes[0].nodes;
    let (first, last) = (longitudes[0], longitudes[longitudes.len() - 1]);
    let step = (last - first) / (longitudes.len() as f64 - 1.0);
    Geographic::check_longitudes(&name, first, (last + step).min(first + 360.0).max(last))?;
    let tables = |location: Location| -> Result<Arc<Geographic>> {
        let circle = Some(Period::Length(360.0));
        let tables = vec![
            axis_table(&name, &axes[0], location, circle)?,
            axis_table(&name, &axes[1], location, None)?,
            axis_table(&name, &axes[2], location, None)?,
        ];
        Ok(Arc::new(Geographic::new(&name, grid(&name, tables, (interpolation, Interpolation::Constant))?)?))
    };
    // Those that are known by their names have Cartesian components.
    let is_known = |v: &Variable| matches!(v.name.as_str(), names::VELOCITIES | names::MAGNETIC_FIELD);
    let is_unknown = |v: &Variable| v.components > 1 && !is_known(v);
    let vectors = input.others.iter().filter(|v| is_unknown(v)).map(|v| v.name.clone()).collect::<Vec<_>>();
    if !vectors.is_empty() {
        input.others.retain(|v| !is_unknown(v));
        input.notes.push(format!("vectors on a geographic grid were left out: {}", vectors.join(", ")));
    }
    let sampler = tables(input.density.location)?;
    let domain = sampler.domain()?;
    input.finish(sampler, domain, &|location| Ok(tables(location)?))
}

pub(crate) fn curvilinear<const D: usize>(
    mut input: Input<'_, D>,
    coordinates: Coordinates,
    axes: &[GridAxis],
) -> Result<Source<D>> {
    check_grid(&mut input, axes, 3)?;
    let name = input.density.name.clone();
    let faces: Vec<Vec<f64>> = axes.iter().filter_map(|axis| axis.bounds.clone()).collect();
    let at_cells = std::iter::once(&input.density).chain(&input.others).all(|v| v.location == Location::Node);
    let (Ok(faces), true) = (<[Vec<f64>; 3]>::try_from(faces), at_cells) else {
        let problem =
            format!("is on a grid of kind {coordinates:?}, which needs the faces of its cells along three axes");
        return Err(Error::field(name, problem));
    };
    let (faces, is_round) = check_faces(&name, coordinates, faces)?;
    let along_z = input.options.periodic.get(2).copied().flatten();
    let [height, azimuth] = coordinates.height_and_azimuth();
    let tables = faces.into_iter().zip(axes).enumerate().map(|(k, (faces, axis))| {
        let centers = faces.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
        let period = match k {
            _ if k == azimuth => is_round.then_some(Period::Auto),
            _ if k == height && coordinates != Coordinates::Spherical => along_z,
            _ => None,
        };
        AxisTable::cells(&axis.name, faces, centers, period)
    });
    let tables = tables.collect::<Result<Vec<_>>>()?;
    let sampler = Arc::new(Curvilinear::new(
        coordinates,
        grid(&name, tables, (input.options.interpolation, Interpolation::Constant))?,
    ));
    input.notes.extend(sampler.notes::<D>());
    let domain = sampler.domain()?;
    let own = Arc::clone(&sampler);
    input.finish(sampler, domain, &|_| Ok(Arc::clone(&own) as Arc<dyn super::sampled::Sampler<D>>))
}

/// A grid with the interpolation that is asked for, or else linear between nodes and as `of_cells` in cells.
fn grid<const K: usize>(
    name: &str,
    tables: Vec<AxisTable>,
    (interpolation, of_cells): (Option<Interpolation>, Interpolation),
) -> Result<Grid<K>> {
    let has_cells = tables.iter().all(AxisTable::is_cells) && of_cells == Interpolation::PiecewiseLinear;
    if interpolation == Some(Interpolation::PiecewiseLinear) && !has_cells {
        let problem = format!(
            "is piecewise-linear, which there is for cells with Cartesian axes, but '{name}' is not known in such ones; leave it out"
        );
        return Err(Error::scene("input.interpolation", problem));
    }
    let default = match tables.iter().any(AxisTable::is_cells) {
        true if has_cells => of_cells,
        true => Interpolation::Constant,
        false => Interpolation::Linear,
    };
    let axes = tables
        .try_into()
        .map_err(|t: Vec<AxisTable>| Error::field(name, format!("the grid has {} axes, expected {K}", t.len())))?;
    Ok(Grid::new(axes, interpolation.unwrap_or(default)))
}

/// Axes in order, and the density's values with a place for each.
fn check_grid<const D: usize>(input: &mut Input<'_, D>, axes: &[GridAxis], count: usize) -> Result<()> {
    let name = input.density.name.clone();
    if axes.len() != count {
        return Err(Error::field(name, format!("the grid has {} axes, expected {count}", axes.len())));
    }
    for axis in axes {
        if axis.nodes.len() < 2 && axis.bounds.is_none() {
            return Err(Error::field(
                &name,
                format!(
                    "axis '{}' has {} node(s), expected two or more; choose fewer dimensions",
                    axis.name,
                    axis.nodes.len()
                ),
            ));
        }
        let what = format!("axis '{}'", axis.name);
        // An equal pair is a discontinuity of layered models.
        check_ascending(
            &name,
            &what,
            &axis.nodes,
            if axis.bounds.is_some() { Repeats::Refused } else { Repeats::Allowed },
        )?;
        if let Some(bounds) = &axis.bounds {
            check_ascending(&name, &format!("the bounds of axis '{}'", axis.name), bounds, Repeats::Refused)?;
            if bounds.len() != axis.nodes.len() + 1 {
                return Err(Error::field(
                    &name,
                    format!(
                        "axis '{}' has {} nodes and {} bounds, expected one more",
                        axis.name,
                        axis.nodes.len(),
                        bounds.len()
                    ),
                ));
            }
        }
    }
    let location = input.density.location;
    input.check(&|mut i| {
        let mut indices = Vec::new();
        let mut position = Vec::new();
        for axis in axes {
            let n = match location {
                Location::Node => axis.nodes.len(),
                Location::Cell => axis.nodes.len().saturating_sub(1).max(1),
            };
            indices.push((i % n).to_string());
            position.push(axis.nodes[i % n]);
            i /= n;
        }
        format!("index ({}), position {}", indices.join(", "), point_text(&position))
    })
}

fn axis_table(name: &str, axis: &GridAxis, location: Location, period: Option<Period>) -> Result<AxisTable> {
    match (location, &axis.bounds) {
        (Location::Node, None) => AxisTable::nodes(&axis.name, axis.nodes.clone(), period, false),
        (Location::Node, Some(bounds)) => AxisTable::cells(&axis.name, bounds.clone(), axis.nodes.clone(), period),
        (Location::Cell, _) => {
            if axis.nodes.windows(2).any(|w| w[0] >= w[1]) || axis.nodes.len() < 2 {
                return Err(Error::field(name, format!("axis '{}' has cells without volume", axis.name)));
            }
            let centers = axis.nodes.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
            AxisTable::cells(&axis.name, axis.nodes.clone(), centers, period)
        }
    }
}

/// Whether the last slice across axis `k` has the values of the first, in every variable at the nodes.
fn ends_agree(density: &Variable, others: &[Variable], axes: &[GridAxis], k: usize) -> bool {
    let all = std::iter::once(density).chain(others);
    all.filter(|v| v.location == Location::Node).all(|v| last_plane_repeats(&v.values, v.components, axes, k))
}

/// Whether the values of the last plane of axis `k` are those of the first, to a millionth of the largest.
fn last_plane_repeats(values: &Values, components: usize, axes: &[GridAxis], k: usize) -> bool {
    let stride: usize = components * axes[..k].iter().map(|a| a.nodes.len()).product::<usize>();
    let n = axes[k].nodes.len();
    let outer: usize = axes[k + 1..].iter().map(|a| a.nodes.len()).product();
    let (low, high, _) = values.range();
    let tolerance = 1e-6 * low.abs().max(high.abs());
    (0..outer).all(|o| {
        (0..stride).all(|i| {
            let first = values.get(i + stride * n * o);
            let last = values.get(i + stride * (n - 1 + n * o));
            (first - last).abs() <= tolerance
        })
    })
}
