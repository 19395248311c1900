//! Runs the same scene with several methods at several numbers of particles, and compares error, noise and time.
//!
//! Every iteration gives the epsilon that its stage monitors; the states after the seeding and after each stage are
//! measured in the same way as the result of a run. Times are those of seeding and relaxation, without the measurements.
//!
//! The page and its figures are drawn with the feature `plots`; without it only the table and the JSON are written.

mod advice;
mod comparison;
#[cfg(feature = "plots")]
mod figures;
mod files;
mod methods;
#[cfg(feature = "plots")]
mod page;
#[cfg(feature = "plots")]
mod picture;
mod run;
mod table;

pub use advice::advice;
pub use comparison::{Comparison, MethodRun, MethodSheet, Omitted, State, Step};
pub use files::{FILES, json, probe, write};
pub use methods::{Compared, DEFAULT, VARIATIONS, Variation};
pub use run::{Request, check, compare, numbers};
pub use table::{CSV_COLUMNS, csv};
