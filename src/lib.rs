//! Low-noise initial conditions for smoothed particle hydrodynamics (SPH).
//!
//! A field (density, or density and resolution) becomes particles whose summed density matches it: file ->
//! raw field -> interpolant and domain -> plan -> seed -> relaxation -> carried fields -> measures -> file.
//!
//! Every file format is a feature of its own name; `cli` is the program, `plots` the figures of [`compare`]. All are
//! on by default, and a library user may leave out any of them.

#![forbid(unsafe_code)]

#[cfg(feature = "cli")]
pub mod cli;
pub mod compare;
pub mod error;
pub mod field;
pub mod input;
pub mod metrics;
pub mod output;
mod random;
pub mod relaxation;
pub mod run;
pub mod scene;
pub mod seeding;
pub mod target;

pub use error::{Error, Result};
pub use relaxation::Control;
pub use run::pipeline::{place, run};
pub use run::report::Report;
pub use scene::Scene;
pub use sph;
pub use sph_formats::{FORMATS, ParticleFile, WriteOptions, write};

/// The README's example, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
