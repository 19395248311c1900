//! NetCDF classic, 64-bit and NetCDF-4 fields

use crate::registry::{Capabilities, FormatSpec, Match};

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: "netcdf",
    summary: "NetCDF classic, 64-bit and NetCDF-4 fields",
    extensions: &["nc", "nc4", "cdf"],
    feature: "netcdf",
    reference: "https://docs.unidata.ucar.edu/netcdf-c/current/file_format_specifications.html",
    capabilities: Capabilities {
        read_field: true,
        read_particles: false,
        write_particles: false,
        geometries: &[],
        dimensions: &[1, 2, 3],
    },
    sniff,
    read: None,
    write: None,
};

fn sniff(_head: &[u8]) -> Match {
    Match::No
}
