//! `amr_00001.out00001`: the octs of a process.

use super::info::Info;
use super::numbers::{count, real, whole};
use super::octs::{Octs, Owned};
use super::schema::NAME;
use crate::common::fortran::Records;
use crate::error::Result;
use std::path::Path;

/// Records between the size of the box and the numbers of octs.
const BEFORE_COUNTS: usize = 13;
/// Bytes of a header's record that is passed over, at most.
const MOST_BYTES: u64 = 1 << 32;
/// How far the middle of an oct may be off its place, in its own cells: numbers may have 4 bytes.
const OFF_PLACE: f64 = 0.01;

/// What the first file says of all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Coarse cells along each axis, with those of boundaries.
    pub coarse: [u64; 3],
    pub boundaries: usize,
}

/// Reads the octs that process `own` (from 1) owns into `levels`.
///
/// # Errors
/// [`crate::FormatError::Input`] where the file contradicts the info file, is truncated, or an oct lies where none can;
/// [`crate::FormatError::Limit`], [`crate::FormatError::Io`].
pub fn read(path: &Path, info: &Info, own: usize, levels: &mut [Octs]) -> Result<(Shape, Owned)> {
    let mut records = Records::open(path, NAME)?;
    let shape = header(&mut records, info)?;
    let counts = counts(&mut records, info, shape.boundaries)?;
    let ordering = records.record("the kind of domains", MOST_BYTES)?;
    let domains = if ordering.starts_with(b"bisection") { 5 } else { 1 };
    for _ in 0..domains + 3 {
        records.skip("domains and coarse cells", MOST_BYTES)?;
    }
    for (level, row) in counts.iter().enumerate() {
        for (owner, &octs) in row.iter().enumerate().filter(|(_, octs)| **octs > 0) {
            let location = format!("octs of level {} of domain {}", level + 1, owner + 1);
            if owner + 1 == own {
                take(&mut records, &location, (level + 1, octs, own), info, shape.coarse, &mut levels[level])?;
            } else {
                pass(&mut records, &location, octs, info.dimension)?;
            }
        }
    }
    Ok((shape, Owned { counts }))
}

/// The records up to the numbers of octs.
fn header(records: &mut Records, info: &Info) -> Result<Shape> {
    let expect = |records: &mut Records, location: &str, expected: usize| {
        let found = count(records, location)?;
        if found != expected {
            let problem = format!("is {found}, but {expected} in the info file; the files are of different outputs");
            return Err(records.error(location, problem));
        }
        Ok(())
    };
    expect(records, "the number of files", info.files)?;
    expect(records, "the number of dimensions", info.dimension)?;
    let coarse = whole(records, "the coarse grid", 3)?;
    let is_sensible = |k: usize| (1..=if k < info.dimension { 1 << 20 } else { 1 }).contains(&coarse[k]);
    if !(0..3).all(is_sensible) {
        let problem = format!("has {coarse:?} cells, expected some along each of {} axes", info.dimension);
        return Err(records.error("the coarse grid", problem));
    }
    expect(records, "the number of levels", info.levels)?;
    count(records, "the most octs")?;
    let boundaries = count(records, "the number of boundaries")?;
    count(records, "the number of octs")?;
    real(records, "the size of the box", 1)?;
    for _ in 0..BEFORE_COUNTS {
        records.skip("the header", MOST_BYTES)?;
    }
    Ok(Shape { coarse: std::array::from_fn(|k| coarse[k] as u64), boundaries })
}

/// Numbers of octs, by level and then by process and boundary.
fn counts(records: &mut Records, info: &Info, boundaries: usize) -> Result<Vec<Vec<usize>>> {
    let mut rows = vec![Vec::new(); info.levels];
    let mut take = |records: &mut Records, location: &str, columns: usize| {
        let all = whole(records, location, columns.saturating_mul(info.levels))?;
        for (row, numbers) in rows.iter_mut().zip(all.chunks(columns)) {
            for &n in numbers {
                let octs = usize::try_from(n);
                row.push(octs.map_err(|_| records.error(location, format!("one is {n}, expected none below 0")))?);
            }
        }
        Ok::<(), crate::FormatError>(())
    };
    take(records, "numbers of octs", info.files)?;
    records.skip("the header", MOST_BYTES)?;
    if boundaries > 0 {
        records.skip("the header", MOST_BYTES)?;
        records.skip("the header", MOST_BYTES)?;
        take(records, "numbers of octs at boundaries", boundaries)?;
    }
    records.skip("the header", MOST_BYTES)?;
    Ok(rows)
}

/// Passes over octs: indices, middles, neighbors, sons, owners and flags.
fn pass(records: &mut Records, location: &str, octs: usize, d: usize) -> Result<()> {
    let most = 8 * octs as u64;
    let count = 3 + d + 1 + 2 * d + 3 * (1 << d);
    (0..count).try_for_each(|_| records.skip(location, most))
}

/// Takes the middles of octs, and which of their cells are leaves.
fn take(
    records: &mut Records,
    location: &str,
    (level, octs, process): (usize, usize, usize),
    info: &Info,
    coarse: [u64; 3],
    all: &mut Octs,
) -> Result<()> {
    let d = info.dimension;
    let most = 8 * octs as u64;
    let begin = all.first.len();
    (0..3).try_for_each(|_| records.skip(location, most))?;
    // The first record is of that length, and so is the memory that is taken.
    let mut middles = Vec::new();
    for _ in 0..d {
        middles.push(real(records, location, octs)?);
    }
    all.first.resize(begin + octs, [0; 3]);
    all.process.resize(begin + octs, process as u32);
    all.leaves.resize(begin + octs, 0);
    let cells = 2.0_f64.powi(level as i32);
    for (k, middle) in middles.iter().enumerate() {
        for (first, &x) in all.first[begin..].iter_mut().zip(middle) {
            // An odd number of cells lies below the middle: two for each oct before, and one.
            let place = 0.5 * (x * cells - 1.0);
            let octs_along = coarse[k] as f64 * 0.5 * cells;
            if !((place - place.round()).abs() <= 0.5 * OFF_PLACE && (-0.25..octs_along - 0.5).contains(&place)) {
                let problem = format!(
                    "one has its middle at {x:e} along axis {} in coarse cells, expected one within {} of them, halfway between faces of its level",
                    k + 1,
                    coarse[k]
                );
                return Err(records.error(location, problem));
            }
            first[k] = place.round() as u64;
        }
    }
    (0..1 + 2 * d).try_for_each(|_| records.skip(location, most))?;
    for cell in 0..1_usize << d {
        let sons = whole(records, location, octs)?;
        for (leaves, son) in all.leaves[begin..].iter_mut().zip(sons) {
            *leaves |= u8::from(son == 0 || level == info.levels) << cell;
        }
    }
    (0..2 * (1 << d)).try_for_each(|_| records.skip(location, most))
}
