//! Writes particles as an archive of arrays.

use super::npy;
use super::schema::{HEADER, NAME};
use crate::common::facts::{escaped, texts};
use crate::common::flatten::{Flat, flatten};
use crate::error::{FormatError, Result};
use crate::model::ParticleFile;
use crate::particle_names as names;
use crate::registry::WriteOptions;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

/// Bytes gathered before they are compressed.
const BUFFER: usize = 1 << 16;
/// Entries of 4 GiB need a longer record.
const LARGE: usize = 1 << 31;

pub(super) fn write(path: &Path, file: &ParticleFile, options: WriteOptions) -> Result<()> {
    let refuse = |problem: String| FormatError::Output { path: path.into(), format: NAME, problem };
    if path.extension().is_some_and(|e| e == "npy") {
        return Err(refuse("particles are several arrays, which go into .npz; .npy holds one".into()));
    }
    let (count, arrays) = flatten(file).map_err(refuse)?;
    let created = File::create(path).map_err(|e| FormatError::io(path, "create", e))?;
    let mut out = Out { path, zip: ZipWriter::new(BufWriter::new(created)), level: options.compression };
    let mut facts = texts(&file.header);
    facts.extend(arrays.iter().filter_map(|a| {
        let symbol = file.header.units.symbol(a.dimension);
        (!symbol.is_empty()).then(|| (format!("unit {}", a.name), symbol))
    }));
    let text: String = facts.iter().map(|(k, v)| format!("{k}: {}\n", escaped(v))).collect();
    out.entry(HEADER, &npy::header(&format!("|S{}", text.len()), &[]), text.len(), std::iter::once(text.into_bytes()))?;
    for array in &arrays {
        out.array(array, count, options.double_precision)?;
    }
    let io = |e: std::io::Error| FormatError::io(path, "write", e);
    out.zip.finish().map_err(|e| io(e.into())).and_then(|mut file| file.flush().map_err(io))
}

struct Out<'a> {
    path: &'a Path,
    zip: ZipWriter<BufWriter<File>>,
    level: u8,
}

impl Out<'_> {
    fn array(&mut self, array: &Flat<'_>, count: usize, double: bool) -> Result<()> {
        let shape = if array.components == 1 { vec![count] } else { vec![count, array.components] };
        let values = count * array.components;
        let name = array.name.replace(['/', '\\'], "_");
        let name = if name == HEADER { names::apart(&name) } else { name };
        if array.integers {
            let head = npy::header("<i8", &shape);
            return self.entry(&name, &head, 8 * values, array.whole().map(i64::to_le_bytes));
        }
        if array.wants_double(double) {
            return self.entry(&name, &npy::header("<f8", &shape), 8 * values, array.floats().map(f64::to_le_bytes));
        }
        let singles = array.floats().map(|v| (v as f32).to_le_bytes());
        self.entry(&name, &npy::header("<f4", &shape), 4 * values, singles)
    }

    fn entry(
        &mut self,
        name: &str,
        head: &[u8],
        bytes: usize,
        values: impl Iterator<Item = impl AsRef<[u8]>>,
    ) -> Result<()> {
        let method = if self.level == 0 { CompressionMethod::Stored } else { CompressionMethod::Deflated };
        // The time of writing would make equal particles unequal files.
        let options = SimpleFileOptions::default()
            .compression_method(method)
            .compression_level((self.level > 0).then_some(i64::from(self.level)))
            .last_modified_time(DateTime::default())
            .large_file(bytes >= LARGE);
        let io = |e: std::io::Error| FormatError::io(self.path, "write", e);
        self.zip.start_file(format!("{name}.npy"), options).map_err(|e| io(e.into()))?;
        let mut buffer = head.to_vec();
        for value in values {
            buffer.extend_from_slice(value.as_ref());
            if buffer.len() >= BUFFER {
                self.zip.write_all(&buffer).map_err(io)?;
                buffer.clear();
            }
        }
        self.zip.write_all(&buffer).map_err(io)
    }
}
