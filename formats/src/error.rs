//! Errors of readers and writers. Each states whose fault it is, where it is, what was found and what was expected.

use std::path::{Path, PathBuf};

/// Result of every reader and writer.
pub type Result<T> = std::result::Result<T, FormatError>;

/// What went wrong with a file. Texts are lowercase, carry the path, what was found, what was expected and,
/// where there is one, the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FormatError {
    /// The file's content is wrong: damaged, incomplete or meaningless as a field.
    #[error("{format} file '{path}', {location}: {problem}")]
    Input {
        path: PathBuf,
        format: &'static str,
        /// Variable, dataset, line or byte offset, e.g. `variable 'rho'`, `line 12`.
        location: String,
        /// What was found, what was expected, and the remedy.
        problem: String,
    },
    /// The file's content is right but this program has no use for it or does not implement it.
    #[error("{format} file '{path}' uses something that is not supported: {what}")]
    Unsupported { path: PathBuf, format: &'static str, what: String },
    /// A size declared in the file exceeds what the file can hold or what the limits allow.
    #[error(
        "{format} file '{path}', {location}: declares {declared}, more than {allowed}; the file is damaged or not of this format"
    )]
    Limit { path: PathBuf, format: &'static str, location: String, declared: String, allowed: String },
    /// The format could not be found out, or is not in this build.
    #[error("cannot tell the format of '{path}': {problem}")]
    Detection { path: PathBuf, problem: String },
    /// The particles cannot be written in this format.
    #[error("cannot write '{path}' as {format}: {problem}")]
    Output { path: PathBuf, format: &'static str, problem: String },
    /// The operating system refused.
    #[error("cannot {action} '{path}': {source}")]
    Io {
        path: PathBuf,
        action: &'static str,
        #[source]
        source: std::io::Error,
    },
}

impl FormatError {
    /// Shorthand for [`FormatError::Input`].
    pub fn input(path: &Path, format: &'static str, location: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Input { path: path.into(), format, location: location.into(), problem: problem.into() }
    }

    /// Shorthand for [`FormatError::Io`]; `action` is a verb such as `read`.
    pub fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        Self::Io { path: path.into(), action, source }
    }

    /// The same error about `path` instead of the temporary file that stood in for it.
    #[must_use]
    pub(crate) fn renamed(mut self, to: &Path) -> Self {
        match &mut self {
            Self::Input { path, .. }
            | Self::Unsupported { path, .. }
            | Self::Limit { path, .. }
            | Self::Detection { path, .. }
            | Self::Output { path, .. }
            | Self::Io { path, .. } => *path = to.into(),
        }
        self
    }
}
