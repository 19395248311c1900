//! Builds sources from radial profiles.
//!
//! A scalar column named like a velocity, with a velocity's unit or none, becomes a vector along the radius;
//! every other column stays a scalar.

use super::build_input::{Input, Repeats, check_ascending};
use super::categorical::{carried_field, kinds};
use super::curve::Curve;
use super::mass::check_mass;
use super::narrow_jumps;
use super::radial::{Direction, RadialCarried, RadialDensity, volume_midpoints};
use super::rows::{is_enclosed_mass, placed};
use super::staggering::Budget;
use super::{CarriedField, CarriedInfo, RadialProfile, RadialSource, Source};
use crate::error::{Error, Result};
use sph::domain::{Domain, Wall};
use sph_formats::{Location, UnitDimension, Variable};
use std::sync::Arc;

/// `budget` is the mass that the file states, by which the rows are placed.
pub(crate) fn radial<const D: usize>(
    mut input: Input<'_, D>,
    nodes: Vec<f64>,
    length_cgs: Option<f64>,
    budget: Option<&Budget>,
) -> Result<Source<D>> {
    let name = input.density.name.clone();
    check_ascending(&name, "radius", &nodes, Repeats::Allowed)?;
    if nodes[0] < 0.0 {
        return Err(Error::field(name, format!("the first radius is {}; radii must not be negative", nodes[0])));
    }
    let location = input.density.location;
    input.check(&|i| match location {
        Location::Node => format!("node {i}, radius {:e}", nodes[i]),
        Location::Cell => format!("cell {i}, radius {:e} to {:e}", nodes[i], nodes[i + 1]),
    })?;
    let mut nodes = placed(&mut input, nodes, budget)?;
    let values = input.density.values.to_f64();
    let mut profile = match input.density.location {
        Location::Node => RadialProfile::from_nodes(D, &nodes, &values),
        Location::Cell => RadialProfile::from_cells(D, &nodes, &values),
    };
    if input.density.location == Location::Node {
        let steps = narrow_jumps::merge(&profile, &mut nodes, &values);
        if !steps.is_empty() {
            profile = RadialProfile::from_nodes(D, &nodes, &values);
        }
        input.notes.extend(steps);
    }
    let nodes = &nodes;
    let mass = check_mass(&name, profile.total_mass())?;
    if nodes[0] > 0.0 {
        let share = nodes[0] / profile.outer_radius();
        input.notes.push(format!(
            "the innermost node lies at {share:.2e} of the outer radius; the density within is taken as constant"
        ));
    }
    if D == 3 {
        input.notes.extend(compare_enclosed_mass(&input, mass.value, length_cgs));
    }
    let center = input.options.center;
    let outer = profile.outer_radius();
    let midpoints = volume_midpoints(D, nodes);
    let make = |v: Variable| Ok(radial_carried(v, nodes, &midpoints, center));
    let borders = material_borders(&input.others, nodes);
    let carried = input.others.into_iter().map(|v| carried_field(v, &make)).collect::<Result<_>>()?;
    let profile = Arc::new(profile);
    Ok(Source {
        density: Box::new(RadialDensity { profile: Arc::clone(&profile), center, borders }),
        carried,
        domain: Domain::ball(center, outer, Wall::Open)?,
        mass: Some(mass),
        radial: Some(RadialSource { profile, center }),
        notes: input.notes,
    })
}

/// Radii at which one material ends and another begins: nodes that are there twice.
fn material_borders(others: &[Variable], nodes: &[f64]) -> Vec<f64> {
    let of_kinds = others.iter().filter(|v| v.location == Location::Node && kinds(v).is_some());
    let changes = |v: &Variable, i: usize| nodes[i] == nodes[i + 1] && v.values.get(i) != v.values.get(i + 1);
    of_kinds.flat_map(|v| (0..nodes.len() - 1).filter(move |&i| changes(v, i)).map(|i| nodes[i])).collect()
}

/// Names under which a velocity along the radius is known.
const RADIAL_VELOCITIES: [&str; 10] =
    ["velocities", "v", "velocity", "vel", "v_r", "vr", "vel_r", "velr", "radial_velocity", "velocity_r"];

fn radial_carried<const D: usize>(
    variable: Variable,
    nodes: &[f64],
    midpoints: &[f64],
    center: [f64; D],
) -> Box<dyn CarriedField<D>> {
    let positions = match variable.location {
        Location::Node => nodes,
        Location::Cell => midpoints,
    };
    let is_velocity = variable.components == 1
        && RADIAL_VELOCITIES.contains(&variable.name.to_ascii_lowercase().as_str())
        && variable.unit.as_ref().is_none_or(|u| u.dimension == UnitDimension::VELOCITY);
    // Of a vector in a radial table only the first component has a meaning here: the radial one.
    let values: Vec<f64> = (0..positions.len()).map(|i| variable.values.get(i * variable.components)).collect();
    let outward = is_velocity || variable.components > 1;
    Box::new(RadialCarried {
        info: CarriedInfo { name: variable.name, unit: variable.unit, components: if outward { D } else { 1 } },
        curve: Curve::through(positions, &values),
        center,
        direction: if outward { Direction::Outward } else { Direction::Scalar },
    })
}

/// One sentence on how the profile's mass compares with the file's own, where units allow it.
fn compare_enclosed_mass<const D: usize>(input: &Input<'_, D>, mass: f64, length_cgs: Option<f64>) -> Option<String> {
    let listed = input.others.iter().find(|v| is_enclosed_mass(v))?;
    let factor = match (&listed.unit, &input.density.unit, length_cgs) {
        (Some(m), Some(rho), Some(length)) => rho.to_cgs * length.powi(3) / m.to_cgs,
        (None, None, None) => 1.0,
        _ => return None,
    };
    let total = listed.values.range().1;
    let own = mass * factor;
    (total > 0.0 && own.is_finite()).then(|| {
        format!(
            "the profile's density holds a mass of {own:.6e}, the file's '{}' ends at {total:.6e}: relative difference {:.1e}",
            listed.name,
            own / total - 1.0
        )
    })
}
