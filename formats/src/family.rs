//! Snapshots in several files: `NAME.0.hdf5`, `NAME.1.hdf5` and so on, as GADGET and SWIFT name them, or `NAME.0`, `NAME.1`
//! as GADGET does with its binary files, whatever their extension.

use crate::error::{FormatError, Result};
use std::path::{Path, PathBuf};

/// The file by which a folder of several is known: that of plotfiles of AMReX.
const ENTRY: &str = "Header";
/// The same of an output of RAMSES, by how its name begins and ends.
const INFO: [&str; 2] = ["info_", ".txt"];
/// The folders within it that hold the values, by how their names begin.
const LEVEL: &str = "Level_";
/// Digits of a file's number, at most.
const MOST_DIGITS: usize = 9;

/// The files of one snapshot, known by what stands before and after their numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Family {
    folder: PathBuf,
    /// With the separator.
    before: String,
    /// With the extension's dot.
    after: String,
}

impl Family {
    /// The family whose member `path` is by its name, and its number there.
    pub(crate) fn of_member(path: &Path) -> Option<(Self, usize)> {
        let name = path.file_name()?.to_str()?;
        let (rest, last) = name.rsplit_once('.')?;
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let family = |before: &str, after: String| Self { folder, before: format!("{before}."), after };
        if let Some(number) = number(last) {
            return Some((family(rest, String::new()), number));
        }
        let (stem, middle) = rest.rsplit_once('.')?;
        Some((family(stem, format!(".{last}")), number(middle)?))
    }

    /// The family that is written for `path`: its number goes before the extension.
    pub(crate) fn for_output(path: &Path) -> Self {
        let text = |part: Option<&std::ffi::OsStr>| part.map_or(String::new(), |s| s.to_string_lossy().into_owned());
        let after = path.extension().map_or(String::new(), |e| format!(".{}", e.to_string_lossy()));
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        Self { folder, before: format!("{}.", text(path.file_stem())), after }
    }

    /// The family that is written for `path`, with the numbers at the very end.
    pub(crate) fn of_whole_name(path: &Path) -> Self {
        let name = path.file_name().map_or(String::new(), |s| s.to_string_lossy().into_owned());
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        Self { folder, before: format!("{name}."), after: String::new() }
    }

    /// The path of a member.
    pub(crate) fn member(&self, number: usize) -> PathBuf {
        self.folder.join(format!("{}{number}{}", self.before, self.after))
    }

    /// All of `count` members, each of which is there.
    ///
    /// # Errors
    /// The first that is missing; `said_by` is the file that says how many there are.
    #[cfg(any(feature = "gadget", feature = "gadget-binary"))]
    pub(crate) fn complete(&self, format: &'static str, said_by: &Path, count: usize) -> Result<Vec<PathBuf>> {
        let mut members = Vec::new();
        for number in 0..count {
            let member = self.member(number);
            if !member.is_file() {
                let problem = format!(
                    "it is missing, but '{}' says that the snapshot is in {count} files; put all of them into one folder",
                    said_by.display()
                );
                return Err(FormatError::input(&member, format, "snapshot in several files", problem));
            }
            members.push(member);
        }
        Ok(members)
    }
}

fn number(text: &str) -> Option<usize> {
    let digits = !text.is_empty() && text.len() <= MOST_DIGITS && text.bytes().all(|b| b.is_ascii_digit());
    if digits { text.parse().ok() } else { None }
}

/// The members of the family to which a file belongs that says how many there are, in order.
///
/// # Errors
/// A name that is none of a family's, or a member that is missing.
#[cfg(any(feature = "gadget", feature = "gadget-binary"))]
pub(crate) fn members_of(path: &Path, format: &'static str, count: usize) -> Result<Vec<PathBuf>> {
    match Family::of_member(path) {
        Some((family, number)) if number < count => family.complete(format, path, count),
        _ => {
            let problem = format!(
                "it says that the snapshot is in {count} files, but its name is none of NAME.0.hdf5 to NAME.{}.hdf5; name the files so",
                count - 1
            );
            Err(FormatError::input(path, format, "snapshot in several files", problem))
        }
    }
}

/// The file to open for a name that may be that of a folder, or the common stem of a family, with or without its extension: the
/// file in the folder that says what else is in it, `path` itself where there is such a file, else the member with the lowest number.
///
/// # Errors
/// [`FormatError::Detection`] where the stem is that of several families.
pub(crate) fn resolve(path: &Path) -> Result<PathBuf> {
    if path.exists() {
        let entry = path.join(ENTRY);
        return Ok(if entry.is_file() { entry } else { info_of(path).unwrap_or(path.to_owned()) });
    }
    let (Some(name), folder) = (path.file_name(), path.parent().unwrap_or(Path::new(""))) else {
        return Ok(path.to_owned());
    };
    let listed = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let Ok(entries) = std::fs::read_dir(listed) else { return Ok(path.to_owned()) };
    let mut found: Vec<(Family, usize)> = Vec::new();
    for entry in entries.flatten() {
        let Some((family, number)) = Family::of_member(&folder.join(entry.file_name())) else { continue };
        if !family.is_named(name) {
            continue;
        }
        match found.iter_mut().find(|(known, _)| *known == family) {
            Some((_, lowest)) => *lowest = number.min(*lowest),
            None => found.push((family, number)),
        }
    }
    match found.as_slice() {
        [] => Ok(path.to_owned()),
        [(family, lowest)] => Ok(family.member(*lowest)),
        several => {
            let mut names: Vec<String> = several.iter().map(|(f, n)| f.member(*n).display().to_string()).collect();
            names.sort();
            let problem =
                format!("there are several files whose names begin so: {}; name one of them", names.join(", "));
            Err(FormatError::Detection { path: path.into(), problem })
        }
    }
}

/// The number of an info file's output.
fn info_number(path: &Path) -> Option<&str> {
    let digits = path.file_name()?.to_str()?.strip_prefix(INFO[0])?.strip_suffix(INFO[1])?;
    number(digits).map(|_| digits)
}

/// The info file of a folder that has one of them.
fn info_of(folder: &Path) -> Option<PathBuf> {
    if !folder.is_dir() {
        return None;
    }
    let mut found =
        std::fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path()).filter(|p| info_number(p).is_some());
    let info = found.next()?;
    (found.next().is_none() && info.is_file()).then_some(info)
}

/// The files of the output of RAMSES that an info file or its folder is; `None` where there is no such output.
fn output_of(path: &Path) -> Option<Vec<PathBuf>> {
    let info = if path.is_dir() { info_of(path)? } else { path.to_owned() };
    let digits = info_number(&info)?;
    let kinds = [format!("amr_{digits}.out"), format!("hydro_{digits}.out")];
    let descriptor = info.with_file_name("hydro_file_descriptor.txt");
    let folder = info.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let is_part = |path: &PathBuf| {
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        path.is_file() && (*path == descriptor || kinds.iter().any(|kind| name.starts_with(kind)))
    };
    let listed = std::fs::read_dir(folder).ok()?.flatten().map(|entry| info.with_file_name(entry.file_name()));
    let mut files: Vec<PathBuf> = listed.filter(is_part).collect();
    if files.is_empty() {
        return None;
    }
    files.push(info);
    files.sort();
    Some(files)
}

/// The files whose content an input is: those of a folder of several that is named by itself or by its first file, in the order of
/// their names, else `path` itself.
///
/// # Errors
/// [`FormatError::Io`] where the folder cannot be listed.
pub fn files_of(path: &Path) -> Result<Vec<PathBuf>> {
    let entry = if path.is_dir() { path.join(ENTRY) } else { path.to_owned() };
    let folder = entry.parent().unwrap_or(Path::new(""));
    let is_one_of_several = entry.ends_with(ENTRY) && entry.is_file() && folder.join(format!("{LEVEL}0")).is_dir();
    if !is_one_of_several {
        return Ok(output_of(path).unwrap_or_else(|| vec![path.to_owned()]));
    }
    let listed = |folder: &Path| -> Result<Vec<PathBuf>> {
        let entries = std::fs::read_dir(folder).map_err(|e| FormatError::io(folder, "list", e))?;
        let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        paths.sort();
        Ok(paths)
    };
    let mut files = Vec::new();
    for own in listed(if folder.as_os_str().is_empty() { Path::new(".") } else { folder })? {
        let is_level = own.file_name().is_some_and(|name| name.to_string_lossy().starts_with(LEVEL));
        match own.is_dir() {
            true if is_level => files.extend(listed(&own)?.into_iter().filter(|path| path.is_file())),
            true => {}
            false => files.push(own),
        }
    }
    Ok(files)
}

/// Whether `input` would be lost, or a piece of the snapshot in several files that it is of by its name, if `output` were written.
pub fn would_be_lost(input: &Path, output: &Path) -> bool {
    let (Ok(output), Ok(input)) = (output.canonicalize(), input.canonicalize()) else { return false };
    let (own, other) = (Family::of_member(&input), Family::of_member(&output));
    // A number may be part of a name, as in `polytrope-1.5.nc`: those of a snapshot begin with 0.
    let is_piece = own
        .zip(other)
        .is_some_and(|((own, i), (other, j))| own == other && (0..i.max(j)).all(|number| own.member(number).is_file()));
    input == output || is_piece
}

impl Family {
    /// Whether `name` is the stem, alone or with the extension.
    fn is_named(&self, name: &std::ffi::OsStr) -> bool {
        let stem = self.before.trim_end_matches('.');
        let has_stem = |name: &str| name == stem || !self.after.is_empty() && name == format!("{stem}{}", self.after);
        name.to_str().is_some_and(has_stem)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_known_by_their_names() {
        let of = |name: &str| Family::of_member(Path::new(name)).map(|(f, k)| (f.member(7), k));
        let path = |name: &str| PathBuf::from(name);
        assert_eq!(of("a/snap_001.3.hdf5"), Some((path("a/snap_001.7.hdf5"), 3)));
        assert_eq!(of("snap.12"), Some((path("snap.7"), 12)));
        assert_eq!(of("v1.5.0.h5"), Some((path("v1.5.7.h5"), 0)));
        for name in ["snap.hdf5", "snap", "snap.x.hdf5", "snap.-1.hdf5", "snap.1234567890", ".", ""] {
            assert_eq!(of(name), None, "{name}");
        }
        assert_eq!(Family::for_output(Path::new("a/ic.hdf5")).member(2), path("a/ic.2.hdf5"));
        assert_eq!(Family::for_output(Path::new("ic")).member(0), path("ic.0"));
    }

    #[test]
    fn stems_lead_to_the_lowest_member_unless_they_are_files_or_doubtful() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let make = |name: &str| std::fs::write(at(name), "x").unwrap();
        assert_eq!(resolve(&at("ic")).unwrap(), at("ic"));
        make("ic.1.hdf5");
        make("ic.10.hdf5");
        make("icy.0.hdf5");
        assert_eq!(resolve(&at("ic")).unwrap(), at("ic.1.hdf5"));
        assert_eq!(resolve(&at("ic.hdf5")).unwrap(), at("ic.1.hdf5"));
        assert_eq!(resolve(&at("ic.h5")).unwrap(), at("ic.h5"));
        make("ic.0");
        let error = resolve(&at("ic")).unwrap_err().to_string();
        assert!(error.contains("ic.0") && error.contains("ic.1.hdf5"), "{error}");
        assert_eq!(resolve(&at("ic.hdf5")).unwrap(), at("ic.1.hdf5"));
        make("ic");
        assert_eq!(resolve(&at("ic")).unwrap(), at("ic"));
    }
}
