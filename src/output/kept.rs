//! A snapshot in which some particles are replaced by others, while everything else is kept.
//!
//! The new particles have the mass, the momentum, the center of mass (along axes that are not periodic), the angular momentum and the
//! energy of those that they replace.

use super::conservation::{Conserved, conserve};
use crate::error::{Error, Result};
use crate::input::totals::{MassPoints, Totals};
use sph_formats::common::particle_names as names;
use sph_formats::{Column, ParticleFile, ParticleTable, Species, Values};

/// What becomes of the gas of a snapshot.
pub(crate) struct Replacement<'a> {
    pub file: &'a ParticleFile,
    /// Rows that stay, in their order.
    pub kept: &'a [usize],
    /// The row in whose place each new particle is.
    pub parents: &'a [usize],
    /// Of the new particles in the file's units, interleaved.
    pub positions: Vec<f64>,
    pub masses: Vec<f64>,
    /// What interpolates to the places of the new particles.
    pub carried: Vec<Column>,
    /// Sums over all particles, the kept ones first: columns by their names.
    pub sums: &'a ParticleTable,
    /// Whether numbers of 4 bytes become such of 8.
    pub double: bool,
}

impl Replacement<'_> {
    /// The file, and what keeping totals has changed of the new particles.
    ///
    /// # Errors
    /// Identifiers that go beyond 64 bits.
    pub fn file(&self) -> Result<(ParticleFile, Option<Conserved>)> {
        let gas = self.file.species.iter().position(|s| s.part_type == 0 && s.table.count > 0).unwrap_or(0);
        let old = &self.file.species[gas].table;
        let first = self.first_identifier()?;
        let mut new: Vec<Column> = old.columns.iter().map(|c| self.of_new(c, first)).collect();
        let conserved = self.conserve(old, &mut new);
        let columns = old.columns.iter().zip(&new).map(|(old, new)| self.joined(old, new)).collect();
        let count = self.kept.len() + self.parents.len();
        let mut species: Vec<Species> = self.file.species.clone();
        species[gas].table = ParticleTable { count, columns };
        Ok((ParticleFile { header: self.file.header.clone(), species }, conserved))
    }

    /// The first number that no particle of any kind has.
    fn first_identifier(&self) -> Result<i64> {
        let columns = self.file.species.iter().filter_map(|s| s.table.column(names::PARTICLE_IDS));
        let largest = columns.filter_map(|c| match &c.values {
            Values::I64(ids) => ids.iter().copied().max(),
            values => Some(values.range().1 as i64),
        });
        let largest = largest.max().unwrap_or(0);
        match largest.checked_add(self.parents.len() as i64).and_then(|last| last.checked_add(1)) {
            Some(_) => Ok(largest + 1),
            None => {
                let problem =
                    format!("go up to {largest}, so that 64 bits have no others for new particles; number them anew");
                Err(Error::field(names::PARTICLE_IDS, problem))
            }
        }
    }

    /// A column of the new particles.
    fn of_new(&self, old: &Column, first: i64) -> Column {
        let (n, width) = (self.parents.len(), old.components);
        let sums = |column: &Column| (self.kept.len()..self.kept.len() + n).map(|i| column.values.get(i)).collect();
        let values = match (old.name.as_str(), &old.values) {
            (names::PARTICLE_IDS, _) => Values::I64((first..first + n as i64).collect()),
            (names::COORDINATES, _) => Values::F64(self.positions.clone()),
            (names::MASSES, _) => Values::F64(self.masses.clone()),
            (_, Values::I64(all)) if self.carried(old).is_none() => {
                Values::I64(self.parents.iter().flat_map(|&i| all[i * width..(i + 1) * width].to_vec()).collect())
            }
            (name @ (names::DENSITY | names::SUPPORT_RADIUS), _) => match self.sums.column(name) {
                Some(column) => Values::F64(sums(column)),
                None => Values::F64(vec![0.0; n]),
            },
            _ => {
                let carried = self.carried(old);
                let value = |i: usize, c: usize| match carried {
                    Some(found) => found.values.get(i * found.components + c),
                    None => old.values.get(self.parents[i] * width + c),
                };
                Values::F64((0..n).flat_map(|i| (0..width).map(move |c| value(i, c))).collect())
            }
        };
        Column { values, ..Column::new(&old.name, width, Values::F64(Vec::new()), old.dimension) }
    }

    fn carried(&self, old: &Column) -> Option<&Column> {
        self.carried.iter().find(|c| c.name == old.name && c.components == old.components)
    }

    /// Gives the new particles the totals of those that they replace.
    fn conserve(&self, old: &ParticleTable, new: &mut [Column]) -> Option<Conserved> {
        let d = self.file.header.dimension;
        let mut stays = vec![false; old.count];
        self.kept.iter().for_each(|&i| stays[i] = true);
        let replaced: Vec<usize> = (0..old.count).filter(|i| !stays[*i]).collect();
        let rows = |name: &str, width: usize| {
            let column = old.column(name).filter(|c| c.components == width)?;
            Some(
                replaced
                    .iter()
                    .flat_map(|&i| (0..width).map(move |c| column.values.get(i * width + c)))
                    .collect::<Vec<f64>>(),
            )
        };
        let (places, masses) = (rows(names::COORDINATES, d)?, rows(names::MASSES, 1)?);
        let mean = |u: Vec<f64>| u.iter().zip(&masses).map(|(u, m)| u * m).sum::<f64>() / masses.iter().sum::<f64>();
        let points =
            |positions, masses| MassPoints { positions, masses, dimension: d, periodic: self.file.header.periodic };
        let motion = rows(names::VELOCITIES, d).map(|v| points(&places, &masses).sums(&v));
        let totals = Totals { motion, thermal: rows(names::INTERNAL_ENERGY, 1).map(mean), are_pure: false };
        if replaced.is_empty() { None } else { conserve(new, &points(&self.positions, &self.masses), &totals) }
    }

    /// Kept rows as they are, then the new ones.
    fn joined(&self, old: &Column, new: &Column) -> Column {
        let width = old.components;
        let rows = || self.kept.iter().flat_map(move |&i| i * width..(i + 1) * width);
        let values = match (&old.values, &new.values) {
            (Values::I64(all), Values::I64(more)) => {
                Values::I64(rows().map(|j| all[j]).chain(more.iter().copied()).collect())
            }
            (Values::I64(all), more) => {
                let more = (0..more.len()).map(|j| more.get(j).round() as i64);
                Values::I64(rows().map(|j| all[j]).chain(more).collect())
            }
            (Values::F32(all), more) if !self.double => {
                Values::F32(rows().map(|j| all[j]).chain((0..more.len()).map(|j| more.get(j) as f32)).collect())
            }
            (all, more) => {
                Values::F64(rows().map(|j| all.get(j)).chain((0..more.len()).map(|j| more.get(j))).collect())
            }
        };
        Column { name: old.name.clone(), components: width, values, dimension: old.dimension }
    }
}

/// Whether numbers of a file are of 8 bytes, so that fewer would not hold them.
pub(crate) fn is_double(file: &ParticleFile) -> bool {
    let columns = file.species.iter().flat_map(|s| &s.table.columns);
    columns.into_iter().any(|c| matches!(c.values, Values::F64(_)))
}
