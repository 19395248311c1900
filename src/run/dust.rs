//! Adds separately placed dust to the gas.

use crate::error::Error;
use crate::scene::DUST_RATIO;
use sph_formats::common::particle_names as names;
use sph_formats::{Column, ParticleFile, Species, UnitDimension, Values};

/// An error of the scene of dust by itself, with the keys of the scene that it is of.
pub(super) fn in_dust(error: Error) -> Error {
    match error {
        Error::Scene { key, problem } if key == "input.factor" || key == format!("fields.{DUST_RATIO}") => {
            Error::scene("dust.ratio", problem)
        }
        Error::Scene { key, problem } => Error::Scene { key: format!("dust ({key})"), problem },
        other => other,
    }
}

/// Adds the particles of `dust`, which are in the corner of a box with the same middle, to `file`; returns what there is to note.
pub(super) fn join(file: &mut ParticleFile, dust: ParticleFile) -> Option<String> {
    let d = file.header.dimension;
    let corner = file.header.box_corner.unwrap_or_default();
    let shift: [f64; 3] = sph::array(|k| corner[k] + 0.5 * (file.header.box_size[k] - dust.header.box_size[k]));
    let total = |species: &Species| {
        let masses = species.table.column(names::MASSES);
        masses.map_or(0.0, |c| (0..c.values.len()).map(|i| c.values.get(i)).sum::<f64>())
    };
    let gas: f64 = file.species.iter().filter(|s| s.part_type == 0).map(total).sum();
    let first = file.species.iter().map(|s| s.table.count as i64).sum::<i64>() + 1;
    let Species { part_type, mut table } = dust.species.into_iter().next()?;
    for column in &mut table.columns {
        if column.name == names::COORDINATES {
            let moved = column.values.to_f64().into_iter().enumerate().map(|(i, x)| x + shift[i % d]);
            column.values = Values::F64(moved.collect());
        }
        if column.name == names::PARTICLE_IDS {
            column.values = Values::I64((first..first + table.count as i64).collect());
        }
    }
    // All of a file moves, or nothing does.
    let gas_moves = file.species.iter().any(|s| s.part_type == 0 && s.table.column(names::VELOCITIES).is_some());
    if gas_moves && table.column(names::VELOCITIES).is_none() {
        let zeros = Values::F64(vec![0.0; d * table.count]);
        table.columns.push(Column::new(names::VELOCITIES, d, zeros, UnitDimension::VELOCITY));
    }
    let count = table.count;
    let dust = Species { part_type, table };
    let mass = total(&dust);
    file.species.push(dust);
    file.species.sort_by_key(|s| s.part_type);
    Some(format!(
        "dust is {count} particles of type {part_type} with a mass of {mass:.6e}, {:.6} of the gas's",
        mass / gas
    ))
}
