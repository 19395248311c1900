//! The region that particles fill: a box, or the interior of their surface as a hull.

use super::level::{APART, End, Outline, REACH, REACHED, STEPS, length};
use crate::error::Result;
use crate::field::listed::Listed;
use nalgebra::SVector;
use sph::domain::{Axis, Domain, Hull, Region, Wall};
use std::sync::Arc;

/// Steps along the surface towards a place.
const SLIDES: usize = 3;

/// Where particles end.
pub(in crate::field) enum Ends<const D: usize> {
    /// They fill a box; its faces along axes that do not repeat are half a spacing beyond the outermost.
    Box(Domain<D>),
    Surface(Arc<Outline<D>>),
}

impl<const D: usize> Ends<D> {
    /// The particle of `particles` that is nearest to `x`, and its distance; `None` where there is no matter.
    pub(in crate::field) fn near(&self, x: &[f64; D], particles: &Listed<D>) -> Option<(usize, f64)> {
        match self {
            Self::Box(filled) => filled.contains(x).then(|| particles.near(x)),
            Self::Surface(outline) if outline.domain.contains(x) => {
                let found = outline.found(&outline.domain.wrapped(x));
                found.is_within.then_some(found.near)
            }
            Self::Surface(_) => None,
        }
    }

    /// How far `x`, within, is from where matter ends; no more than that, but `enough`, where it is farther.
    pub(in crate::field) fn distance(&self, x: &[f64; D], enough: f64) -> f64 {
        match self {
            Self::Box(filled) => (0..D)
                .filter(|&k| filled.axes[k] != Axis::Periodic)
                .map(|k| (x[k] - filled.lo[k]).min(filled.hi[k] - x[k]))
                .fold(f64::INFINITY, f64::min),
            Self::Surface(outline) => {
                let x = outline.domain.wrapped(x);
                let depth = outline.depth(outline.found(&x).near);
                if depth >= enough { depth } else { outline.nearest_end(&x).map_or(f64::INFINITY, |end| end.1) }
            }
        }
    }

    /// The domain that the particles fill.
    ///
    /// # Errors
    /// None, as there is a box about them.
    pub(in crate::field) fn domain(&self) -> Result<Domain<D>> {
        match self {
            Self::Box(filled) => Ok(filled.clone()),
            Self::Surface(outline) => {
                let Domain { lo, hi, axes, .. } = outline.domain;
                let hull: Arc<dyn Hull<D>> = Arc::clone(outline) as Arc<dyn Hull<D>>;
                Ok(Domain::new(lo, hi, axes, Region::Hull(hull, Wall::Open))?)
            }
        }
    }
}

impl<const D: usize> Hull<D> for Outline<D> {
    fn contains(&self, x: &[f64; D]) -> bool {
        self.holds(x)
    }

    fn nearest_on_surface(&self, x: &[f64; D]) -> [f64; D] {
        let Some((nearest, distance)) = self.nearest_end(x) else { return *x };
        let End { at, normal, spacing, .. } = self.ends[nearest];
        let offset = SVector::<f64, D>::from(self.domain.displacement(x, &at));
        let from = SVector::<f64, D>::from(*x);
        // Towards the foot of the perpendicular, as far as the points of the surface are apart.
        let slid = |offset: SVector<f64, D>, normal: SVector<f64, D>| {
            let along = offset - normal * normal.dot(&offset);
            let size = along.norm();
            offset - along * if size > APART * spacing { APART * spacing / size } else { 1.0 }
        };
        let mut offset = slid(offset, normal.into());
        if distance > REACH * spacing {
            return (from + offset).into();
        }
        for _ in 0..SLIDES {
            let Some(end) = self.led(&(from + offset).into(), spacing, STEPS) else { break };
            offset = self.domain.displacement(x, &end.at).into();
            let next = slid(offset, end.normal.into());
            if (next - offset).norm() <= REACHED * spacing {
                break;
            }
            offset = next;
        }
        (from + offset).into()
    }

    /// The sum of the particles' own.
    fn volume(&self) -> f64 {
        self.blobs.iter().map(|b| b.volume).sum()
    }

    fn nearest_within(&self, x: &[f64; D], reach: f64) -> Option<[f64; D]> {
        if self.depth(self.found(x).near) > reach {
            return None;
        }
        let (nearest, distance) = self.nearest_end(x)?;
        // The foot is nearer than the nearest of the points by less than these are apart.
        if distance > reach + APART * self.ends[nearest].spacing {
            return None;
        }
        Some(self.nearest_on_surface(x)).filter(|p| length(&self.domain.displacement(p, x)) < reach)
    }

    fn is_edge_within(&self, x: &[f64; D], reach: f64) -> bool {
        let Some((nearest, distance)) = self.nearest_end(x) else { return true };
        distance + reach > self.ends[nearest].smooth
    }
}
