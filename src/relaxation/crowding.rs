//! Single pairs that a stage leaves much closer than all others, such as in layers that N particles do not resolve: there the sums that it watches
//! change little as two come together. They part along their layer, with those about them that are then too close.

use super::layers::Layers;
use super::pairs::{closer_than_by, measured_spacings, spacings};
use super::separation::{Separation, near};
use crate::target::{Positions, Target};
use sph::exchange::Exchange;
use sph::sums::Apart;

/// Distance in spacings by which particles part that are closer than [`CROWDED`].
const PARTED: f64 = 0.55;
/// Distance of the closest pair, in spacings, that is no longer good.
pub(super) const CROWDED: f64 = 0.5;
/// What may be missing of that: the last moves are as small as the rounding.
const ENOUGH: f64 = 0.99;
/// A larger part of all than this is not single pairs: there are more particles than have room.
const MANY: f64 = 0.2;

/// How often spacings are measured again: two that part leave each other with lower densities.
const LOOKS: usize = 4;

/// Parts particles that are closer than [`CROWDED`] spacings, as their sums say, to another; says whether any moved, on whatever rank.
pub(super) fn part_crowded<const D: usize>(
    exchange: &dyn Exchange,
    target: &Target<'_, D>,
    positions: &mut Positions<D>,
) -> bool {
    let count = exchange.count(positions[0].len());
    let most = MANY * count as f64 + 2.0;
    count >= 2 && (0..LOOKS).take_while(|_| part_once(exchange, target, positions, most)).count() > 0
}

/// The same by the spacings that are measured first, if there are no more than `most` such particles.
fn part_once<const D: usize>(
    exchange: &dyn Exchange,
    target: &Target<'_, D>,
    positions: &mut Positions<D>,
    most: f64,
) -> bool {
    let spacing = measured_spacings(exchange, target, positions, &spacings(target, positions));
    // As they are counted in the end: an image in a wall is no other particle.
    let domain = target.domain.without_mirrors();
    let crowded = closer_than_by(Apart::Larger, exchange, &domain, positions, &spacing, CROWDED);
    let found = exchange.count(crowded.iter().filter(|c| **c).count());
    if found == 0 || found as f64 > most {
        return false;
    }
    let near = near((exchange, &domain), positions, &spacing, &crowded);
    let places = positions.each_ref().map(|x| near.iter().map(|&i| x[i]).collect::<Vec<f64>>());
    let density = target.number_densities(&places);
    let layers = Layers::find(target, &places, &density, |_| true);
    let distance: Vec<f64> = near.iter().map(|&i| PARTED * spacing[i]).collect();
    let separation = Separation {
        exchange,
        domain: &domain,
        target,
        distance: &|_| distance.clone(),
        close: (Apart::Larger, ENOUGH),
        may_move: &vec![true; near.len()],
        way: &|i, shift| layers.as_ref().map_or(shift, |layers| turned(shift, layers.along(i, shift))),
    };
    separation.of(positions, near)
}

/// Of the size of the one vector along the other. Two one above the other in a layer have room beside each other.
fn turned<const D: usize>(of: [f64; D], along: [f64; D]) -> [f64; D] {
    let size = |v: &[f64; D]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let factor = size(&of) / size(&along);
    if factor.is_finite() { along.map(|c| factor * c) } else { of }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::AnalyticField;
    use crate::metrics::Measured;
    use crate::target::at;
    use sph::domain::{Axis, Domain, Region};
    use sph::exchange::Alone;
    use sph::kernel::{KernelName, default_kernel_neighbors};

    /// Closest pair of particles of a periodic box, in spacings, by the report's measure.
    fn closest<const D: usize>(domain: &Domain<D>, positions: &Positions<D>) -> f64 {
        let (count, neighbors) = (positions[0].len(), default_kernel_neighbors(D));
        let guess = vec![0.2; count];
        let measured = Measured::new(KernelName::default(), domain, positions, &vec![1.0; count], &guess, neighbors);
        measured.neighbors(domain, neighbors).closest_pair
    }

    /// A lattice of 12 to the power D in a periodic box of 1, with as many layers along the last axis as `rows`.
    fn lattice<const D: usize>(rows: usize) -> Positions<D> {
        let count = 12_usize.pow(D as u32 - 1) * rows;
        std::array::from_fn(|k| (0..count).map(|i| (((i / 12_usize.pow(k as u32)) % 12) as f64 + 0.5) / 12.0).collect())
    }

    fn check<const D: usize>() {
        let domain = Domain::new([0.0; D], [1.0; D], [Axis::Periodic; D], Region::Box).unwrap();
        let field = AnalyticField::<D>::new("density", "1", [0.0; D]).unwrap();
        let start = lattice::<D>(12);
        let target = Target::of_equal_masses(&domain, &field, start[0].len(), 1.0);
        let mut positions = start.clone();
        assert!(!part_crowded(&Alone, &target, &mut positions));
        assert_eq!(positions, start);
        // One beside the next across the periodic face.
        positions[0][0] = 1.0 - 0.4 / 12.0;
        let before = positions.clone();
        // On a line, where kernels hold few, the spacing that sums say is that of the two.
        let is_close = closest(&domain, &positions) < CROWDED;
        assert!(is_close || D == 1);
        assert_eq!(part_crowded(&Alone, &target, &mut positions), is_close);
        let apart = closest(&domain, &positions);
        assert!(apart > CROWDED || !is_close, "{D}-D: {apart}");
        let moved = (0..target.count).filter(|&i| at(&before, i) != at(&positions, i)).count();
        assert!((2..=12).contains(&moved) || !is_close, "{D}-D: {moved} moved");
        assert!((0..target.count).all(|i| domain.contains(&at(&positions, i))));
    }

    #[test]
    fn a_pair_parts_and_others_stay_where_they_are() {
        check::<1>();
        check::<2>();
        check::<3>();
    }

    /// Of two one above the other within a layer of a tenth of their spacing each goes along it, and no particle leaves it.
    #[test]
    fn pairs_of_a_layer_part_along_it() {
        let domain = Domain::new([0.0; 3], [1.0; 3], [Axis::Periodic; 3], Region::Box).unwrap();
        let field = AnalyticField::<3>::new("density", "exp(-((z-0.5)/0.005)^2)", [0.0; 3]).unwrap();
        let mut positions = lattice::<3>(1);
        positions[2].fill(0.5);
        let target = Target::of_equal_masses(&domain, &field, positions[0].len(), 0.005 * std::f64::consts::PI.sqrt());
        (0..2).for_each(|k| positions[k][0] = positions[k][1] + 1e-4);
        positions[2][0] = 0.502;
        assert!(part_crowded(&Alone, &target, &mut positions));
        let apart = closest(&domain, &positions);
        assert!(apart > CROWDED, "{apart}");
        let farthest = positions[2].iter().map(|z| (z - 0.5).abs()).fold(0.0, f64::max);
        assert!(farthest < 0.002 + 1e-12, "{farthest}");
    }
}
