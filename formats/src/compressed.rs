//! Files compressed with gzip, xz or Zstandard: they are unpacked into a temporary file, read, and the temporary file is removed.
//!
//! A stream that is made to burst takes no more than [`LARGEST_RATIO`] times the file.

use crate::error::{FormatError, Result};
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// How files are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Packing {
    Gzip,
    Xz,
    Zstandard,
}

/// A file may unpack to so many times its own bytes: arrays of zeros pack well.
const LARGEST_RATIO: u64 = 20_000;
/// Small files may, too.
const ALWAYS: u64 = 1 << 24;

const PACKINGS: [(Packing, &[u8], &str); 3] = [
    (Packing::Gzip, &[0x1f, 0x8b], "gz"),
    (Packing::Xz, &[0xfd, b'7', b'z', b'X', b'Z', 0], "xz"),
    (Packing::Zstandard, &[0x28, 0xb5, 0x2f, 0xfd], "zst"),
];

/// How a file is packed, by its first bytes and its extension: other formats begin like gzip, too.
pub fn packing(path: &Path) -> Option<Packing> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    let (packing, magic, _) = PACKINGS.iter().find(|(.., own)| *own == extension)?;
    let mut head = Vec::new();
    File::open(path).ok()?.take(magic.len() as u64).read_to_end(&mut head).ok()?;
    (head == *magic).then_some(*packing)
}

/// An unpacked file, removed with this value.
pub struct Unpacked {
    _folder: TempDir,
    pub path: PathBuf,
}

/// Unpacks a file under its name without the last extension.
///
/// # Errors
/// [`FormatError::Io`]; [`FormatError::Input`] where the stream is damaged; [`FormatError::Limit`] where it bursts;
/// [`FormatError::Detection`] where the build lacks it.
pub fn unpack(path: &Path, packing: Packing) -> Result<Unpacked> {
    let io = |e| FormatError::io(path, "unpack", e);
    let folder = tempfile::Builder::new().prefix(".sph-prep-").tempdir().map_err(io)?;
    let name = path.file_stem().unwrap_or(path.as_os_str());
    let inner = folder.path().join(name);
    let file = File::open(path).map_err(|e| FormatError::io(path, "open", e))?;
    let allowed = file.metadata().map_err(io)?.len().saturating_mul(LARGEST_RATIO).max(ALWAYS);
    let mut out = Bounded { out: BufWriter::new(File::create(&inner).map_err(io)?), left: allowed, is_full: false };
    let copied = decode(packing, BufReader::new(file), &mut out).and_then(|()| out.out.flush());
    if out.is_full {
        return Err(FormatError::Limit {
            path: path.into(),
            format: NAMES[packing as usize],
            location: "content".into(),
            declared: format!("more than {allowed} bytes"),
            allowed: format!("{LARGEST_RATIO} times the file"),
        });
    }
    copied.map_err(|e| match e.kind() {
        std::io::ErrorKind::Unsupported => FormatError::Detection { path: path.into(), problem: e.to_string() },
        _ => FormatError::input(
            path,
            NAMES[packing as usize],
            "content",
            format!("cannot be unpacked: {e}; the file is damaged"),
        ),
    })?;
    Ok(Unpacked { _folder: folder, path: inner })
}

const NAMES: [&str; 3] = ["gzip", "xz", "Zstandard"];

#[cfg(feature = "compressed")]
fn decode(packing: Packing, mut file: BufReader<File>, out: &mut impl Write) -> std::io::Result<()> {
    let damaged = |e: String| std::io::Error::new(std::io::ErrorKind::InvalidData, e);
    match packing {
        Packing::Gzip => std::io::copy(&mut flate2::bufread::MultiGzDecoder::new(file), out).map(drop),
        Packing::Xz => lzma_rs::xz_decompress(&mut file, out).map_err(|e| damaged(format!("{e:?}"))),
        Packing::Zstandard => {
            let mut stream = ruzstd::decoding::StreamingDecoder::new(file).map_err(|e| damaged(e.to_string()))?;
            std::io::copy(&mut stream, out).map(drop)
        }
    }
}

#[cfg(not(feature = "compressed"))]
fn decode(_: Packing, _: BufReader<File>, _: &mut impl Write) -> std::io::Result<()> {
    let problem = "packed files cannot be read by this build; rebuild with --features compressed, or unpack it";
    Err(std::io::Error::new(std::io::ErrorKind::Unsupported, problem))
}

/// Takes so many bytes and no more.
struct Bounded<W> {
    out: W,
    left: u64,
    is_full: bool,
}

impl<W: Write> Write for Bounded<W> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        match self.left.checked_sub(bytes.len() as u64) {
            Some(left) => {
                let taken = self.out.write(bytes)?;
                self.left = left + (bytes.len() - taken) as u64;
                Ok(taken)
            }
            None => {
                self.is_full = true;
                Err(std::io::Error::other("too many bytes"))
            }
        }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.out.flush()
    }
}
