//! Tables over a radius: profiles of points, or of cells with outer radii.

use super::layout::Heading;
use super::sheet::{NumberColumn, Sheet};
use crate::common::text::Text;
use crate::error::Result;
use crate::model::{Location, Variable};
use crate::registry::plain_name;
use crate::units::{Unit, UnitDimension};

/// A radial geometry and its columns, ascending.
pub struct Profile {
    pub nodes: Vec<f64>,
    pub columns: Vec<(Heading, Location, Vec<f64>)>,
}

/// Takes the column `radius` as nodes of points, or as outer faces of cells.
///
/// # Errors
/// [`crate::FormatError::Input`] with the line where radii are negative, not finite, not in order, or too few.
pub fn profile(text: &Text, sheet: Sheet, radius: usize, is_outer: bool, notes: &mut Vec<String>) -> Result<Profile> {
    let Sheet { mut columns, mut lines, .. } = sheet;
    let column = columns.remove(radius);
    let name = column.heading.name;
    let mut nodes = column.values;
    if is_descending(&nodes) {
        nodes.reverse();
        lines.reverse();
        columns.iter_mut().for_each(|c| c.values.reverse());
        notes.push("the rows run inwards; they were turned around".into());
    }
    check_radii(text, &name, &nodes, &lines, is_outer)?;
    if is_outer {
        notes.push(format!(
            "'{name}' is the outer face of each row's cell: densities and other values are averages within the cells"
        ));
        nodes.insert(0, 0.0);
        let columns = columns.into_iter().map(staggered).collect();
        return Ok(Profile { nodes, columns });
    }
    let dropped = drop_inner_repeats(&mut nodes, &mut columns);
    if dropped > 0 {
        notes.push(format!("{dropped} rows between the first and the last of more than two equal radii were left out"));
    }
    let jumps = nodes.windows(2).filter(|w| w[0] == w[1]).count();
    if jumps > 0 {
        notes.push(format!("{jumps} pairs of equal radii are taken as jumps"));
    }
    let columns = columns.into_iter().map(|c| (c.heading, Location::Node, c.values)).collect();
    Ok(Profile { nodes, columns })
}

fn is_descending(radii: &[f64]) -> bool {
    matches!((radii.first(), radii.last()), (Some(first), Some(last)) if first > last)
}

/// `radii` run outwards, `lines` with them.
fn check_radii(text: &Text, name: &str, radii: &[f64], lines: &[usize], is_outer: bool) -> Result<()> {
    let fault = |i: usize, problem: String| {
        let line = lines.get(i).copied().unwrap_or_default();
        Err(text.error(format!("line {line}, column '{name}'"), problem))
    };
    if radii.len() < 2 && !is_outer {
        return fault(0, "there is one radius, expected at least two".into());
    }
    let mut previous = if is_outer { 0.0 } else { f64::NEG_INFINITY };
    for (i, &r) in radii.iter().enumerate() {
        if !r.is_finite() || r < 0.0 {
            return fault(i, format!("the radius is {r:e}, expected a finite one that is not negative"));
        }
        if r < previous {
            return fault(i, format!("radii {r:e} and {previous:e} are out of order; sort the rows by radius"));
        }
        if is_outer && r == previous {
            return fault(i, format!("the outer radius {r:e} leaves no volume between the faces"));
        }
        previous = r;
    }
    if radii.first() == radii.last() && !is_outer {
        return fault(0, format!("all radii are {previous:e}"));
    }
    Ok(())
}

/// Leaves two of each run of equal radii: the values on both sides. Returns how many rows went.
fn drop_inner_repeats(nodes: &mut Vec<f64>, columns: &mut [NumberColumn]) -> usize {
    let inside: Vec<bool> = (0..nodes.len())
        .map(|i| {
            let r = nodes.get(i);
            i > 0 && nodes.get(i - 1) == r && nodes.get(i + 1) == r
        })
        .collect();
    let dropped = inside.iter().filter(|d| **d).count();
    if dropped > 0 {
        let keep = |values: &mut Vec<f64>| {
            let mut is_inside = inside.iter();
            values.retain(|_| is_inside.next() != Some(&true));
        };
        keep(nodes);
        columns.iter_mut().for_each(|c| keep(&mut c.values));
    }
    dropped
}

/// A column of cells: one that is called `outer` belongs to the faces and gets a value at the center, which is 0
/// for what vanishes there.
fn staggered(column: NumberColumn) -> (Heading, Location, Vec<f64>) {
    let NumberColumn { heading, mut values } = column;
    let name = plain_name(&heading.name);
    if !name.contains("outer") {
        return (heading, Location::Cell, values);
    }
    let vanishes = ["mass", "velocity", "luminosity"].iter().any(|n| name.contains(n));
    let center = if vanishes { 0.0 } else { values.first().copied().unwrap_or_default() };
    values.insert(0, center);
    (heading, Location::Node, values)
}

/// What the units of a profile make of its mean density, for the reader of the report to judge: headers err.
pub fn mean_density_note(nodes: &[f64], unit: Option<&Unit>, density: &Variable) -> Option<String> {
    let unit = unit.filter(|u| u.dimension == UnitDimension::LENGTH)?;
    let cgs = density.unit.as_ref().filter(|u| u.dimension == UnitDimension::mass_density(3))?.to_cgs;
    let cube = |r: f64| r.powi(3);
    let mut mass = 0.0;
    for (i, w) in nodes.windows(2).enumerate() {
        let rho = match density.location {
            Location::Cell => density.values.get(i),
            Location::Node => 0.5 * (density.values.get(i) + density.values.get(i + 1)),
        };
        mass += rho * (cube(w[1]) - cube(w[0]));
    }
    let mean = cgs * mass / (cube(*nodes.last()?) - cube(*nodes.first()?));
    let stated = density.unit.as_ref().map(|u| u.symbol.as_str()).unwrap_or_default();
    Some(format!(
        "with the header's units, {stated} and {}, the mean density is {mean:.3e} g/cm^3; \
         if that is wrong, so is the header",
        unit.symbol
    ))
}
