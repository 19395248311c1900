//! `hydro_00001.out00001`: values of the cells of a process's octs.

use super::info::Info;
use super::numbers::{count, real};
use super::octs::{Octs, Owned};
use super::schema::NAME;
use crate::common::fortran::Records;
use crate::error::Result;
use std::path::Path;

/// The number of variables in a file, and the adiabatic index.
///
/// # Errors
/// Those of its header's records.
pub fn variables(path: &Path, info: &Info) -> Result<(usize, f64)> {
    header(&mut Records::open(path, NAME)?, info, None)
}

fn header(records: &mut Records, info: &Info, boundaries: Option<usize>) -> Result<(usize, f64)> {
    let expect = |records: &mut Records, location: &str, expected: Option<usize>| {
        let found = count(records, location)?;
        match expected {
            Some(expected) if found != expected => {
                let problem = format!("is {found}, but {expected} in the other files; they are of different outputs");
                Err(records.error(location, problem))
            }
            _ => Ok(()),
        }
    };
    expect(records, "the number of files", Some(info.files))?;
    let variables = count(records, "the number of variables")?;
    expect(records, "the number of dimensions", Some(info.dimension))?;
    expect(records, "the number of levels", Some(info.levels))?;
    expect(records, "the number of boundaries", boundaries)?;
    let gamma = real(records, "the adiabatic index", 1)?;
    Ok((variables, gamma[0]))
}

/// What is read of each file.
pub struct Wanted<'a> {
    /// Variables of the file.
    pub count: usize,
    /// Numbers of those that are wanted.
    pub numbers: &'a [usize],
    /// Boundaries of the octs.
    pub boundaries: usize,
}

/// Appends the values of the octs that process `own` owns to those of `levels`, which has these octs already.
///
/// # Errors
/// [`crate::FormatError::Input`] where the file does not fit the octs or is truncated; [`crate::FormatError::Limit`],
/// [`crate::FormatError::Io`].
pub fn read(path: &Path, info: &Info, own: usize, octs: &Owned, wanted: &Wanted, levels: &mut [Octs]) -> Result<()> {
    let mut records = Records::open(path, NAME)?;
    let (variables, _) = header(&mut records, info, Some(wanted.boundaries))?;
    if variables != wanted.count {
        let problem = format!("is {variables}, but {} in the first file", wanted.count);
        return Err(records.error("the number of variables", problem));
    }
    for (level, row) in octs.counts.iter().enumerate() {
        for (owner, &octs) in row.iter().enumerate() {
            let location = format!("values of level {} of domain {}", level + 1, owner + 1);
            let stated = [count(&mut records, &location)?, count(&mut records, &location)?];
            if stated != [level + 1, octs] {
                let problem = format!(
                    "begin with level {} and {} octs, but the amr file of this number has {octs} there; they do not belong together",
                    stated[0], stated[1]
                );
                return Err(records.error(&location, problem));
            }
            if octs == 0 {
                continue;
            }
            let to = (owner + 1 == own).then_some(&mut levels[level]);
            cells(&mut records, &location, octs, 1 << info.dimension, wanted, to)?;
        }
    }
    Ok(())
}

/// The records of some octs: for each cell of an oct one for each variable.
fn cells(
    records: &mut Records,
    location: &str,
    octs: usize,
    per_oct: usize,
    wanted: &Wanted,
    mut to: Option<&mut Octs>,
) -> Result<()> {
    let begin = to.as_ref().map_or(0, |level| (level.first.len() - octs) * per_oct);
    for cell in 0..per_oct {
        for variable in 0..wanted.count {
            let place = wanted.numbers.iter().position(|n| *n == variable);
            let (Some(place), Some(level)) = (place, to.as_deref_mut()) else {
                records.skip(location, 8 * octs as u64)?;
                continue;
            };
            let values = real(records, location, octs)?;
            if level.values.len() < wanted.numbers.len() {
                level.values.resize_with(wanted.numbers.len(), Vec::new);
            }
            let all = &mut level.values[place];
            all.resize(begin + octs * per_oct, 0.0);
            all.iter_mut().skip(begin + cell).step_by(per_oct).zip(values).for_each(|(to, value)| *to = value);
        }
    }
    Ok(())
}
