//! Seeds by mass bisection or on shells that are made while they are written, in bounded memory: as one file, or as one of several by
//! each process of a job array, without any of them knowing of the others.

use super::streamed::{Places, Read, Streamed};
use crate::error::Result;
use crate::input::internal_units::Prepared;
use crate::scene::{DEFAULT_PARTICLES, Scene};
use crate::seeding::{Blockwise, Seeding};
use crate::target::Positions;
use sph_formats::{FormatSpec, ParticleStream};
use std::ops::Range;

impl<const D: usize> Places<D> for Blockwise<'_, D> {
    fn positions(&self, numbers: Range<usize>) -> Result<Positions<D>> {
        Blockwise::positions(self, numbers)
    }
}

/// Calls `with` with the seeds of `scene`, and with what there is to say of them.
///
/// # Errors
/// A scene whose seeds cannot be made block by block, or with parts that cannot be streamed, and what `with` says.
pub fn seeds<R>(
    scene: &Scene,
    formats: &[FormatSpec],
    format: Option<&FormatSpec>,
    with: impl FnOnce(&dyn ParticleStream, Vec<String>) -> Result<R>,
) -> Result<R> {
    let read = Read::new(scene, formats)?;
    match read.dimension {
        1 => seeds_in::<1, R>(scene, (formats, format), read, with),
        2 => seeds_in::<2, R>(scene, (formats, format), read, with),
        _ => seeds_in::<3, R>(scene, (formats, format), read, with),
    }
}

fn seeds_in<const D: usize, R>(
    scene: &Scene,
    (formats, format): (&[FormatSpec], Option<&FormatSpec>),
    Read { raw, units, .. }: Read,
    with: impl FnOnce(&dyn ParticleStream, Vec<String>) -> Result<R>,
) -> Result<R> {
    let count = scene.particles.unwrap_or(DEFAULT_PARTICLES);
    let prepared = Prepared::<D>::new(scene, formats, (raw, &units), count)?;
    let regions = prepared.target().find_regions(scene.region_contrast);
    let target = prepared.target().with_regions(regions.as_ref());
    let seeds = Blockwise::new(&target, scene.seeding.unwrap_or(Seeding::MassBisection), scene.seed)?;
    let stream = Streamed::new(scene, (&prepared, units), (target, &seeds), format, "Seeded")?;
    let notes = stream.notes().to_vec();
    with(&stream, notes)
}
