//! `Header`: names, levels and boxes.

use super::scan::{Cells, Scan};
use super::schema::NAME;
use crate::error::{FormatError, Result};
use std::path::{Component, Path, PathBuf};

/// Levels that are read at most; no grid of so many can be counted.
const MOST_LEVELS: usize = 42;
/// Longest list of names.
const MOST_NAMES: usize = 1 << 20;

/// What `Header` says.
#[derive(Debug)]
pub struct Header {
    pub names: Vec<String>,
    pub dimension: usize,
    pub time: f64,
    /// Both ends of the box along each axis.
    pub ends: [[f64; 2]; 3],
    /// How many cells of each level fill one of level 0 along an axis.
    pub ratios: Vec<u64>,
    /// The box of each level, in its cells.
    pub domains: Vec<Cells>,
    /// Patches of each level, and the path of its data without the ends `_H` and `_D_00000`.
    pub levels: Vec<(usize, PathBuf)>,
}

impl Header {
    /// Parses the text of the `Header` at `path`.
    ///
    /// # Errors
    /// What is missing, no number or cannot be; coordinates other than Cartesian ones.
    pub fn parse(path: &Path, text: &str) -> Result<Self> {
        let wrong = |what: &str, problem: String| FormatError::input(path, NAME, what, problem);
        let mut lines = text.splitn(3, '\n');
        let (_, count) = (lines.next(), lines.next().unwrap_or_default().trim());
        let count: usize = count
            .parse()
            .ok()
            .filter(|n| (1..=MOST_NAMES).contains(n))
            .ok_or_else(|| wrong("line 2", format!("is '{count}', expected the number of variables")))?;
        let mut rest = lines.next().unwrap_or_default();
        let mut names = Vec::new();
        for k in 0..count {
            let Some((name, behind)) = rest.split_once('\n') else {
                return Err(wrong("names", format!("the file ends after {k} of {count} names of variables")));
            };
            names.push(name.trim().to_owned());
            rest = behind;
        }
        let mut scan = Scan::new(path, rest);
        let dimension: usize = scan.number("the number of dimensions")?;
        if !(1..=3).contains(&dimension) {
            return Err(wrong("the number of dimensions", format!("is {dimension}, expected 1 to 3")));
        }
        let time = scan.number("the time")?;
        let finest: usize = scan.number("the finest level")?;
        if finest >= MOST_LEVELS {
            return Err(wrong("the finest level", format!("is {finest}, expected less than {MOST_LEVELS}")));
        }
        let lo = scan.axes("the lower end of the box", dimension, 0.0)?;
        let hi = scan.axes("the upper end of the box", dimension, 1.0)?;
        let mut ratios = vec![1_u64];
        for _ in 0..finest {
            let by: u64 = scan.number("a ratio of refinement")?;
            let all = ratios.last().and_then(|r| r.checked_mul(by));
            match all.filter(|_| by > 1) {
                Some(all) => ratios.push(all),
                None => return Err(wrong("a ratio of refinement", format!("is {by}, expected 2 or 4"))),
            }
        }
        let domains: Vec<Cells> =
            (0..=finest).map(|_| scan.cells("the box of a level", dimension)).collect::<Result<_>>()?;
        for (level, (domain, ratio)) in domains.iter().zip(&ratios).enumerate() {
            let expected: [Option<u64>; 3] =
                std::array::from_fn(
                    |k| {
                        if k < dimension { domains[0].sizes()[k].checked_mul(*ratio) } else { Some(1) }
                    },
                );
            if domain.sizes().map(Some) != expected {
                let problem = format!(
                    "has {:?} cells, expected {ratio} times those of level 0, {:?}",
                    domain.sizes(),
                    domains[0].sizes()
                );
                return Err(wrong(&format!("the box of level {level}"), problem));
            }
        }
        (0..=finest).try_for_each(|_| scan.word("a number of steps").map(drop))?;
        (0..(finest + 1) * dimension).try_for_each(|_| scan.number::<f64>("the width of cells").map(drop))?;
        let coordinates: i64 = scan.number("the kind of coordinates")?;
        if coordinates != 0 {
            let kind = match coordinates {
                1 => "cylindrical coordinates (R and z)",
                2 => "spherical coordinates",
                _ => "unknown coordinates",
            };
            let what = format!("{kind}, kind {coordinates}; Cartesian ones (0) are read: resample this one");
            return Err(FormatError::Unsupported { path: path.into(), format: NAME, what });
        }
        scan.word("the width of the boundary")?;
        let levels = (0..=finest).map(|level| level_of(&mut scan, path, level, dimension)).collect::<Result<_>>()?;
        let ends = std::array::from_fn(|k| [lo[k], hi[k]]);
        Ok(Self { names, dimension, time, ends, ratios, domains, levels })
    }
}

/// The number of patches of a level and the path of its data; the corners of patches between them stand in `Cell_H` as well.
fn level_of(scan: &mut Scan, path: &Path, level: usize, dimension: usize) -> Result<(usize, PathBuf)> {
    let what = format!("level {level}");
    let own: usize = scan.number(&what)?;
    let patches: usize = scan.number(&what)?;
    if own != level || patches == 0 {
        let problem =
            format!("begins with level {own} and {patches} patches, expected its own number and some patches");
        return Err(FormatError::input(path, NAME, what, problem));
    }
    // Its time and steps.
    scan.number::<f64>(&what)?;
    scan.word(&what)?;
    for _ in 0..patches {
        for _ in 0..2 * dimension {
            scan.number::<f64>(&what)?;
        }
    }
    let data = Path::new(scan.word(&what)?);
    Ok((patches, inside(path, path, data)?))
}

/// The path of a file that `by`, beside which it is, names.
///
/// # Errors
/// A path that leads out of the folder.
pub fn inside(path: &Path, by: &Path, name: &Path) -> Result<PathBuf> {
    if name.components().all(|part| matches!(part, Component::Normal(_))) {
        return Ok(by.with_file_name("").join(name));
    }
    let problem = format!("names '{}', expected a file within the folder", name.display());
    Err(FormatError::input(path, NAME, "path of data", problem))
}
