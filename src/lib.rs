//! Low-noise initial conditions for smoothed particle hydrodynamics (SPH).
//!
//! A field (density, or density and resolution) becomes particles whose summed density matches it: file ->
//! raw field -> interpolant and domain -> plan -> seed -> relaxation -> carried fields -> measures -> file.

pub mod atmosphere;
pub mod carry;
pub mod checkpoint;
pub mod cli;
pub mod compare;
pub mod domain;
pub mod error;
pub mod field;
pub mod hydrostatics;
pub mod ingest;
pub mod kernel;
pub mod metrics;
pub mod neighbors;
pub mod pipeline;
pub mod placement;
pub mod plan;
mod prepared;
pub mod reduce;
pub mod relaxation;
pub mod report;
pub mod rng;
pub mod scene;
pub mod seeding;
pub mod smoothing;
pub mod snapshot;
pub mod target;

pub use error::{Error, Result};

/// The README's example, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
