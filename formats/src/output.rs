//! Output files that appear complete or not at all.

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

/// The same for several files, of which all appear or none: `write` is called with each one's place in `paths`. Older files
/// there go before the first new one comes, so that what a kill leaves in between is never a mixture of both.
///
/// # Errors
/// What `write` returns, or [`FormatError::Io`]; then the older files are what they were.
pub fn atomically_all(paths: &[PathBuf], write: impl FnMut(usize, &Path) -> Result<()>) -> Result<()> {
    atomically_all_among(&TEMPORARIES, paths, write)
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
    sync(&temporary.path).and_then(|()| temporary.persist(&target)).map_err(|e| FormatError::io(path, "write", e))
}

/// Sends a file to the disk. It is opened for writing, which Windows asks for.
fn sync(path: &Path) -> std::io::Result<()> {
    std::fs::OpenOptions::new().write(true).open(path)?.sync_all()
}

fn atomically_all_among(
    temporaries: &Temporaries,
    paths: &[PathBuf],
    mut write: impl FnMut(usize, &Path) -> Result<()>,
) -> Result<()> {
    let targets = paths.iter().map(|p| replaceable(p)).collect::<Result<Vec<_>>>()?;
    let create = |k: usize| {
        let (path, target) = (&paths[k], &targets[k]);
        let suffix = path.extension().map(|e| format!(".{}", e.to_string_lossy())).unwrap_or_default();
        let made = temporaries.create(folder_of(target), &suffix);
        made.map_err(|e| FormatError::io(path, "create a file beside", e))
    };
    let mut written = Vec::new();
    for (k, path) in paths.iter().enumerate() {
        let temporary = create(k)?;
        write(k, &temporary.path)?;
        sync(&temporary.path).map_err(|e| FormatError::io(path, "write", e))?;
        written.push(temporary);
    }
    let older: Vec<usize> = (0..paths.len()).filter(|&k| targets[k].exists()).collect();
    let kept = older.iter().map(|&k| create(k)).collect::<Result<Vec<_>>>()?;
    let out = older.iter().zip(&kept).map(|(&k, kept)| (targets[k].as_path(), kept.path.as_path(), k));
    // The last comes first into its place: a family without its first file is not taken for a whole one.
    let into = (0..paths.len()).rev().map(|k| (written[k].path.as_path(), targets[k].as_path(), k));
    let moves: Vec<_> = out.chain(into).collect();
    temporaries.rename_all(&moves).map_err(|(k, e)| FormatError::io(&paths[k], "write", e))
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

    /// Renames files from the first to the second path of each, or none: what was done is undone after an error, which comes
    /// with the third. The list stays locked, so that none of them can be removed meanwhile.
    fn rename_all(&self, moves: &[(&Path, &Path, usize)]) -> std::result::Result<(), (usize, std::io::Error)> {
        let list = self.lock();
        let gone = |path: &Path| list.iter().all(|p| p != path);
        if let Some((.., k)) = moves.iter().find(|(from, to, _)| gone(from) && gone(to)) {
            return Err((*k, std::io::Error::new(std::io::ErrorKind::Interrupted, "the program is ending")));
        }
        for (done, (from, to, k)) in moves.iter().enumerate() {
            if let Err(error) = std::fs::rename(from, to) {
                for (from, to, _) in moves.iter().take(done).rev() {
                    // Nothing better is left to do where this fails, too.
                    let _ = std::fs::rename(to, from);
                }
                return Err((*k, error));
            }
        }
        Ok(())
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
        _ if target.is_symlink() => refuse(std::io::ErrorKind::InvalidInput, "it is a symbolic link to itself"),
        _ => Ok(target),
    }
}

/// Where a symbolic link leads, be it to what is not there yet, or `path` itself; renaming onto a link would replace the link.
fn link_target(path: &Path) -> PathBuf {
    let mut target = path.to_owned();
    for _ in 0..MOST_LINKS {
        let Ok(to) = std::fs::read_link(&target) else { break };
        target = folder_of(&target).join(to);
    }
    target
}

/// Links from one to the next that are followed, as systems do.
const MOST_LINKS: usize = 40;

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
    fn several_files_appear_together_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let temporaries = Temporaries(Mutex::new(Vec::new()));
        let paths: Vec<PathBuf> = (0..3).map(|k| folder.path().join(format!("ic.{k}.a"))).collect();
        let contents = |names: &[PathBuf]| names.iter().map(|p| std::fs::read_to_string(p).ok()).collect::<Vec<_>>();
        let put = |k: usize, path: &Path, text: &str| {
            std::fs::write(path, format!("{text}{k}")).map_err(|e| FormatError::io(path, "write", e))
        };
        // The second is there from before, and the third fails.
        std::fs::write(&paths[1], "older").unwrap();
        let fails = |k: usize, path: &Path| match k {
            2 => Err(FormatError::io(path, "write", std::io::Error::other("full"))),
            _ => put(k, path, "new"),
        };
        assert!(atomically_all_among(&temporaries, &paths, fails).is_err());
        assert_eq!(contents(&paths), [None, Some("older".into()), None]);
        assert_eq!(names_in(folder.path()), ["ic.1.a"]);

        // Renaming fails when others are done: a folder has taken the place of the last.
        let result = atomically_all_among(&temporaries, &paths, |k, path| {
            if k == 2 {
                std::fs::write(&paths[0], "older").unwrap();
                std::fs::create_dir(&paths[2]).unwrap();
            }
            put(k, path, "new")
        });
        assert!(result.is_err() && temporaries.lock().is_empty());
        assert_eq!(contents(&paths), [Some("older".into()), Some("older".into()), None]);
        assert_eq!(names_in(folder.path()).len(), 3);

        std::fs::remove_dir(&paths[2]).unwrap();
        atomically_all_among(&temporaries, &paths, |k, path| put(k, path, "whole")).unwrap();
        assert_eq!(contents(&paths), (0..3).map(|k| Some(format!("whole{k}"))).collect::<Vec<_>>());
        assert_eq!(names_in(folder.path()).len(), 3);

        let interrupted = atomically_all_among(&temporaries, &paths, |k, path| {
            put(k, path, "late")?;
            temporaries.remove_all();
            Ok(())
        });
        assert!(interrupted.is_err());
        assert_eq!(contents(&paths), (0..3).map(|k| Some(format!("whole{k}"))).collect::<Vec<_>>());
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
