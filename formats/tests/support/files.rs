//! Files of tests that try many damages.

use std::path::Path;

/// Puts `bytes` where another file may be. That one is removed first: file systems such as ext4 wait for the disk where a
/// file is emptied and written again.
pub fn replace(path: &Path, bytes: &[u8]) {
    let _ = std::fs::remove_file(path);
    std::fs::write(path, bytes).unwrap();
}
