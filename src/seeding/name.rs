//! The seeding methods by name.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the initial positions are made; [`METHODS`](super::METHODS) tells what each can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Seeding {
    /// Recursive bisection into equal masses, one particle per part: no long-wave error from the start.
    #[default]
    MassBisection,
    /// Independent random positions with probability proportional to the target.
    Random,
    /// Simple cubic (square) lattice.
    Cubic,
    /// Face-centered cubic (hexagonal) lattice.
    #[schemars(extend("x-aliases" = ["fcc"]))]
    #[serde(alias = "fcc")]
    CubicClosePacked,
    /// Hexagonal close packing: layers in the order ABAB.
    #[schemars(extend("x-aliases" = ["hcp"]))]
    #[serde(alias = "hcp")]
    HexagonalClosePacked,
    /// Body-centered cubic (hexagonal) lattice.
    #[schemars(extend("x-aliases" = ["bcc"]))]
    #[serde(alias = "bcc")]
    BodyCenteredCubic,
    /// Points of a Kronecker sequence, mapped by mass: more uniform than random points.
    LowDiscrepancy,
    /// Centroids of the tiles of an aperiodic tiling by prisms.
    Quaquaversal,
    /// Concentric shells with particles on a spiral (rings in two dimensions).
    Shells,
    /// Concentric shells with particles in regions of equal area.
    EqualAreaShells,
    /// Irregular but uniform: a relaxed periodic box, tiled.
    Glass,
    /// The same, relaxed by reversed gravity.
    GravitationalGlass,
    /// A simple cubic lattice of uniform spacing, whose particle masses represent the density.
    VariableMasses,
}

impl Seeding {
    /// Whether neighbors are evenly spaced in its arrangement.
    pub fn is_in_order(self) -> bool {
        !matches!(self, Self::MassBisection | Self::Random | Self::LowDiscrepancy | Self::Quaquaversal)
    }

    /// Whether it is a lattice, perfect where the target is uniform and stretched elsewhere.
    pub fn is_lattice(self) -> bool {
        matches!(self, Self::Cubic | Self::CubicClosePacked | Self::HexagonalClosePacked | Self::BodyCenteredCubic)
    }

    /// Whether it fills each region of a target by itself, with the whole number of particles that is due to it. Patterns
    /// that cover all of space do not.
    pub fn goes_by_region(self) -> bool {
        matches!(self, Self::MassBisection | Self::Random | Self::LowDiscrepancy | Self::Shells | Self::EqualAreaShells)
    }
}
