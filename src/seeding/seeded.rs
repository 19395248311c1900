//! The result of a seeding method.

use crate::target::Positions;

/// Initial positions.
#[derive(Debug, Clone, PartialEq)]
pub struct Seeded<const D: usize> {
    /// In the unit of the target's domain.
    pub positions: Positions<D>,
    /// Decisions of the method, for the report.
    pub notes: Vec<String>,
}

impl<const D: usize> From<Positions<D>> for Seeded<D> {
    fn from(positions: Positions<D>) -> Self {
        Self { positions, notes: Vec::new() }
    }
}

/// Coordinates by axis.
pub(super) fn to_positions<const D: usize>(points: &[[f64; D]]) -> Positions<D> {
    std::array::from_fn(|k| points.iter().map(|x| x[k]).collect())
}
