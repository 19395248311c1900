//! Support radii of particles whose file has none that can be interpreted.

use super::particles::Snapshot;
use crate::error::Result;
use sph::kernel::{default_kernel_neighbors, support_over_spacing};
use sph_formats::common::particle_names as names;
use sph_formats::{Column, ParticleFile, UnitDimension, Values};
use std::path::Path;

/// Gives gas its support radii where the file has none that are understood: from masses and densities, which are summed
/// over the neighbors where the file has none either.
pub(crate) fn support_radii(path: &Path, file: &mut ParticleFile) -> Vec<String> {
    let d = file.header.dimension;
    let Some(gas) = file.species.iter_mut().find(|s| s.part_type == 0 && s.table.count > 0) else { return Vec::new() };
    let mut notes = Vec::new();
    let empty = |c: &Column| c.name == names::DENSITY && c.values.range() == (0.0, 0.0, 0);
    if gas.table.columns.iter().any(empty) {
        gas.table.columns.retain(|c| !empty(c));
        notes.push("the densities of the input, which are all 0, were left out".to_owned());
    }
    let (known, masses) = (gas.table.column(names::SUPPORT_RADIUS), gas.table.column(names::MASSES));
    let (None, Some(masses)) = (known, masses) else { return notes };
    let (masses, stated) = (masses.values.to_f64(), gas.table.column(names::DENSITY).map(|c| c.values.to_f64()));
    let why = match gas.table.column(names::SMOOTHING_LENGTH) {
        Some(_) => "smoothing lengths of an unknown convention",
        None => "no smoothing lengths",
    };
    let whose = if stated.is_some() { "each particle's density" } else { "a density summed over them" };
    let density = match stated.map_or_else(|| summed(path, file), Ok) {
        Ok(density) => density,
        Err(e) => {
            notes.push(format!("the input has {why}, and there are no support radii: {e}"));
            return notes;
        }
    };
    let neighbors = default_kernel_neighbors(d);
    let ratio = support_over_spacing(d, neighbors);
    let radius = |(m, rho): (&f64, &f64)| ratio * (m / rho).powf(1.0 / d as f64);
    let values = Values::F64(masses.iter().zip(&density).map(radius).collect());
    let column = Column { name: names::SUPPORT_RADIUS.into(), components: 1, values, dimension: UnitDimension::LENGTH };
    for gas in file.species.iter_mut().filter(|s| s.part_type == 0) {
        gas.table.columns.retain(|c| c.name != names::SMOOTHING_LENGTH);
        gas.table.columns.push(column.clone());
    }
    if !(file.header.kernel_neighbors > 0.0) {
        file.header.kernel_neighbors = neighbors;
    }
    notes.push(format!("the input has {why}: support radii are set for {neighbors} neighbors at {whose}"));
    notes
}

/// Densities of gas by summation.
fn summed(path: &Path, file: &ParticleFile) -> Result<Vec<f64>> {
    let snapshot = Snapshot::new(path, file, None)?;
    Ok(snapshot.field.variable(names::DENSITY).map(|v| v.values.to_f64()).unwrap_or_default())
}
