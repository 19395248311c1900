//! The profile of a density that depends only on the distance from a center: that of the input, or that of an expression for which this symmetry
//! is found.

use crate::field::{RadialProfile, ScalarField, Source};
use sph::domain::Region;
use sph::geometry::distance;

/// Radii at which an expression is looked at.
const ROWS: usize = 2000;
/// Radii go outward as the hyperbolic sine of up to this, so that the innermost are close to the center.
const REACH: f64 = 9.0;
/// Relative differences between directions that are rounding.
const ALIKE: f64 = 1e-9;
/// Directions in which a density is looked at.
const WAYS: [[f64; 3]; 7] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [-1.0, 0.0, 0.0],
    [0.6, 0.8, 0.0],
    [0.0, -0.6, 0.8],
    [0.48, -0.64, -0.6],
];

/// A sphere, in the units of its source.
pub(crate) struct Spherical {
    pub profile: RadialProfile,
    pub center: [f64; 3],
    /// Where the domain ends.
    pub end: f64,
}

/// The sphere that a source is; `None` where it is no function of the radius, or its domain not all of a ball about the
/// center.
pub(crate) fn spherical<const D: usize>(source: &Source<D>) -> Option<Spherical> {
    if D != 3 {
        return None;
    }
    let filled = |x: [f64; D]| sph::array(|k| x.get(k).copied().unwrap_or(0.0));
    let near = 1e-9 * source.domain.size();
    if let Some(radial) = &source.radial {
        let outer = radial.profile.outer_radius();
        let end = match source.domain.region {
            Region::Ball { center, inner_radius: 0.0, radius, .. } if distance(&center, &radial.center) <= near => {
                radius.min(outer)
            }
            Region::Box if source.domain.distance_to_edge(&radial.center) >= outer - near => outer,
            _ => return None,
        };
        let profile = RadialProfile::clone(&radial.profile);
        return Some(Spherical { profile, center: filled(radial.center), end });
    }
    let Region::Ball { center, inner_radius: 0.0, radius, .. } = source.domain.region else { return None };
    let profile = profile_of(source.density.as_ref(), &center, radius)?;
    Some(Spherical { profile, center: filled(center), end: radius })
}

/// The profile of a density that is the same in all directions.
fn profile_of<const D: usize>(density: &dyn ScalarField<D>, center: &[f64; D], radius: f64) -> Option<RadialProfile> {
    let at = |r: f64, way: &[f64; 3]| {
        let x: [f64; D] = sph::array(|k| center[k] + r * way[k]);
        density.value(&x)
    };
    let row = |i: usize| radius * (REACH * i as f64 / ROWS as f64).sinh() / REACH.sinh();
    let (mut nodes, mut values) = (Vec::new(), Vec::new());
    for i in 1..=ROWS {
        // The surface itself may be outside by rounding.
        let r = if i == ROWS { radius * (1.0 - 1e-12) } else { row(i) };
        let first = at(r, &WAYS[0]);
        let is_alike = |way: &[f64; 3]| (at(r, way) - first).abs() <= ALIKE * first.abs() + f64::MIN_POSITIVE;
        if !(first.is_finite() && first >= 0.0 && WAYS.iter().all(is_alike)) {
            return None;
        }
        nodes.push(r);
        values.push(first);
    }
    Some(RadialProfile::from_nodes(3, &nodes, &values))
}
