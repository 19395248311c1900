//! The description of a format, and the search for the format of a file.

use crate::axis_units;
pub use crate::capabilities::{Capabilities, Columns, FixedCorner, Origin};
use crate::compressed;
use crate::error::{FormatError, Result};
use crate::family::{self, Family};
pub use crate::model::WriteOptions;
use crate::model::{ParticleFile, RawField};
use crate::nearest::did_you_mean;
use crate::space::refuse_without_room;
use crate::stream::{Part, ParticleStream, Piece};
use crate::units::Unit;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// How sure a format is of the first bytes of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Match {
    No,
    /// The container fits (an HDF5 file, a text table); several formats may say so.
    Container,
    /// The signature belongs to this format alone.
    Certain,
}

/// What to read from a field file. What is left empty is for the reader to decide.
#[derive(Debug, Clone, Default)]
pub struct FieldRequest {
    /// Variable that is the mass density.
    pub density: Option<String>,
    /// Variables to read in addition to the density: `None` is all of them.
    pub carry: Option<Vec<String>>,
    /// Variables to read as well where the file has them, whatever is carried: by the letters and digits of their names.
    pub optional: Vec<String>,
    /// Record of a time axis: a value of the time coordinate (the nearest record is taken and named in a note).
    pub time: Option<f64>,
    /// Radius of the planet from whose surface depth or height counts, over the file's own.
    pub planet_radius: Option<f64>,
    /// Its unit; `None` is that of the axis.
    pub planet_radius_unit: Option<Unit>,
}

impl FieldRequest {
    /// Whether a variable that is not the density is to be read.
    pub fn takes(&self, name: &str) -> bool {
        self.carry.as_ref().is_none_or(|names| names.iter().any(|n| n == name)) || self.takes_if_there(name)
    }

    /// Whether it is one of the optional ones.
    pub fn takes_if_there(&self, name: &str) -> bool {
        !self.optional.is_empty() && self.optional.iter().any(|n| plain_name(n) == plain_name(name))
    }
}

/// The letters and digits of a name, in lower case: `M_r`, `m(r)` and `mr` are one.
pub fn plain_name(name: &str) -> String {
    name.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_lowercase()).collect()
}

/// What a file holds.
#[derive(Debug, Clone)]
pub enum FileContent {
    Field(RawField),
    Particles(ParticleFile),
}

/// Reads a file that [`FormatSpec::sniff`] accepted.
pub type ReadFn = fn(&Path, &FieldRequest) -> Result<FileContent>;
/// Writes particles to a path that does not matter until it returns `Ok`: the caller renames it into place.
/// An existing file at the path is overwritten.
pub type WriteFn = fn(&Path, &ParticleFile, WriteOptions) -> Result<()>;

/// Writes one of several files, block by block where the format allows, to a path as that of [`WriteFn`].
pub type StreamFn = fn(&Piece<'_>, WriteOptions) -> Result<()>;
/// Writes the file that lists others, whose names it gets.
pub type IndexFn = fn(&Path, &[String], &dyn ParticleStream, WriteOptions) -> Result<()>;

/// How a format writes several files, or particles that are made while they are written.
#[derive(Debug, Clone, Copy)]
pub struct Streaming {
    pub write: StreamFn,
    pub names: FileNames,
    /// Whether a file takes no more memory for more particles; else those of one file are held at once.
    pub in_blocks: bool,
}

/// Which files hold the particles where there are several.
#[derive(Debug, Clone, Copy)]
pub enum FileNames {
    /// One file, since the code that is written for reads no more.
    One,
    /// `NAME.0.EXT`, `NAME.1.EXT` and so on.
    Numbered,
    /// `NAME.EXT.0`, `NAME.EXT.1` and so on, for codes that add the number to whatever name they are told.
    Appended,
    /// `NAME_0.EXT` and so on, and one that lists them, of an extension of its own: pairs of that and theirs.
    Listed { extensions: &'static [(&'static str, &'static str)], index: IndexFn },
}

/// Data sheet of one format. Always compiled; the code behind it is under its Cargo feature.
#[derive(Debug, Clone, Copy)]
pub struct FormatSpec {
    pub name: &'static str,
    /// One line for the table of formats.
    pub summary: &'static str,
    /// Lowercase, without the dot; the first is the default.
    pub extensions: &'static [&'static str],
    /// Cargo feature that switches it on.
    pub feature: &'static str,
    /// Where the format is specified.
    pub reference: &'static str,
    pub capabilities: Capabilities,
    /// Judges the first 4096 bytes (fewer if the file is shorter), and the first and last MiB where several formats share the container.
    pub sniff: fn(&[u8]) -> Match,
    /// `None`: cannot read, or not in this build (see `capabilities`).
    pub read: Option<ReadFn>,
    /// `None`: cannot write, or not in this build.
    pub write: Option<WriteFn>,
    /// `None`: cannot write several files, nor particles that memory does not hold.
    pub stream: Option<Streaming>,
}

/// First bytes of an HDF5 file without a user block.
pub const HDF5_SIGNATURE: &[u8; 8] = b"\x89HDF\r\n\x1a\n";

/// The [`FormatSpec::sniff`] of formats that live in HDF5 files.
pub fn sniff_hdf5(head: &[u8]) -> Match {
    if head.starts_with(HDF5_SIGNATURE) { Match::Container } else { Match::No }
}

/// Whether `what` stands somewhere in `head`.
///
/// It is looked for by its first byte: comparing all of it at every place takes longer than reading a small file.
pub(crate) fn contains(head: &[u8], what: &[u8]) -> bool {
    let Some(&first) = what.first() else { return true };
    let mut rest = head;
    while let Some(at) = rest.iter().position(|&byte| byte == first) {
        rest = &rest[at..];
        if rest.starts_with(what) {
            return true;
        }
        rest = &rest[1..];
    }
    false
}

/// Bytes that [`FormatSpec::sniff`] gets to see at first.
pub const SNIFF_BYTES: usize = 4096;

/// Bytes that it sees where several formats share the container: names in HDF5 files may stand behind some data.
const DEEP_SNIFF_BYTES: usize = 1 << 20;

/// Finds the format of an existing file: by `explicit` name, else by its first bytes, else by its extension.
///
/// # Errors
/// [`FormatError::Io`] where the file cannot be opened or is a directory, [`FormatError::Detection`] where it
/// is empty, unknown, or fits several formats equally.
pub fn detect<'a>(formats: &'a [FormatSpec], path: &Path, explicit: Option<&str>) -> Result<&'a FormatSpec> {
    let path = &family::resolve(path)?;
    let head = read_head(path, SNIFF_BYTES)?;
    // Every second byte of common letters is 0.
    if matches!(head.as_slice(), [0xff, 0xfe, _, 0, ..] | [0xfe, 0xff, 0, _, ..]) {
        return Err(detection(path, "it is text in UTF-16, expected UTF-8; save it as that".into()));
    }
    if let Some(name) = explicit {
        return by_name(formats, path, name);
    }
    if head.is_empty() {
        return Err(detection(path, "the file is empty".into()));
    }
    let readable = || formats.iter().filter(|f| f.capabilities.read_field || f.capabilities.read_particles);
    let fitting = |head: &[u8]| -> Vec<&'a FormatSpec> {
        let matches: Vec<(Match, &FormatSpec)> = readable().map(|f| ((f.sniff)(head), f)).collect();
        let best = matches.iter().map(|m| m.0).max().unwrap_or(Match::No);
        matches.into_iter().filter(|m| best > Match::No && m.0 == best).map(|m| m.1).collect()
    };
    let mut found = fitting(&head);
    if found.len() > 1 && head.len() == SNIFF_BYTES {
        let mut deep = read_head(path, DEEP_SNIFF_BYTES)?;
        deep.extend(read_tail(path, DEEP_SNIFF_BYTES, deep.len())?);
        found = fitting(&deep);
    }
    if found.len() != 1 {
        let all = found.is_empty();
        let by_extension: Vec<_> =
            readable().filter(|f| (all || found.iter().any(|g| g.name == f.name)) && has_extension(f, path)).collect();
        if !by_extension.is_empty() {
            found = by_extension;
        }
    }
    match found.as_slice() {
        [one] => Ok(one),
        [] => Err(detection(
            path,
            format!(
                "neither its first bytes nor its extension are known; name it with --format, one of {}",
                names(formats.iter())
            ),
        )),
        many => Err(detection(path, format!("it may be {}; name it with --format", names(many.iter().copied())))),
    }
}

/// Finds the format to write `path` in: by `explicit` name, else by its extension among the writers.
///
/// # Errors
/// [`FormatError::Detection`] where no or several writers fit.
pub fn detect_output<'a>(formats: &'a [FormatSpec], path: &Path, explicit: Option<&str>) -> Result<&'a FormatSpec> {
    if let Some(name) = explicit {
        return by_name(formats, path, name);
    }
    let writers = || formats.iter().filter(|f| f.capabilities.write_particles);
    // The first listed extension is a format's own; later ones it shares with others.
    let own: Vec<_> = writers().filter(|f| extension(path).as_deref() == f.extensions.first().copied()).collect();
    let any: Vec<_> = writers().filter(|f| has_extension(f, path)).collect();
    match (own.as_slice(), any.as_slice()) {
        ([one], _) | ([], [one]) => Ok(one),
        ([], []) => Err(detection(
            path,
            format!("no writer has this extension; name the flavor with --to, one of {}", names(writers())),
        )),
        (_, many) => {
            Err(detection(path, format!("the flavor may be {}; name it with --to", names(many.iter().copied()))))
        }
    }
}

/// Reads a file in the format found for it and checks that what came is consistent in itself.
///
/// # Errors
/// Those of [`detect`], [`reader`] and the reader itself; [`FormatError::Input`] where counts, axes or
/// connectivity contradict each other.
pub fn read(
    formats: &[FormatSpec],
    path: &Path,
    explicit: Option<&str>,
    request: &FieldRequest,
) -> Result<FileContent> {
    let path = &family::resolve(path)?;
    if let Some(packing) = compressed::packing(path) {
        let unpacked = compressed::unpack(path, packing)?;
        let mut content = read(formats, &unpacked.path, explicit, request).map_err(|e| e.renamed(path))?;
        if let FileContent::Field(field) = &mut content {
            field.path = path.into();
        }
        return Ok(content);
    }
    let spec = detect(formats, path, explicit)?;
    let mut content = reader(spec, path)?(path, request)?;
    let checked = match &content {
        FileContent::Field(field) => field.validate(),
        FileContent::Particles(file) => file.validate(),
    };
    checked.map_err(|(location, problem)| FormatError::input(path, spec.name, location, problem))?;
    if let FileContent::Field(field) = &mut content {
        axis_units::unify(field);
    }
    Ok(content)
}

/// Writes particles; the file appears whole or not at all.
///
/// # Errors
/// [`FormatError::Output`] where columns contradict each other, or a position or mass is not finite.
/// Those of [`detect_output`], [`writer`], the writer itself and the operating system.
pub fn write(
    formats: &[FormatSpec],
    path: &Path,
    explicit: Option<&str>,
    file: &ParticleFile,
    options: WriteOptions,
) -> Result<()> {
    write_files(formats, path, explicit, file, 1, options).map(drop)
}

/// The same to so many `files`, which appear all or none; returns their paths.
///
/// # Errors
/// As [`write()`] and [`write_stream`].
pub fn write_files(
    formats: &[FormatSpec],
    path: &Path,
    explicit: Option<&str>,
    file: &ParticleFile,
    files: usize,
    options: WriteOptions,
) -> Result<Vec<PathBuf>> {
    let spec = detect_output(formats, path, explicit)?;
    let write = writer(spec, path)?;
    let refuse = |problem: String| FormatError::Output { path: path.into(), format: spec.name, problem };
    file.validate().map_err(|(location, problem)| refuse(format!("{location}: {problem}")))?;
    if let Some(problem) = file.meaningless() {
        return Err(refuse(problem));
    }
    if let Some(corner) = spec.capabilities.corner.misses(&file.header) {
        let problem = format!(
            "the box begins at {corner:?}, and files of the format have it at the origin; move it there first (move_corner_to_origin)"
        );
        return Err(refuse(problem));
    }
    output_files(spec, path, files)?;
    let is_list = spec.stream.is_some_and(|s| s.names.lists(path).is_some());
    if files == 1 && !is_list {
        crate::output::atomically(path, |temporary| write(temporary, file, options)).map_err(|e| e.renamed(path))?;
        return Ok(vec![path.into()]);
    }
    let counted: usize = file.counts().iter().sum();
    let there: usize = file.species.iter().map(|s| s.table.count).sum();
    let types = file.species.iter().map(|s| s.part_type);
    if counted != there || types.clone().any(|t| types.clone().filter(|&u| u == t).count() > 1) {
        let types: Vec<u8> = types.collect();
        return Err(refuse(format!("the particles are of types {types:?}, expected each of 0 to 5 once at most")));
    }
    write_stream(formats, path, Some(spec.name), file, files, options)
}

/// Writes particles that are made while they are written, to so many `files`, which appear all or none; returns their paths.
///
/// # Errors
/// [`FormatError::Output`] where the format cannot, or for more files than particles; those of [`detect_output`], the writer,
/// the stream and the operating system.
pub fn write_stream(
    formats: &[FormatSpec],
    path: &Path,
    explicit: Option<&str>,
    particles: &dyn ParticleStream,
    files: usize,
    options: WriteOptions,
) -> Result<Vec<PathBuf>> {
    let (spec, streaming) = streaming(formats, path, explicit)?;
    let totals = particles.counts();
    let count: usize = totals.iter().sum();
    if files == 0 || files > count.max(1) {
        let problem = format!("{count} particles do not fill {files} files; expected 1 to {}", count.max(1));
        return Err(FormatError::Output { path: path.into(), format: spec.name, problem });
    }
    refuse_without_room((path, spec.name), particles, 1.0, options)?;
    let paths = output_files(spec, path, files)?;
    let names = || paths.iter().map(|p| p.file_name().unwrap_or_default().to_string_lossy().into_owned());
    // The one that lists the others goes before them.
    let listing = streaming.names.lists(path).map(|(_, index)| index);
    crate::output::atomically_all(&paths, |k, temporary| {
        let written = match (k, listing) {
            (0, Some(index)) => index(temporary, &names().skip(1).collect::<Vec<_>>(), particles, options),
            _ => {
                let part = Part::new(totals, k - usize::from(listing.is_some()), files);
                (streaming.write)(&Piece { path: temporary, part, stream: particles }, options)
            }
        };
        written.map_err(|e| e.renamed(&paths[k]))
    })?;
    Ok(paths)
}

const ONE_FILE: &str = "it is one file for the programs that read it; leave out --files (output.files), or write gadget, \
    gizmo, arepo, gadget-binary or VTK's .pvtu";

/// Writes one of `files` alone, for as many processes that do not know of each other; returns its path.
///
/// # Errors
/// As [`write_stream`]; [`FormatError::Output`] where there is no file of this number, or one lists the others.
pub fn write_part(
    formats: &[FormatSpec],
    path: &Path,
    explicit: Option<&str>,
    particles: &dyn ParticleStream,
    (index, files): (usize, usize),
    options: WriteOptions,
) -> Result<PathBuf> {
    let (spec, streaming) = streaming(formats, path, explicit)?;
    let refuse = |problem: String| Err(FormatError::Output { path: path.into(), format: spec.name, problem });
    let totals = particles.counts();
    if index >= files || files > totals.iter().sum() {
        return refuse(format!(
            "there is no part {index} of {files}, expected one of 0 to {}",
            files.saturating_sub(1)
        ));
    }
    if !matches!(streaming.names, FileNames::Numbered | FileNames::Appended) {
        return refuse("its parts are not written one by one; write gadget, gizmo, arepo or gadget-binary".into());
    }
    refuse_without_room((path, spec.name), particles, 1.0 / files as f64, options)?;
    let target = output_files(spec, path, files)?.swap_remove(index);
    let part = Part::new(totals, index, files);
    let piece = |temporary: &Path| (streaming.write)(&Piece { path: temporary, part, stream: particles }, options);
    crate::output::atomically(&target, piece).map_err(|e| e.renamed(&target))?;
    Ok(target)
}

/// The files that a format writes for `path` where there are to be so many: the first is the one that tells of the others.
///
/// # Errors
/// [`FormatError::Output`] where the format writes no more than one, or none of such a name.
pub fn output_files(spec: &FormatSpec, path: &Path, files: usize) -> Result<Vec<PathBuf>> {
    let refuse = |problem: String| Err(FormatError::Output { path: path.into(), format: spec.name, problem });
    let names = match spec.stream {
        Some(streaming) => streaming.names,
        None if files == 1 => return Ok(vec![path.into()]),
        None => return refuse(ONE_FILE.into()),
    };
    if let Some((extension, _)) = names.lists(path) {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let piece = |k| path.with_file_name(format!("{stem}_{k}.{extension}"));
        return Ok(std::iter::once(path.to_owned()).chain((0..files).map(piece)).collect());
    }
    match names {
        _ if files == 1 => Ok(vec![path.into()]),
        FileNames::One => refuse(ONE_FILE.into()),
        FileNames::Numbered | FileNames::Appended => {
            let is_appended = matches!(names, FileNames::Appended);
            let family = if is_appended { Family::of_whole_name(path) } else { Family::for_output(path) };
            Ok((0..files).map(|k| family.member(k)).collect())
        }
        FileNames::Listed { extensions, .. } => {
            let known: Vec<String> = extensions.iter().map(|(listing, _)| format!(".{listing}")).collect();
            refuse(format!("several files are listed by one that ends in {}; name that", known.join(" or ")))
        }
    }
}

impl FileNames {
    /// The extension of the files that `path` lists by its own, and what writes it.
    fn lists(&self, path: &Path) -> Option<(&'static str, IndexFn)> {
        let Self::Listed { extensions, index } = self else { return None };
        let own = extension(path)?;
        extensions.iter().find(|(listing, _)| *listing == own).map(|(_, extension)| (*extension, *index))
    }
}

fn streaming<'f>(
    formats: &'f [FormatSpec],
    path: &Path,
    explicit: Option<&str>,
) -> Result<(&'f FormatSpec, Streaming)> {
    let spec = detect_output(formats, path, explicit)?;
    writer(spec, path)?;
    match spec.stream {
        Some(streaming) => Ok((spec, streaming)),
        None => {
            let able = names(formats.iter().filter(|f| f.stream.is_some()));
            let problem = format!("particles are written to it at once only; write one of {able}");
            Err(FormatError::Output { path: path.into(), format: spec.name, problem })
        }
    }
}

/// The reader of a format.
///
/// # Errors
/// [`FormatError::Detection`] where the format cannot be read, or is not in this build.
pub fn reader(spec: &FormatSpec, path: &Path) -> Result<ReadFn> {
    let can = spec.capabilities.read_field || spec.capabilities.read_particles;
    spec.read.ok_or_else(|| absent(spec, path, can, "read"))
}

/// The writer of a format.
///
/// # Errors
/// [`FormatError::Detection`] where the format cannot be written, or is not in this build.
pub fn writer(spec: &FormatSpec, path: &Path) -> Result<WriteFn> {
    spec.write.ok_or_else(|| absent(spec, path, spec.capabilities.write_particles, "written"))
}

fn absent(spec: &FormatSpec, path: &Path, can: bool, verb: &str) -> FormatError {
    let problem = if can {
        format!("format '{}' is not in this build; rebuild with --features {}", spec.name, spec.feature)
    } else {
        format!("format '{}' cannot be {verb}", spec.name)
    };
    detection(path, problem)
}

fn read_head(path: &Path, bytes: usize) -> Result<Vec<u8>> {
    let kind = std::fs::metadata(path).map_err(|e| FormatError::io(path, "open", e))?.file_type();
    let refuse = |kind, problem: &str| Err(FormatError::io(path, "read", std::io::Error::new(kind, problem)));
    if kind.is_dir() {
        let problem =
            "it is a directory, not a file; the folders that are read have a file named Header (AMReX plotfiles)";
        return refuse(std::io::ErrorKind::IsADirectory, problem);
    }
    if !kind.is_file() {
        // What was read from a pipe to recognize the format would be lost, and one that nobody writes to waits forever.
        let problem =
            "it is a pipe or a device, and formats are read more than once; save its contents as a file first";
        return refuse(std::io::ErrorKind::InvalidInput, problem);
    }
    let file = File::open(path).map_err(|e| FormatError::io(path, "open", e))?;
    let mut head = Vec::with_capacity(SNIFF_BYTES);
    file.take(bytes as u64).read_to_end(&mut head).map_err(|e| FormatError::io(path, "read", e))?;
    Ok(head)
}

/// The last `bytes` of a file, without the first `skip`: where HDF5 libraries put the names that came last.
fn read_tail(path: &Path, bytes: usize, skip: usize) -> Result<Vec<u8>> {
    let fail = |e| FormatError::io(path, "read", e);
    let mut file = File::open(path).map_err(fail)?;
    let length = file.metadata().map_err(fail)?.len();
    let start = length.saturating_sub(bytes as u64).max(skip as u64);
    let mut tail = Vec::new();
    if start < length {
        file.seek(SeekFrom::Start(start)).map_err(fail)?;
        file.take(bytes as u64).read_to_end(&mut tail).map_err(fail)?;
    }
    Ok(tail)
}

fn by_name<'a>(formats: &'a [FormatSpec], path: &Path, name: &str) -> Result<&'a FormatSpec> {
    formats.iter().find(|f| f.name == name).ok_or_else(|| {
        let hint = did_you_mean(name, formats.iter().map(|f| f.name));
        detection(path, format!("there is no format '{name}'; known are {}{hint}", names(formats.iter())))
    })
}

fn extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
}

fn has_extension(spec: &FormatSpec, path: &Path) -> bool {
    extension(path).is_some_and(|e| spec.extensions.contains(&e.as_str()))
}

fn names<'a>(formats: impl Iterator<Item = &'a FormatSpec>) -> String {
    formats.map(|f| f.name).collect::<Vec<_>>().join(", ")
}

fn detection(path: &Path, problem: String) -> FormatError {
    FormatError::Detection { path: path.into(), problem }
}

#[cfg(test)]
mod tests {
    use super::contains;

    #[test]
    fn names_are_found_anywhere_and_after_false_starts() {
        for (head, what) in [("Step#0", "Step#"), ("a SteStep#", "Step#"), ("xx", "x"), ("", ""), ("aab", "ab")] {
            assert!(contains(head.as_bytes(), what.as_bytes()), "{head}");
        }
        for (head, what) in [("", "a"), ("Step", "Step#"), ("StepStep", "Step#")] {
            assert!(!contains(head.as_bytes(), what.as_bytes()), "{head}");
        }
    }
}
