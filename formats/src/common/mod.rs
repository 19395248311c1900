//! Pieces that several formats share.

pub mod assemble;
pub mod columns;
#[cfg(any(feature = "gadget", feature = "gadget-binary"))]
pub mod entropy;
pub mod facts;
pub mod flatten;
#[cfg(any(feature = "hdf5-layer", feature = "gadget-binary", feature = "phantom"))]
pub mod flavor;
#[cfg(feature = "hdf5-layer")]
pub mod hdf5;
#[cfg(feature = "hdf5-layer")]
pub mod hdf5_read;
pub mod netcdf_classic;
#[cfg(feature = "hdf5-layer")]
pub mod snapshot;
pub mod text;
#[cfg(feature = "hdf5-layer")]
pub mod wanted;

pub use crate::particle_names;
