//! The particles of several ranks as one stream on the first rank. Data to be written is fetched row by row, so that no rank holds more than its
//! own part and a few blocks.

use crate::error::{Error, Result};
use sph::exchange::Exchange;
use sph_formats::common::particle_names as names;
use sph_formats::stream::{Part, TYPES};
use sph_formats::{Column, FormatError, ParticleFile, ParticleStream, ParticleTable, RunHeader, Values};
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

/// What came of a step on this rank, unless it failed on any: then all end, with the name of the first that failed. All ranks
/// call it together.
///
/// # Errors
/// The rank's own, or [`Error::Rank`].
pub(super) fn agreed<T>(exchange: &dyn Exchange, own: Result<T>) -> Result<T> {
    if exchange.is_alone() {
        return own;
    }
    let said = own.as_ref().err().map_or_else(String::new, |e| format!("{e} "));
    let all = exchange.all(&said.bytes().map(f64::from).collect::<Vec<_>>());
    let first = all.iter().enumerate().find(|(_, words)| !words.is_empty());
    match (own, first) {
        (own, None) => own,
        (Err(error), Some((rank, _))) if rank == exchange.rank() => Err(error),
        (_, Some((rank, words))) => {
            let bytes: Vec<u8> = words.iter().map(|w| *w as u8).collect();
            let problem = String::from_utf8_lossy(&bytes).trim_end().to_owned();
            Err(Error::Rank { rank, ranks: exchange.ranks(), problem })
        }
    }
}

/// Which of `count` particles of gas one of several ranks has.
pub(super) fn share_of(count: usize, rank: usize, ranks: usize) -> Range<usize> {
    let totals = sph::array(|t| if t == 0 { count } else { 0 });
    let Part { starts, counts, .. } = Part::new(totals, rank, ranks);
    starts[0]..starts[0] + counts[0]
}

/// The particles of all ranks, in the order of ranks; of gas alone.
pub(super) struct Gathered<'a> {
    exchange: &'a dyn Exchange,
    header: &'a RunHeader,
    own: &'a ParticleTable,
    /// Number of the first particle of each rank, and of all at the end.
    firsts: Vec<usize>,
    /// Rows are made by several threads; ranks are asked by one at a time.
    turn: Mutex<()>,
}

impl<'a> Gathered<'a> {
    /// `file` holds this rank's gas. All ranks call it together.
    ///
    /// # Errors
    /// Particles of other types.
    pub(super) fn new(exchange: &'a dyn Exchange, file: &'a ParticleFile) -> Result<Self> {
        let [gas] = file.species.as_slice() else {
            let problem =
                format!("has {} types of particles; over several ranks there is gas alone", file.species.len());
            return Err(Error::Numeric { stage: "write", problem });
        };
        let counts = exchange.all(&[gas.table.count as f64]);
        let mut firsts = vec![0];
        for count in counts.iter().flatten() {
            firsts.push(firsts.last().copied().unwrap_or(0) + *count as usize);
        }
        Ok(Self { exchange, header: &file.header, own: &gas.table, firsts, turn: Mutex::new(()) })
    }

    fn total(&self) -> usize {
        self.firsts.last().copied().unwrap_or(0)
    }

    /// Gives the first rank the rows that it asks for, until it has all.
    pub(super) fn serve(&self) {
        let nothing = || vec![Vec::new(); self.exchange.ranks()];
        loop {
            let asked = self.exchange.swap(nothing());
            let Some([start, end, columns @ ..]) = asked.first().map(Vec::as_slice) else { return };
            let mut to = nothing();
            to[0] = self.rows_here(*start as usize..*end as usize, columns);
            self.exchange.swap(to);
        }
    }

    /// Tells the other ranks that nothing more is asked for.
    pub(super) fn done(&self) {
        self.exchange.swap(vec![Vec::new(); self.exchange.ranks()]);
    }

    /// Values of some columns, one after the other, of those rows that are here.
    fn rows_here(&self, rows: Range<usize>, columns: &[f64]) -> Vec<f64> {
        let rank = self.exchange.rank();
        let (first, last) = (self.firsts[rank], self.firsts[rank + 1]);
        let here = rows.start.clamp(first, last) - first..rows.end.clamp(first, last) - first;
        let values = |column: &Column| {
            let flat = here.start * column.components..here.end * column.components;
            flat.map(|i| column.values.get(i)).collect::<Vec<f64>>()
        };
        columns.iter().filter_map(|c| self.own.columns.get(*c as usize)).flat_map(values).collect()
    }

    /// Columns of all ranks, by their places; none where another rank has ended.
    fn fetch(&self, rows: &Range<usize>, columns: &[f64]) -> Option<Vec<Vec<f64>>> {
        // A panic of another thread while it had its turn ends the run anyway.
        let _turn = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
        let request = [&[rows.start as f64, rows.end as f64], columns].concat();
        let swaps = || {
            self.exchange.swap(vec![request; self.exchange.ranks()]);
            let mut to = vec![Vec::new(); self.exchange.ranks()];
            to[0] = self.rows_here(rows.clone(), columns);
            self.exchange.swap(to)
        };
        // The writer's threads end by an error: one that unwinds would hide which rank it was.
        let parts = catch_unwind(AssertUnwindSafe(swaps)).ok()?;
        let components: Vec<usize> = columns.iter().map(|c| self.own.columns[*c as usize].components).collect();
        let width: usize = components.iter().sum::<usize>().max(1);
        let mut all = vec![Vec::new(); columns.len()];
        for part in &parts {
            let mut rest = part.as_slice();
            for (values, components) in all.iter_mut().zip(&components) {
                let (own, after) = rest.split_at(part.len() / width * components);
                values.extend_from_slice(own);
                rest = after;
            }
        }
        Some(all)
    }
}

impl ParticleStream for Gathered<'_> {
    fn header(&self) -> &RunHeader {
        self.header
    }

    fn counts(&self) -> [usize; TYPES] {
        sph::array(|t| if t == 0 { self.total() } else { 0 })
    }

    fn rows(
        &self,
        part_type: u8,
        rows: Range<usize>,
        wanted: &dyn Fn(&str) -> bool,
    ) -> std::result::Result<ParticleTable, FormatError> {
        if part_type != 0 {
            return Ok(ParticleTable::default());
        }
        let places = (0..self.own.columns.len()).filter(|&c| wanted(&self.own.columns[c].name)).collect::<Vec<_>>();
        let fetched: Vec<f64> =
            places.iter().filter(|&&c| self.own.columns[c].name != names::PARTICLE_IDS).map(|&c| c as f64).collect();
        let lost = || FormatError::Output {
            path: PathBuf::new(),
            format: "particles",
            problem: "a rank has ended that had some of them".into(),
        };
        let mut values = self.fetch(&rows, &fetched).ok_or_else(lost)?.into_iter();
        let columns = places.iter().map(|&c| {
            let column = &self.own.columns[c];
            let values = if column.name == names::PARTICLE_IDS {
                // By their places among all.
                Values::I64((rows.start as i64 + 1..=rows.end as i64).collect())
            } else {
                let own = values.next().unwrap_or_default();
                match column.values {
                    Values::F32(_) => Values::F32(own.iter().map(|v| *v as f32).collect()),
                    Values::F64(_) => Values::F64(own),
                    Values::I64(_) => Values::I64(own.iter().map(|v| *v as i64).collect()),
                }
            };
            Column { name: column.name.clone(), values, ..*column }
        });
        Ok(ParticleTable { count: rows.len(), columns: columns.collect() })
    }
}
