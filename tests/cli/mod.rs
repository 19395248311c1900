//! The built binary, as people and scripts meet it: exit codes, texts, files left behind, bytes written.

mod bad_grids;
mod bad_output;
mod bad_tables;
mod check;
mod codes;
mod dry_run;
mod follow;
mod layouts;
mod pages;
mod parameters;
mod parameters_of_files;
mod phantom;
mod reference;
mod runs;
mod streams;
pub(crate) mod support;
mod wrong;
