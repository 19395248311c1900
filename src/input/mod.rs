//! From a scene's input to the source that relaxation aims at: files and expressions, particles of another run, units, the
//! atmosphere that is cut, and the hydrostatics of the body.

pub mod atmosphere;
mod attractors;
mod beside;
pub(crate) mod body_materials;
pub(crate) mod collisionless;
pub(crate) mod constants;
pub(crate) mod core;
mod differences;
mod disc;
pub(crate) mod displacement;
mod factor;
pub(crate) mod fields;
mod from_spacing;
mod halo;
pub mod hydrostatics;
pub mod ingest;
pub(crate) mod internal_units;
pub mod particles;
pub(crate) mod profile;
pub(crate) mod refinement;
pub(crate) mod roles;
pub(crate) mod shapes;
pub(crate) mod slips;
pub(crate) mod solenoidal;
mod spherical;
pub mod stated_units;
pub(crate) mod support;
mod surfaces;
pub(crate) mod surroundings;
pub(crate) mod thermal;
pub(crate) mod totals;
pub(crate) mod turbulence;
pub mod units;
mod waves;
mod way;
mod weight;
