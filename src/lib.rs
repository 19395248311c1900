//! Low-noise initial conditions for smoothed particle hydrodynamics (SPH).
//!
//! A field (density, or density and resolution) becomes particles whose summed density matches it: file ->
//! raw field -> interpolant and domain -> plan -> seeding -> relaxation -> carried fields -> measures -> file.
//!
//! Every file format is a feature of its own name; `cli` is the program, `plots` the figures of [`compare`]. All are
//! on by default, and a library user may leave out any of them.
//!
//! [`place`] does all of it for a [`Scene`] and returns the particles with a [`Report`]; [`write()`] puts them into a file.
//!
//! ```
//! use sph_prep::{Control, FORMATS, Scene, place};
//!
//! let scene = Scene::parse(
//!     "input: {expression: '1 + 0.5*sin(2*pi*x)'}
//! domain: {box: [[0, 0], [1, 1]], boundary: [periodic]}
//! particles: 400",
//! )?;
//! let (file, report) = place(&scene, FORMATS, &Control::default())?;
//! assert_eq!(file.species[0].table.count, 400);
//! assert!(report.density_error.stated().mean < 0.01);
//! # Ok::<(), sph_prep::Error>(())
//! ```
//!
//! The modules are in the order of the data: [`scene`] and [`input`] come to a [`field`] and a [`target`]; [`seeding`] and
//! [`relaxation`] place particles, [`metrics`] measures them, [`output`] makes the file, and [`mod@run`] keeps the order. What
//! knows nothing of fields and files is in [`sph`], what knows files alone in `sph_formats`.

#![forbid(unsafe_code)]

pub mod check;
#[cfg(feature = "cli")]
pub mod cli;
pub mod codes;
pub mod compare;
pub mod eos;
pub mod error;
pub mod field;
pub mod follow;
pub mod input;
pub mod metrics;
mod ode;
pub mod output;
#[cfg(feature = "plots")]
pub mod page;
#[cfg(feature = "mpi")]
pub mod processes;
mod random;
pub mod relaxation;
mod roots;
pub mod run;
pub mod scene;
pub mod seeding;
pub mod target;

pub use error::{Error, Result};
pub use relaxation::Control;
pub use run::bodies::{place_bodies, run_bodies};
pub use run::bodies_report::BodiesReport;
pub use run::destination::write_placed;
pub use run::pipeline::{place, run};
pub use run::report::Report;
pub use scene::Scene;
pub use sph;
pub use sph_formats::{FORMATS, ParticleFile, WriteOptions, write};

/// Examples of the README and of the manual, run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

#[cfg(doctest)]
#[doc = include_str!("../docs/src/library.md")]
pub struct Manual;
