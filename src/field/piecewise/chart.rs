//! Coordinates in which the surface of a domain is a face of the unit cube, or else one more discontinuity.

use super::integrand::Integrand;
use crate::field::patch::sine_of_polar_angles;
use crate::field::{Enclosure, Level, Patch, ScalarField, Trace};
use sph::domain::{Domain, Region};
use sph::geometry::{distance, unit_ball_volume};
use std::f64::consts::{PI, TAU};

/// A field over a domain as a function on the unit cube: balls by radius and angles, cylinders by radius, angle and
/// height.
pub(crate) struct Chart<'a, const D: usize> {
    field: &'a dyn ScalarField<D>,
    domain: &'a Domain<D>,
    volume: f64,
}

impl<'a, const D: usize> Chart<'a, D> {
    /// `None` within a hull that smooth functions do not tell.
    pub fn new(field: &'a dyn ScalarField<D>, domain: &'a Domain<D>) -> Option<Self> {
        let extent = domain.extent();
        let volume = match &domain.region {
            Region::Box => extent.iter().product(),
            Region::Ball { radius, .. } => unit_ball_volume(D) * radius.powi(D as i32),
            Region::Cylinder { axis, radius, .. } => unit_ball_volume(2) * radius.powi(2) * extent[*axis],
            Region::Hull(hull, _) if hull.levels(&domain.lo, &mut |_| ()) => extent.iter().product(),
            Region::Hull(..) => return None,
        };
        Some(Self { field, domain, volume })
    }

    /// The place, and the volume about it per volume of the unit cube.
    fn place(&self, u: &[f64; D]) -> ([f64; D], f64) {
        let (lo, extent) = (self.domain.lo, self.domain.extent());
        match &self.domain.region {
            Region::Ball { center, inner_radius, radius, .. } => {
                let (offset, share) = on_spheres(u, inner_radius / radius);
                (sph::array(|k| center[k] + radius * offset[k]), share * self.volume)
            }
            Region::Cylinder { center, axis, inner_radius, radius, .. } => {
                let inner = inner_radius / radius;
                let q = inner + u[0] * (1.0 - inner);
                let (sin, cos) = (TAU * u[1]).sin_cos();
                let mut around = [cos, sin].into_iter();
                let x = sph::array(|k| match k == *axis {
                    true => lo[k] + u[D - 1] * extent[k],
                    false => center[k] + q * radius * around.next().unwrap_or(0.0),
                });
                (x, 2.0 * q * (1.0 - inner) * self.volume)
            }
            Region::Box | Region::Hull(..) => (sph::array(|k| lo[k] + u[k] * extent[k]), self.volume),
        }
    }
}

/// The place in a shell of the radii `inner` to 1, and the share of the ball's volume per volume of the unit cube.
///
/// The angle to the pole is a coordinate, not its cosine, of which the place is no smooth function there.
fn on_spheres<const D: usize>(u: &[f64; D], inner: f64) -> ([f64; 3], f64) {
    let width = 1.0 - inner;
    let q = inner + u[0] * width;
    match D {
        1 if u[0] < 0.5 => ([-1.0 + 2.0 * u[0] * width, 0.0, 0.0], width),
        1 => ([inner + (2.0 * u[0] - 1.0) * width, 0.0, 0.0], width),
        2 => {
            let (sin, cos) = (TAU * u[1]).sin_cos();
            ([q * cos, q * sin, 0.0], 2.0 * q * width)
        }
        _ => {
            let (ring, z) = (PI * u[1]).sin_cos();
            let (sin, cos) = (TAU * u[2]).sin_cos();
            ([q * ring * cos, q * ring * sin, q * z], 3.0 * q * q * width * 0.5 * PI * ring)
        }
    }
}

/// Parts of a cell along an axis, at most.
const MOST_CUTS: [usize; 4] = [1, 1, 8, 4];

impl<const D: usize> Chart<'_, D> {
    /// Into how many parts along each axis a cell is cut that are about as long as they are wide: boxes around curved cells that are
    /// long hold much that is not in them.
    fn cuts(&self, lo: &[f64; D], hi: &[f64; D]) -> [usize; D] {
        let middle = |k: usize| 0.5 * (lo[k] + hi[k]);
        let (inner, ring) = match &self.domain.region {
            Region::Ball { inner_radius, radius, .. } if D > 1 => (inner_radius / radius, (PI * middle(1)).sin()),
            Region::Cylinder { inner_radius, radius, .. } => (inner_radius / radius, 0.0),
            _ => return [1; D],
        };
        let from_center = inner + middle(0) * (1.0 - inner);
        let is_ball = matches!(self.domain.region, Region::Ball { .. });
        // A height is along an axis of the boxes.
        let length = |k: usize| match k {
            0 => Some((1.0 - inner) * (hi[0] - lo[0])),
            1 if D == 3 && is_ball => Some(PI * from_center * (hi[1] - lo[1])),
            1 => Some(TAU * from_center * (hi[1] - lo[1])),
            _ => Some(TAU * from_center * ring * (hi[2] - lo[2])).filter(|_| is_ball),
        };
        let least = (0..D).filter_map(length).fold(f64::INFINITY, f64::min);
        sph::array(|k| length(k).map_or(1, |l| ((l / least).ceil() as usize).clamp(1, MOST_CUTS[D])))
    }

    /// What holds a cell, with bounds of the volume about its places per volume of the unit cube.
    fn patch(&self, a: &[f64; D], b: &[f64; D]) -> (Patch<D>, [f64; 2]) {
        let (lo, extent) = (self.domain.lo, self.domain.extent());
        let pair = |k: usize| [a[k], b[k]];
        match &self.domain.region {
            Region::Ball { center, inner_radius, radius, .. } => {
                let inner = inner_radius / radius;
                let width = 1.0 - inner;
                let shares = pair(0).map(|u| inner + u * width);
                let radii = shares.map(|q| q * radius);
                match D {
                    1 => {
                        // Cells are on one side of the center.
                        let side = if a[0] < 0.5 { -1.0 } else { inner - width };
                        let corner = |u: &[f64; D]| center.map(|c| c + radius * (side + 2.0 * u[0] * width));
                        (Patch::of_box(corner(a), corner(b)), [width * self.volume; 2])
                    }
                    2 => {
                        let patch = Patch::of_shell(*center, radii, [0.0; 2], pair(1));
                        (patch, shares.map(|q| 2.0 * q * width * self.volume))
                    }
                    _ => {
                        let angles = pair(1).map(|u| PI * u);
                        let [pole, equator] = [angles[1], angles[0]].map(f64::cos);
                        let patch = Patch::of_shell(*center, radii, [pole, equator], pair(2));
                        let rings = sine_of_polar_angles(angles);
                        let volume = |i: usize| 1.5 * PI * shares[i].powi(2) * width * rings[i] * self.volume;
                        (patch, [volume(0), volume(1)])
                    }
                }
            }
            Region::Cylinder { center, axis, inner_radius, radius, .. } => {
                let inner = inner_radius / radius;
                let shares = pair(0).map(|u| inner + u * (1.0 - inner));
                let ends = pair(D - 1).map(|u| lo[*axis] + u * extent[*axis]);
                let patch = Patch::of_tube((center, *axis), shares.map(|q| q * radius), ends, pair(1));
                (patch, shares.map(|q| 2.0 * q * (1.0 - inner) * self.volume))
            }
            Region::Box | Region::Hull(..) => {
                let corner = |u: &[f64; D]| sph::array(|k| lo[k] + u[k] * extent[k]);
                (Patch::of_box(corner(a), corner(b)), [self.volume; 2])
            }
        }
    }
}

impl<const D: usize> Integrand<D> for Chart<'_, D> {
    fn value(&self, u: &[f64; D]) -> f64 {
        let (x, volume) = self.place(u);
        let is_outside = matches!(&self.domain.region, Region::Hull(hull, _) if !hull.contains(&x));
        if is_outside { 0.0 } else { self.field.value(&x) * volume }
    }

    /// Outside of a hull everything is one part.
    fn trace(&self, u: &[f64; D]) -> Trace {
        let x = self.place(u).0;
        let Region::Hull(hull, _) = &self.domain.region else { return self.field.trace(&x) };
        let mut trace = Trace::new(0, 0);
        hull.levels(&x, &mut |value| {
            let (lo, hi) = if value <= 0.0 { (f64::NEG_INFINITY, 0.0) } else { (0.0, f64::INFINITY) };
            trace.kink(f64::from(value <= 0.0));
            trace.push(Level { value, lo, hi });
        });
        if hull.contains(&x) {
            trace.append(&self.field.trace(&x));
        }
        trace
    }

    fn enclosure(&self, lo: &[f64; D], hi: &[f64; D]) -> Option<Enclosure> {
        let middle = self.place(&sph::array(|k| 0.5 * (lo[k] + hi[k]))).0;
        let of = |(patch, volume): (Patch<D>, [f64; 2])| {
            let patch = Patch { middle, ..patch };
            let Region::Hull(hull, _) = &self.domain.region else {
                return Some(self.field.enclosure(&patch)?.times(volume));
            };
            let is_cut = hull.nearest_within(&middle, 0.5 * distance(&patch.lo, &patch.hi)).is_some();
            if !is_cut && !hull.contains(&middle) {
                return Some(Enclosure::new(0.0, 0.0, true));
            }
            let bounds = self.field.enclosure(&patch)?.times(volume);
            // Of those of the hull points tell the course, which is that of polynomials.
            let mut levels = Vec::new();
            hull.levels(&middle, &mut |value| levels.push([value; 2]));
            Some(bounds.within_hull(&levels, is_cut))
        };
        let cuts = self.cuts(lo, hi);
        let parts = (0..cuts.iter().product::<usize>()).map(|i| {
            let at = |k: usize, j: usize| lo[k] + (hi[k] - lo[k]) * j as f64 / cuts[k] as f64;
            let place = |k: usize| i / cuts[..k].iter().product::<usize>() % cuts[k];
            of(self.patch(&sph::array(|k| at(k, place(k))), &sph::array(|k| at(k, place(k) + 1))))
        });
        parts.reduce(|a, b| Some(a?.union(b?))).flatten()
    }
}
