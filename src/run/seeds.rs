//! Initial positions by mass bisection or on shells that are generated while they are written, in bounded memory: as one file, or as one of
//! several files by each process of a job array, without communication between the processes.

use super::plan::{Held, Plan};
use super::remarks::Remarks;
use super::streamed::{Places, Read, Streamed, prepare};
use crate::error::Result;
use crate::metrics::{PatchFigures, Patches};
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

/// Number of positions around which the seeded particles are measured.
const MEASURED: usize = 32;

/// Measures seeded particles around some positions, which are spread over the particle numbers.
pub type Measure<'a> = &'a dyn Fn() -> Result<Option<PatchFigures>>;

/// Calls `with` with the initial positions of `scene`, with what there is to say of them, and with a function that measures them. If the scene does not state a
/// seeding, they are those that a run of it starts from if these can be made block by block, otherwise those of mass bisection.
///
/// # Errors
/// A scene whose initial positions cannot be made block by block, or with parts that cannot be streamed, and errors of `with`.
pub fn seeds<R>(
    scene: &Scene,
    formats: &[FormatSpec],
    format: Option<&FormatSpec>,
    with: impl FnOnce(&dyn ParticleStream, Remarks, Measure<'_>) -> Result<R>,
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
    Read { raw, units, mut told, .. }: Read,
    with: impl FnOnce(&dyn ParticleStream, Remarks, Measure<'_>) -> Result<R>,
) -> Result<R> {
    let count = scene.particles.unwrap_or(DEFAULT_PARTICLES);
    let prepared = prepare::<D>(scene, formats, (raw, &units), count)?;
    let regions = prepared.target().find_regions(scene.region_contrast);
    let target = prepared.target().with_regions(regions.as_ref());
    let seeding = scene.seeding.unwrap_or_else(|| {
        let planned = Plan::new(scene, &target, prepared.source.radial.is_some(), &Held::Not).seeding;
        if Blockwise::<D>::can_make(planned) { planned } else { Seeding::MassBisection }
    });
    let seeds = Blockwise::new(&target, seeding, scene.seed)?;
    let stream = Streamed::new(scene, (&prepared, units), (target, &seeds), format, "Seeded")?;
    told.of_target(scene, &prepared, count);
    told.of_regions(regions.as_ref(), count);
    stream.tell(&mut told, false, format)?;
    told.notes.push(format!("the seeding is {}", seeding.method().name));
    let places = MEASURED.min(count);
    let measure = || {
        let mut patches = Patches::new(scene.kernel(), scene.kernel_neighbors(D));
        let number = |place: usize| (count as u128 * (2 * place as u128 + 1) / (2 * places as u128)) as usize;
        let middles = seeds.each(&(0..places).map(number).collect::<Vec<_>>())?;
        patches.add(&target, &middles, |asked| seeds.near(asked))?;
        Ok(patches.figures())
    };
    with(&stream, told, &measure)
}
