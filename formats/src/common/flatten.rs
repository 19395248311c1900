//! All particles of a file as one table, for formats without particle types: one array per column name, with a column `ParticleType` if there are
//! types other than gas, and NaN where a type lacks a column.

use crate::model::{Column, ParticleFile, Species, Values};
use crate::particle_names as names;
use crate::units::UnitDimension;

/// One array over all particles.
pub struct Flat<'a> {
    pub name: String,
    pub components: usize,
    pub dimension: UnitDimension,
    /// All values are integers.
    pub integers: bool,
    parts: Vec<(Part<'a>, usize)>,
}

enum Part<'a> {
    Column(&'a Column),
    Missing,
    Type(u8),
}

/// The arrays of a file, and the number of particles.
///
/// # Errors
/// A column with different numbers of components in two types.
pub fn flatten(file: &ParticleFile) -> Result<(usize, Vec<Flat<'_>>), String> {
    let species: Vec<_> = file.species.iter().filter(|s| s.table.count > 0).collect();
    Ok((species.iter().map(|s| s.table.count).sum(), flatten_species(&species)?))
}

/// The arrays of species in this order, each of which has particles.
///
/// # Errors
/// A column with different numbers of components in two types.
pub fn flatten_species<'a>(species: &[&'a Species]) -> Result<Vec<Flat<'a>>, String> {
    let mut arrays: Vec<Flat> = Vec::new();
    for column in species.iter().flat_map(|s| &s.table.columns) {
        match arrays.iter().find(|a| a.name == column.name) {
            Some(known) if known.components != column.components => {
                return Err(format!("column '{}' has different numbers of components", column.name));
            }
            Some(_) => {}
            None => {
                let parts: Vec<_> = species
                    .iter()
                    .map(|s| (s.table.column(&column.name).map_or(Part::Missing, Part::Column), s.table.count))
                    .collect();
                let whole = |(p, _): &(Part, usize)| matches!(p, Part::Column(c) if matches!(c.values, Values::I64(_)));
                arrays.push(Flat {
                    name: column.name.clone(),
                    components: column.components,
                    dimension: column.dimension,
                    integers: parts.iter().all(whole),
                    parts,
                });
            }
        }
    }
    if species.len() > 1 || species.iter().any(|s| s.part_type != 0) {
        arrays.push(Flat {
            name: names::PARTICLE_TYPE.into(),
            components: 1,
            dimension: UnitDimension::NONE,
            integers: true,
            parts: species.iter().map(|s| (Part::Type(s.part_type), s.table.count)).collect(),
        });
    }
    Ok(arrays)
}

impl Flat<'_> {
    pub fn floats(&self) -> impl Iterator<Item = f64> {
        self.parts.iter().flat_map(|(part, count)| {
            (0..count * self.components).map(move |i| match part {
                Part::Column(c) => c.values.get(i),
                Part::Missing => f64::NAN,
                Part::Type(t) => f64::from(*t),
            })
        })
    }

    /// Values of an array of integers.
    pub fn whole(&self) -> impl Iterator<Item = i64> {
        self.parts.iter().flat_map(|(part, count)| {
            (0..count * self.components).map(move |i| match part {
                Part::Column(c) => match &c.values {
                    Values::I64(v) => v.get(i).copied().unwrap_or(0),
                    values => values.get(i) as i64,
                },
                Part::Missing => 0,
                Part::Type(t) => i64::from(*t),
            })
        })
    }

    /// Whether the array is to be stored in f64: positions always are, others on request or where f32 has no such
    /// number.
    pub fn wants_double(&self, asked: bool) -> bool {
        let beyond = |v: f64| v.is_finite() && v != 0.0 && !(v as f32).is_normal();
        asked || self.name == names::COORDINATES || self.floats().any(beyond)
    }
}
