//! Names in the files, and the bytes that the files begin with.

use crate::registry::Columns;

pub const NAME: &str = "dualsphysics";

/// What every file of its container begins with, and which of them are particles.
pub const MAGIC: &[u8] = b"#FileJBD JPartDataBi4";

#[cfg(feature = "dualsphysics")]
pub const CONTENT: &str = "JPartDataBi4";

/// The item in which a header's other facts are texts.
#[cfg(feature = "dualsphysics")]
pub const OWN_ITEM: &str = "SphPrep";

/// Before the name of a column, in the keys of the texts that say what it is measured in.
#[cfg(feature = "dualsphysics")]
pub const UNIT: &str = "unit ";

/// Type of wall particles.
pub const WALLS: u8 = 5;

/// Unit normals of the wall's surface, towards the fluid, and the distance from there: the code has their product.
pub const NORMALS: &str = "Normals";
#[cfg(feature = "dualsphysics")]
pub const SURFACE_DISTANCE: &str = "SurfaceDistance";

/// Columns that a file holds, of names as long as the code takes them.
pub const COLUMNS: Columns =
    Columns::Scalars { longest_name: 120, vectors: &[crate::particle_names::VELOCITIES, NORMALS] };

/// Dimensions of the code.
pub const DIMENSIONS: &[usize] = &[2, 3];

/// The reach of both of the code's kernels over its smoothing length.
pub const SUPPORT: f64 = 2.0;

/// Axes along which a number of the header says that the box is periodic: a bit for each; this stands for an unknown one.
#[cfg(feature = "dualsphysics")]
pub const UNKNOWN_AXES: i64 = 96;

/// Where the axis of so many dimensions is in a triple: a plane is that of x and z.
#[cfg(feature = "dualsphysics")]
pub fn slot(axis: usize, dimension: usize) -> usize {
    if dimension == 2 && axis == 1 { 2 } else { axis }
}
