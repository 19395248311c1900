//! The boundary to the HDF5 crates: `rust-hdf5` writes; `hdf5-reader` reads, in
//! [`super::hdf5_read`].
//!
//! Files are written at the 1.8 library bound (version 2 superblock, version 1 B-trees), which HDF5 1.8 to 2.x
//! open; object times are off, so that equal input gives equal bytes. Two crates, because the writer's own
//! reader cannot decode numeric group attributes, and the reader is in the build for NetCDF-4 anyway.
//!
//! Reference: <https://support.hdfgroup.org/documentation/hdf5/latest/_f_m_t3.html>

use crate::error::{FormatError, Result};
use flate2::{Compression, write::ZlibEncoder};
use rust_hdf5::{DatatypeMessage, H5Dataset, H5File, H5Group, H5Type, Hdf5Error, LibverBound};
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::mpsc;

/// Rows of one chunk of a compressed dataset, and rows that are converted and written at once.
const CHUNK_ROWS: usize = 1 << 16;

/// Threads that convert numbers for the file, at most: plain ones, which writing keeps up with no more of, and those that are compressed.
const MAX_THREADS: usize = 4;
const MAX_COMPRESSING: usize = 32;

/// A number that can be stored.
pub trait Scalar: H5Type {
    /// Its bytes, the least significant first.
    fn bytes(self) -> impl AsRef<[u8]>;
}

macro_rules! scalar {
    ($($number:ty),+) => {
        $(impl Scalar for $number {
            fn bytes(self) -> impl AsRef<[u8]> {
                self.to_le_bytes()
            }
        })+
    };
}
scalar!(f32, f64, i8, i32, u32, i64, u64);

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
    /// appends the numbers of the given rows, for the next blocks while one is being written. `compression`
    /// 0 stores them contiguously, 1 to 9 in chunks with shuffle and deflate.
    ///
    /// # Errors
    /// Those of `fill`, or [`FormatError::Io`].
    pub fn dataset<T: Scalar + Send>(
        &self,
        name: &str,
        rows: usize,
        columns: usize,
        compression: u8,
        fill: impl Fn(Range<usize>, &mut Vec<T>) -> Result<()> + Sync,
    ) -> Result<Dataset<'_>> {
        let mut shape = vec![rows, columns];
        let mut chunk = vec![rows.min(CHUNK_ROWS), columns];
        if columns == 1 {
            shape.truncate(1);
            chunk.truncate(1);
        }
        let mut builder = self.group.new_dataset::<T>().shape(&shape);
        let is_packed = compression > 0 && rows > 0;
        if is_packed {
            builder = builder.chunk(&chunk).shuffle_deflate(u32::from(compression.min(9)));
        }
        let data = builder.create(name).map_err(|e| self.writer.error(e))?;
        if is_packed {
            let (numbers, path) = (chunk.iter().product(), &self.writer.path);
            let pack = |range: Range<usize>, packed: &mut Vec<u8>| {
                let mut block = Vec::with_capacity(numbers);
                fill(range, &mut block)?;
                pack(&block, numbers, compression, packed).map_err(|e| FormatError::io(path, "write", e))
            };
            blocks(rows, MAX_COMPRESSING, pack, |range, packed| {
                let place = [range.start / CHUNK_ROWS, 0];
                data.write_chunk_raw_at(&place[..shape.len()], packed, 0).map_err(|e| self.writer.error(e))
            })?;
            return Ok(Dataset { writer: self.writer, data });
        }
        blocks(rows, MAX_THREADS, fill, |range, block| {
            let mut starts = vec![range.start, 0];
            let mut counts = vec![range.len(), columns];
            starts.truncate(shape.len());
            counts.truncate(shape.len());
            data.write_slice(&starts, &counts, block).map_err(|e| self.writer.error(e))
        })?;
        Ok(Dataset { writer: self.writer, data })
    }
}

/// Appends a chunk of `count` numbers, of which those that are left out are zero, as the filters shuffle and deflate leave it.
fn pack<T: Scalar>(numbers: &[T], count: usize, level: u8, out: &mut Vec<u8>) -> std::io::Result<()> {
    let mut shuffled = vec![0; count * size_of::<T>()];
    for (i, number) in numbers.iter().enumerate() {
        for (place, byte) in number.bytes().as_ref().iter().enumerate() {
            shuffled[place * count + i] = *byte;
        }
    }
    let mut encoder = ZlibEncoder::new(out, Compression::new(u32::from(level.min(9))));
    encoder.write_all(&shuffled)?;
    encoder.finish().map(drop)
}

/// Gives the rows to `write` block by block and in order, as `fill` makes them in threads of their own, so many at most. The first
/// error ends it.
fn blocks<T: Send>(
    rows: usize,
    most_threads: usize,
    fill: impl Fn(Range<usize>, &mut Vec<T>) -> Result<()> + Sync,
    mut write: impl FnMut(Range<usize>, &[T]) -> Result<()>,
) -> Result<()> {
    let count = rows.div_ceil(CHUNK_ROWS);
    let range = |i: usize| i * CHUNK_ROWS..rows.min((i + 1) * CHUNK_ROWS);
    let filled = |i: usize, mut block: Vec<T>| {
        block.clear();
        fill(range(i), &mut block).map(|()| block)
    };
    if count <= 1 {
        return (0..count).try_for_each(|i| filled(i, Vec::new()).and_then(|block| write(range(i), &block)));
    }
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(most_threads).min(count);
    std::thread::scope(|scope| {
        // Thread k of n makes the blocks k, k + n, ..., one ahead of what is taken from it, into memory that comes back.
        let makers: Vec<_> = (0..threads)
            .map(|first| {
                let (to_write, made) = mpsc::sync_channel(1);
                let (give_back, used) = mpsc::channel();
                let filled = &filled;
                scope.spawn(move || {
                    for i in (first..count).step_by(threads) {
                        let block = filled(i, used.try_recv().unwrap_or_default());
                        let failed = block.is_err();
                        // Nobody receives after an error in writing.
                        if to_write.send(block).is_err() || failed {
                            break;
                        }
                    }
                });
                (made, give_back)
            })
            .collect();
        for (i, (made, give_back)) in (0..count).zip(makers.iter().cycle()) {
            // Only a thread that panics leaves without a word, and the scope passes that on.
            let Ok(block) = made.recv() else { break };
            let block: Vec<T> = block?;
            write(range(i), &block)?;
            // The thread may have made its last block.
            let _ = give_back.send(block);
        }
        Ok(())
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(range: Range<usize>, out: &mut Vec<usize>) -> Result<()> {
        out.extend(range);
        Ok(())
    }

    fn full(at: usize) -> FormatError {
        FormatError::io(Path::new("a"), "write", std::io::Error::other(at.to_string()))
    }

    #[test]
    fn blocks_arrive_in_order_and_whole() {
        for rows in [0, 1, CHUNK_ROWS, CHUNK_ROWS + 1, 5 * CHUNK_ROWS + 7] {
            let mut seen = Vec::new();
            let keep = |range: Range<usize>, block: &[usize]| {
                assert_eq!((range.start, range.len()), (seen.len(), block.len()));
                seen.extend_from_slice(block);
                Ok(())
            };
            blocks(rows, MAX_THREADS, numbered, keep).unwrap();
            assert_eq!(seen, (0..rows).collect::<Vec<_>>());
        }
    }

    #[test]
    fn the_first_error_of_either_side_ends_it() {
        for rows in [10, 9 * CHUNK_ROWS] {
            let fails = |range: Range<usize>, out: &mut Vec<usize>| match range.end > rows / 2 {
                true => Err(full(range.start)),
                false => numbered(range, out),
            };
            let mut written = 0;
            let error = blocks(rows, MAX_THREADS, fails, |range, _| {
                written += range.len();
                Ok(())
            });
            assert!(error.is_err() && written <= rows / 2, "{written}");
            assert!(
                blocks(rows, MAX_THREADS, numbered, |range, _| Err(full(range.start)))
                    .unwrap_err()
                    .to_string()
                    .ends_with(": 0")
            );
        }
    }
}
