//! Files that appear whole or not at all.

use crate::error::{FormatError, Result};
use std::path::{Path, PathBuf};

/// Runs `write` on a temporary path beside `path`, syncs it and renames it into place; on any error nothing is
/// left behind and an older file at `path` stays as it was. Where `path` is a link, the file it leads to is replaced.
///
/// # Errors
/// What `write` returns, or [`FormatError::Io`].
pub fn atomically(path: &Path, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let target = replaceable(path)?;
    let folder = folder_of(&target);
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
    temporary.persist(&target).map_err(|e| FormatError::io(path, "write", e.error))
}

/// Whether a file could be put at `path`: its folder exists and takes new files, and nothing but a file is there
/// already. Asked before a long run, so that it does not end in vain.
///
/// # Errors
/// [`FormatError::Io`].
pub fn probe(path: &Path) -> Result<()> {
    let target = replaceable(path)?;
    let folder = folder_of(&target);
    tempfile::tempfile_in(folder).map(drop).map_err(|e| FormatError::io(folder, "create a file in", e))
}

/// Where the output goes, unless something is there that renaming must not replace: a folder, or a device such
/// as `/dev/null`, which an administrator's run would otherwise turn into a plain file for everyone.
fn replaceable(path: &Path) -> Result<PathBuf> {
    let target = link_target(path);
    let refuse = |kind, what| Err(FormatError::io(path, "write", std::io::Error::new(kind, what)));
    match std::fs::metadata(&target) {
        Ok(found) if found.is_dir() => refuse(std::io::ErrorKind::IsADirectory, "it is a directory"),
        Ok(found) if !found.is_file() => {
            refuse(std::io::ErrorKind::InvalidInput, "it is a device, pipe or socket; name a file")
        }
        _ => Ok(target),
    }
}

/// Where a symbolic link leads, or `path` itself; renaming onto a link would replace the link.
fn link_target(path: &Path) -> PathBuf {
    match path.is_symlink() {
        true => std::fs::canonicalize(path).unwrap_or_else(|_| path.into()),
        false => path.into(),
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
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
