#![cfg_attr(feature = "default", doc = include_str!("../README.md"))]
//!
//! # Adding a format
//!
//! `examples/adding_a_format.rs`, which the tests compile and run, is a whole format in a host's own list:
//!
//! ```no_run
#![doc = include_str!("../examples/adding_a_format.rs")]
//! ```
//!
//! A format of this crate also gets a folder, a Cargo feature of its name here and in the root crate, and a line in
//! [`FORMATS`], by which the conformance tests (`tests/particles.rs`, `tests/conformance.rs`) take it up.

#![forbid(unsafe_code)]

mod axis_units;
mod capabilities;
mod compressed;
pub mod error;
mod family;
mod in_other_terms;
pub mod layout;
mod limits;
pub mod magnetic;
pub mod model;
pub mod nearest;
pub mod output;
pub mod particle_names;
mod provenance;
pub mod refined;
pub mod registry;
mod space;
pub mod stream;
pub mod units;

pub mod amrex;
pub mod arepo;
pub mod common;
pub mod dualsphysics;
pub mod fgong;
pub mod gadget;
pub mod gadget_binary;
pub mod gizmo;
pub mod grid_hdf5;
pub mod gyre;
pub mod gyre_hdf5;
pub mod image;
pub mod kepler;
pub mod mesa;
pub mod netcdf;
pub mod numpy;
pub mod obj;
pub mod phantom;
pub mod ply;
pub mod ramses;
pub mod sph_exa;
pub mod stl;
pub mod swift;
pub mod table;
pub mod vtk;
pub mod wdec;

pub use capabilities::halvings;
pub use error::{FormatError, Result};
pub use family::{files_of, would_be_lost};
pub use model::{
    Cells, Column, Coordinates, Geometry, GridAxis, Location, ParticleFile, ParticleTable, RawField, RunHeader,
    Species, Values, Variable, WITHOUT_AXES,
};
pub use nearest::{did_you_mean, nearest};
pub use refined::{RefinedAxis, RefinedBlock, RefinedGrid};
pub use registry::{
    Capabilities, Columns, FieldRequest, FileContent, FormatSpec, Match, WriteOptions, plain_name, read, write,
    write_files, write_part, write_stream,
};
pub use stream::ParticleStream;
pub use units::{Unit, UnitDimension, UnitSystem};

/// Every format of this crate, sorted by name. A format left out of the build is still listed, without its
/// reader and writer.
pub static FORMATS: &[FormatSpec] = &[
    amrex::SPEC,
    arepo::SPEC,
    dualsphysics::SPEC,
    fgong::SPEC,
    gadget::SPEC,
    gadget_binary::SPEC,
    gadget_binary::SPEC_1,
    gizmo::SPEC,
    grid_hdf5::SPEC,
    gyre::SPEC,
    gyre_hdf5::SPEC,
    image::SPEC,
    kepler::SPEC,
    mesa::SPEC,
    netcdf::SPEC,
    numpy::SPEC,
    obj::SPEC,
    phantom::SPEC,
    ply::SPEC,
    ramses::SPEC,
    sph_exa::SPEC,
    stl::SPEC,
    swift::SPEC,
    table::SPEC,
    vtk::SPEC,
    wdec::SPEC,
];
