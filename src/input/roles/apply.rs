//! Renames variables after their roles, and joins components to Cartesian vectors.
//!
//! Components along curvilinear directions are turned at each node, before anything is interpolated:
//! v = v_r e_r + v_theta e_theta + v_phi e_phi with e_r = (sin theta cos phi, sin theta sin phi, cos theta),
//! e_theta = (cos theta cos phi, cos theta sin phi, -sin theta), e_phi = (-sin phi, cos phi, 0), and e_north = -e_theta.
//! On grids of r, theta, phi or R, phi, z the components stay along these, as a grid may have one cell in phi: the interpolant turns them.

use super::assign::{Assignment, along};
use crate::error::{Error, Result};
use crate::scene::{Part, Role, Vector};
use sph_formats::{Coordinates, Geometry, Location, RawField, Values, Variable};

/// Applies what was decided to the variables of a field, in a run of `dimension` dimensions.
///
/// # Errors
/// Components of one vector at nodes and in cells.
pub fn apply(field: &mut RawField, assignments: &[Assignment], dimension: usize) -> Result<()> {
    for vector in [Vector::Velocity, Vector::MagneticField] {
        join(field, assignments, vector, dimension)?;
    }
    for a in assignments.iter().filter(|a| a.role != Some(Role::Density) && a.column != a.variable) {
        if let Some(v) = field.variables.iter_mut().find(|v| v.name == a.variable) {
            v.name.clone_from(&a.column);
        }
    }
    Ok(())
}

fn join(field: &mut RawField, assignments: &[Assignment], vector: Vector, dimension: usize) -> Result<()> {
    let part_of = |a: &&Assignment| match a.role {
        Some(Role::Vector(v, part)) if v == vector && part != Part::Whole => Some((part, a.variable.clone())),
        _ => None,
    };
    let wanted: Vec<(Part, String)> = assignments.iter().filter_map(|a| part_of(&a)).collect();
    // A profile's velocity along the radius becomes a vector where it is evaluated.
    if wanted.is_empty() || matches!(field.geometry, Geometry::Radial { .. }) {
        return Ok(());
    }
    let Some(column) = assignments.iter().find(|a| a.variable == wanted[0].1).map(|a| a.column.clone()) else {
        return Ok(());
    };
    let mut parts: Vec<(Part, Variable)> = Vec::new();
    for (part, name) in wanted {
        if let Some(i) = field.variables.iter().position(|v| v.name == name) {
            parts.push((part, field.variables.remove(i)));
        }
    }
    let Some(joined) = joined(&field.geometry, &parts, dimension, column)? else { return Ok(()) };
    field.variables.push(joined);
    Ok(())
}

fn joined(geometry: &Geometry, parts: &[(Part, Variable)], dimension: usize, name: String) -> Result<Option<Variable>> {
    let Some((_, first)) = parts.first() else { return Ok(None) };
    if let Some((_, other)) = parts.iter().find(|(_, v)| v.location != first.location) {
        let problem = format!(
            "is given at nodes and '{}' in cells, or the other way round, so they cannot form a vector; leave one out \
             with input.carry",
            other.name
        );
        return Err(Error::field(&first.name, problem));
    }
    let unit = parts.iter().find_map(|(_, v)| v.unit.clone());
    let factor = |v: &Variable| match (&v.unit, &unit) {
        (Some(own), Some(all)) => own.to_cgs / all.to_cgs,
        _ => 1.0,
    };
    let factors: Vec<f64> = parts.iter().map(|(_, v)| factor(v)).collect();
    let description = first.description.clone();
    if let Geometry::Grid { coordinates, .. } = geometry
        && coordinates.is_curvilinear()
    {
        let of = |part: &Part| parts.iter().zip(&factors).find(|((p, _), _)| p == part);
        let value = |i: usize, part: &Part| of(part).map_or(0.0, |((_, v), factor)| v.values.get(i) * factor);
        let directions = along(*coordinates);
        let values = (0..geometry.count(first.location)).flat_map(|i| directions.map(|part| value(i, &part)));
        let values = Values::F64(values.collect());
        return Ok(Some(Variable { name, description, unit, location: first.location, components: 3, values }));
    }
    let count = geometry.count(first.location);
    let is_single = parts.iter().all(|(_, v)| matches!(v.values, Values::F32(_)));
    let places = Places::new(geometry, first.location);
    let mut singles = Vec::new();
    let mut doubles = Vec::new();
    for i in 0..count {
        let mut sum = [0.0; 3];
        for ((part, v), factor) in parts.iter().zip(&factors) {
            let direction = places.direction(*part, i, dimension);
            let value = v.values.get(i) * factor;
            for k in 0..3 {
                // Not 0 times NaN: a component that is missing spoils its own direction alone.
                sum[k] += if direction[k] == 0.0 { 0.0 } else { value * direction[k] };
            }
        }
        let row = sum.iter().take(dimension);
        if is_single { singles.extend(row.map(|c| *c as f32)) } else { doubles.extend(row) }
    }
    let values = if is_single { Values::F32(singles) } else { Values::F64(doubles) };
    Ok(Some(Variable { name, description, unit, location: first.location, components: dimension, values }))
}

/// Where the values of a geometry lie.
struct Places<'a> {
    geometry: &'a Geometry,
    /// Coordinates of the values along each axis of a grid.
    axes: Vec<Vec<f64>>,
    location: Location,
}

impl<'a> Places<'a> {
    fn new(geometry: &'a Geometry, location: Location) -> Self {
        let axes = match geometry {
            Geometry::Grid { axes, .. } => axes.iter().map(|axis| match location {
                Location::Node => axis.nodes.clone(),
                Location::Cell if axis.nodes.len() < 2 => axis.nodes.clone(),
                Location::Cell => axis.nodes.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect(),
            }),
            _ => return Self { geometry, axes: Vec::new(), location },
        };
        Self { geometry, axes: axes.collect(), location }
    }

    /// The unit vector of a part at value `i`.
    fn direction(&self, part: Part, i: usize, dimension: usize) -> [f64; 3] {
        match part {
            Part::X => return [1.0, 0.0, 0.0],
            Part::Y => return [0.0, 1.0, 0.0],
            Part::Z => return [0.0, 0.0, 1.0],
            _ => {}
        }
        let [x, y, z] = self.sphere(i, dimension);
        let ring = x.hypot(y);
        // On the axis every azimuth is as good.
        let (cos, sin) = if ring > 0.0 { (x / ring, y / ring) } else { (1.0, 0.0) };
        let r = ring.hypot(z);
        let (up, out) = if r > 0.0 { (z / r, ring / r) } else { (0.0, 0.0) };
        match part {
            Part::R => [out * cos, out * sin, up],
            Part::Theta => [up * cos, up * sin, -out],
            Part::North => [-up * cos, -up * sin, out],
            Part::Phi => [-sin, cos, 0.0],
            Part::Cylindrical if ring > 0.0 => [cos, sin, 0.0],
            _ => [0.0; 3],
        }
    }

    /// Cartesian coordinates of value `i`, up to a factor.
    fn sphere(&self, i: usize, dimension: usize) -> [f64; 3] {
        let x = match self.geometry {
            Geometry::Grid { coordinates, .. } => {
                let mut rest = i;
                let mut x = [0.0; 3];
                for (slot, axis) in x.iter_mut().zip(&self.axes) {
                    *slot = axis.get(rest % axis.len().max(1)).copied().unwrap_or(0.0);
                    rest /= axis.len().max(1);
                }
                if *coordinates == Coordinates::Geographic {
                    let (lon, lat) = (x[0].to_radians(), x[1].to_radians());
                    return [lat.cos() * lon.cos(), lat.cos() * lon.sin(), lat.sin()];
                }
                x
            }
            Geometry::Mesh { points, cells, .. } if self.location == Location::Cell => {
                let ends = cells.offsets.get(i).copied().zip(cells.offsets.get(i + 1).copied());
                let corners = ends.and_then(|(a, b)| cells.connectivity.get(a..b)).unwrap_or(&[]);
                let sum =
                    corners.iter().filter_map(|p| points.get(*p)).fold([0.0; 3], |s, p| sph::array(|k| s[k] + p[k]));
                sum.map(|c| c / corners.len().max(1) as f64)
            }
            Geometry::Mesh { points, .. } | Geometry::Cloud { points, .. } => {
                points.get(i).copied().unwrap_or_default()
            }
            // Components on refined grids are along x, y and z, whose directions need no place.
            Geometry::Radial { .. } | Geometry::Refined(_) | Geometry::Surface { .. } => [0.0; 3],
        };
        sph::array(|k| if k < dimension { x[k] } else { 0.0 })
    }
}
