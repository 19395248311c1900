//! Pieces that several formats share.

pub mod columns;
pub mod particle_names;
pub mod text;
