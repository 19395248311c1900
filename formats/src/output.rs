//! Files that appear whole or not at all.

use crate::error::{FormatError, Result};
use std::path::Path;

/// Runs `write` on a temporary path beside `path`, syncs it and renames it into place; on any error nothing is
/// left behind and an older file at `path` stays as it was.
///
/// # Errors
/// What `write` returns, or [`FormatError::Io`].
pub fn atomically(path: &Path, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let suffix = path.extension().map(|e| format!(".{}", e.to_string_lossy())).unwrap_or_default();
    let temporary = tempfile::Builder::new()
        .prefix(".sph-prep-")
        .suffix(&suffix)
        .permissions_for_new_files()
        .tempfile_in(folder)
        .map_err(|e| FormatError::io(path, "create a file beside", e))?
        .into_temp_path();
    write(&temporary)?;
    let sync = std::fs::File::open(&temporary).and_then(|f| f.sync_all());
    sync.map_err(|e| FormatError::io(path, "write", e))?;
    temporary.persist(path).map_err(|e| FormatError::io(path, "write", e.error))
}

trait PermissionsForNewFiles {
    fn permissions_for_new_files(&mut self) -> &mut Self;
}

impl PermissionsForNewFiles for tempfile::Builder<'_, '_> {
    /// The temporary becomes the output: it gets the permissions of any new file (0666 less the umask), not
    /// those of a private temporary.
    fn permissions_for_new_files(&mut self) -> &mut Self {
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            self.permissions(std::fs::Permissions::from_mode(0o666));
        }
        self
    }
}
