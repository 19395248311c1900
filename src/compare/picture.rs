//! The particles of a result as the figures show them.

use crate::input::internal_units::Prepared;
use crate::metrics::{DensityError, Outcome};
use crate::target::{Positions, Target, at};
use sph::domain::Region;

/// The result of a run, in units of the input.
#[derive(Debug, Clone, Default)]
pub(super) struct Picture {
    pub samples: Vec<Sample>,
    /// Whether the density is shown against the radius.
    pub radial: bool,
    /// The factor on the mass in the errors that are shown.
    pub refit: f64,
}

/// A particle of the result in units of the input.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub x: [f64; 3],
    /// Distance from the domain's center.
    pub r: f64,
    pub spacing: f64,
    pub density: f64,
    pub target_density: f64,
}

impl Picture {
    /// Of the last state of a run.
    pub fn new<const D: usize>(
        prepared: &Prepared<D>,
        target: &Target<'_, D>,
        positions: &Positions<D>,
        outcome: &Outcome,
    ) -> Self {
        Self {
            samples: samples(prepared, target, positions, outcome),
            radial: prepared.source.radial.is_some() || !matches!(target.domain.region, Region::Box),
            refit: refit(&outcome.density_error),
        }
    }
}

/// The factor on the mass in [`DensityError::stated`].
fn refit(e: &DensityError) -> f64 {
    if e.interior_refitted.is_some() { e.refit_interior } else { e.refit_all }
}

/// The result in the input's units.
fn samples<const D: usize>(
    prepared: &Prepared<D>,
    target: &Target<'_, D>,
    positions: &Positions<D>,
    outcome: &Outcome,
) -> Vec<Sample> {
    let center = prepared.source.center();
    let density = prepared.mass.value / prepared.length.powi(D as i32);
    (0..outcome.density.len())
        .map(|i| {
            let x = at(positions, i);
            let offset: [f64; D] = std::array::from_fn(|k| x[k] - center[k]);
            Sample {
                x: std::array::from_fn(|k| if k < D { x[k] * prepared.length } else { 0.0 }),
                r: offset.iter().map(|v| v * v).sum::<f64>().sqrt() * prepared.length,
                spacing: target.spacing(target.number_density(&x)) * prepared.length,
                density: outcome.density[i] * density,
                target_density: outcome.target_density[i] * density,
            }
        })
        .collect()
}
