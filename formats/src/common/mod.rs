//! Pieces that several formats share.

pub mod particle_names;
pub mod text;
