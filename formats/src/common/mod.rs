//! Code shared by several formats. Public are the writer of classic NetCDF files, with which programs and their tests make inputs, and the names
//! of particle columns.

// A build of few formats has no use for some of them.
#![cfg_attr(not(feature = "default"), allow(dead_code))]

pub(crate) mod assemble;
pub(crate) mod columns;
#[cfg(any(feature = "gadget", feature = "gadget-binary"))]
pub(crate) mod cosmology;
#[cfg(any(feature = "netcdf", feature = "numpy"))]
pub(crate) mod curvilinear;
#[cfg(any(feature = "gadget", feature = "gadget-binary"))]
pub(crate) mod entropy;
pub(crate) mod facts;
pub(crate) mod fixed_width;
pub(crate) mod flatten;
#[cfg(any(feature = "hdf5-layer", feature = "gadget-binary", feature = "phantom"))]
pub(crate) mod flavor;
// Hidden, not private: the tests look into files with them.
#[cfg(any(feature = "phantom", feature = "ramses"))]
pub(crate) mod fortran;
#[cfg(feature = "hdf5-layer")]
#[doc(hidden)]
pub mod hdf5;
#[cfg(feature = "hdf5-layer")]
#[doc(hidden)]
pub mod hdf5_read;
pub mod netcdf_classic;
#[cfg(any(feature = "hdf5-layer", feature = "gadget-binary", feature = "phantom"))]
pub(crate) mod number;
#[cfg(any(feature = "gadget", feature = "gadget-binary", feature = "vtk"))]
pub(crate) mod parts;
#[cfg(any(feature = "fgong", feature = "wdec", feature = "kepler"))]
pub(crate) mod points;
#[cfg(any(feature = "obj", feature = "ply"))]
mod polygon;
#[cfg(any(feature = "hdf5-layer", feature = "gadget-binary", feature = "phantom"))]
pub(crate) mod quantity;
#[cfg(any(feature = "hdf5-layer", feature = "gadget-binary", feature = "phantom"))]
pub(crate) mod rule;
#[cfg(feature = "hdf5-layer")]
pub mod snapshot;
#[cfg(any(feature = "stl", feature = "obj", feature = "ply"))]
pub(crate) mod surface;
pub(crate) mod text;
#[cfg(any(feature = "hdf5-layer", feature = "amrex", feature = "ramses"))]
pub(crate) mod wanted;

pub use crate::particle_names;
