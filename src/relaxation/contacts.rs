//! Layers on both sides of a jump, which stages relax separately or hold. Where particles of different regions, or particles of one region beside
//! the surface, have come too close, they are separated by the mean of their spacings.
//!
//! A layer does not know where the particles of the other lie along the surface, so that some face each other across it. Moves are small parts of a
//! spacing: spheres of the diameter that is asked for fill a third of the volume, where even random ones jam at two thirds.

use super::pairs::{parted, partings_among};
use crate::target::{Positions, Target, at};
use sph::domain::Domain;
use sph::exchange::Exchange;
use sph::nearest::Nearest;
use sph::neighbors::{Halo, Sees, Tree};
use sph::parallel;
use sph::sums::Apart;

/// Distance over the mean spacing of two particles to which they part.
const CLOSEST: f64 = 0.87;
/// What may be missing of that: the last moves are as small as the rounding.
const ENOUGH: f64 = 0.995;
/// How far from a surface particles part, in spacings.
const BESIDE: f64 = 1.5;
/// Distance over the mean spacing within which others may be in the way of those that part: they move by less than a spacing.
const IN_THE_WAY: f64 = 2.0;
/// Rounds after which the rest is left.
const ROUNDS: usize = 60;
/// No particle moves farther in a round, in its own spacing.
const MAX_STEP: f64 = 0.1;

/// Parts particles beside the surfaces between regions; says whether any moved, on whatever rank. Without surfaces, and where none are too close,
/// positions stay as they are, bit for bit.
pub(super) fn part_contacts<const D: usize>(
    exchange: &dyn Exchange,
    target: &Target<'_, D>,
    positions: &mut Positions<D>,
) -> bool {
    let n = positions[0].len();
    if exchange.count(n) < 2 || target.regions().is_none_or(|regions| regions.number() < 2) {
        return false;
    }
    let spacing = spacings(target, positions);
    let is_beside = parallel::map(n, |i| target.is_beside_region(&at(positions, i), BESIDE * spacing[i]));
    if !exchange.any(is_beside.contains(&true)) {
        return false;
    }
    let domain = target.domain.mirrored();
    let near = near((exchange, &domain), positions, &spacing, &is_beside);
    let is_beside = across(exchange, target, positions, &spacing, (&near, &is_beside));
    let mut layer = positions.each_ref().map(|x| near.iter().map(|&i| x[i]).collect::<Vec<f64>>());
    let mut any = false;
    for round in 0..ROUNDS {
        if !exchange.any(part_once((exchange, &domain), target, &mut layer, &is_beside, round as u64)) {
            break;
        }
        any = true;
    }
    for (place, i) in near.into_iter().enumerate() {
        (0..D).for_each(|k| positions[k][i] = layer[k][place]);
    }
    any
}

/// One round: every particle beside a surface that is too close to another moves a part of the way; says whether any did.
fn part_once<const D: usize>(
    (exchange, domain): (&dyn Exchange, &Domain<D>),
    target: &Target<'_, D>,
    layer: &mut Positions<D>,
    is_beside: &[bool],
    round: u64,
) -> bool {
    let spacing = spacings(target, layer);
    let close = (Apart::Mean, ENOUGH);
    let found = partings_among(exchange, domain, layer, |i| CLOSEST * spacing[i], close, round);
    let mut any = false;
    for (i, parting) in found.into_iter().filter(|(i, parting)| parting.paired && is_beside[*i]) {
        let from = at(layer, i);
        if let Some(x) = parted(target, domain, &from, &parting.shift, MAX_STEP * CLOSEST * spacing[i])
            && x != from
        {
            (0..D).for_each(|k| layer[k][i] = x[k]);
            any = true;
        }
    }
    any
}

/// The particles that are beside a surface, and those that may be in their way.
fn near<const D: usize>(
    (exchange, domain): (&dyn Exchange, &Domain<D>),
    positions: &Positions<D>,
    spacing: &[f64],
    is_beside: &[bool],
) -> Vec<usize> {
    let reach = |i: usize| if is_beside[i] { 2.0 * IN_THE_WAY * spacing[i] } else { 0.0 };
    let mut near = is_beside.to_vec();
    for (i, parting) in partings_among(exchange, domain, positions, reach, (Apart::Mean, 1.0), 0) {
        near[i] |= parting.paired;
    }
    (0..near.len()).filter(|&i| near[i]).collect()
}

/// Which of those that are `near` are beside a surface, or have a particle of another region there that is: a layer may be thinner than any look
/// for it. What lies across a periodic face is not looked for.
fn across<const D: usize>(
    exchange: &dyn Exchange,
    target: &Target<'_, D>,
    positions: &Positions<D>,
    spacing: &[f64],
    (near, is_beside): (&[usize], &[bool]),
) -> Vec<bool> {
    let region = |x: &[f64; D]| target.regions().and_then(|regions| regions.of(x));
    let own = near.iter().filter(|&&i| is_beside[i]).map(|&i| at(positions, i));
    let known: Vec<[f64; D]> = own.chain(beside_elsewhere(exchange, target, positions, spacing, is_beside)).collect();
    let regions = parallel::map(known.len(), |k| region(&known[k]));
    let tree = Nearest::new(&known).ok();
    parallel::map(near.len(), |k| {
        let i = near[k];
        is_beside[i]
            || tree.as_ref().is_some_and(|tree| {
                let (own, reach) = (region(&at(positions, i)), BESIDE * spacing[i]);
                let found = tree.find(&at(positions, i), FEW);
                found.into_iter().any(|(k, distance)| distance < reach && regions[k] != own)
            })
    })
}

/// Particles of other ranks that are beside a surface, where those of this rank may be.
fn beside_elsewhere<const D: usize>(
    exchange: &dyn Exchange,
    target: &Target<'_, D>,
    positions: &Positions<D>,
    spacing: &[f64],
    is_beside: &[bool],
) -> Vec<[f64; D]> {
    if exchange.is_alone() {
        return Vec::new();
    }
    let tree = Tree::build(positions);
    let of = |place: usize| tree.order()[place] as usize;
    let reach = parallel::map(spacing.len(), |place| BESIDE * spacing[of(place)]);
    let told = parallel::map(spacing.len(), |place| f64::from(u8::from(is_beside[of(place)])));
    let halo = Halo::new(exchange, target.domain, (&tree, &reach), None, Sees::Targets);
    let [told] = halo.values(exchange, [[&told, &[]]]);
    (0..told.len()).filter(|&i| told[i] > 0.0).map(|i| halo.tree.position(i)).collect()
}

/// Particles beside a surface of which the nearest are looked at.
const FEW: usize = 4;

/// Of every particle, as the target has it there.
fn spacings<const D: usize>(target: &Target<'_, D>, positions: &Positions<D>) -> Vec<f64> {
    let density = target.number_densities(positions);
    parallel::map(density.len(), |i| target.spacing(density[i]).min(target.domain.size()))
}
