//! Errors of everything between the formats and the command line.

use sph::domain::DomainError;
use sph_formats::FormatError;
use std::path::PathBuf;

pub type Result<T> = std::result::Result<T, Error>;

/// Outer variant: whose fault it is.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The scene asks for something impossible or contradictory.
    #[error("scene, {key}: {problem}")]
    Scene { key: String, problem: String },
    /// The field is no density: negative, not finite, zero everywhere, or not defined in the domain.
    #[error("field '{name}': {problem}")]
    Field { name: String, problem: String },
    /// A stage of the placement could not go on.
    #[error("{stage}: {problem}")]
    Numeric { stage: &'static str, problem: String },
    /// Interrupted by the user before anything was written.
    #[error("interrupted; nothing was written")]
    Interrupted,
    /// Interrupted by the user, with a checkpoint to go on from.
    #[error("interrupted; no particles were written; go on with --resume '{}'", .0.display())]
    InterruptedKept(PathBuf),
    /// Interrupted by the user, where the checkpoint of that could not be written.
    #[error("interrupted; no particles were written, and the last checkpoint could not be: {0}")]
    InterruptedUnkept(String),
    /// Interrupted by the user, with blocks of particles in a folder to go on from.
    #[error("interrupted; nothing was written; the same command goes on with the blocks in '{}'", .0.display())]
    InterruptedIn(PathBuf),
    /// Another rank of the run failed, or ended.
    #[error("rank {rank} of {ranks}: {problem}")]
    Rank { rank: usize, ranks: usize, problem: String },
    /// A file that is no checkpoint of this run.
    #[error("checkpoint '{}': {problem}", path.display())]
    Checkpoint { path: PathBuf, problem: String },
}

impl From<DomainError> for Error {
    fn from(error: DomainError) -> Self {
        let key = if matches!(error, DomainError::Cylinder { .. }) { "domain.cylinder" } else { "domain" };
        Self::scene(key, error.to_string())
    }
}

impl Error {
    pub fn scene(key: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Scene { key: key.into(), problem: problem.into() }
    }

    pub fn field(name: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Field { name: name.into(), problem: problem.into() }
    }
}
