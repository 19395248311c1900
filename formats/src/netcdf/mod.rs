//! NetCDF fields: classic (CDF-1, CDF-2, CDF-5) and NetCDF-4, with the CF conventions.
//!
//! - Axes are known by `axis`, `standard_name`, `units`, `positive` or their name, never by their order; descending
//!   ones are turned round together with the data, and the data is brought into x-fastest order.
//! - One axis that is a radius makes a radial profile; x, y, z a grid; longitude, latitude and radius a spherical grid.
//! - `_FillValue`, `missing_value` and `valid_range` mask to NaN before `scale_factor` and `add_offset` are applied (in f64);
//!   unpacked f32 data stays f32.
//! - A time axis is cut at one record.

#[cfg(feature = "netcdf")]
mod axes;
#[cfg(feature = "netcdf")]
mod read;

use crate::registry::{Capabilities, FormatSpec, Match};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: "netcdf",
    summary: "NetCDF classic, 64-bit and NetCDF-4 fields",
    extensions: &["nc", "nc4", "cdf", "netcdf"],
    feature: "netcdf",
    reference: "https://docs.unidata.ucar.edu/netcdf-c/current/file_format_specifications.html",
    capabilities: Capabilities {
        read_field: true,
        read_particles: false,
        write_particles: false,
        geometries: &["radial", "grid"],
        dimensions: &[1, 2, 3],
    },
    sniff,
    #[cfg(feature = "netcdf")]
    read: Some(read::read),
    #[cfg(not(feature = "netcdf"))]
    read: None,
    write: None,
};

/// `CDF` and a version byte, or an HDF5 file, which may be NetCDF-4.
fn sniff(head: &[u8]) -> Match {
    if head.len() >= 4 && head.starts_with(b"CDF") && matches!(head[3], 1 | 2 | 5) {
        Match::Certain
    } else if head.starts_with(b"\x89HDF\r\n\x1a\n") {
        Match::Container
    } else {
        Match::No
    }
}
