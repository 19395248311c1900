//! Entropies that GADGET-2 stores in place of internal energies.
//!
//! Where the header's `Flag_Entropy_ICs` is not 0, InternalEnergy of gas holds the entropic function A = P / rho^gamma
//! (GADGET-2 user guide, section 6; Springel & Hernquist 2002, MNRAS 333, 649), so that u = A rho^(gamma - 1) / (gamma - 1).

use crate::error::{FormatError, Result};
use crate::model::{ParticleTable, Values};
use crate::particle_names as names;
use crate::units::UnitDimension;
use std::path::Path;

/// GADGET's adiabatic index, which no file states.
const GAMMA: f64 = 5.0 / 3.0;

/// Replaces the entropic function in the column InternalEnergy of gas by energies per mass; returns what was done.
///
/// # Errors
/// [`FormatError::Unsupported`] where there is no Density to do it with.
pub fn to_energies(path: &Path, format: &'static str, table: &mut ParticleTable) -> Result<Option<String>> {
    let density = table.column(names::DENSITY).map(|c| c.values.to_f64());
    let Some(column) = table.columns.iter_mut().find(|c| c.name == names::INTERNAL_ENERGY) else { return Ok(None) };
    let Some(density) = density else {
        let what = "entropies in InternalEnergy (Flag_Entropy_ICs is not 0) without Density to make energies of them; \
                    add the densities, or read a snapshot that the code has written";
        return Err(FormatError::Unsupported { path: path.into(), format, what: what.into() });
    };
    let energy = |(i, rho): (usize, &f64)| column.values.get(i) * rho.powf(GAMMA - 1.0) / (GAMMA - 1.0);
    column.values = Values::F64(density.iter().enumerate().map(energy).collect());
    column.dimension = UnitDimension::SPECIFIC_ENERGY;
    Ok(Some("energies of gas made from the entropies that Flag_Entropy_ICs announces, with gamma = 5/3".to_owned()))
}
