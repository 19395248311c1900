//! Particles that are generated while they are written, so that there may be more of them than fit in memory.

use crate::error::Result;
use crate::model::{Column, ParticleFile, ParticleTable, RunHeader, Species, Values};
use std::ops::Range;
use std::path::Path;

/// Particle types that are counted.
pub const TYPES: usize = 6;

/// Particles of known numbers whose rows can be made in any order, again and again.
pub trait ParticleStream: Sync {
    fn header(&self) -> &RunHeader;

    /// How many there are of each type.
    fn counts(&self) -> [usize; TYPES];

    /// Some rows of a type: at least the columns of which `wanted` is true, the same ones with the same components for
    /// every range.
    ///
    /// # Errors
    /// Rows that cannot be made.
    fn rows(&self, part_type: u8, rows: Range<usize>, wanted: &dyn Fn(&str) -> bool) -> Result<ParticleTable>;
}

impl ParticleStream for ParticleFile {
    fn header(&self) -> &RunHeader {
        &self.header
    }

    fn counts(&self) -> [usize; TYPES] {
        let of = |t: usize| self.species.iter().filter(|s| usize::from(s.part_type) == t).map(|s| s.table.count).sum();
        std::array::from_fn(of)
    }

    fn rows(&self, part_type: u8, rows: Range<usize>, wanted: &dyn Fn(&str) -> bool) -> Result<ParticleTable> {
        let columns = self.species.iter().filter(|s| s.part_type == part_type).flat_map(|s| &s.table.columns);
        let columns = columns.filter(|c| wanted(&c.name)).map(|c| slice(c, &rows)).collect();
        Ok(ParticleTable { count: rows.len(), columns })
    }
}

fn slice(column: &Column, rows: &Range<usize>) -> Column {
    let flat = rows.start * column.components..rows.end * column.components;
    let values = match &column.values {
        Values::F32(v) => Values::F32(v.get(flat).unwrap_or_default().to_vec()),
        Values::F64(v) => Values::F64(v.get(flat).unwrap_or_default().to_vec()),
        Values::I64(v) => Values::I64(v.get(flat).unwrap_or_default().to_vec()),
    };
    Column { name: column.name.clone(), values, ..*column }
}

/// Runs of particles of successive numbers that a sample is of.
const RUNS: usize = 32;

/// Numbers of about `most` of `count` particles, or of all: runs that are spread evenly.
pub fn runs(count: usize, most: usize) -> impl Iterator<Item = Range<usize>> {
    let (runs, each) = if count > most { (RUNS, most.div_ceil(RUNS)) } else { (1, count) };
    let start = move |run: usize| (count as u128 * run as u128 / runs as u128) as usize;
    (0..runs).map(move |run| start(run)..start(run) + each)
}

/// Some of the particles in memory, about `most` of each type at most, or all: runs that are spread evenly over their numbers.
///
/// # Errors
/// Those of the stream.
pub fn sampled(stream: &dyn ParticleStream, most: usize) -> Result<ParticleFile> {
    let mut species = Vec::new();
    for (t, count) in stream.counts().into_iter().enumerate().filter(|(_, count)| *count > 0) {
        let mut table = ParticleTable::default();
        for run in runs(count, most) {
            let more = stream.rows(t as u8, run, &|_| true)?;
            if table.count == 0 {
                table = more;
                continue;
            }
            table.columns.iter_mut().zip(&more.columns).for_each(|(column, more)| column.values.extend(&more.values));
            table.count += more.count;
        }
        species.push(Species { part_type: t as u8, table });
    }
    Ok(ParticleFile { header: stream.header().clone(), species })
}

/// Which part of the particles one file holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Number of this file, from 0, and of all files.
    pub index: usize,
    pub files: usize,
    /// Particles of each type in all files.
    pub totals: [usize; TYPES],
    /// The first particle of each type in this file, and how many there are.
    pub starts: [usize; TYPES],
    pub counts: [usize; TYPES],
}

impl Part {
    /// Part `index` of `files`, each with its share of every type.
    pub fn new(totals: [usize; TYPES], index: usize, files: usize) -> Self {
        let edge = |n: usize, k: usize| (n as u128 * k as u128 / files.max(1) as u128) as usize;
        let starts = totals.map(|n| edge(n, index));
        let counts = std::array::from_fn(|t| edge(totals[t], index + 1) - starts[t]);
        Self { index, files, totals, starts, counts }
    }

    /// Number that the first particle of a type in this file gets where particles have none: 1, 2, 3 ... through the types.
    pub fn first_id(&self, part_type: usize) -> u64 {
        1 + self.totals.iter().take(part_type).map(|&n| n as u64).sum::<u64>() + self.starts[part_type] as u64
    }

    /// The particles of this part in memory.
    ///
    /// # Errors
    /// Those of the stream.
    pub fn collect(&self, stream: &dyn ParticleStream) -> Result<ParticleFile> {
        let mut species = Vec::new();
        for (t, &count) in self.counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            let table = stream.rows(t as u8, self.starts[t]..self.starts[t] + count, &|_| true)?;
            species.push(Species { part_type: t as u8, table });
        }
        Ok(ParticleFile { header: stream.header().clone(), species })
    }
}

/// What one file of several is written from.
pub struct Piece<'a> {
    /// Where it goes until all are complete.
    pub path: &'a Path,
    pub part: Part,
    pub stream: &'a dyn ParticleStream,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_follow_each_other_and_make_up_the_whole() {
        let totals = [10, 0, 3, usize::MAX / 2, 0, 1];
        for files in [1, 2, 3, 7] {
            let mut next = [0; TYPES];
            for index in 0..files {
                let part = Part::new(totals, index, files);
                assert_eq!(part.starts, next);
                next = std::array::from_fn(|t| part.starts[t] + part.counts[t]);
            }
            assert_eq!(next, totals);
        }
        let part = Part::new([1 << 33, 0, 5, 0, 0, 0], 1, 2);
        assert_eq!((part.first_id(0), part.first_id(2)), ((1 << 32) + 1, (1 << 33) + 3));
    }
}
