//! Builds a [`Source`] from the numbers of a file.

use super::build_grid::{cartesian, curvilinear, geographic};
use super::build_input::Input;
use super::build_radial::radial;
use super::build_refined::refined;
use super::build_surface::surface;
use super::check::{point_text, replace_missing};
use super::cloud::Cloud;
use super::fitted::{self, FromParticles, Scatter};
use super::hull::MeshHull;
use super::mesh::{Mesh, MeshSampler};
use super::outer_layer::Balance;
use super::rows::budget;
use super::staggering::Budget;
use super::voronoi::Voronoi;
use super::{FieldOptions, Interpolation, Missing, Source};
use crate::error::{Error, Result};
use sph::domain::{Axis, Domain, Region, Wall};
use sph_formats::{Cells, Coordinates, Geometry, Location, RawField, Variable, WITHOUT_AXES, plain_name};
use std::path::Path;
use std::sync::Arc;

/// The dimension that an input has of itself: 3 for a radial profile.
pub fn natural_dimension(raw: &RawField) -> usize {
    match &raw.geometry {
        Geometry::Radial { .. } => 3,
        Geometry::Grid { coordinates: Coordinates::Geographic | Coordinates::Spherical, .. } => 3,
        // One cell along z is a plane.
        Geometry::Grid { coordinates, axes } if coordinates.is_curvilinear() => {
            let [z, _] = coordinates.height_and_azimuth();
            if axes.get(z).is_some_and(|axis| axis.nodes.len() == 1) { 2 } else { 3 }
        }
        Geometry::Grid { axes, .. } => axes.len(),
        Geometry::Refined(grid) => grid.dimension(),
        Geometry::Mesh { dimension, .. } | Geometry::Cloud { dimension, .. } | Geometry::Surface { dimension, .. } => {
            *dimension
        }
    }
}

/// Makes the source of a file's numbers: the density with its interpolant, and the carried variables. Values keep
/// the file's units and precision and are moved, not copied.
///
/// # Errors
/// No density, one that is negative, missing, not finite or zero everywhere, a geometry that does not fit
/// `D`, or damaged coordinates.
pub fn from_raw<const D: usize>(raw: RawField, options: &FieldOptions<D>) -> Result<Source<D>> {
    let path = raw.path.clone();
    build(raw, options).map_err(|error| in_file(error, &path))
}

/// What is known of the densities of particles that a source is made of.
#[derive(Debug, Clone, Default)]
pub struct Samples {
    /// Their scatter, where they are positive.
    pub scatter: Option<Scatter>,
    /// What is wrong with them or the masses, with the remedy.
    pub doubt: Option<String>,
}

/// Makes the source of particles in their `domain`, which along axes that do not repeat ends half a spacing beyond them. With the particles' `masses`, in the unit of the densities, the density has these within what they fill.
///
/// # Errors
/// As [`from_raw`].
pub fn from_particles<const D: usize>(
    raw: RawField,
    (domain, masses): (&Domain<D>, Option<&[f64]>),
    options: &FieldOptions<D>,
) -> Result<(Source<D>, Samples)> {
    let path = raw.path.clone();
    particles(raw, (domain, masses), options).map_err(|error| in_file(error, &path))
}

fn in_file(error: Error, path: &Path) -> Error {
    match error {
        Error::Field { name, problem } => {
            Error::Field { name, problem: format!("{problem} (file '{}')", path.display()) }
        }
        other => other,
    }
}

/// Gives a grid without axes of its own the box that the scene states.
fn fill_box<const D: usize>(raw: &mut RawField, stated: Option<&[[f64; D]; 2]>) {
    let is_free = raw.metadata.iter().any(|(key, _)| key == WITHOUT_AXES);
    if let (true, Some([lo, hi]), Geometry::Grid { axes, .. }) = (is_free, stated, &mut raw.geometry) {
        for (axis, (lo, hi)) in axes.iter_mut().zip(lo.iter().zip(hi)) {
            let places = axis.nodes.iter_mut().chain(axis.bounds.iter_mut().flatten());
            places.for_each(|x| *x = lo + (hi - lo) * *x);
        }
    }
}

fn build<const D: usize>(mut raw: RawField, options: &FieldOptions<D>) -> Result<Source<D>> {
    fill_box(&mut raw, options.stated_box.as_ref());
    if matches!(raw.geometry, Geometry::Surface { .. }) {
        return surface(&raw.path, raw.geometry, options, Vec::new());
    }
    let (mut input, geometry, stated) = opened(raw, options)?;
    if options.interpolation.is_some() && !matches!(geometry, Geometry::Grid { .. } | Geometry::Refined(..)) {
        let kind = geometry.kind();
        input.notes.push(format!("input.interpolation is for grids and particles: it is not used for this {kind}"));
    }
    match geometry {
        Geometry::Radial { nodes, unit } => radial(input, nodes, unit.map(|u| u.to_cgs), stated.as_ref()),
        Geometry::Grid { coordinates: Coordinates::Cartesian, axes } => cartesian(input, &axes),
        Geometry::Grid { coordinates: Coordinates::Geographic, axes } => geographic(input, &axes),
        Geometry::Grid { coordinates, axes } => curvilinear(input, coordinates, &axes),
        Geometry::Refined(grid) => refined(input, grid),
        Geometry::Mesh { points, cells, .. } => mesh(input, &points, cells),
        Geometry::Cloud { points, .. } => cloud(input, &points),
        Geometry::Surface { .. } => Err(Error::field("density", "is not that of a surface")),
    }
}

/// The density and what is carried beside it, less their geometry, and the mass that a radial file states.
type Opened<'a, const D: usize> = (Input<'a, D>, Geometry, Option<Budget>);

/// Chooses and checks the variables.
fn opened<const D: usize>(mut raw: RawField, options: &FieldOptions<D>) -> Result<Opened<'_, D>> {
    let density = take_density(&mut raw, options.density_name.as_deref())?;
    let natural = natural_dimension(&raw);
    if natural != D && !matches!(raw.geometry, Geometry::Radial { .. }) {
        return Err(Error::field(
            density.name,
            format!("the {} has {natural} dimension(s), the scene asks for {D}", raw.geometry.kind()),
        ));
    }
    for v in std::iter::once(&density).chain(&raw.variables) {
        let expected = raw.geometry.count(v.location) * v.components;
        if v.values.len() != expected {
            return Err(Error::field(
                &v.name,
                format!("has {} values where the {} takes {expected}", v.values.len(), raw.geometry.kind()),
            ));
        }
    }
    let mut notes = Vec::new();
    let stated = match &raw.geometry {
        Geometry::Radial { nodes, unit } if options.has_mass => {
            budget(&raw.variables, &density, nodes, unit.as_ref().map(|u| u.to_cgs), &mut notes)
        }
        _ => None,
    };
    let others = select_carried(raw.variables, options, &mut notes)?;
    Ok((Input { density, others, options, notes }, raw.geometry, stated))
}

/// Whether a name is that of a density's logarithm.
fn is_logarithm(name: &str) -> bool {
    let plain = plain_name(name);
    let of = ["log10", "log", "ln"].iter().find_map(|log| plain.strip_prefix(log));
    of.is_some_and(|of| matches!(of, "rho" | "density" | "dens" | "d" | "massdensity"))
}

fn take_density(raw: &mut RawField, asked: Option<&str>) -> Result<Variable> {
    let names = || -> String {
        let candidates = raw.variables.iter().filter(|v| !is_logarithm(&v.name));
        let all: Vec<String> = candidates.map(|v| format!("'{}'", v.name)).collect();
        if all.is_empty() { "no variables".into() } else { all.join(", ") }
    };
    // Where nothing else is a density, what is wrong with its logarithm is the matter.
    let logarithm = || raw.variables.iter().map(|v| v.name.as_str()).find(|name| is_logarithm(name));
    let Some(name) = asked.or(raw.density.as_deref()).or_else(logarithm) else {
        return Err(Error::field(
            "density",
            format!("cannot tell which variable is the density; choose one by --density: the file has {}", names()),
        ));
    };
    let Some(i) = raw.variables.iter().position(|v| v.name == name) else {
        return Err(Error::field(name, format!("is not in the file, which has {}", names())));
    };
    if is_logarithm(name) {
        let problem = "is a logarithm by its name, and no density; write its antilogarithm into a column of its own, such as 'rho'";
        return Err(Error::field(name, problem));
    }
    if raw.variables[i].components != 1 {
        return Err(Error::field(
            name,
            format!(
                "has {} components; a density is a scalar: choose another of {}",
                raw.variables[i].components,
                names()
            ),
        ));
    }
    Ok(raw.variables.remove(i))
}

/// The variables to carry: those asked for, or all that can be carried.
fn select_carried<const D: usize>(
    variables: Vec<Variable>,
    options: &FieldOptions<D>,
    notes: &mut Vec<String>,
) -> Result<Vec<Variable>> {
    let lost = options.carried.iter().flatten().find(|w| variables.iter().all(|v| v.name != **w));
    if let Some(lost) = lost {
        let names: Vec<String> = variables.iter().map(|v| format!("'{}'", v.name)).collect();
        return Err(Error::scene(
            "carried",
            format!("no variable '{lost}' in the file, which has {}", names.join(", ")),
        ));
    }
    let mut selected = Vec::new();
    for mut v in variables {
        if options.carried.as_ref().is_some_and(|w| !w.contains(&v.name)) {
            continue;
        }
        if v.components != 1 && !(D..=3).contains(&v.components) {
            notes.push(format!("'{}' has {} components and was left out", v.name, v.components));
            continue;
        }
        if options.missing == Missing::Zero {
            replace_missing(&mut v.values);
        }
        let (.., bad) = v.values.range();
        if bad > 0 {
            notes.push(format!(
                "'{}' was left out: {bad} of its {} values are missing or not finite (`missing: zero` sets missing ones to 0)",
                v.name,
                v.values.len()
            ));
            continue;
        }
        selected.push(v);
    }
    Ok(selected)
}

fn mesh<const D: usize>(mut input: Input<'_, D>, points: &[[f64; 3]], cells: Cells) -> Result<Source<D>> {
    let name = input.density.name.clone();
    let flat = flatten::<D>(&name, points)?;
    let location = input.density.location;
    input.check(&|i| match location {
        Location::Node => format!("point {i}, position {}", point_text(&flat[i])),
        Location::Cell => format!("cell {i}"),
    })?;
    let mesh = Arc::new(Mesh::new(&name, flat, cells, &mut input.notes)?);
    let hull = MeshHull { mesh: Arc::clone(&mesh) };
    let domain =
        Domain::new(mesh.bounds.lo, mesh.bounds.hi, [Axis::OPEN; D], Region::Hull(Arc::new(hull), Wall::Open))?;
    let sampler = Arc::new(MeshSampler { mesh: Arc::clone(&mesh), location });
    input.finish(sampler, domain, &|location| Ok(Arc::new(MeshSampler { mesh: Arc::clone(&mesh), location })))
}

fn cloud<const D: usize>(mut input: Input<'_, D>, points: &[[f64; 3]]) -> Result<Source<D>> {
    let name = input.density.name.clone();
    let flat = flatten::<D>(&name, points)?;
    input.check(&|i| format!("point {i}, position {}", point_text(&flat[i])))?;
    let sampler = Arc::new(Cloud::new(&name, &flat, None)?);
    let domain = sampler.domain();
    input.notes.push(format!(
        "the cloud of {} points fills its bounding box where a point is near; set the domain in the scene if it is another",
        flat.len()
    ));
    input.finish(sampler, domain, &|_| Err(Error::field(&name, "a point cloud has no cells".to_owned())))
}

fn particles<const D: usize>(
    raw: RawField,
    (domain, masses): (&Domain<D>, Option<&[f64]>),
    options: &FieldOptions<D>,
) -> Result<(Source<D>, Samples)> {
    let (mut input, geometry, _) = opened(raw, options)?;
    let Geometry::Cloud { points, .. } = geometry else {
        return Err(Error::field(&input.density.name, "is not that of particles"));
    };
    let points = flatten::<D>(&input.density.name, &points)?;
    input.check(&|i| format!("particle {i}, position {}", point_text(&points[i])))?;
    if options.interpolation == Some(Interpolation::Constant) {
        let name = input.density.name.clone();
        input
            .notes
            .push(format!("the values of each of the {} particles hold throughout its Voronoi cell", points.len()));
        let cells = Arc::new(Voronoi::new(&name, &points, domain)?);
        let nowhere = |_| Err(Error::field(&name, "is not that of particles".to_owned()));
        return Ok((input.finish(cells, domain.clone(), &nowhere)?, Samples::default()));
    }
    let FromParticles { density, carried, scatter, domain, balance, moved } =
        fitted::from_particles(&input.density, input.others, (&points, masses), domain)?;
    let mut notes = input.notes;
    if options.interpolation.is_some_and(|kind| kind != Interpolation::Linear) {
        notes.push(
            "input.interpolation is one for grids: a smooth field is fitted to the particles, as with `linear`".into(),
        );
    }
    if matches!(domain.region, Region::Hull(..)) {
        notes.push("the body ends at a smooth surface half a spacing beyond its outermost particles".into());
    }
    if let Balance::Kept(factors) = balance {
        notes.extend(factors.note());
    }
    notes.extend(moved.map(|mean| {
        format!(
            "so that mass stays where the particles have it, as beside jumps that sums over neighbors smooth, their densities are changed by {:.1} % on average",
            100.0 * mean
        )
    }));
    Ok((
        Source { density, carried, domain, mass: None, radial: None, notes },
        Samples { scatter, doubt: balance.doubt() },
    ))
}

/// The first D components, which must be finite.
fn flatten<const D: usize>(name: &str, points: &[[f64; 3]]) -> Result<Vec<[f64; D]>> {
    if let Some((i, p)) = points.iter().enumerate().find(|(_, p)| p.iter().any(|v| !v.is_finite())) {
        return Err(Error::field(name, format!("point {i} lies at {}; coordinates must be finite", point_text(p))));
    }
    Ok(points.iter().map(|p| sph::array(|k| p[k])).collect())
}

#[cfg(test)]
#[path = "build_tests.rs"]
mod tests;
