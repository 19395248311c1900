//! From placed particles to the file that holds them: its columns, and the frame (box, origin, units) that they are in.

pub mod columns;
pub mod conservation;
pub mod frame;
pub(crate) mod kept;
pub mod origin;
pub(crate) mod others;
pub(crate) mod parameters;
pub mod particle_file;
pub(crate) mod walls;
