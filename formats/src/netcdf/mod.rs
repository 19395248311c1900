//! NetCDF classic, 64-bit offset, 64-bit data and NetCDF-4: radial profiles, rectilinear grids, and particles
//! (see `particles`).
//!
//! | axes of the density               | geometry                                                              |
//! |-----------------------------------|-----------------------------------------------------------------------|
//! | radius                            | radial profile; equal neighboring radii are jumps                     |
//! | one to three of x, y, z           | Cartesian grid                                                        |
//! | longitude, latitude, radius       | geographic grid                                                       |
//! | the same with depth or height     | so too, if a global attribute planet_radius, earth_radius or          |
//! |                                   | reference_radius states the surface in the axis's unit                |
//!
//! A time axis is cut at one record. Axes may be in any order, descending and non-uniform. Quirks: `missing`
//! values may be of another type than the data, or NaN; units may stand in a title only. Only the root group
//! is read.

use crate::registry::{Capabilities, FormatSpec, Match, ReadFn, WriteFn, contains};

#[cfg(feature = "netcdf")]
mod axes;
#[cfg(feature = "netcdf")]
mod decode;
#[cfg(feature = "netcdf")]
mod file;
#[cfg(feature = "netcdf")]
mod geometry;
#[cfg(feature = "netcdf")]
mod particles;
#[cfg(feature = "netcdf")]
mod read;
mod schema;

#[cfg(feature = "netcdf")]
const CODE: (Option<ReadFn>, Option<WriteFn>) = (Some(read::read), Some(particles::write));
#[cfg(not(feature = "netcdf"))]
const CODE: (Option<ReadFn>, Option<WriteFn>) = (None, None);

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: schema::NAME,
    summary: "NetCDF classic, 64-bit and NetCDF-4: fields, particles",
    extensions: &["nc", "nc4", "cdf"],
    feature: "netcdf",
    reference: "https://docs.unidata.ucar.edu/netcdf-c/current/file_format_specifications.html",
    capabilities: Capabilities {
        read_field: true,
        read_particles: true,
        write_particles: true,
        geometries: &["radial", "grid"],
        dimensions: &[1, 2, 3],
        ..Capabilities::NONE
    },
    sniff,
    read: CODE.0,
    write: CODE.1,
    stream: None,
};

/// Classic files have their own signature; NetCDF-4 files are HDF5, most with an attribute by which to know them.
fn sniff(head: &[u8]) -> Match {
    let container = crate::registry::sniff_hdf5(head);
    let marked = contains(head, b"_NCProperties");
    match head {
        [b'C', b'D', b'F', 1 | 2 | 5, ..] => Match::Certain,
        _ if container == Match::Container && marked => Match::Certain,
        _ => container,
    }
}
