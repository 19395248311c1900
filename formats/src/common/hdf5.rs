//! The boundary to the HDF5 library: what snapshots need, and no more.
//!
//! Files are written for HDF5 1.8 and later, without object times, so that equal content gives equal bytes.

use crate::error::{FormatError, Result};
use rust_hdf5::{H5Dataset, H5File, H5Group, LibverBound};
use std::path::Path;

/// First bytes of every HDF5 file without a user block.
pub const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Rows of a chunk where a dataset is compressed.
const CHUNK_ROWS: usize = 65_536;
/// Chunks handed over at once: enough for the library to compress them in parallel.
const CHUNKS_AT_ONCE: usize = 8;

pub use rust_hdf5::types::H5Type;

/// Creates a file.
///
/// # Errors
/// [`FormatError::Io`].
pub fn create(path: &Path) -> Result<H5File> {
    let file = H5File::create(path).map_err(|e| io(path, "create", e))?;
    file.set_libver_bound(LibverBound::V18).map_err(|e| io(path, "create", e))?;
    file.set_track_times(false).map_err(|e| io(path, "create", e))?;
    Ok(file)
}

/// An attribute of shape (1,), which every reader takes where some refuse scalars.
///
/// # Errors
/// [`FormatError::Io`].
pub fn attribute<T: H5Type>(path: &Path, group: &H5Group, name: &str, values: &[T]) -> Result<()> {
    group.set_attr_array_numeric(name, values).map_err(|e| io(path, "write", e))
}

/// A numeric attribute of a dataset, of shape (1,).
///
/// # Errors
/// [`FormatError::Io`].
pub fn dataset_attribute(path: &Path, dataset: &H5Dataset, name: &str, value: f32) -> Result<()> {
    dataset
        .new_attr::<f32>()
        .shape([1_usize])
        .create(name)
        .and_then(|a| a.write_array(&[value]))
        .map_err(|e| io(path, "write", e))
}

/// Writes `rows` of `columns` values, `value(row, column)`, slab by slab, so that no second copy of the data
/// exists. `compression` 0 stores contiguously, else chunks are shuffled and deflated.
///
/// # Errors
/// [`FormatError::Io`].
pub fn dataset<T: H5Type>(
    path: &Path,
    group: &H5Group,
    name: &str,
    (rows, columns): (usize, usize),
    compression: u8,
    value: impl Fn(usize, usize) -> T,
) -> Result<H5Dataset> {
    let shape = if columns == 1 { vec![rows] } else { vec![rows, columns] };
    let mut builder = group.new_dataset::<T>().shape(&shape);
    if compression > 0 && rows > 0 {
        let mut chunk = shape.clone();
        chunk[0] = CHUNK_ROWS.min(rows);
        builder = builder.chunk(&chunk).shuffle_deflate(compression.into());
    }
    let dataset = builder.create(name).map_err(|e| io(path, "write", e))?;
    let slab_rows = CHUNK_ROWS * CHUNKS_AT_ONCE;
    let mut slab = Vec::with_capacity(slab_rows.min(rows) * columns);
    for start in (0..rows).step_by(slab_rows) {
        let count = slab_rows.min(rows - start);
        slab.clear();
        slab.extend((start..start + count).flat_map(|i| (0..columns).map(move |k| (i, k))).map(|(i, k)| value(i, k)));
        let (from, counts) =
            if columns == 1 { (vec![start], vec![count]) } else { (vec![start, 0], vec![count, columns]) };
        dataset.write_slice(&from, &counts, &slab).map_err(|e| io(path, "write", e))?;
    }
    Ok(dataset)
}

/// An error of the library as ours.
pub fn io(path: &Path, action: &'static str, error: impl std::fmt::Display) -> FormatError {
    FormatError::io(path, action, std::io::Error::other(error.to_string()))
}
