//! `info_00001.txt`: parameters that all files of an output share.

use super::schema::{NAME, output_number};
use crate::common::text::Text;
use crate::error::{FormatError, Result};
use crate::units::UnitSystem;
use std::path::{Path, PathBuf};

/// Finest level whose cells can be told apart.
pub const MOST_LEVELS: usize = 41;

/// What the info file says.
#[derive(Debug)]
pub struct Info {
    path: PathBuf,
    /// Digits of the output's number.
    number: String,
    pub files: usize,
    pub dimension: usize,
    pub levels: usize,
    /// Width of a coarse cell in units of the code.
    pub coarse: f64,
    pub time: f64,
    /// `None` where all units are 1.
    pub units: Option<UnitSystem>,
}

impl Info {
    /// Reads the info file at `path`.
    ///
    /// # Errors
    /// [`FormatError::Input`] for what is missing, no number or cannot be, and for a file of another name;
    /// [`FormatError::Unsupported`] for more levels than can be told apart.
    pub fn read(path: &Path) -> Result<Self> {
        let text = Text::read(path, NAME)?;
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let Some(number) = output_number(&name) else {
            let problem =
                format!("its name is '{name}', expected info_NNNNN.txt: the other files are found by its number");
            return Err(text.error("name", problem));
        };
        let value = |key: &str| {
            let found = text.lines().find_map(|(line, content)| {
                let (own, value) = content.split_once('=')?;
                (own.trim() == key).then_some((line, value.trim()))
            });
            let (line, value) =
                found.ok_or_else(|| text.error(format!("key '{key}'"), "is missing; the file is truncated"))?;
            Ok((line, text.number(line, key, value)?))
        };
        let positive = |key: &str| match value(key)? {
            (_, x) if x.is_finite() && x > 0.0 => Ok(x),
            (line, x) => {
                Err(text.error(format!("line {line}, column '{key}'"), format!("is {x:e}, expected a positive number")))
            }
        };
        let whole = |key: &str, most: usize| match value(key)? {
            (_, x) if x.fract() == 0.0 && (1.0..=most as f64).contains(&x) => Ok(x as usize),
            (line, x) => Err(text.error(
                format!("line {line}, column '{key}'"),
                format!("is {x}, expected a whole number from 1 to {most}"),
            )),
        };
        let levels = whole("levelmax", i32::MAX as usize)?;
        if levels > MOST_LEVELS {
            let what = format!("levelmax {levels}; cells are told apart down to level {MOST_LEVELS}");
            return Err(FormatError::Unsupported { path: path.into(), format: NAME, what });
        }
        let [length, density, time] = [positive("unit_l")?, positive("unit_d")?, positive("unit_t")?];
        let system = UnitSystem { length, mass: density * length.powi(3), time, temperature: 1.0 };
        Ok(Self {
            number: number.to_owned(),
            files: whole("ncpu", i32::MAX as usize)?,
            dimension: whole("ndim", 3)?,
            levels,
            coarse: positive("boxlen")?,
            time: value("time")?.1,
            units: ([length, density, time] != [1.0; 3]).then_some(system),
            path: path.into(),
        })
    }

    /// The file of a kind that a process wrote; processes are counted from 1.
    ///
    /// # Errors
    /// [`FormatError::Input`] with its name where it is missing.
    pub fn file(&self, kind: &str, process: usize) -> Result<PathBuf> {
        let path = self.path.with_file_name(format!("{kind}_{}.out{process:05}", self.number));
        if path.is_file() {
            return Ok(path);
        }
        let problem = format!(
            "it is missing, but '{}' says that the output is in {} files of each kind; put all of them into one folder",
            self.path.display(),
            self.files
        );
        Err(FormatError::input(&path, NAME, format!("file {process} of {}", self.files), problem))
    }
}
