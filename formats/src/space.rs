//! Checks whether a disk has enough space for the file that is about to be written.

use crate::error::{FormatError, Result};
use crate::model::{Values, WriteOptions};
use crate::stream::ParticleStream;
use std::path::Path;

/// What compression leaves of numbers, at least.
const COMPRESSED: f64 = 0.25;
const GIGABYTE: f64 = 1e9;

/// Refuses to begin with particles for which there is no room, of which `share` go to the folder of `path`.
///
/// # Errors
/// [`FormatError::Output`] with what they take and what is free; those of the stream.
pub(crate) fn refuse_without_room(
    (path, format): (&Path, &'static str),
    particles: &dyn ParticleStream,
    share: f64,
    options: WriteOptions,
) -> Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let Some(free) = free(folder) else { return Ok(()) };
    let part = if options.compression > 0 { COMPRESSED } else { 1.0 };
    let needed = share * part * bytes(particles, options)?;
    if needed <= free {
        return Ok(());
    }
    let [needed, free] = [needed, free].map(|bytes| bytes / GIGABYTE);
    let problem = format!(
        "the particles take {needed:.3e} GB at least, and {free:.3e} GB are free there; write to another disk, or fewer of them"
    );
    Err(FormatError::Output { path: path.into(), format, problem })
}

/// The numbers of all particles, before compression.
fn bytes(particles: &dyn ParticleStream, options: WriteOptions) -> Result<f64> {
    let float = if options.double_precision { 8 } else { 4 };
    let mut sum = 0.0;
    for (t, count) in particles.counts().into_iter().enumerate().filter(|(_, count)| *count > 0) {
        let first = particles.rows(t as u8, 0..1, &|_| true)?;
        let width = |values: &Values| if matches!(values, Values::I64(_)) { 8 } else { float };
        let row: usize = first.columns.iter().map(|c| c.components * width(&c.values)).sum();
        sum += count as f64 * row as f64;
    }
    Ok(sum)
}

/// Bytes that are free on the disk of a folder, where the system says so.
#[cfg(unix)]
fn free(folder: &Path) -> Option<f64> {
    let disk = rustix::fs::statvfs(folder).ok()?;
    Some(disk.f_bavail as f64 * disk.f_frsize as f64)
}

#[cfg(not(unix))]
fn free(_: &Path) -> Option<f64> {
    None
}
