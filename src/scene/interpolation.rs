//! How values between those of grids and particles are found.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Interpolation on grids, and between the particles of a snapshot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum InterpolationName {
    /// The density has a slope in each direction within each cell, which conserves the cell's mass and keeps jumps sharp; carried variables are
    /// constant in each cell. Default for cells of one size in Cartesian coordinates.
    PiecewiseLinear,
    /// Between the nearest nodes, or middles of cells, in each direction; on refined grids the same as `piecewise-linear`.
    Linear,
    /// Limited cubic, without overshoots; not on refined grids.
    Cubic,
    /// The value of the cell, or of the nearest node. For a snapshot, each particle's values hold throughout its Voronoi cell, which is the
    /// default for AREPO; `linear` fits a smooth field to them, as to other snapshots.
    Nearest,
}
