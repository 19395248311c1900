//! Regions with curved or irregular surfaces.

use crate::geometry::distance;
use std::fmt::Debug;
use std::sync::Arc;

/// What a wall or surface does to the fluid beyond it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wall {
    /// The fluid continues as its mirror image.
    Reflecting,
    /// Vacuum beyond.
    Open,
}

/// Irregular region, for example the hull of a mesh.
pub trait Hull<const D: usize>: Send + Sync + Debug {
    fn contains(&self, x: &[f64; D]) -> bool;
    /// The nearest point of the surface.
    fn nearest_on_surface(&self, x: &[f64; D]) -> [f64; D];
    fn volume(&self) -> f64;

    /// The nearest point of the surface where one is nearer than `reach`; a search that may stop early.
    fn nearest_within(&self, x: &[f64; D], reach: f64) -> Option<[f64; D]> {
        Some(self.nearest_on_surface(x)).filter(|p| distance(p, x) < reach)
    }

    /// Whether the surface may have an edge within `reach`; a guess that is never false by mistake.
    fn is_edge_within(&self, x: &[f64; D], reach: f64) -> bool {
        let _ = (x, reach);
        true
    }

    /// What is probably not meant with it, a sentence for those who see results.
    fn doubt(&self) -> Option<String> {
        None
    }

    /// The parts of the line through `x` along `axis` that lie inside, as ascending intervals of that coordinate; `None` where
    /// containment is only known point by point.
    fn chords(&self, axis: usize, x: &[f64; D]) -> Option<Vec<[f64; 2]>> {
        let _ = (axis, x);
        None
    }

    /// Whether the region is put together from shapes that smooth functions tell; if so `each` gets the value of every one at
    /// `x`, not positive within its shape, always in the same order.
    fn levels(&self, x: &[f64; D], each: &mut dyn FnMut(f64)) -> bool {
        let _ = (x, each);
        false
    }
}

/// The part of the bounding box that may hold particles.
#[derive(Debug, Clone)]
pub enum Region<const D: usize> {
    /// All of it.
    Box,
    /// Interval, disc or sphere; with an `inner_radius` above zero, an annulus or shell.
    Ball {
        center: [f64; D],
        inner_radius: f64,
        radius: f64,
        wall: Wall,
    },
    /// Cylinder along `axis`, or what is between two of them; its ends are the faces of the bounding box.
    Cylinder {
        center: [f64; D],
        axis: usize,
        inner_radius: f64,
        radius: f64,
        wall: Wall,
    },
    Hull(Arc<dyn Hull<D>>, Wall),
}

/// What balls and cylinders have in common: a surface at a distance from a point or a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Round<const D: usize> {
    pub center: [f64; D],
    /// Of a cylinder.
    pub axis: Option<usize>,
    pub inner_radius: f64,
    pub radius: f64,
}

impl<const D: usize> Round<D> {
    /// From the center, or from the line through it, to `x`.
    #[inline]
    pub fn offset(&self, x: &[f64; D]) -> [f64; D] {
        crate::array(|k| if self.axis == Some(k) { 0.0 } else { x[k] - self.center[k] })
    }

    /// Length of [`Self::offset`].
    #[inline]
    pub fn distance(&self, x: &[f64; D]) -> f64 {
        self.offset(x).iter().map(|o| o * o).sum::<f64>().sqrt()
    }

    /// `x` moved to `factor` times its distance.
    pub fn scaled(&self, x: &[f64; D], factor: f64) -> [f64; D] {
        crate::array(|k| match self.axis == Some(k) {
            true => x[k],
            false => self.center[k] + factor * (x[k] - self.center[k]),
        })
    }

    /// Directions along the surface in which it is curved.
    pub fn curved(&self) -> usize {
        D - 1 - usize::from(self.axis.is_some())
    }
}

impl<const D: usize> Region<D> {
    /// The same region in other units of length.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        match self {
            Self::Box => Self::Box,
            Self::Ball { center, inner_radius, radius, wall } => Self::Ball {
                center: center.map(|c| c * factor),
                inner_radius: inner_radius * factor,
                radius: radius * factor,
                wall: *wall,
            },
            Self::Cylinder { center, axis, inner_radius, radius, wall } => Self::Cylinder {
                center: center.map(|c| c * factor),
                axis: *axis,
                inner_radius: inner_radius * factor,
                radius: radius * factor,
                wall: *wall,
            },
            Self::Hull(hull, wall) => Self::Hull(Arc::new(ScaledHull { inner: Arc::clone(hull), factor }), *wall),
        }
    }

    /// The region as a [`Round`] one, if it is.
    pub fn round(&self) -> Option<Round<D>> {
        match *self {
            Self::Ball { center, inner_radius, radius, .. } => Some(Round { center, axis: None, inner_radius, radius }),
            Self::Cylinder { center, axis, inner_radius, radius, .. } => {
                Some(Round { center, axis: Some(axis), inner_radius, radius })
            }
            Self::Box | Self::Hull(..) => None,
        }
    }

    #[inline]
    pub fn contains(&self, x: &[f64; D]) -> bool {
        match (self.round(), self) {
            (Some(round), _) => {
                let r = round.distance(x);
                r <= round.radius && r >= round.inner_radius
            }
            (None, Self::Hull(hull, _)) => hull.contains(x),
            (None, _) => true,
        }
    }

    /// Mirror image of `x` in the nearest surface point. `None` for a box (its faces mirror by axis) and where
    /// the image is not defined (the center of a ball).
    pub fn mirror(&self, x: &[f64; D]) -> Option<[f64; D]> {
        self.mirror_with_stretch(x).map(|(image, _)| image)
    }

    /// [`Self::mirror`] with the ratio of volumes, (r'/r)^(d-1) in a ball and r'/r in a cylinder, by which mirroring
    /// stretches space; 1 for a hull, whose faces are flat.
    pub fn mirror_with_stretch(&self, x: &[f64; D]) -> Option<([f64; D], f64)> {
        match (self.round(), self) {
            (Some(round), _) => {
                let r = round.distance(x);
                if r <= 0.0 {
                    return None;
                }
                let inner = round.inner_radius > 0.0 && r - round.inner_radius < round.radius - r;
                let surface = if inner { round.inner_radius } else { round.radius };
                let scale = (2.0 * surface - r) / r;
                (scale > 0.0).then(|| (round.scaled(x, scale), scale.powi(round.curved() as i32)))
            }
            (None, Self::Hull(hull, _)) => {
                let p = hull.nearest_on_surface(x);
                Some((crate::array(|k| 2.0 * p[k] - x[k]), 1.0))
            }
            (None, _) => None,
        }
    }

    /// What the curved surface does; `None` for a box.
    pub fn wall(&self) -> Option<Wall> {
        match self {
            Self::Box => None,
            Self::Ball { wall, .. } | Self::Cylinder { wall, .. } | Self::Hull(_, wall) => Some(*wall),
        }
    }

    /// Whether the curved surface is nearer than `reach`.
    pub fn is_surface_within(&self, x: &[f64; D], reach: f64) -> bool {
        match self {
            Self::Hull(hull, _) => hull.nearest_within(x, reach).is_some(),
            _ => self.distance_to_surface(x) < reach,
        }
    }

    /// Unsigned distance to the curved surface; infinite for a box.
    pub fn distance_to_surface(&self, x: &[f64; D]) -> f64 {
        match (self.round(), self) {
            (Some(round), _) => {
                let r = round.distance(x);
                let outer = (round.radius - r).abs();
                if round.inner_radius > 0.0 { outer.min((r - round.inner_radius).abs()) } else { outer }
            }
            (None, Self::Hull(hull, _)) => distance(&hull.nearest_on_surface(x), x),
            (None, _) => f64::INFINITY,
        }
    }
}

/// A hull in other units of length.
#[derive(Debug)]
struct ScaledHull<const D: usize> {
    inner: Arc<dyn Hull<D>>,
    factor: f64,
}

impl<const D: usize> ScaledHull<D> {
    fn to_inner(&self, x: &[f64; D]) -> [f64; D] {
        crate::array(|k| x[k] / self.factor)
    }

    fn to_outer(&self, x: &[f64; D]) -> [f64; D] {
        crate::array(|k| x[k] * self.factor)
    }
}

impl<const D: usize> Hull<D> for ScaledHull<D> {
    fn contains(&self, x: &[f64; D]) -> bool {
        self.inner.contains(&self.to_inner(x))
    }

    fn nearest_on_surface(&self, x: &[f64; D]) -> [f64; D] {
        self.to_outer(&self.inner.nearest_on_surface(&self.to_inner(x)))
    }

    fn volume(&self) -> f64 {
        self.inner.volume() * self.factor.powi(D as i32)
    }

    fn nearest_within(&self, x: &[f64; D], reach: f64) -> Option<[f64; D]> {
        let found = self.inner.nearest_within(&self.to_inner(x), reach / self.factor)?;
        Some(self.to_outer(&found))
    }

    fn is_edge_within(&self, x: &[f64; D], reach: f64) -> bool {
        self.inner.is_edge_within(&self.to_inner(x), reach / self.factor)
    }

    fn doubt(&self) -> Option<String> {
        self.inner.doubt()
    }

    fn chords(&self, axis: usize, x: &[f64; D]) -> Option<Vec<[f64; 2]>> {
        let chords = self.inner.chords(axis, &self.to_inner(x))?;
        Some(chords.into_iter().map(|chord| chord.map(|v| v * self.factor)).collect())
    }
}
