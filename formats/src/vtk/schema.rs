//! The name of the format.

pub const NAME: &str = "vtk";
