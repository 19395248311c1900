//! Files that appear whole or not at all.

use crate::error::{FormatError, Result};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::TempPath;

/// Those of the whole process.
static TEMPORARIES: Temporaries = Temporaries(Mutex::new(Vec::new()));

/// Runs `write` on a temporary path beside `path`, syncs it and renames it into place; on any error nothing is
/// left behind and an older file at `path` stays as it was. Where `path` is a link, the file it leads to is replaced.
///
/// # Errors
/// What `write` returns, or [`FormatError::Io`].
pub fn atomically(path: &Path, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    atomically_among(&TEMPORARIES, path, write)
}

/// Removes the temporary files of all writes that have not ended, for a program that ends in the middle of them. If such a
/// write still comes to its end, it fails; later ones are not affected.
///
/// This takes a lock and must not be called from a signal handler itself, but from a thread that waits for signals.
pub fn remove_temporaries() {
    TEMPORARIES.remove_all();
}

fn atomically_among(temporaries: &Temporaries, path: &Path, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let target = replaceable(path)?;
    let suffix = path.extension().map(|e| format!(".{}", e.to_string_lossy())).unwrap_or_default();
    let temporary = temporaries
        .create(folder_of(&target), &suffix)
        .map_err(|e| FormatError::io(path, "create a file beside", e))?;
    write(&temporary.path)?;
    let sync = std::fs::File::open(&temporary.path).and_then(|f| f.sync_all());
    sync.and_then(|()| temporary.persist(&target)).map_err(|e| FormatError::io(path, "write", e))
}

/// The temporary files in use.
struct Temporaries(Mutex<Vec<PathBuf>>);

impl Temporaries {
    /// A panic while it is locked leaves the list as it should be.
    fn lock(&self) -> MutexGuard<'_, Vec<PathBuf>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn create(&self, folder: &Path, suffix: &str) -> std::io::Result<Temporary<'_>> {
        let mut list = self.lock();
        let file = tempfile::Builder::new()
            .prefix(".sph-prep-")
            .suffix(suffix)
            .permissions_for_new_files()
            .tempfile_in(folder)?
            .into_temp_path();
        let path = file.to_path_buf();
        list.push(path.clone());
        Ok(Temporary { file: Some(file), path, among: self })
    }

    fn remove_all(&self) {
        for path in self.lock().drain(..) {
            // The program is about to end: nobody is left to hear of a file that cannot be removed.
            let _ = std::fs::remove_file(path);
        }
    }
}

/// A temporary file, which is listed as long as it is there.
struct Temporary<'t> {
    file: Option<TempPath>,
    path: PathBuf,
    among: &'t Temporaries,
}

impl Temporary<'_> {
    /// Renames it, unless it was removed in the meantime. The list stays locked, so that it cannot be removed now.
    fn persist(mut self, target: &Path) -> std::io::Result<()> {
        let among = self.among;
        let list = among.lock();
        match self.file.take() {
            Some(file) if list.contains(&self.path) => file.persist(target).map_err(|e| e.error),
            _ => Err(std::io::Error::new(std::io::ErrorKind::Interrupted, "the program is ending")),
        }
    }
}

impl Drop for Temporary<'_> {
    fn drop(&mut self) {
        let mut list = self.among.lock();
        drop(self.file.take());
        list.retain(|path| *path != self.path);
    }
}

/// Whether a file could be put at `path`: its folder exists and takes new files, and nothing but a file is there
/// already. To be asked before a long run, whose result would be lost otherwise.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn write(path: &Path) -> Result<()> {
        std::fs::write(path, "whole").map_err(|e| FormatError::io(path, "write", e))
    }

    fn names_in(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    // A list of its own, since other tests may be writing.
    #[test]
    fn what_is_being_written_when_the_program_ends_is_removed_and_does_not_appear() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ic.a");
        let temporaries = Temporaries(Mutex::new(Vec::new()));
        let interrupted = atomically_among(&temporaries, &path, |temporary| {
            write(temporary)?;
            assert_eq!(*temporaries.lock(), [temporary]);
            temporaries.remove_all();
            assert!(!temporary.exists() && names_in(folder.path()).is_empty());
            // A writer that has not noticed.
            write(temporary)
        });
        assert!(interrupted.unwrap_err().to_string().ends_with("the program is ending"));
        assert!(names_in(folder.path()).is_empty());

        atomically_among(&temporaries, &path, write).unwrap();
        assert!(temporaries.lock().is_empty());
        temporaries.remove_all();
        assert_eq!(names_in(folder.path()), ["ic.a"]);
    }

    #[test]
    fn failed_writes_are_not_listed_any_more() {
        let folder = tempfile::tempdir().unwrap();
        let temporaries = Temporaries(Mutex::new(Vec::new()));
        let fails = |path: &Path| Err(FormatError::io(path, "write", std::io::Error::other("no")));
        assert!(atomically_among(&temporaries, &folder.path().join("ic.a"), fails).is_err());
        assert!(temporaries.lock().is_empty() && names_in(folder.path()).is_empty());
    }
}
