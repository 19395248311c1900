//! Particles of a file that states no domain except perhaps its box, in units of their own extent and mass.

use crate::target::Positions;
use sph::domain::{Axis, Domain, DomainError, Region};

/// Positions from the lower corner of what they span, with the longest edge 1 and the total mass 1.
pub struct InOwnUnits<const D: usize> {
    pub positions: Positions<D>,
    pub masses: Vec<f64>,
    /// The box along periodic axes, elsewhere as far as there are particles, with vacuum beyond.
    pub domain: Domain<D>,
    /// The lower corner in the file's units.
    pub start: [f64; D],
    /// The longest edge, and the total mass, in the file's units.
    pub size: f64,
    pub total: f64,
}

/// An axis of the box whose faces are stated, in the file's units.
#[derive(Debug, Clone, Copy)]
pub struct Stated {
    pub corner: f64,
    pub edge: f64,
    pub axis: Axis,
}

/// Shortest edge of what particles span: all may be in one plane.
const THINNEST: f64 = 1e-6;

impl<const D: usize> InOwnUnits<D> {
    /// From interleaved coordinates and masses, with the edges of the box, which has its corner at the origin. Particles beyond
    /// a periodic face are those within.
    ///
    /// # Errors
    /// Coordinates that are not finite.
    pub fn new(
        coordinates: &[f64],
        masses: &[f64],
        (box_size, periodic): (&[f64; 3], [bool; 3]),
    ) -> Result<Self, DomainError> {
        let stated = |k: usize| {
            (periodic[k] && box_size[k] > 0.0).then_some(Stated {
                corner: 0.0,
                edge: box_size[k],
                axis: Axis::Periodic,
            })
        };
        Self::within(coordinates, masses, stated)
    }

    /// The same where some axes are stated.
    ///
    /// # Errors
    /// Coordinates that are not finite, or edges that are none.
    pub fn within(
        coordinates: &[f64],
        masses: &[f64],
        stated: impl Fn(usize) -> Option<Stated>,
    ) -> Result<Self, DomainError> {
        let along = |k: usize| coordinates.iter().skip(k).step_by(D).copied();
        let lo: [f64; D] = sph::array(|k| along(k).fold(f64::INFINITY, f64::min));
        let hi: [f64; D] = sph::array(|k| along(k).fold(f64::NEG_INFINITY, f64::max));
        let edge = |k: usize| stated(k).map_or((hi[k] - lo[k]).max(f64::MIN_POSITIVE), |s| s.edge);
        let size = (0..D).map(edge).fold(0.0, f64::max);
        let total: f64 = masses.iter().sum();
        let start: [f64; D] = sph::array(|k| stated(k).map_or(lo[k], |s| s.corner));
        let axes = std::array::from_fn(|k| stated(k).map_or(Axis::OPEN, |s| s.axis));
        let extent: [f64; D] = sph::array(|k| (edge(k) / size).max(THINNEST));
        let domain = Domain::new([0.0; D], extent, axes, Region::Box)?;
        let mut positions: Positions<D> = std::array::from_fn(|k| along(k).map(|v| (v - start[k]) / size).collect());
        for i in 0..masses.len() {
            let inside = domain.wrapped(&sph::array(|k| positions[k][i]));
            (0..D).for_each(|k| positions[k][i] = inside[k]);
        }
        Ok(Self { positions, masses: masses.iter().map(|m| m / total).collect(), domain, start, size, total })
    }
}
