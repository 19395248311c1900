//! Uniform and rectilinear grids in HDF5 files of hydrodynamics codes: Athena++ and PLUTO. All values are averages within
//! the cells, all numbers are in the code's own units.
//!
//! Athena++ (`.athdf`):
//!
//! | object | content |
//! |---|---|
//! | root attributes | Coordinates, RootGridSize, NumMeshBlocks, MeshBlockSize, MaxLevel, DatasetNames, NumVariables, VariableNames, Time |
//! | `LogicalLocations` | place of each mesh block along x1, x2, x3, counted in blocks |
//! | `x1f`, `x2f`, `x3f` | faces of the cells, one row per block |
//! | `prim`, `cons`, ... | values by variable, block, x3, x2, x1 |
//!
//! Read where no block is refined (MaxLevel 0), in coordinates `cartesian`, `minkowski`, `spherical_polar` (r, theta, phi; in one
//! dimension a radial profile) and `cylindrical` (R, phi, z).
//!
//! PLUTO on a static grid (`.dbl.h5`, `.flt.h5`):
//!
//! | object | content |
//! |---|---|
//! | `Timestep_<n>`, attribute Time | one of them |
//! | `Timestep_<n>/vars/<name>` | values by x3, x2, x1; the density is `rho` |
//! | `node_coords/X`, `Y`, `Z` | Cartesian corners of the cells, one more than there are cells along each index |
//!
//! In curvilinear coordinates the corners are the Cartesian ones of the curved cells, in single precision, and in one and two
//! dimensions nothing tells whether x and y are the r and z of an axisymmetric run, or x the radius of a spherical one. PLUTO's
//! `grid.out` in the same folder tells: its line `GEOMETRY:`, and the faces of the cells along each coordinate. Read are CARTESIAN
//! (also without that file in three dimensions, or where x is negative somewhere), SPHERICAL (r, theta, phi; in one dimension a
//! radial profile), POLAR (R, phi, z) and CYLINDRICAL (R, z). The corners must be those of `grid.out`.
//! Chombo's files of refined grids and FLASH's trees of blocks are refused.

use crate::registry::{Capabilities, FormatSpec, HDF5_SIGNATURE, Match, ReadFn, contains};

#[cfg(feature = "grid-hdf5")]
mod athena;
#[cfg(feature = "grid-hdf5")]
mod mesh;
#[cfg(feature = "grid-hdf5")]
mod pluto;
#[cfg(feature = "grid-hdf5")]
mod pluto_grid;
#[cfg(feature = "grid-hdf5")]
mod read;
mod schema;

#[cfg(feature = "grid-hdf5")]
const READ: Option<ReadFn> = Some(read::read);
#[cfg(not(feature = "grid-hdf5"))]
const READ: Option<ReadFn> = None;

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: schema::NAME,
    summary: "Athena++ and PLUTO HDF5 grids without refinement",
    extensions: &["athdf", "h5"],
    feature: "grid-hdf5",
    reference: "https://github.com/PrincetonUniversity/athena/wiki/HDF5-Format",
    capabilities: Capabilities::of_fields(&["radial", "grid"], &[1, 2, 3]),
    sniff,
    read: READ,
    write: None,
    stream: None,
};

/// Names that stand near the beginning of such files and of no others.
fn sniff(head: &[u8]) -> Match {
    let has = |what: &[u8]| contains(head, what);
    let names: [&[u8]; 5] = [b"RootGrid", b"MeshBlock", b"LogicalLocations", b"node_coords", b"bounding box"];
    match head.starts_with(HDF5_SIGNATURE) {
        true if names.into_iter().any(has) => Match::Certain,
        true => Match::Container,
        false => Match::No,
    }
}
