//! The outer layer of a star that particles cannot resolve.

use crate::domain::{Region, Wall};
use crate::field::{MassEstimate, Source};

/// The cut is where the target spacing reaches this many times the depth below the surface. What lies beyond
/// is a handful of particles' worth of mass, spread over a layer far thinner than their spacing.
const UNRESOLVED: f64 = 10.0;
/// A layer is an atmosphere if its mean density is below this fraction of the density at its base; a sharp
/// surface (a planet, a uniform ball) is none.
const THIN: f64 = 0.5;
/// Steps of the search for the cut, which needs no more accuracy than a particle's spacing.
const BISECTIONS: usize = 60;

/// Cuts an open ball filled by a radial profile at the radius beyond which `count` equal masses have less
/// than a tenth of their spacing left. Returns what was done, for the report.
pub fn cut<const D: usize>(source: &mut Source<D>, count: usize) -> Option<String> {
    let radial = source.radial.as_ref()?;
    let profile = radial.profile.clone();
    let Region::Ball { center, inner_radius, radius, wall: Wall::Open } = source.domain.region else { return None };
    if center != radial.center || inner_radius > 0.0 {
        return None;
    }
    let total = profile.enclosed_mass(radius);
    let particle = total / count as f64;
    let resolved = |r: f64| {
        let spacing = (particle / profile.density(r)).powf(1.0 / D as f64);
        spacing <= UNRESOLVED * (radius - r)
    };
    let (mut inner, mut outer) = (0.0, radius);
    if !resolved(inner) {
        return None;
    }
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (inner + outer);
        if resolved(middle) { inner = middle } else { outer = middle }
    }
    let kept = profile.enclosed_mass(inner);
    let volume = |r: f64| crate::kernel::unit_ball_volume(D) * r.powi(D as i32);
    let mean = (total - kept) / (volume(radius) - volume(inner));
    if !(mean < THIN * profile.density(inner)) {
        return None;
    }
    let error = source.mass.map_or(0.0, |m| m.error);
    let Ok(domain) = crate::domain::Domain::ball(center, inner, Wall::Open) else { return None };
    source.domain = domain;
    source.mass = Some(MassEstimate { value: kept, error });
    Some(format!(
        "the atmosphere is cut at {:.6} of the radius, which encloses {:.8} of the mass: beyond it {count} particles have a spacing of over {UNRESOLVED} times the depth left (input.atmosphere: keep prevents it)",
        inner / radius,
        kept / total,
    ))
}
