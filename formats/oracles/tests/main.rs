//! The C libraries of HDF5 and NetCDF read what `sph-formats` writes, and it reads what they write.
//!
//! Takes libhdf5-dev and libnetcdf-dev. `cargo test --release -p sph-prep -p sph-formats-oracles --test oracles` shares the
//! libraries of the program's build, which `-p sph-formats-oracles` alone would compile anew with fewer features.

mod hdf5;
mod netcdf;
