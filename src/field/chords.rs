//! Integrals over regions that know which parts of a line lie inside them.

use super::MassEstimate;
use super::bvh::Aabb;
use super::cubature::integrate_unit_box;
use sph::domain::Hull;

/// The integral over a region within `bounds`, from at most some `most` chords, of `along`, which gets a point on a chord and its ends along the axis of the longest
/// edge; `None` where the region knows no chords.
pub(crate) fn chord_integral<const D: usize>(
    hull: &dyn Hull<D>,
    bounds: &Aabb<D>,
    most: usize,
    along: &(dyn Fn(&[f64; D], [f64; 2]) -> f64 + Sync),
) -> Option<MassEstimate> {
    let extent: [f64; D] = sph::array(|k| bounds.hi[k] - bounds.lo[k]);
    let axis = bounds.longest();
    hull.chords(axis, &bounds.lo)?;
    let at = |u: [f64; 2]| {
        let mut u = u.into_iter();
        let x =
            sph::array(|k| if k == axis { bounds.lo[k] } else { bounds.lo[k] + u.next().unwrap_or(0.0) * extent[k] });
        let chords = hull.chords(axis, &x).unwrap_or_default();
        chords.into_iter().map(|chord| along(&x, chord)).sum::<f64>()
    };
    let mean = match D {
        1 => MassEstimate { value: at([0.0; 2]), error: 0.0 },
        2 => integrate_unit_box::<1>(&|u| at([u[0], 0.0]), CHORD_TOLERANCE, most),
        _ => integrate_unit_box::<2>(&|u| at(*u), CHORD_TOLERANCE, most),
    };
    let across: f64 = (0..D).filter(|k| *k != axis).map(|k| extent[k]).product();
    Some(MassEstimate { value: mean.value * across, error: mean.error * across })
}

/// Relative error at which the integral of chords ends.
const CHORD_TOLERANCE: f64 = 1e-9;
