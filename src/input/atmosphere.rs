//! The outer layer of a star that particles cannot resolve.

use crate::field::{MassEstimate, Source};
use serde::Serialize;
use sph::domain::{Region, Wall};

/// What is done about an atmosphere.
pub struct Atmosphere {
    /// For the report, where something was cut.
    pub note: Option<String>,
    pub cut: Option<Cut>,
    /// The spacing at which one layer of particles spans what is left to the surface: larger ones mean nothing.
    pub largest_spacing: f64,
}

/// What was cut.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cut {
    /// Of the mass.
    pub share: f64,
    /// Where, as a fraction of the radius.
    pub radius: f64,
}

/// The cut is where the target spacing reaches this many times the depth below the surface. What lies beyond
/// is a handful of particles' worth of mass, spread over a layer far thinner than their spacing.
const UNRESOLVED: f64 = 10.0;
/// A layer is an atmosphere if its mean density is below this fraction of the density at its base; a sharp
/// surface (a planet, a uniform ball) is none.
const THIN: f64 = 0.5;
/// Steps of the search for the cut, which needs no more accuracy than a particle's spacing.
const BISECTIONS: usize = 60;

/// Cuts an open ball filled by a radial profile at the radius beyond which `count` equal masses have less
/// than a tenth of their spacing left. `None` where the input has no such atmosphere.
pub fn cut<const D: usize>(source: &mut Source<D>, count: usize, keep: bool) -> Option<Atmosphere> {
    let radial = source.radial.as_ref()?;
    let profile = radial.profile.clone();
    let Region::Ball { center, inner_radius, radius, wall: Wall::Open } = source.domain.region else { return None };
    if center != radial.center || inner_radius > 0.0 {
        return None;
    }
    let total = profile.enclosed_mass(radius);
    let particle = total / count as f64;
    let spacing = |r: f64| (particle / profile.density(r)).powf(1.0 / D as f64);
    // The outermost radius at which the spacing is `depths` times the depth.
    let reached = |depths: f64| {
        let (mut inner, mut outer) = (0.0, radius);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (inner + outer);
            if spacing(middle) <= depths * (radius - middle) { inner = middle } else { outer = middle }
        }
        inner
    };
    let (layer, edge) = (reached(1.0), reached(UNRESOLVED));
    if layer <= 0.0 || edge <= 0.0 {
        return None;
    }
    let kept = profile.enclosed_mass(edge);
    let volume = |r: f64| sph::geometry::unit_ball_volume(D) * r.powi(D as i32);
    let mean = (total - kept) / (volume(radius) - volume(edge));
    if !(mean < THIN * profile.density(edge)) {
        return None;
    }
    let largest_spacing = spacing(layer);
    if keep {
        return Some(Atmosphere { note: None, cut: None, largest_spacing });
    }
    let domain = sph::domain::Domain::ball(center, edge, Wall::Open).ok()?;
    let error = source.mass.map_or(0.0, |m| m.error);
    source.domain = domain;
    source.mass = Some(MassEstimate { value: kept, error });
    let note = format!(
        "the atmosphere is cut at {:.6} of the radius, which encloses {:.8} of the mass: beyond it the spacing of \
         {count} particles exceeds {UNRESOLVED} times the remaining depth (input.atmosphere: keep prevents the cut)",
        edge / radius,
        kept / total,
    );
    let cut = Cut { share: 1.0 - kept / total, radius: edge / radius };
    Some(Atmosphere { note: Some(note), cut: Some(cut), largest_spacing })
}
