//! Pieces that several formats share.

pub mod netcdf_classic;
pub mod particle_names;
