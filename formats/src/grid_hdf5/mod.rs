//! Grids in HDF5 files of hydrodynamics codes: Athena++, FLASH and PLUTO. All values are averages within the cells; all numbers
//! are in the code's own units, those of FLASH in cgs units.
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
//! | `Levels` | level of each mesh block, 0 where it is not refined |
//!
//! Read in coordinates `cartesian`, `minkowski`, `spherical_polar` (r, theta, phi; in one dimension a radial profile) and
//! `cylindrical` (R, phi, z) where no block is refined (MaxLevel 0). Refined, by static or adaptive refinement, the blocks that are
//! left undivided are all in the file; these are read in Cartesian coordinates with even steps, in one to three dimensions.
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
//!
//! FLASH and Flash-X, checkpoints and plot files, of refined and of uniform grids:
//!
//! | object | content |
//! |---|---|
//! | `bounding box` | both ends of each block along x, y, z |
//! | `refine level`, `node type` | its level, from 1 on, and whether it is a leaf (1), which has no finer blocks in its place |
//! | `unknown names` | names of variables |
//! | `dens`, `pres`, `velx`, ... | values by block, z, y, x |
//! | `integer scalars`, `real scalars` | names and values: `dimensionality`, `nxb`, `nyb`, `nzb`, `globalnumblocks`, `time` |
//! | `real runtime parameters`, `string runtime parameters` | the same: `xmin`, `xmax`; `geometry`, `xl_boundary_type`, `pc_unitsbase` |
//!
//! Read are the leaves, in Cartesian geometry, in one to three dimensions. Numbers are in cgs units unless `pc_unitsbase` says MKS
//! or none. Axes of which both boundaries are `periodic` repeat.
//!
//! Chombo's files of refined grids are refused.

use crate::registry::{Capabilities, FormatSpec, HDF5_SIGNATURE, Match, ReadFn, contains};

#[cfg(feature = "grid-hdf5")]
mod athena;
#[cfg(feature = "grid-hdf5")]
mod athena_tree;
#[cfg(feature = "grid-hdf5")]
mod flash;
#[cfg(feature = "grid-hdf5")]
mod flash_parameters;
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
mod tree;

#[cfg(feature = "grid-hdf5")]
const READ: Option<ReadFn> = Some(read::read);
#[cfg(not(feature = "grid-hdf5"))]
const READ: Option<ReadFn> = None;

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: schema::NAME,
    summary: "Athena++ and FLASH HDF5 grids, refined or not, and PLUTO's without refinement",
    extensions: &["athdf", "h5"],
    feature: "grid-hdf5",
    reference: "https://github.com/PrincetonUniversity/athena/wiki/HDF5-Format",
    capabilities: Capabilities::of_fields(&["radial", "grid", "refined grid"], &[1, 2, 3]),
    sniff,
    read: READ,
    write: None,
    stream: None,
};

/// Names that stand near the beginning of such files and of no others.
fn sniff(head: &[u8]) -> Match {
    let has = |what: &[u8]| contains(head, what);
    let names: [&[u8]; 7] = [
        b"RootGrid",
        b"MeshBlock",
        b"LogicalLocations",
        b"node_coords",
        b"bounding box",
        b"refine level",
        b"node type",
    ];
    match head.starts_with(HDF5_SIGNATURE) {
        true if names.into_iter().any(has) => Match::Certain,
        true => Match::Container,
        false => Match::No,
    }
}
