//! The same scene through several methods at several numbers of particles: error, noise and time of each.
//!
//! Every iteration gives the epsilon that its stage watches; the states that the seed and each stage leave are
//! measured as a run's result is. Times are those of seeding and relaxing, without the measuring.
//!
//! The page and its figures are drawn with the feature `plots`; without it there are the table and the JSON.

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
