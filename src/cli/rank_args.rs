//! Arguments of parallel runs.

use crate::scene::parse_count;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct PlanArgs {
    /// Scene file (YAML).
    #[arg(long, value_name = "FILE")]
    pub scene: PathBuf,
    /// Number of particles, overrides the scene's; it may be more than one process can hold.
    #[arg(short = 'n', long, value_name = "N", value_parser = parse_count)]
    pub particles: Option<usize>,
    /// Number of ranks.
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..))]
    pub ranks: u32,
    /// Number of threads of each rank [default: all cores].
    #[arg(long, value_parser = threads)]
    pub threads: Option<usize>,
    /// Print the plan as JSON.
    #[arg(long)]
    pub json: bool,
}

/// More threads than this are no use in one process.
const MOST_RANKS: usize = 1024;

/// A number of threads.
///
/// # Errors
/// What is expected.
pub fn threads(text: &str) -> std::result::Result<usize, String> {
    at_most(text, 0, ", for as many as there are cores,")
}

/// A number of ranks within a process.
///
/// # Errors
/// What is expected.
pub fn ranks(text: &str) -> std::result::Result<usize, String> {
    at_most(text, 1, "")
}

fn at_most(text: &str, least: usize, meaning: &str) -> std::result::Result<usize, String> {
    let expected = || format!("expected a whole number from {least}{meaning} to {MOST_RANKS}");
    text.parse().ok().filter(|n| (least..=MOST_RANKS).contains(n)).ok_or_else(expected)
}
