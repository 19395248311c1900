//! Files that list other files, each with part of the particles: `.pvtu` and `.pvtp`.

use super::schema::NAME;
use super::write::declared_arrays;
use crate::common::parts;
use crate::error::{FormatError, Result};
use crate::model::ParticleFile;
use crate::registry::{FileContent, SNIFF_BYTES, WriteOptions, contains};
use crate::stream::{Part, ParticleStream, Piece};
use quick_xml::events::Event;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Types of files that list others.
const LISTINGS: [&str; 2] = ["PUnstructuredGrid", "PPolyData"];

/// Writes one part as a file of its own.
pub(super) fn write_piece(piece: &Piece<'_>, options: WriteOptions) -> Result<()> {
    super::write::write(piece.path, &piece.part.collect(piece.stream)?, options)
}

/// Writes the list of `pieces`, which are in the same folder.
pub(super) fn write_index(
    path: &Path,
    pieces: &[String],
    stream: &dyn ParticleStream,
    options: WriteOptions,
) -> Result<()> {
    // One particle of each type tells which columns there are.
    let totals = stream.counts();
    let sample =
        Part { index: 0, files: 1, totals, starts: [0; 6], counts: totals.map(|n| n.min(1)) }.collect(stream)?;
    let arrays = declared_arrays(path, &sample, options)?;
    let kind = LISTINGS[usize::from(path.extension().is_some_and(|e| e == "pvtp"))];
    let create = || std::fs::File::create(path).map(BufWriter::new);
    create().and_then(|out| index(out, kind, &arrays, pieces)).map_err(|e| FormatError::io(path, "write", e))
}

fn index(mut out: impl Write, kind: &str, arrays: &[(String, &str, usize)], pieces: &[String]) -> std::io::Result<()> {
    let array = |(name, kind, components): &(String, &str, usize)| {
        let name = quick_xml::escape::escape(name);
        format!("<PDataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"/>")
    };
    writeln!(out, "<?xml version=\"1.0\"?>")?;
    writeln!(out, "<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">")?;
    writeln!(out, "<{kind} GhostLevel=\"0\">")?;
    writeln!(out, "<PPointData>")?;
    for a in arrays {
        writeln!(out, "{}", array(a))?;
    }
    writeln!(out, "</PPointData><PCellData></PCellData>")?;
    writeln!(out, "<PPoints>{}</PPoints>", array(&("Points".into(), "Float64", 3)))?;
    for piece in pieces {
        writeln!(out, "<Piece Source=\"{}\"/>", quick_xml::escape::escape(piece))?;
    }
    writeln!(out, "</{kind}>\n</VTKFile>")?;
    out.flush()
}

/// The listing that names `path` as one of its pieces, where it lies beside it under the name that is written here: `NAME.pvtu` of
/// `NAME_0.vtu`.
pub(super) fn list_of(path: &Path) -> Option<PathBuf> {
    let (stem, extension) = (path.file_stem()?.to_str()?, path.extension()?.to_str()?);
    let (name, number) = stem.rsplit_once('_')?;
    if !matches!(extension, "vtu" | "vtp") || !number.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let list = path.with_file_name(format!("{name}.p{extension}"));
    let bytes = std::fs::read(&list).ok()?;
    let is_among = |pieces: Vec<PathBuf>| pieces.iter().any(|piece| piece.file_name() == path.file_name());
    // A damaged list, or one with pieces that are missing, says so when it is read.
    listed(&list, &bytes).map_or(Some(true), |pieces| pieces.map(is_among)).filter(|is_among| *is_among).map(|_| list)
}

/// The files that a listing names; `None` of any other file.
///
/// # Errors
/// [`FormatError::Input`] for XML that is none, a list of none, of the same file twice, or of files that are not there;
/// [`FormatError::Unsupported`] where parts overlap.
pub(super) fn listed(path: &Path, bytes: &[u8]) -> Result<Option<Vec<PathBuf>>> {
    let fail = |problem: String| FormatError::input(path, NAME, "list of pieces", problem);
    let head = bytes.get(..SNIFF_BYTES.min(bytes.len())).unwrap_or_default();
    if !LISTINGS.iter().any(|kind| contains(head, kind.as_bytes())) {
        return Ok(None);
    }
    let Ok(text) = std::str::from_utf8(bytes) else { return Ok(None) };
    let mut reader = quick_xml::Reader::from_str(text);
    let mut pieces: Vec<PathBuf> = Vec::new();
    let mut is_listing = false;
    loop {
        let event = reader.read_event().map_err(|e| fail(format!("{e}; the file is damaged")))?;
        let tag = match event {
            Event::Start(tag) | Event::Empty(tag) => tag,
            Event::Eof => break,
            _ => continue,
        };
        let attribute = |name: &str| -> Result<Option<String>> {
            let found = tag.try_get_attribute(name).map_err(|e| fail(e.to_string()))?;
            let text = found.map(|a| a.value.into_owned());
            let plain =
                |t: String| quick_xml::escape::unescape(&t).map(|t| t.into_owned()).map_err(|e| fail(e.to_string()));
            text.map(plain).transpose()
        };
        match tag.name().as_ref() {
            "VTKFile" => {
                is_listing = attribute("type")?.is_some_and(|t| LISTINGS.contains(&t.as_str()));
                if !is_listing {
                    return Ok(None);
                }
            }
            "Piece" if is_listing => {
                let source = attribute("Source")?.ok_or_else(|| fail("a piece has no Source".into()))?;
                let piece = path.with_file_name("").join(&source);
                if !piece.is_file() {
                    return Err(fail(format!("'{}' is missing, which it lists", piece.display())));
                }
                if pieces.contains(&piece) {
                    return Err(fail(format!("'{source}' comes twice")));
                }
                pieces.push(piece);
            }
            _ if is_listing && attribute("GhostLevel")?.is_some_and(|level| level.trim() != "0") => {
                let what = "pieces that overlap (GhostLevel is not 0); write them without ghost cells".into();
                return Err(FormatError::Unsupported { path: path.into(), format: NAME, what });
            }
            _ => {}
        }
    }
    match (is_listing, pieces.is_empty()) {
        (false, _) => Ok(None),
        (true, true) => Err(fail("is empty".into())),
        (true, false) => Ok(Some(pieces)),
    }
}

/// Particles of all pieces; `read` reads a file that is none of this kind.
///
/// # Errors
/// Those of `read`; pieces of a grid or mesh.
pub(super) fn particles(
    path: &Path,
    pieces: &[PathBuf],
    read: impl Fn(&Path) -> Result<FileContent>,
) -> Result<ParticleFile> {
    parts::joined(NAME, pieces, |piece| match read(piece)? {
        FileContent::Particles(file) => Ok(file),
        FileContent::Field(field) => Err(FormatError::Unsupported {
            path: path.into(),
            format: NAME,
            what: format!(
                "pieces that hold a {}; expected particles, or join them into one file",
                field.geometry.kind()
            ),
        }),
    })
}
