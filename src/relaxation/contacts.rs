//! Layers on both sides of a jump, which stages relax separately or hold. Where particles of different regions, or particles of one region beside
//! the surface, have come too close, they are separated by the mean of their spacings.
//!
//! A layer does not know where the particles of the other lie along the surface, so that some face each other across it. Moves are small parts of a
//! spacing: spheres of the diameter that is asked for fill a third of the volume, where even random ones jam at two thirds.

use super::pairs::spacings;
use super::separation::{Separation, near};
use crate::target::{Positions, Target, at};
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
    let separation = Separation {
        exchange,
        domain: &domain,
        target,
        distance: &|layer| spacings(target, layer).into_iter().map(|s| CLOSEST * s).collect(),
        close: (Apart::Mean, ENOUGH),
        may_move: &is_beside,
        way: &|_, shift| shift,
    };
    separation.of(positions, near)
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
