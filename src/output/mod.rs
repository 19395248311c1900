//! Converts placed particles to the file that contains them: its columns, and their frame (box, origin, units).

pub mod columns;
pub mod conservation;
pub mod frame;
pub(crate) mod kept;
pub mod origin;
pub(crate) mod others;
pub(crate) mod parameters;
pub mod particle_file;
pub(crate) mod walls;
