//! From a scene's input to the source that relaxation aims at: files and expressions, particles of another run, units, the
//! atmosphere that is cut, and the hydrostatics of the body.

pub mod atmosphere;
pub mod hydrostatics;
pub mod ingest;
pub(crate) mod internal_units;
pub mod particles;
pub(crate) mod roles;
pub mod units;
