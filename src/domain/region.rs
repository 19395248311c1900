//! Regions with curved or irregular surfaces.

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
    Hull(Arc<dyn Hull<D>>, Wall),
}

impl<const D: usize> Region<D> {
    pub fn contains(&self, x: &[f64; D]) -> bool {
        match self {
            Self::Box => true,
            Self::Ball { center, inner_radius, radius, .. } => {
                let r = distance(center, x);
                r <= *radius && r >= *inner_radius
            }
            Self::Hull(hull, _) => hull.contains(x),
        }
    }

    /// Mirror image of `x` in the nearest surface point. `None` for a box (its faces mirror by axis) and where
    /// the image is not defined (the center of a ball).
    pub fn mirror(&self, x: &[f64; D]) -> Option<[f64; D]> {
        self.mirror_with_stretch(x).map(|(image, _)| image)
    }

    /// [`Self::mirror`] with the ratio of volumes (r'/r)^(d-1) by which mirroring in a ball's surface
    /// stretches space; 1 for a hull, whose faces are flat.
    pub fn mirror_with_stretch(&self, x: &[f64; D]) -> Option<([f64; D], f64)> {
        match self {
            Self::Box => None,
            Self::Ball { center, inner_radius, radius, .. } => {
                let r = distance(center, x);
                if r <= 0.0 {
                    return None;
                }
                let surface =
                    if *inner_radius > 0.0 && r - inner_radius < radius - r { *inner_radius } else { *radius };
                let scale = (2.0 * surface - r) / r;
                let image = std::array::from_fn(|k| center[k] + scale * (x[k] - center[k]));
                (scale > 0.0).then(|| (image, scale.powi(D as i32 - 1)))
            }
            Self::Hull(hull, _) => {
                let p = hull.nearest_on_surface(x);
                Some((std::array::from_fn(|k| 2.0 * p[k] - x[k]), 1.0))
            }
        }
    }

    /// What the curved surface does; `None` for a box.
    pub fn wall(&self) -> Option<Wall> {
        match self {
            Self::Box => None,
            Self::Ball { wall, .. } | Self::Hull(_, wall) => Some(*wall),
        }
    }

    /// Unsigned distance to the surface; infinite for a box.
    pub fn distance_to_surface(&self, x: &[f64; D]) -> f64 {
        match self {
            Self::Box => f64::INFINITY,
            Self::Ball { center, inner_radius, radius, .. } => {
                let r = distance(center, x);
                let outer = (radius - r).abs();
                if *inner_radius > 0.0 { outer.min((r - inner_radius).abs()) } else { outer }
            }
            Self::Hull(hull, _) => distance(&hull.nearest_on_surface(x), x),
        }
    }
}

/// |a - b|, without images.
pub fn distance<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (0..D).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}
