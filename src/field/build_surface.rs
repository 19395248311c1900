//! Builds a domain from a surface in a file, with an expression for the density inside.

use super::check::point_text;
use super::mass::check_mass;
use super::surface::Surface;
use super::{AnalyticField, FieldOptions, MassEstimate, Orientation, ScalarField, Source};
use crate::error::{Error, Result};
use sph::domain::{Axis, Domain, Hull, Region, Wall};
use sph_formats::Geometry;
use std::path::Path;
use std::sync::Arc;

/// The region within a surface of a file, with notes on what was repaired.
///
/// # Errors
/// A surface of another dimension, or one that encloses nothing.
pub fn surface_of<const D: usize>(
    path: &Path,
    geometry: Geometry,
    orientation: &Orientation,
) -> Result<(Surface<D>, Vec<String>)> {
    let name = || format!("surface '{}'", path.display());
    let Geometry::Surface { dimension, points, facets, .. } = geometry else {
        let problem = format!("is a {}, expected a surface (STL, OBJ, PLY)", geometry.kind());
        return Err(Error::field(name(), problem));
    };
    if dimension != D {
        let problem = match dimension {
            2 => format!("is a curve in 2-D, but the scene has {D} dimensions"),
            _ => format!(
                "is made of triangles in 3-D, but the scene has {D} dimension(s); in 2-D a region is bounded by the lines of an OBJ file"
            ),
        };
        return Err(Error::field(name(), problem));
    }
    let mut corners = Vec::with_capacity(points.len());
    for (i, point) in points.iter().enumerate() {
        let moved = orientation.apply(point);
        if moved.iter().any(|v| !(v.abs() < FARTHEST)) {
            let problem = format!("has point {i} at {}, expected coordinates below {FARTHEST:e}", point_text(&moved));
            return Err(Error::field(name(), problem));
        }
        corners.push(sph::array(|k| moved[k]));
    }
    drop(points);
    let facets = facets.chunks_exact(D).map(|f| sph::array(|k| f[k])).collect();
    Surface::new(corners, facets).map_err(|problem| Error::field(name(), problem))
}

/// Coordinates whose cubes and squares f64 holds.
const FARTHEST: f64 = 1e75;

/// The source: what `options` call the density is a number or an expression.
pub(crate) fn surface<const D: usize>(
    path: &Path,
    geometry: Geometry,
    options: &FieldOptions<D>,
    mut notes: Vec<String>,
) -> Result<Source<D>> {
    let Some(text) = &options.density_name else {
        return Err(Error::field(
            format!("surface '{}'", path.display()),
            "has no density inside; give one by --density (input.density), a number such as 2000 or an expression in x, y, z and r",
        ));
    };
    let (surface, repairs) = surface_of::<D>(path, geometry, &options.orientation)?;
    notes.extend(repairs);
    let volume = surface.volume_estimate();
    let [lo, hi] = surface.bounds();
    let domain = Domain::new(lo, hi, [Axis::OPEN; D], Region::Hull(Arc::new(surface) as Arc<dyn Hull<D>>, Wall::Open))?;
    let density = AnalyticField::<D>::new("input.density", text, domain.center())?;
    density.check(&domain)?;
    let mass = density.constant().map(|rho| MassEstimate { value: rho * volume.value, error: rho * volume.error });
    let mass = mass.map(|m| check_mass(text, m)).transpose()?;
    let size = if D == 3 { "volume" } else { "area" };
    notes.push(format!("{size} of the surface {:.9e}, known to {:.1e}", volume.value, volume.error / volume.value));
    let density: Box<dyn ScalarField<D>> = Box::new(density);
    Ok(Source { density, carried: Vec::new(), domain, mass, radial: None, notes })
}
