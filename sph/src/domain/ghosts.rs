//! Mirror images of particles in curved surfaces. (Flat walls need none: see [`crate::domain::Domain::axis_images`].)

use super::bounds::Domain;
use super::edges;
use super::region::Region;
use crate::geometry::{Positions, at, distance};
use crate::parallel;

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
        let n = positions[0].len();
        let made: Vec<([f64; D], u32, f64)> = match &domain.region {
            // Near an edge there are several.
            Region::Hull(hull, _) => {
                let all = parallel::map(n, |i| edges::images(hull.as_ref(), &at(positions, i), reach(i)));
                let of_each = all.into_iter().enumerate();
                of_each.flat_map(|(i, images)| images.into_iter().map(move |image| (image, i as u32, 1.0))).collect()
            }
            round => {
                let all = parallel::map(n, |i| {
                    let x = at(positions, i);
                    let (image, stretch) = round.mirror_with_stretch(&x)?;
                    (0.5 * distance(&image, &x) < reach(i)).then_some((image, i as u32, stretch))
                });
                all.into_iter().flatten().collect()
            }
        };
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
