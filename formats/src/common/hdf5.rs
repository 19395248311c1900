//! The boundary to the HDF5 crates: `rust-hdf5` writes; `hdf5-reader` reads, in
//! [`super::hdf5_read`].
//!
//! Files are written at the 1.8 library bound (version 2 superblock, version 1 B-trees), which HDF5 1.8 to 2.x
//! open; object times are off, so that equal input gives equal bytes. Two crates, because the writer's own
//! reader cannot decode numeric group attributes, and the reader is in the build for NetCDF-4 anyway.
//!
//! Reference: <https://support.hdfgroup.org/documentation/hdf5/latest/_f_m_t3.html>

use crate::error::{FormatError, Result};
use rust_hdf5::{DatatypeMessage, H5Dataset, H5File, H5Group, Hdf5Error, LibverBound};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Rows of one chunk of a compressed dataset, and rows that are converted and written at once.
const CHUNK_ROWS: usize = 1 << 16;

/// A number that can be stored.
pub use rust_hdf5::H5Type as Scalar;

/// A file being written.
pub struct Writer {
    file: H5File,
    path: PathBuf,
}

impl Writer {
    /// Creates `path`, replacing an older file.
    ///
    /// # Errors
    /// [`FormatError::Io`].
    pub fn create(path: &Path) -> Result<Self> {
        let file =
            H5File::options().libver(LibverBound::V18).no_locking().create(path).map_err(|e| write_error(path, e))?;
        Ok(Self { file, path: path.into() })
    }

    /// Adds a group below the root.
    ///
    /// # Errors
    /// [`FormatError::Io`].
    pub fn group(&self, name: &str) -> Result<Group<'_>> {
        let group = self.file.create_group(name).map_err(|e| self.error(e))?;
        Ok(Group { writer: self, group })
    }

    /// Completes the file.
    ///
    /// # Errors
    /// [`FormatError::Io`].
    pub fn close(self) -> Result<()> {
        self.file.close_no_sync().map_err(|e| write_error(&self.path, e))
    }

    fn error(&self, e: Hdf5Error) -> FormatError {
        write_error(&self.path, e)
    }
}

fn write_error(path: &Path, e: Hdf5Error) -> FormatError {
    let source = match e {
        Hdf5Error::Io(e) => e,
        other => std::io::Error::other(other.to_string()),
    };
    FormatError::io(path, "write", source)
}

/// A group of a [`Writer`].
pub struct Group<'w> {
    writer: &'w Writer,
    group: H5Group,
}

impl Group<'_> {
    /// Sets a one-dimensional attribute. Scalars are written as one element: some readers take nothing else.
    ///
    /// # Errors
    /// [`FormatError::Io`].
    pub fn numbers<T: Scalar>(&self, name: &str, values: &[T]) -> Result<()> {
        self.group.set_attr_array_numeric(name, values).map_err(|e| self.writer.error(e))
    }

    /// Sets an attribute that is a scalar to HDF5, too.
    ///
    /// # Errors
    /// [`FormatError::Io`].
    pub fn scalar<T: Scalar>(&self, name: &str, value: T) -> Result<()> {
        self.group.set_attr_numeric(name, &value).map_err(|e| self.writer.error(e))
    }

    /// Sets a text attribute, of fixed length: the crate's own texts of variable length have a base type from
    /// which HDF5 1.10 knows no conversion, so that programs in C cannot read them.
    ///
    /// # Errors
    /// [`FormatError::Io`].
    pub fn text(&self, name: &str, value: &str) -> Result<()> {
        let mut bytes = value.as_bytes().to_vec();
        bytes.push(0);
        u32::try_from(bytes.len())
            .map_err(|_| Hdf5Error::InvalidState(format!("attribute '{name}' is longer than 4 GiB")))
            .and_then(|size| self.group.set_attr_typed(name, DatatypeMessage::fixed_string_utf8(size), bytes))
            .map_err(|e| self.writer.error(e))
    }

    /// Writes a dataset of shape (`rows`) or, from two columns on, (`rows`, `columns`), block by block: `fill`
    /// appends the numbers of the rows that it is asked for. `compression` 0 stores them contiguously, 1 to 9
    /// in chunks with shuffle and deflate.
    ///
    /// # Errors
    /// Those of `fill`, or [`FormatError::Io`].
    pub fn dataset<T: Scalar>(
        &self,
        name: &str,
        rows: usize,
        columns: usize,
        compression: u8,
        mut fill: impl FnMut(Range<usize>, &mut Vec<T>) -> Result<()>,
    ) -> Result<Dataset<'_>> {
        let mut shape = vec![rows, columns];
        let mut chunk = vec![rows.min(CHUNK_ROWS), columns];
        if columns == 1 {
            shape.truncate(1);
            chunk.truncate(1);
        }
        let mut builder = self.group.new_dataset::<T>().shape(&shape);
        if compression > 0 && rows > 0 {
            builder = builder.chunk(&chunk).shuffle_deflate(u32::from(compression.min(9)));
        }
        let data = builder.create(name).map_err(|e| self.writer.error(e))?;
        let mut block = Vec::new();
        for start in (0..rows).step_by(CHUNK_ROWS) {
            let end = rows.min(start + CHUNK_ROWS);
            block.clear();
            fill(start..end, &mut block)?;
            let mut starts = vec![start, 0];
            let mut counts = vec![end - start, columns];
            starts.truncate(shape.len());
            counts.truncate(shape.len());
            data.write_slice(&starts, &counts, &block).map_err(|e| self.writer.error(e))?;
        }
        Ok(Dataset { writer: self.writer, data })
    }
}

/// A dataset that has been written; attributes may follow.
pub struct Dataset<'w> {
    writer: &'w Writer,
    data: H5Dataset,
}

impl Dataset<'_> {
    /// Sets a one-dimensional attribute.
    ///
    /// # Errors
    /// [`FormatError::Io`].
    pub fn numbers<T: Scalar>(&self, name: &str, values: &[T]) -> Result<()> {
        self.data
            .new_attr::<T>()
            .shape([values.len()])
            .create(name)
            .and_then(|a| a.write_array(values))
            .map_err(|e| self.writer.error(e))
    }
}
