//! Writes both formats, little-endian.

use super::layout::{FLAVOR, offset};
use super::schema::{HEADER_BYTES, NAME_BYTES};
use crate::common::flavor::{Flavor, Job, Planned, Storage, TYPES};
use crate::error::{FormatError, Result};
use crate::model::{ParticleFile, Species, Values};
use crate::particle_names as names;
use crate::registry::WriteOptions;
use crate::stream::{Part, ParticleStream, Piece};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Particles converted at a time.
const ROWS: usize = 1 << 14;

pub(super) fn format_1(path: &Path, particles: &ParticleFile, options: WriteOptions) -> Result<()> {
    let part = Part::new(particles.counts(), 0, 1);
    write(&Flavor { format: "gadget-binary-1", ..FLAVOR }, false, (path, particles), options, (&part, false))
}

pub(super) fn format_2(path: &Path, particles: &ParticleFile, options: WriteOptions) -> Result<()> {
    let part = Part::new(particles.counts(), 0, 1);
    write(&FLAVOR, true, (path, particles), options, (&part, false))
}

pub(super) fn piece_of_format_1(piece: &Piece<'_>, options: WriteOptions) -> Result<()> {
    write_piece(&Flavor { format: "gadget-binary-1", ..FLAVOR }, false, piece, options)
}

pub(super) fn piece_of_format_2(piece: &Piece<'_>, options: WriteOptions) -> Result<()> {
    write_piece(&FLAVOR, true, piece, options)
}

fn write_piece(flavor: &Flavor, named: bool, piece: &Piece<'_>, options: WriteOptions) -> Result<()> {
    let particles = piece.part.collect(piece.stream)?;
    let long_ids = piece.part.files > 1 && has_long_ids_anywhere(piece)?;
    write(flavor, named, (piece.path, &particles), options, (&piece.part, long_ids))
}

/// Whether a number of any file of the snapshot takes 64 bits.
fn has_long_ids_anywhere(piece: &Piece<'_>) -> Result<bool> {
    let totals = piece.part.totals;
    if totals.iter().sum::<usize>() > i32::MAX as usize {
        return Ok(true);
    }
    for (t, &total) in totals.iter().enumerate() {
        for start in (0..total).step_by(ROWS) {
            let table =
                piece.stream.rows(t as u8, start..total.min(start + ROWS), &|name| name == names::PARTICLE_IDS)?;
            if has_long_ids(&Species { part_type: t as u8, table }) {
                return Ok(true);
            }
        }
    }
    Ok(false)
}

fn write(
    flavor: &Flavor,
    named: bool,
    (path, particles): (&Path, &ParticleFile),
    options: WriteOptions,
    (part, long_ids): (&Part, bool),
) -> Result<()> {
    let mut sorted: Vec<&Species> = particles.species.iter().filter(|s| s.table.count > 0).collect();
    sorted.sort_by_key(|s| s.part_type);
    let job = Job { flavor, path, header: &particles.header, options, first_row: 0 };
    let plan = job.plan(particles)?;
    let box_size = job.box_size()?;
    let planned = |s: &Species, name: &str| {
        let found = particles.species.iter().zip(&plan).find(|(p, _)| p.part_type == s.part_type);
        found.and_then(|(_, datasets)| datasets.iter().find(|d| d.name == name))
    };
    let file = File::create(path).map_err(|e| FormatError::io(path, "create", e))?;
    let mut out =
        Out { job: &job, file: BufWriter::new(file), named, double: options.double_precision, part, long_ids };
    out.header(&sorted, box_size.first().copied().unwrap_or(0.0))?;
    for rule in flavor.rules {
        let parts: Vec<_> = sorted.iter().filter_map(|s| Some((*s, planned(s, rule.name)?))).collect();
        let gas_only = matches!(rule.name, "U   " | "RHO " | "HSML");
        let parts: Vec<_> = parts.into_iter().filter(|(s, _)| !gas_only || s.part_type == 0).collect();
        // In format 1 a block is known by those before it.
        let known = rule.name != "HSML" || named || parts.iter().all(|(s, _)| planned(s, "RHO ").is_some());
        if !parts.is_empty() && known {
            out.block(rule.name, &parts)?;
        }
    }
    out.file.flush().map_err(|e| FormatError::io(path, "write", e))
}

struct Out<'a> {
    job: &'a Job<'a>,
    file: BufWriter<File>,
    named: bool,
    double: bool,
    part: &'a Part,
    /// Whether numbers take 64 bits in this or another file of the snapshot, all of which have one width.
    long_ids: bool,
}

impl Out<'_> {
    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.file.write_all(bytes).map_err(|e| FormatError::io(self.job.path, "write", e))
    }

    fn word(&mut self, word: u32) -> Result<()> {
        self.put(&word.to_le_bytes())
    }

    /// The name record of a block, in format 2, and the block's length.
    fn open(&mut self, label: &str, length: u32) -> Result<()> {
        if self.named {
            self.word(NAME_BYTES)?;
            self.put(label.as_bytes())?;
            self.word(length.saturating_add(8))?;
            self.word(NAME_BYTES)?;
        }
        self.word(length)
    }

    fn header(&mut self, species: &[&Species], box_size: f64) -> Result<()> {
        let mut bytes = [0; HEADER_BYTES as usize];
        let mut put = |at: usize, value: &[u8]| {
            if let Some(room) = bytes.get_mut(at..at + value.len()) {
                room.copy_from_slice(value);
            }
        };
        for s in species {
            let count = u32::try_from(s.table.count).ok().filter(|&n| i32::try_from(n).is_ok()).ok_or_else(|| {
                self.job.refuse(format!(
                    "{} particles are more than one file holds (2^31); write more files, or gadget (HDF5)",
                    s.table.count
                ))
            })?;
            let at = 4 * usize::from(s.part_type).min(TYPES - 1);
            put(offset::COUNTS + at, &count.to_le_bytes());
        }
        for (t, &total) in self.part.totals.iter().enumerate() {
            put(offset::TOTALS + 4 * t, &(total as u32).to_le_bytes());
            put(offset::TOTAL_HIGH_WORDS + 4 * t, &((total as u64 >> 32) as u32).to_le_bytes());
        }
        put(offset::TIME, &self.job.header.time.to_le_bytes());
        put(offset::FILES, &u32::try_from(self.part.files).unwrap_or(u32::MAX).to_le_bytes());
        put(offset::BOX_SIZE, &box_size.to_le_bytes());
        put(offset::FLAG_DOUBLE, &u32::from(self.double).to_le_bytes());
        self.open("HEAD", HEADER_BYTES)?;
        self.put(&bytes)?;
        self.word(HEADER_BYTES)
    }

    fn block(&mut self, label: &str, parts: &[(&Species, &Planned<'_>)]) -> Result<()> {
        let long_ids = self.long_ids || parts.iter().any(|(s, _)| has_long_ids(s));
        let width = |p: &Planned<'_>| match p.storage {
            Storage::Id => 4 + 4 * u64::from(long_ids),
            _ => 4 + 4 * u64::from(self.double),
        };
        let length: u64 = parts.iter().map(|(s, p)| (s.table.count * p.components) as u64 * width(p)).sum();
        // Codes hold the length in an int.
        let length = u32::try_from(length).ok().filter(|&n| i32::try_from(n).is_ok()).ok_or_else(|| {
            self.job.refuse(format!(
                "block {} needs {length} bytes, more than a record holds (2^31); write more files, or gadget (HDF5)",
                label.trim_end()
            ))
        })?;
        self.open(label, length)?;
        for (species, planned) in parts {
            let first_id = self.first_id(species);
            for start in (0..species.table.count).step_by(ROWS) {
                let rows = start..(start + ROWS).min(species.table.count);
                self.rows(planned, rows, first_id, long_ids)?;
            }
        }
        self.word(length)
    }

    /// The number that the first particle of a species gets where there are none.
    fn first_id(&self, species: &Species) -> u64 {
        self.part.first_id(usize::from(species.part_type).min(TYPES - 1))
    }

    fn rows(
        &mut self,
        planned: &Planned<'_>,
        rows: std::ops::Range<usize>,
        first_id: u64,
        long_ids: bool,
    ) -> Result<()> {
        let bytes: Vec<u8> = match planned.storage {
            Storage::Id => {
                let mut ids = Vec::new();
                self.job.ids(planned, rows, first_id, &mut ids)?;
                match long_ids {
                    true => ids.into_iter().flat_map(u64::to_le_bytes).collect(),
                    false => ids.into_iter().flat_map(|id| (id as u32).to_le_bytes()).collect(),
                }
            }
            _ if self.double => {
                let mut numbers = Vec::new();
                self.job.doubles(planned, rows, &mut numbers)?;
                numbers.into_iter().flat_map(f64::to_le_bytes).collect()
            }
            _ => {
                let mut numbers = Vec::new();
                self.job.singles(planned, rows, &mut numbers)?;
                numbers.into_iter().flat_map(f32::to_le_bytes).collect()
            }
        };
        self.put(&bytes)
    }
}

/// Whether numbers need 64 bits; codes built for 32 take only those files whose numbers fit.
fn has_long_ids(species: &Species) -> bool {
    let limit = f64::from(i32::MAX);
    species.table.column(names::PARTICLE_IDS).is_some_and(|c| match &c.values {
        Values::I64(v) => v.iter().any(|&id| id > i64::from(i32::MAX)),
        values => (0..values.len()).any(|i| values.get(i) > limit),
    })
}
