//! Mirror images of particles in curved surfaces. (Flat walls need none: see [`crate::domain::Domain::axis_images`].)

use super::bounds::Domain;
use super::edges;
use super::region::Region;
use crate::geometry::{Positions, at, distance};
use crate::parallel;

/// All images of `x` in surfaces nearer than `reach`, with their stretch: one in a smooth surface, and near the edges of a hull one in each face and
/// those beyond.
fn images_within<const D: usize>(region: &Region<D>, x: &[f64; D], reach: f64) -> Vec<([f64; D], f64)> {
    if let Region::Hull(hull, _) = region {
        return edges::images(hull.as_ref(), x, reach).into_iter().map(|image| (image, 1.0)).collect();
    }
    let is_near = |image: &[f64; D]| 0.5 * distance(image, x) < reach;
    region.mirror_with_stretch(x).filter(|(image, _)| is_near(image)).into_iter().collect()
}

/// Ghost particles: sources only, each with the particle that it mirrors.
#[derive(Debug, Clone, Default)]
pub struct Ghosts<const D: usize> {
    pub positions: Vec<[f64; D]>,
    pub parents: Vec<u32>,
    /// Volume of a ghost over that of its parent: mirroring in a curved surface stretches space.
    pub stretch: Vec<f64>,
}

impl<const D: usize> Ghosts<D> {
    /// Mirrors every particle that lies within `reach` of the region's surface; none for a box.
    pub fn mirror(domain: &Domain<D>, positions: &Positions<D>, reach: impl Fn(usize) -> f64 + Sync) -> Self {
        if domain.region.wall().is_none() {
            return Self { positions: Vec::new(), parents: Vec::new(), stretch: Vec::new() };
        }
        let made = parallel::map(positions[0].len(), |i| {
            let images = images_within(&domain.region, &at(positions, i), reach(i)).into_iter();
            images.map(|(image, stretch)| (image, i as u32, stretch)).collect::<Vec<_>>()
        });
        let made: Vec<([f64; D], u32, f64)> = made.into_iter().flatten().collect();
        Self {
            positions: made.iter().map(|g| g.0).collect(),
            parents: made.iter().map(|g| g.1).collect(),
            stretch: made.iter().map(|g| g.2).collect(),
        }
    }

    /// Coordinates by axis.
    pub fn soa(&self) -> Positions<D> {
        std::array::from_fn(|k| self.positions.iter().map(|x| x[k]).collect())
    }
}
