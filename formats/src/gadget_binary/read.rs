//! Reads both formats, block by block.

use super::layout::{BLOCKS, Block, Cover, Header, is_cooling, offset, offset_of_4};
use super::records::{Head, Kind, Records};
use super::schema::{HEADER_BYTES_OF_4, NAME};
use crate::common::entropy;
use crate::common::flavor::TYPES;
use crate::common::parts;
use crate::error::{FormatError, Result};
use crate::family;
use crate::model::{Column, ParticleFile, ParticleTable, RunHeader, Species, Values};
use crate::particle_names as names;
use crate::registry::{FieldRequest, FileContent};
use crate::units::{UnitDimension, UnitSystem};
use std::path::Path;

/// Files of one snapshot, at most.
const MOST_FILES: u32 = 1_000_000;

pub(super) fn read(path: &Path, _request: &FieldRequest) -> Result<FileContent> {
    let first = read_header(&mut Records::open(path)?)?;
    let mut particles = match first.files {
        0 | 1 => read_one(path, &first)?,
        files => {
            let members = family::members_of(path, NAME, files as usize)?;
            let mut sums = [0_u64; TYPES];
            let whole = parts::joined(NAME, &members, |member| {
                let mut records = Records::open(member)?;
                let header = read_header(&mut records)?;
                if (header.files, header.totals) != (first.files, first.totals) {
                    let problem = format!(
                        "it counts {:?} particles in {} files, but '{}' {:?} in {files}; the files are of two snapshots",
                        header.totals,
                        header.files,
                        path.display(),
                        first.totals,
                    );
                    return Err(records.error("the header", problem));
                }
                sums.iter_mut().zip(header.counts).for_each(|(sum, n)| *sum += u64::from(n));
                read_one(member, &first)
            })?;
            if first.totals != [0; TYPES] && first.totals != sums {
                let problem =
                    format!("its files have {sums:?} particles together, but the total is {:?}", first.totals);
                return Err(FormatError::input(path, NAME, "the header", problem));
            }
            whole
        }
    };
    let dimension = used_axes(&particles.species);
    particles.species.iter_mut().for_each(|s| drop_axes(&mut s.table, dimension));
    let box_size: [f64; 3] = std::array::from_fn(|k| if k < dimension { first.box_size } else { 0.0 });
    particles.header.dimension = dimension;
    particles.header.box_size = box_size;
    particles.header.periodic = box_size.map(|l| l > 0.0);
    Ok(FileContent::Particles(particles))
}

/// The particles of one file, with three axes.
fn read_one(path: &Path, of_snapshot: &Header) -> Result<ParticleFile> {
    let mut records = Records::open(path)?;
    let header = read_header(&mut records)?;
    // Which blocks there are, all files of format 1 must agree about.
    let cooling = header.cooling || of_snapshot.cooling;
    let mut reading = Reading { header, tables: Default::default(), notes: Vec::new() };
    let order: Vec<&Block> = BLOCKS.iter().filter(|b| reading.exists(b) && (cooling || !is_cooling(b))).collect();
    let mut order = order.into_iter();
    while let Some(head) = records.next()? {
        let block = match head.label {
            Some(label) => BLOCKS.iter().find(|b| *b.label == label),
            None => order.next(),
        };
        match block {
            Some(block) => reading.block(&mut records, &head, block)?,
            None => {
                let name = head.label.map_or("without a name".to_owned(), |l| String::from_utf8_lossy(&l).into_owned());
                records.skip(&format!("block '{name}'"), &head)?;
                reading.notes.push(("not read".into(), format!("block '{name}': not one of those known")));
            }
        }
    }
    let mut particles = reading.finish(&records)?;
    if header.entropy {
        for gas in particles.species.iter_mut().filter(|s| s.part_type == 0) {
            let done = entropy::to_energies(path, NAME, &mut gas.table)?;
            particles.header.provenance.extend(done.map(|what| ("converted".to_owned(), what)));
        }
    }
    Ok(particles)
}

fn read_header(records: &mut Records<'_>) -> Result<Header> {
    let head = records.next()?.ok_or_else(|| records.error("the header", "the file is empty"))?;
    if head.label.is_some_and(|l| l != *b"HEAD") {
        return Err(records.error("the header", "the first block is not named HEAD"));
    }
    let bytes = records.header(&head)?;
    let word =
        |at: usize| -> u32 { bytes.get(at..).and_then(|b| b.first_chunk()).map_or(0, |b: &[u8; 4]| records.word(*b)) };
    let long = |at: usize| -> u64 {
        bytes.get(at..).and_then(|b| b.first_chunk()).map_or(0, |b: &[u8; 8]| records.long_word(*b))
    };
    let number = |at: usize| f64::from_bits(long(at));
    let header = if bytes.len() == HEADER_BYTES_OF_4 as usize {
        let counts: [u64; TYPES] = std::array::from_fn(|t| long(offset_of_4::COUNTS + 8 * t));
        if let Some(most) = counts.iter().find(|n| u32::try_from(**n).is_err()) {
            let problem = format!("it counts {most} particles of a type in this file, expected at most 2^32 - 1");
            return Err(records.error("the header", problem));
        }
        Header {
            counts: counts.map(|n| n as u32),
            totals: std::array::from_fn(|t| long(offset_of_4::TOTALS + 8 * t)),
            masses: std::array::from_fn(|t| number(offset_of_4::MASSES + 8 * t)),
            time: number(offset_of_4::TIME),
            redshift: number(offset_of_4::REDSHIFT),
            box_size: number(offset_of_4::BOX_SIZE),
            files: word(offset_of_4::FILES),
            ..Header::default()
        }
    } else {
        let total = |t: usize| {
            let (low, high) = (word(offset::TOTALS + 4 * t), word(offset::TOTAL_HIGH_WORDS + 4 * t));
            u64::from(low) | u64::from(high) << 32
        };
        Header {
            counts: std::array::from_fn(|t| word(offset::COUNTS + 4 * t)),
            totals: std::array::from_fn(total),
            masses: std::array::from_fn(|t| number(offset::MASSES + 8 * t)),
            time: number(offset::TIME),
            redshift: number(offset::REDSHIFT),
            matter: number(offset::MATTER),
            hubble: number(offset::HUBBLE),
            box_size: number(offset::BOX_SIZE),
            files: word(offset::FILES),
            cooling: word(offset::FLAG_COOLING) != 0,
            entropy: word(offset::FLAG_ENTROPY) != 0,
        }
    };
    if header.files > MOST_FILES {
        let problem = format!("it says that there are {} files, expected at most {MOST_FILES}", header.files);
        return Err(records.error("the header", problem));
    }
    // Some programs leave the totals at 0, others the high words undefined.
    let low = header.totals.map(|n| n as u32);
    if header.files <= 1 && low != [0; TYPES] && low != header.counts {
        let problem = format!(
            "it counts {:?} particles in this file and {low:?} in all, but says that there is one file",
            header.counts
        );
        return Err(records.error("the header", problem));
    }
    if !header.time.is_finite() {
        return Err(records.error("the header", format!("Time is {}, expected a number", header.time)));
    }
    if let Some(m) = header.masses.iter().find(|m| !(m.is_finite() && **m >= 0.0)) {
        return Err(records.error("the header", format!("its table of masses has {m}, expected masses")));
    }
    if !(header.box_size.is_finite() && header.box_size >= 0.0) {
        return Err(records.error("the header", format!("BoxSize is {}, expected a length", header.box_size)));
    }
    Ok(header)
}

struct Reading {
    header: Header,
    tables: [Vec<Column>; TYPES],
    notes: Vec<(String, String)>,
}

impl Reading {
    fn covers(&self, block: &Block, part_type: usize) -> bool {
        let h = &self.header;
        let some = h.counts.get(part_type).is_some_and(|&n| n > 0);
        some && match block.cover {
            Cover::All => true,
            Cover::Gas => part_type == 0,
            Cover::OwnMass => h.masses.get(part_type) == Some(&0.0),
        }
    }

    fn exists(&self, block: &Block) -> bool {
        (0..TYPES).any(|t| self.covers(block, t))
    }

    fn block(&mut self, records: &mut Records<'_>, head: &Head, block: &Block) -> Result<()> {
        let location = format!("block '{}'", String::from_utf8_lossy(block.label).trim_end());
        let covered: Vec<usize> = (0..TYPES).filter(|&t| self.covers(block, t)).collect();
        let count_of = |t: usize| self.header.counts.get(t).map_or(0, |&n| u64::from(n));
        let count = covered.iter().map(|&t| count_of(t)).sum::<u64>() * block.components as u64;
        let kinds = if block.integers { [Kind::Word, Kind::LongWord] } else { [Kind::Float, Kind::Double] };
        // The marker holds the length modulo 2^32.
        let Some(kind) = kinds.into_iter().find(|k| (count * k.width()) as u32 == head.marker) else {
            let problem = format!(
                "it has {} bytes, expected {count} values of 4 or 8 bytes by the header's numbers of particles",
                head.marker
            );
            return Err(records.error(&location, problem));
        };
        if self.tables.iter().flatten().any(|c| c.name == block.column) {
            return Err(records.error(&location, "it comes twice"));
        }
        let mut values = records.numbers(&location, head, kind, count)?;
        let (name, dimension) = (block.column, meaning(block));
        for t in covered {
            let own = self.header.counts.get(t).map_or(0, |&n| n as usize) * block.components;
            let rest = split_off(&mut values, own);
            if let Some(table) = self.tables.get_mut(t) {
                table.push(Column { name: name.into(), components: block.components, values, dimension });
            }
            values = rest;
        }
        Ok(())
    }

    fn finish(mut self, records: &Records<'_>) -> Result<ParticleFile> {
        let mut species = Vec::new();
        let header = self.header;
        let tables = std::mem::take(&mut self.tables);
        for (t, mut columns) in tables.into_iter().enumerate() {
            let count = header.counts.get(t).map_or(0, |&n| n as usize);
            if count == 0 {
                continue;
            }
            if !columns.iter().any(|c| c.name == names::COORDINATES) {
                return Err(records.error(
                    "block 'POS'",
                    format!("it is missing, but the header counts {count} particles of type {t}"),
                ));
            }
            let mass = header.masses.get(t).copied().unwrap_or(0.0);
            if mass > 0.0 {
                let values = Values::F64(vec![mass; count]);
                columns.push(Column {
                    name: names::MASSES.into(),
                    components: 1,
                    values,
                    dimension: UnitDimension::MASS,
                });
            } else if !columns.iter().any(|c| c.name == names::MASSES) {
                return Err(
                    records.error("block 'MASS'", format!("it is missing, but the header has no mass for type {t}"))
                );
            }
            species.push(Species { part_type: t as u8, table: ParticleTable { count, columns } });
        }
        Ok(ParticleFile {
            header: RunHeader {
                dimension: 3,
                box_size: [header.box_size; 3],
                box_corner: None,
                periodic: [header.box_size > 0.0; 3],
                units: UnitSystem::CODE,
                time: header.time,
                kernel: String::new(),
                kernel_neighbors: 0.0,
                provenance: self.notes.into_iter().chain(header.cosmology()).collect(),
                layouts: Vec::new(),
            },
            species,
        })
    }
}

fn meaning(block: &Block) -> UnitDimension {
    match block.column {
        names::COORDINATES | names::SUPPORT_RADIUS => UnitDimension::LENGTH,
        names::VELOCITIES => UnitDimension::VELOCITY,
        names::MASSES => UnitDimension::MASS,
        names::DENSITY => UnitDimension::mass_density(3),
        names::INTERNAL_ENERGY => UnitDimension::SPECIFIC_ENERGY,
        _ => UnitDimension::NONE,
    }
}

/// Splits off what follows the first `count` values.
fn split_off(values: &mut Values, count: usize) -> Values {
    match values {
        Values::F32(v) => Values::F32(v.split_off(count.min(v.len()))),
        Values::F64(v) => Values::F64(v.split_off(count.min(v.len()))),
        Values::I64(v) => Values::I64(v.split_off(count.min(v.len()))),
    }
}

/// How many leading axes the particles use: 3, unless all are at 0 and at rest on the last ones.
fn used_axes(species: &[Species]) -> usize {
    let vectors = || {
        let columns = species.iter().flat_map(|s| &s.table.columns);
        columns.filter(|c| c.components == 3)
    };
    let still = |axis: usize| vectors().all(|c| (axis..c.values.len()).step_by(3).all(|i| c.values.get(i) == 0.0));
    if species.is_empty() || !still(2) {
        3
    } else if still(1) {
        1
    } else {
        2
    }
}

fn drop_axes(table: &mut ParticleTable, dimension: usize) {
    if dimension == 3 {
        return;
    }
    for column in &mut table.columns {
        if column.components == 3 {
            let kept = (0..column.values.len()).filter(|i| i % 3 < dimension);
            column.values = match &column.values {
                Values::F32(v) => Values::F32(kept.filter_map(|i| v.get(i).copied()).collect()),
                Values::F64(v) => Values::F64(kept.filter_map(|i| v.get(i).copied()).collect()),
                Values::I64(v) => Values::I64(kept.filter_map(|i| v.get(i).copied()).collect()),
            };
            column.components = dimension;
        }
        if column.name == names::DENSITY {
            column.dimension = UnitDimension::mass_density(dimension);
        }
    }
}
