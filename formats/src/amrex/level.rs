//! `Cell_H`: the boxes of a level's patches, and where their values are.

use super::header::inside;
use super::scan::{Cells, Scan};
use super::schema::NAME;
use crate::common::text::Text;
use crate::error::{FormatError, Result};
use std::path::{Path, PathBuf};

/// The only version that AMReX writes unless told otherwise: every patch has a line of its own before its values.
const VERSION: i64 = 1;

/// Patches of a level.
#[derive(Debug)]
pub struct Level {
    pub patches: Vec<Patch>,
    /// Cells about each patch along each axis that are written with it.
    pub ghosts: [i64; 3],
    /// Variables.
    pub components: usize,
}

/// Cells of a patch, and where its values begin.
#[derive(Debug, Clone)]
pub struct Patch {
    pub cells: Cells,
    pub file: PathBuf,
    pub offset: u64,
}

impl Level {
    /// Reads the file at `prefix` with `_H` behind it.
    ///
    /// # Errors
    /// What is missing or no number; numbers of patches other than `expected`; another version.
    pub fn read(prefix: &Path, expected: usize, dimension: usize) -> Result<Self> {
        let mut name = prefix.as_os_str().to_owned();
        name.push("_H");
        let path = PathBuf::from(name);
        let text = Text::read(&path, NAME)?;
        let wrong = |what: &str, problem: String| FormatError::input(&path, NAME, what, problem);
        let mut lines = text.content().splitn(5, '\n');
        let mut line = || lines.next().unwrap_or_default().trim();
        let number = |what: &str, text: &str| {
            text.parse::<i64>().map_err(|_| wrong(what, format!("is '{text}', expected a whole number")))
        };
        let version = number("line 1", line())?;
        if version != VERSION {
            let what = format!(
                "version {version} of patches; write version {VERSION}, AMReX's default (vismf.headerversion = {VERSION})"
            );
            return Err(FormatError::Unsupported { path, format: NAME, what });
        }
        number("line 2", line())?;
        let components = number("line 3", line())?;
        let components = usize::try_from(components).ok().filter(|n| *n > 0);
        let components = components.ok_or_else(|| wrong("line 3", "expected the number of variables".into()))?;
        let ghosts = ghosts(&path, line(), dimension)?;
        let rest = line_rest(&mut lines);
        let mut scan = Scan::new(&path, rest);
        let count: usize = scan.number("the number of patches")?;
        if count != expected {
            let problem = format!("is {count}, but {expected} in the file Header");
            return Err(wrong("the number of patches", problem));
        }
        scan.word("the list of patches")?;
        let mut boxes = Vec::new();
        for k in 0..count {
            boxes.push(scan.cells(&format!("patch {k}"), dimension)?);
        }
        let places: usize = scan.number("the number of places")?;
        if places != count {
            return Err(wrong("the number of places", format!("is {places}, expected {count}, that of patches")));
        }
        let mut patches = Vec::new();
        for (k, cells) in boxes.into_iter().enumerate() {
            let what = format!("the place of patch {k}");
            scan.word(&what)?;
            let file = inside(&path, &path, Path::new(scan.word(&what)?))?;
            patches.push(Patch { cells, file, offset: scan.number(&what)? });
        }
        Ok(Self { patches, ghosts, components })
    }
}

fn line_rest<'a>(lines: &mut impl Iterator<Item = &'a str>) -> &'a str {
    lines.next().unwrap_or_default()
}

/// A number for all axes, or one for each.
fn ghosts(path: &Path, line: &str, dimension: usize) -> Result<[i64; 3]> {
    let mut scan = Scan::new(path, line);
    let first: u8 = scan.number("line 4")?;
    let mut all = [0; 3];
    for (k, slot) in all.iter_mut().enumerate().take(dimension) {
        *slot = if k == 0 || !line.contains(',') { first.into() } else { scan.number::<u8>("line 4")?.into() };
    }
    Ok(all)
}
