//! The tests of the formats: one program, which links in a fraction of the time that one per file takes. The fuzzer is
//! another, since it counts the memory of its whole process.

mod support;

mod adding_a_format;
#[cfg(feature = "amrex")]
mod amrex;
mod conformance;
#[cfg(all(feature = "gadget", feature = "sph-exa", feature = "netcdf", feature = "grid-hdf5", feature = "gyre-hdf5"))]
mod datasets;
#[cfg(feature = "dualsphysics")]
mod dualsphysics;
#[cfg(all(
    feature = "arepo",
    feature = "gadget",
    feature = "gadget-binary",
    feature = "gizmo",
    feature = "numpy",
    feature = "swift",
    feature = "vtk"
))]
mod families;
mod foreign;
#[cfg(feature = "gadget-binary")]
mod gadget_binary;
#[cfg(feature = "grid-hdf5")]
mod grid_hdf5;
#[cfg(feature = "gyre-hdf5")]
mod gyre_hdf5;
#[cfg(feature = "image")]
mod image;
#[cfg(feature = "gadget")]
mod layouts;
#[cfg(feature = "netcdf")]
mod netcdf;
#[cfg(feature = "numpy")]
mod numpy;
#[cfg(all(
    feature = "arepo",
    feature = "dualsphysics",
    feature = "gadget",
    feature = "gadget-binary",
    feature = "gizmo",
    feature = "netcdf",
    feature = "numpy",
    feature = "phantom",
    feature = "sph-exa",
    feature = "swift",
    feature = "table",
    feature = "vtk"
))]
mod parity;
mod particles;
#[cfg(feature = "phantom")]
mod phantom;
#[cfg(feature = "ramses")]
mod ramses;
#[cfg(feature = "grid-hdf5")]
mod refined_hdf5;
mod registry;
#[cfg(all(feature = "swift", feature = "gadget", feature = "gizmo", feature = "arepo"))]
mod snapshots;
#[cfg(feature = "sph-exa")]
mod sph_exa;
#[cfg(all(feature = "stl", feature = "obj", feature = "ply"))]
mod surfaces;
mod tables;
#[cfg(feature = "vtk")]
mod vtk;
